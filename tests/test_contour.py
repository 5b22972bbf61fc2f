"""`contour` on real and made volumes: the known answers, judged from outside, and what users do wrong."""

import gzip
import json

import numpy as np
import pytest
from check_mesh import defects, judge, load
from conftest import DATA, assert_done, assert_failed, slow
from scipy import ndimage

VOLUMES = DATA / "volumes"
ANSWERS = VOLUMES / "answers.json"

# Marching cubes on 32³ to 64³ samples is within this of the smooth surface's area and volume; measured: 0.8 % at most.
CLOSE = 0.01


def answers():
    return json.loads(ANSWERS.read_text()) if ANSWERS.exists() else {}


def volume(name):
    path = VOLUMES / name
    if not path.exists():
        pytest.skip(f"{path} is missing: set PELLICLE_DATA to the folder of test data")
    return path


def contour(pellicle, path, iso, out, *options):
    process = pellicle("contour", path, "--iso", iso, "-o", out, "--json", *options)
    assert_done(process)
    report = json.loads(process.stdout)
    found = judge(*load(out)) if report["surfaces"][0]["triangles"] else {"triangles": 0, "components": 0}
    assert found["triangles"] == report["surfaces"][0]["triangles"]
    return found, report


def place(answer):
    """NumPy arrays tell no place."""
    if not answer["file"].endswith(".npy"):
        return []
    join = lambda numbers: ",".join(map(repr, numbers))
    return ["--spacing", join(answer["spacing"]), "--origin", join(answer["origin"])]


@pytest.mark.parametrize("name", answers() or ["answers.json"])
def test_known_answers(pellicle, out, name):
    volume("answers.json")
    answer = answers()[name]
    path = volume(answer["file"])
    is_open = answer.get("open_at_border", False)
    options = [*place(answer), *(["--open"] if is_open else [])]
    found, report = contour(pellicle, path, answer["iso"], out / "a.ply", *options)
    assert report["dims"] == answer["dims"]
    assert np.allclose(report["spacing"], answer["spacing"], rtol=1e-6)
    components = answer.get("sampled_components", answer.get("components"))
    if components is not None:
        assert found["components"] == components
    if components == 0:
        assert found["triangles"] == 0 and any("values go from" in line for line in report["warnings"])
        return
    genus = answer.get("sampled_genus", answer.get("genus"))
    if genus is not None:
        genus = genus if isinstance(genus, list) else [genus]
        assert found["euler"] == sum(2 - 2 * g for g in genus)
    if "area" in answer:
        assert found["area"] == pytest.approx(answer["area"], rel=CLOSE)
    if is_open:
        assert not found["non_manifold_edges"] and not found["non_manifold_vertices"] and not found["doubled_half_edges"]
        found, _ = contour(pellicle, path, answer["iso"], out / "a.ply", *place(answer), "--closed")
    assert not defects(found)
    if "volume" in answer:
        assert found["volume"] == pytest.approx(answer["volume"], rel=CLOSE)


@pytest.mark.parametrize("iso", [0.2, 0.45, 0.8])
def test_metaballs_have_as_many_pieces_as_their_samples(pellicle, out, iso):
    path = volume("metaballs40.npy")
    found, _ = contour(pellicle, path, iso, out / "a.ply")
    # Balls far apart: neighbours through faces are enough.
    assert found["components"] == ndimage.label(np.load(path) > iso)[1]


@pytest.mark.parametrize(
    "name, iso, box",
    [
        ("mni152_t1_1mm.nii.gz", 60, ["-,-,-", "0,-,-"]),
        ("nibabel_anatomical.nii", 5000, ["-,-,-", "-,-,-"]),
        ("pyvista_channels.vti", 1.5, ["0,0,0", "99,99,60"]),
    ],
)
def test_scans_are_closed_and_have_their_volume(pellicle, out, name, iso, box):
    found, report = contour(pellicle, volume(name), iso, out / "a.ply", "--crop", *box)
    assert not defects(found)
    # The volume is near that of the samples inside, each as large as a cell.
    info = json.loads(pellicle("info", volume(name), "--json").stdout)
    cell = abs(np.linalg.det(np.array(info["steps"])))
    assert 0 < found["volume"] < cell * np.prod(info["dims"])
    alone, _ = contour(pellicle, volume(name), iso, out / "b.ply", "--largest", "--crop", *box)
    assert alone["components"] == 1 and not defects(alone) and alone["area"] <= found["area"]
    one = pellicle("contour", volume(name), "--iso", iso, "-o", out / "c.ply", "-n", 1, "--crop", *box)
    assert_done(one)
    assert (out / "a.ply").read_bytes() == (out / "c.ply").read_bytes()


