"""Every frame of real particles gives a closed, outward 2-manifold, in every format."""

import json

import numpy as np
import pytest
from check_mesh import defects, judge, load
from conftest import FRAMES, assert_done, frame, slow


@pytest.mark.parametrize("name", FRAMES)
def test_mesh_is_closed_and_outward(pellicle, out, name):
    path, radius = frame(name)
    mesh = out / "out.ply"
    process = pellicle("mesh", path, "-r", radius, "-c", "1.0", "-o", mesh, "--threads", 2, "-q")
    assert_done(process)
    assert process.stdout == "", "-q is quiet"
    report = judge(*load(mesh))
    assert report["triangles"] > 100
    assert defects(report) == []
    assert report["unused_vertices"] == 0
    assert report["volume"] > 0
    assert [file.name for file in out.iterdir()] == ["out.ply"], "nothing else is left"


@pytest.mark.parametrize("name", [name for name in FRAMES if name.startswith("hemi")])
def test_fine_mesh_is_closed_and_outward(pellicle, out, name):
    path, radius = frame(name)
    mesh = out / "out.ply"
    assert_done(pellicle("mesh", path, "-r", radius, "-c", "0.5", "-o", mesh, "-q"))
    assert defects(judge(*load(mesh))) == []


def load_vtk(path):
    """Vertices and triangles of a legacy VTK file, binary PolyData up to version 4.2, which common readers leave to VTK."""
    data = path.read_bytes()

    def block(keyword, kinds):
        """The numbers after the line `keyword count last`, big-endian; `last` names their type or says how many they are."""
        start = data.index(b"\n" + keyword + b" ") + 1
        end = data.index(b"\n", start)
        _, count, last = data[start:end].decode().split()
        dtype, size = kinds.get(last) or (">i4", 0)
        return np.frombuffer(data, dtype, int(count) * size or int(last), end + 1)

    assert data.startswith(b"# vtk DataFile Version") and b"\nDATASET POLYDATA\n" in data
    points = block(b"POINTS", {"float": (">f4", 3), "double": (">f8", 3)}).reshape(-1, 3)
    polygons = block(b"POLYGONS", {}).reshape(-1, 4)
    assert (polygons[:, 0] == 3).all()
    return points, polygons[:, 1:]


def test_formats_hold_the_same_mesh(pellicle, out):
    path, radius = frame("hemi_t1.50.csv")
    for kind in ("ply", "obj", "vtk"):
        # OBJ has no room for attributes.
        made = pellicle("mesh", path, "-r", radius, "-c", "1.0", "-o", out / f"out.{kind}", "-q", "--attributes", "none")
        assert_done(made)
    vertices, triangles = load(out / "out.ply")
    for other in (load(out / "out.obj"), load_vtk(out / "out.vtk")):
        assert np.array_equal(other[1], triangles)
        np.testing.assert_allclose(other[0], vertices, rtol=0, atol=1e-6)


def test_radius_is_inferred_and_said(pellicle, out):
    path, radius = frame("cbd_t0.50.bgeo")
    process = pellicle("mesh", path, "-o", out / "out.ply")
    assert_done(process)
    assert "radius" in (process.stdout + process.stderr).lower()
    given = pellicle("mesh", path, "-r", radius, "-o", out / "given.ply", "-q")
    assert_done(given)
    inferred, known = judge(*load(out / "out.ply")), judge(*load(out / "given.ply"))
    assert inferred["volume"] == pytest.approx(known["volume"], rel=0.1)


def test_json_report_is_json(pellicle, out):
    path, radius = frame("blob.xyz")
    process = pellicle("mesh", path, "-r", radius, "-o", out / "out.ply", "--json")
    assert_done(process)
    assert isinstance(json.loads(process.stdout), dict)


@pytest.mark.parametrize("name", ["cbd_t0.00.npy", "drop_t0.20.bgeo", "cbd_t4.00.vtu", "hemi_t0.35.vtk", "hemi_t1.50.csv"])
def test_info_counts_particles(pellicle, name):
    path, _ = frame(name)
    process = pellicle("info", path)
    assert_done(process)
    count = {"cbd": "140608", "dro": "149260", "hem": "28899"}[name[:3]]
    digits = process.stdout.replace(",", "").replace("_", "").replace("'", "")
    assert count in digits, process.stdout


def test_check_tells_good_from_bad(pellicle, out):
    path, radius = frame("blob.xyz")
    mesh = out / "out.ply"
    assert_done(pellicle("mesh", path, "-r", radius, "-o", mesh, "-q"))
    assert_done(pellicle("check", mesh))
    hole = out / "hole.obj"
    hole.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n")
    verdict = pellicle("check", hole)
    assert verdict.returncode == 1, verdict.stdout + verdict.stderr


@pytest.mark.parametrize("cell", ["0.5", "1.0"])
@pytest.mark.parametrize("name", [pytest.param(name, marks=slow if name.startswith("cbd1m") else ()) for name in FRAMES])
def test_band_finds_all_that_full_evaluation_finds(pellicle, out, name, cell):
    path, radius = frame(name)
    for band in ("auto", "full"):
        assert_done(pellicle("mesh", path, "-r", radius, "-c", cell, "-o", out / f"{band}.ply", "--band", band, "-q"))
    assert (out / "auto.ply").read_bytes() == (out / "full.ply").read_bytes()