@pytest.fixture
def ball(out):
    """A ball of radius 10 in 32 × 30 × 28 samples around (15, 14, 13), and a smaller one in a corner, as bytes."""
    z, y, x = np.indices((28, 30, 32))
    distance = np.sqrt((x - 15) ** 2 + (y - 14) ** 2 + (z - 13) ** 2)
    corner = np.sqrt((x - 2) ** 2 + (y - 2) ** 2 + (z - 2) ** 2)
    path = out / "ball.npy"
    np.save(path, np.clip(128 + 12 * np.maximum(10 - distance, 2 - corner), 0, 255).astype("u1"))
    return path


def test_several_isovalues_go_to_a_file_each_and_to_the_same_bytes_as_alone(pellicle, out, ball):
    process = pellicle("contour", ball, "--iso", "100,128.5", "-o", out / "b.obj", "--png", out / "b.png", "--json")
    assert_done(process)
    report = json.loads(process.stdout)
    assert [s["output"] for s in report["surfaces"]] == [str(out / "b_100.obj"), str(out / "b_128.5.obj")]
    assert (out / "b_100.png").stat().st_size > 1000 and (out / "b_128.5.png").stat().st_size > 1000
    assert_done(pellicle("contour", ball, "--iso", "128.5", "-o", out / "alone.obj"))
    assert (out / "alone.obj").read_bytes() == (out / "b_128.5.obj").read_bytes()
    assert_failed(pellicle("contour", ball, "--iso", "1,1.0"), "named twice", code=2)


def test_isovalues_are_suggested_and_their_range_is_told(pellicle, out, ball):
    assert_failed(pellicle("contour", ball), "no isovalue", "0 to 248", "--iso", code=2)
    for iso in (300, -1):
        process = pellicle("contour", ball, "--iso", iso, "-o", out / "none.ply", "--closed")
        assert_done(process)
        assert "values go from 0 to 248" in process.stderr
        assert b"element face 0\n" in (out / "none.ply").read_bytes()
    info = json.loads(pellicle("info", ball, "--json").stdout)
    assert 20 < info["iso_suggested"] < 200 and info["dims"] == [32, 30, 28] and info["type"] == "u8"


def test_the_largest_piece_stays_and_the_rest_goes(pellicle, out, ball):
    both, _ = contour(pellicle, ball, 128, out / "both.ply")
    alone, report = contour(pellicle, ball, 128, out / "alone.ply", "--largest")
    assert both["components"] == 2 and alone["components"] == 1 and report["surfaces"][0]["pieces"] == 2
    assert alone["volume"] == pytest.approx(4 / 3 * np.pi * 1000, rel=0.02)


def test_open_and_closed_borders_and_boxes(pellicle, out, ball):
    closed, _ = contour(pellicle, ball, 128, out / "c.ply", "--crop", "0,0,0", "15,-,-")
    half = 2 / 3 * np.pi * 1000
    assert not defects(closed) and load(out / "c.ply")[0][:, 0].max() == 15
    opened, _ = contour(pellicle, ball, 128, out / "o.ply", "--crop", "10,-,-", "15,-,-", "--open", "--largest")
    assert opened["open_half_edges"] > 0
    assert closed["volume"] == pytest.approx(half, rel=0.05)
    assert_failed(pellicle("contour", ball, "--iso", 1, "--crop", "50,0,0", "60,1,1"), "fewer than 2 samples", "reaches")
    assert_failed(pellicle("contour", ball, "--iso", 1, "--open", "--closed"), "cannot be used", code=2)


def test_units_scale_and_metres(pellicle, out, ball):
    small, _ = contour(pellicle, ball, 128, out / "s.ply", "--scale", 0.1, "--largest")
    assert small["volume"] == pytest.approx(4 / 3 * np.pi, rel=0.02)
    trimesh = pytest.importorskip("trimesh")
    scan = volume("nibabel_anatomical.nii")
    assert_done(pellicle("contour", scan, "--iso", 5000, "-o", out / "a.glb"))
    assert_done(pellicle("contour", scan, "--iso", 5000, "-o", out / "a.ply"))
    metres = trimesh.load(out / "a.glb").bounds
    millimetres = trimesh.load(out / "a.ply").bounds
    assert np.allclose(np.ptp(metres, axis=0).max(), np.ptp(millimetres, axis=0).max() / 1000, rtol=1e-4)


def test_sequences_go_frame_by_frame(pellicle, out, ball):
    for n in range(1, 5):
        (out / f"step_{n:03}.npy").write_bytes(ball.read_bytes())
    (out / "step_003.npy").write_bytes(b"damaged")
    process = pellicle("contour", out / "step_###.npy", "--iso", 128, "-o", out / "w_{}.ply", "--json")
    report = json.loads(process.stdout)
    assert process.returncode == 1 and (report["frames_done"], report["frames_failed"]) == (3, 1)
    bodies = [(out / f"w_{n}.ply").read_bytes().split(b"end_header")[1] for n in (1, 4)]
    assert bodies[0] == bodies[1]
    process = pellicle("contour", out / "step_{}.npy", "--iso", 128, "-o", out / "w_{}.ply", "--json", "--skip-existing", "--frames", "1-2")
    assert json.loads(process.stdout)["frames_skipped"] == 2
    process = pellicle("contour", out / "step_{}.npy", "--iso", 128, "-o", out / "v_{}.ply", "--shard", "2/2", "--frames", "1,2")
    assert_done(process)
    assert (out / "v_2.ply").exists() and not (out / "v_1.ply").exists()


def test_every_mesh_format_is_written(pellicle, out, ball):
    formats = json.loads(pellicle("formats", "--json").stdout)["formats"]
    ends = [f["extensions"][0] for f in formats if f["writes_meshes"]]
    assert len(ends) >= 7
    for end in ends:
        assert_done(pellicle("contour", ball, "--iso", 128, "-o", out / f"m.{end}"))
        assert (out / f"m.{end}").stat().st_size > 10000
    assert_failed(pellicle("contour", ball, "--iso", 128, "-o", out / "m.csv"), "meshes are written to", code=2)


def test_bad_input_is_an_error_that_says_what(pellicle, out, ball):
    np.save(out / "flat.npy", np.zeros((20, 30), "f4"))
    assert_failed(pellicle("contour", out / "flat.npy", "--iso", 1), "[20, 30]", "three axes")
    np.save(out / "layer.npy", np.zeros((1, 20, 30), "f4"))
    assert_failed(pellicle("contour", out / "layer.npy", "--iso", 1), "30 × 20 × 1", "at least 2")
    np.save(out / "complex.npy", np.zeros((5, 5, 5), "c8"))
    assert_failed(pellicle("contour", out / "complex.npy", "--iso", 1), "c8", "floats")
    np.save(out / "cell.npy", np.arange(8.0).reshape(2, 2, 2))
    assert_done(pellicle("contour", out / "cell.npy", "--iso", 3.5, "-o", out / "cell.ply", "--open"))
    found = judge(*load(out / "cell.ply"))
    assert found["triangles"] == 2 and 1 < found["area"] < 1.5
    sound = gzip.compress((out / "cell.npy").read_bytes() * 50)
    (out / "cut.nii.gz").write_bytes(sound[: len(sound) // 2])
    assert_failed(pellicle("contour", out / "cut.nii.gz", "--iso", 1), out / "cut.nii.gz")
    assert_failed(pellicle("contour", out / "none.nii", "--iso", 1), "none.nii")
    assert_failed(pellicle("contour", ball, "--iso", "x"), "finite number", code=2)
    assert_failed(pellicle("contour", ball, "--iso", 1, "--dims", "9,9,9"), "bytes", "dimensions")
    assert_failed(pellicle("contour", ball, "--iso", 1, "--type", "u8"), "--dims", code=2)
    assert_failed(pellicle("contour", ball, "--iso", 1, "--spacing", "1,0,1"), "along y is 0")
    assert_failed(pellicle("info", ball, "--where", "x>1"), "about particles", code=2)
    assert_failed(pellicle("mesh", out / "cut.nii.gz"), "")


def test_2_to_the_31_cells_are_counted_not_wrapped(pellicle, out):
    """A file with holes, so that it takes no room; cells beyond what 32 bits count."""
    path = out / "huge.raw"
    with open(path, "wb") as file:
        file.truncate(2049 * 1025 * 1025)
    dims = ["--dims", "2049,1025,1025", "--type", "u8"]
    # Layer by layer, in far less memory than the samples take.
    process = pellicle("contour", path, "--iso", 1, *dims, "--max-memory", "64M")
    assert_done(process)
    assert "values go from 0 to 0" in process.stderr
    wrong = ["--dims", "2049,1025,1026", "--type", "u8"]
    assert_failed(pellicle("contour", path, "--iso", 1, *wrong), "2154830850", "2152730625")


def test_options_are_kept_in_a_file(pellicle, out, ball):
    printed = pellicle("contour", ball, "--iso", "100,128", "--open", "--print-config")
    assert_done(printed)
    (out / "job.toml").write_text(printed.stdout)
    assert_done(pellicle("contour", "--config", out / "job.toml", "-o", out / "k.ply"))
    assert (out / "k_100.ply").exists() and (out / "k_128.ply").exists()


METHODS = ["classic", "consistent", "topological", "tetra5", "tetra6", "bcc", "simplex", "regularised"]


@pytest.mark.parametrize("method", METHODS)
def test_every_method_makes_the_torus(pellicle, out, method):
    found, report = contour(pellicle, volume("torus48.mhd"), 0, out / "a.ply", "--method", method)
    answer = answers()["torus48"]
    assert report["method"] == method and not defects(found)
    assert found["components"] == 1 and found["euler"] == 0
    assert found["area"] == pytest.approx(answer["area"], rel=0.03) and found["volume"] == pytest.approx(answer["volume"], rel=0.03)


def test_normals_point_outward_and_are_refused_where_there_are_none(pellicle, out, ball):
    from plyfile import PlyData

    for kind in ("gradient", "faces"):
        assert_done(pellicle("contour", ball, "--iso", 128, "--largest", "--normals", kind, "-o", out / "n.ply"))
        vertex = PlyData.read(out / "n.ply")["vertex"]
        place = np.stack([vertex[a] for a in "xyz"], axis=1) - [15, 14, 13]
        normal = np.stack([vertex[f"n{a}"] for a in "xyz"], axis=1)
        assert np.allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-5)
        assert (np.einsum("ij,ij->i", normal, place) / np.linalg.norm(place, axis=1)).min() > 0.8
    assert_failed(pellicle("contour", ball, "--iso", 1, "--normals", "faces", "--method", "bcc"), "marching cubes", code=2)


@pytest.fixture(scope="module")
def waves(tmp_path_factory):
    """200 samples along x, 180 along y, 220 along z: 32 MB of single precision with a surface everywhere."""
    z, y, x = np.ogrid[:220, :180, :200]
    values = np.sin(x / 7) * np.cos(y / 9) + np.sin(y / 8) * np.cos(z / 11) + np.sin(z / 10) * np.cos(x / 12)
    folder = tmp_path_factory.mktemp("waves")
    values = values.astype("<f4")
    np.save(folder / "waves.npy", values)
    values.tofile(folder / "waves.raw")
    header = "NDims = 3\nDimSize = 200 180 220\nElementSpacing = 0.5 1 2\nOffset = 1 2 3\nElementType = MET_FLOAT\nElementDataFile = waves.raw\n"
    (folder / "waves.mhd").write_text(header)
    nrrd = "NRRD0004\ntype: float\ndimension: 3\nsizes: 200 180 220\nendian: little\nspacings: 0.5 1 2\nencoding: "
    (folder / "waves.nrrd").write_bytes(f"{nrrd}raw\n\n".encode() + values.tobytes())
    (folder / "packed.nrrd").write_bytes(f"{nrrd}gzip\n\n".encode() + gzip.compress(values.tobytes(), 1))
    shorts = (values * 5000).astype(">i2")
    nii = np.zeros(352, "u1")
    nii[:4] = np.frombuffer(np.array(348, ">i4").tobytes(), "u1")
    nii[40:56] = np.frombuffer(np.array([3, 200, 180, 220, 1, 1, 1, 1], ">i2").tobytes(), "u1")
    nii[70:72] = np.frombuffer(np.array(4, ">i2").tobytes(), "u1")
    nii[108:120] = np.frombuffer(np.array([352, -0.0002, 0.25], ">f4").tobytes(), "u1")
    nii[344:348] = list(b"n+1\0")
    (folder / "waves.nii").write_bytes(nii.tobytes() + shorts.tobytes())
    return folder


# What 32 MB of samples do not fit into, but their layers do.
LITTLE = ["--max-memory", "24M"]


@pytest.mark.parametrize("name, options", [
    ("waves.npy", []),
    ("waves.npy", ["--open", "--method", "consistent"]),
    ("waves.npy", ["--crop", "20,30,40", "150,-,200"]),
    ("waves.npy", ["--normals", "gradient"]),
    ("waves.mhd", ["--method", "topological"]),
    ("waves.nrrd", []),
    ("packed.nrrd", []),
    ("waves.nii", []),
    ("waves.raw", ["--dims", "200,180,220"]),
])  # fmt: skip
def test_layer_by_layer_gives_the_same_bytes(pellicle, out, waves, name, options):
    little = ["--max-memory", "12M"] if name == "waves.nii" else LITTLE
    for end in ("ply", "obj"):
        runs = []
        # A cut has less surface: its mesh, for which OBJ needs memory, fits beside the layers.
        if end == "obj":
            if "--crop" not in options:
                continue
            little = ["--max-memory", "31M"]
        for how, limit in (("whole", []), ("layers", little)):
            path = out / f"{how}.{end}"
            process = pellicle("contour", waves / name, "--iso", 0.5, "-o", path, "--json", *options, *limit)
            assert_done(process)
            report = json.loads(process.stdout)
            assert report["streamed"] == (how == "layers") and report["surfaces"][0]["triangles"] > 100000
            runs.append(path.read_bytes())
        assert runs[0] == runs[1]


def test_what_cannot_go_layer_by_layer_says_why(pellicle, out, waves):
    refused = lambda *options: pellicle("contour", waves / "waves.npy", "--iso", 0.5, "-o", out / "a.obj", *options, *LITTLE)
    assert_failed(refused("--method", "tetra6"), "marching tetrahedra", "--max-memory")
    assert_failed(refused(), "only PLY", "--max-memory")
    np.save(out / "fortran.npy", np.asfortranarray(np.load(waves / "waves.npy")))
    assert_failed(pellicle("contour", out / "fortran.npy", "--iso", 0.5, *LITTLE), "Fortran order", "24.0 MiB")
    process = pellicle("contour", waves / "waves.npy", "--iso", "99", "-o", out / "a.ply", *LITTLE)
    assert_done(process)
    assert "values go from" in process.stderr and b"element face 0\n" in (out / "a.ply").read_bytes()


@slow
def test_2_to_the_31_cells_in_200_megabytes(pellicle, out):
    """A file with holes, with a ball of 10 samples in its last corner, beyond what 32 bits count."""
    path = out / "huge.raw"
    with open(path, "wb") as file:
        file.truncate(2049 * 1025 * 1025)
        for z, y in np.ndindex(10, 10):
            file.seek(((1010 + z) * 1025 + 1010 + y) * 2049 + 2030)
            file.write(bytes([200] * 10))
    dims = ["--dims", "2049,1025,1025", "--type", "u8"]
    found, report = contour(pellicle, path, 100, out / "a.ply", *dims, "--max-memory", "200M")
    assert report["streamed"] and report["peak_memory_bytes"] < 200 << 20
    assert found["components"] == 1 and found["euler"] == 2 and not defects(found)
    assert 2029 < load(out / "a.ply")[0][:, 0].min() < 2030
