"""Particle files that other programs wrote, in formats of text and arrays: `pellicle info` finds in them what they hold."""

import csv
import gzip
import json
import struct

import numpy as np
import pytest
from conftest import assert_done, assert_failed

N = 500


def package(name):
    """A package that is not needed to test the rest."""
    return pytest.importorskip(name, reason=f"{name} is not installed: pip install {name}")


@pytest.fixture
def cloud():
    """Positions, velocities, densities."""
    random = np.random.default_rng(7)
    return random.normal(size=(N, 3)), random.normal(size=(N, 3)), random.uniform(900, 1100, N)


def info(pellicle, path):
    process = pellicle("info", path, "--json")
    assert_done(process)
    return json.loads(process.stdout)


def ranges(values):
    values = np.asarray(values, float).reshape(len(values), -1)
    return values.min(axis=0), values.max(axis=0)


def assert_holds(found, positions, exact=0.0, **attributes):
    """The number of particles, their box, and the range of each attribute's components."""
    assert found["particles"] == len(positions)
    assert np.allclose(found["box"], ranges(positions), rtol=0, atol=exact)
    by_name = {attribute["name"]: attribute for attribute in found["attributes"]}
    for name, values in attributes.items():
        low, high = ranges(values)
        assert name in by_name, by_name
        assert np.allclose(by_name[name]["min"], low, rtol=1e-6, atol=exact), name
        assert np.allclose(by_name[name]["max"], high, rtol=1e-6, atol=exact), name


@pytest.mark.witness("NumPy array", "particles in", "numpy", "f16, f32, f64, i32; C and Fortran order")
@pytest.mark.parametrize("dtype", ["<f4", ">f4", "<f8", ">f8", "<f2", "<i4"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_numpy_arrays_of_any_type_and_order(pellicle, tmp_path, cloud, dtype, order):
    positions = (cloud[0] * 10).astype(dtype)
    np.save(tmp_path / "a.npy", np.asarray(positions, order=order))
    assert_holds(info(pellicle, tmp_path / "a.npy"), positions)


@pytest.mark.witness("NumPy array", "particles in", "numpy", "structured types")
def test_numpy_structured_array(pellicle, tmp_path, cloud):
    positions, velocities, densities = cloud
    kind = np.dtype([("id", "<i8"), ("label", "<U3"), ("pos", "<f4", (3,)), ("v", "<f8", (3,)), ("density", "<f4")], align=True)
    particles = np.zeros(N, kind)
    particles["id"], particles["pos"], particles["v"], particles["density"] = np.arange(N), positions, velocities, densities
    np.save(tmp_path / "a.npy", particles)
    found = info(pellicle, tmp_path / "a.npy")
    assert_holds(found, positions.astype("f4"), id=np.arange(N), velocity=velocities, density=densities)
    assert "label" not in [attribute["name"] for attribute in found["attributes"]]


@pytest.mark.witness("NumPy archive", "particles in", "numpy", "stored and deflated")
@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
@pytest.mark.parametrize("name", ["positions", "pos", "x", "whatever"])
def test_numpy_archives(pellicle, tmp_path, cloud, save, name):
    positions, velocities, densities = cloud
    others = {} if name == "whatever" else {"v": velocities}
    save(tmp_path / "a.npz", **{name: positions}, **others, density=densities, id=np.arange(N), dt=0.1, note="text")
    names = {"velocity": velocities} if others else {}
    assert_holds(info(pellicle, tmp_path / "a.npz"), positions, density=densities, id=np.arange(N), **names)


def test_numpy_archive_of_three_columns(pellicle, tmp_path, cloud):
    x, y, z = cloud[0].T
    np.savez(tmp_path / "a.npz", x=x, y=y, z=z, density=cloud[2])
    assert_holds(info(pellicle, tmp_path / "a.npz"), cloud[0], density=cloud[2])


def test_numpy_archive_of_columns_that_make_vectors(pellicle, tmp_path, cloud):
    names = dict(zip(["x", "y", "z", "vx", "vy", "vz"], np.hstack(cloud[:2]).T))
    np.savez_compressed(tmp_path / "a.npz", **names, density=cloud[2])
    assert_holds(info(pellicle, tmp_path / "a.npz"), cloud[0], velocity=cloud[1], density=cloud[2])


def test_numpy_archive_of_one_wide_array(pellicle, tmp_path, cloud):
    np.savez(tmp_path / "a.npz", data=np.hstack([*cloud[:2], cloud[2][:, None]]), dt=0.1)
    assert_holds(info(pellicle, tmp_path / "a.npz"), cloud[0], velocity=cloud[1], density=cloud[2])


def test_transposed_numpy_array_is_told(pellicle, tmp_path, cloud):
    np.save(tmp_path / "a.npy", np.ascontiguousarray(cloud[0].T))
    assert_failed(pellicle("info", tmp_path / "a.npy"), "[3, 500]", "array.T")


def test_numpy_archive_with_two_candidates_is_refused(pellicle, tmp_path, cloud):
    np.savez(tmp_path / "a.npz", a=cloud[0], b=cloud[1])
    assert_failed(pellicle("info", tmp_path / "a.npz"), "a.npz", "a [500, 3]", "b [500, 3]")


@pytest.mark.witness("CSV", "particles in", "numpy", "any separator")
@pytest.mark.parametrize("delimiter", [" ", ",", ";", "\t", "|", ":"])
@pytest.mark.parametrize("ending", [".csv", ".txt", ".dat", ".xyz", ".csv.gz"])
def test_numpy_savetxt(pellicle, tmp_path, cloud, delimiter, ending):
    path = tmp_path / f"a{ending}"
    np.savetxt(path, cloud[0], delimiter=delimiter, header="a comment")
    assert_holds(info(pellicle, path), cloud[0])


@pytest.mark.witness("CSV", "particles in", "pandas", "decimal commas, quotes, index columns")
@pytest.mark.parametrize("options", [{}, {"sep": ";", "decimal": ","}, {"sep": "\t"}, {"index": False}, {"quoting": csv.QUOTE_ALL}])
def test_pandas(pellicle, tmp_path, cloud, options):
    pandas = package("pandas")
    positions, velocities, densities = cloud
    table = pandas.DataFrame(np.hstack([positions, velocities]), columns=["x", "y", "z", "vx", "vy", "vz"])
    table["kind"] = "a,b;c"
    table["density"] = densities
    table.loc[3, "density"] = np.nan
    table.to_csv(tmp_path / "a.csv", **options)
    assert_holds(info(pellicle, tmp_path / "a.csv"), positions, velocity=velocities, density=np.delete(densities, 3))


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|", "/"])
def test_names_with_units(pellicle, tmp_path, cloud, delimiter):
    names = ["Pos.x [m]", "Pos.y [m]", "Pos.z [m]", "Vel.x [m/s]", "Vel.y [m/s]", "Vel.z [m/s]"]
    if delimiter == "/":
        names = ["x(m)", "y(m)", "z(m)", "vx", "vy", "vz"]
    np.savetxt(tmp_path / "a.csv", np.hstack(cloud[:2]), delimiter=delimiter, header=delimiter.join(names), comments="")
    assert_holds(info(pellicle, tmp_path / "a.csv"), cloud[0], velocity=cloud[1])


def atoms(cloud, cell):
    ase = package("ase")
    made = ase.Atoms(["H", "He", "O", "Cl", "U"] * (N // 5), positions=cloud[0], cell=cell, pbc=True)
    made.set_array("velo", cloud[1])
    made.set_array("density", cloud[2])
    made.set_array("id", np.arange(N))
    made.set_array("wet", np.arange(N) % 2 == 0)
    return made


@pytest.mark.witness("text and extended XYZ", "particles in", "ase", "velocity and arrays")
def test_extended_xyz_by_ase(pellicle, tmp_path, cloud):
    write = package("ase.io").write
    first, second = atoms(cloud, [1, 2, 3]), atoms((cloud[0] + 5, cloud[1], cloud[2]), [1, 2, 3])
    write(tmp_path / "a.xyz", [first, second], format="extxyz")
    # ase writes eight decimals.
    names = {"velocity": cloud[1], "density": cloud[2], "id": np.arange(N), "wet": np.arange(N) % 2}
    assert_holds(info(pellicle, tmp_path / "a.xyz"), cloud[0], exact=1e-8, **names)
    write(tmp_path / "a.extxyz", first, format="extxyz")
    assert_holds(info(pellicle, tmp_path / "a.extxyz"), cloud[0], exact=1e-8, **names)


@pytest.mark.witness("text and extended XYZ", "particles in", "ase", "plain XYZ")
def test_plain_xyz_by_ase(pellicle, tmp_path, cloud):
    package("ase.io").write(tmp_path / "a.xyz", atoms(cloud, [1, 2, 3]), format="xyz")
    assert_holds(info(pellicle, tmp_path / "a.xyz"), cloud[0], exact=1e-8)


TILTED = "ITEM: BOX BOUNDS xy xz yz pp pp pp\n{} {} -1\n{} {} 2\n3 9 0.5\n".format(1 - 1, 5 + 2, 2, 7.5)
BOXES = {"orthogonal": "ITEM: BOX BOUNDS pp pp ff\n1 5\n2 7\n3 9\n", "tilted": TILTED}


@pytest.mark.witness("LAMMPS dump", "particles in", "ase", "velocity; scaled, tilted and unwrapped")
@pytest.mark.parametrize("box", BOXES)
@pytest.mark.parametrize("columns", ["id type x y z vx vy vz", "vz type zs vy id ys xs vx", "xu id yu type zu vx vy vz"])
def test_lammps_dumps_are_read_as_ase_reads_them(pellicle, tmp_path, cloud, box, columns):
    read = package("ase.io").read
    values = dict(zip("xyz", cloud[0].T)) | {a + "s": c for a, c in zip("xyz", cloud[0].T)} | {a + "u": c for a, c in zip("xyz", cloud[0].T)}
    values |= dict(zip(["vx", "vy", "vz"], cloud[1].T)) | {"id": np.arange(1, N + 1), "type": np.arange(N) % 3 + 1}
    rows = "".join(" ".join(repr(values[c][i].item()) for c in columns.split()) + "\n" for i in range(N))
    step = f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{N}\n{BOXES[box]}ITEM: ATOMS {columns}\n{rows}"
    (tmp_path / "a.lammpstrj").write_text(step)
    expected = read(tmp_path / "a.lammpstrj", format="lammps-dump-text")
    found = info(pellicle, tmp_path / "a.lammpstrj")
    # ase counts from the box's corner.
    corner = [1, 2, 3] if "xs" in columns else [0, 0, 0]
    shift = np.asarray(corner) if not np.allclose(ranges(expected.positions), found["box"]) else np.zeros(3)
    assert_holds(found, expected.positions + shift, exact=1e-9, velocity=cloud[1], id=values["id"])


@pytest.mark.witness("JSON", "particles in", "json", "velocity, density")
@pytest.mark.parametrize("shape", ["rows", "flat", "objects", "arrays", "columns"])
@pytest.mark.parametrize("indent", [None, 1])
def test_json(pellicle, tmp_path, cloud, shape, indent):
    positions, velocities, densities = (a.tolist() for a in cloud)
    particles = zip(positions, velocities, densities)
    data = {
        "rows": positions,
        "flat": np.ravel(positions).tolist(),
        "objects": [{"position": p, "velocity": v, "density": d} for p, v, d in particles],
        "arrays": {"density": densities, "vel": np.ravel(velocities).tolist(), "points": positions, "name": "a"},
        "columns": {axis: column.tolist() for axis, column in zip("xyz", cloud[0].T)},
    }[shape]
    (tmp_path / "a.json").write_text(json.dumps(data, indent=indent))
    has_attributes = shape in ("objects", "arrays")
    names = {"velocity": velocities, "density": densities} if has_attributes else {}
    assert_holds(info(pellicle, tmp_path / "a.json"), positions, **names)


def bi4(order, arrays):
    """DualSPHysics' layout, written from its description and by nothing of the program's."""

    def text(t):
        return struct.pack(order + "I", len(t)) + t.encode()

    def sized(definition):
        return struct.pack(order + "I", len(definition)) + definition

    def item(name, n_arrays, n_items):
        values = text("\nVALUES") + struct.pack(order + "I", 2)
        values += text("TimeStep") + struct.pack(order + "Id", 12, 0.25) + text("Name") + struct.pack(order + "I", 1) + text("case")
        head = text("\nITEM\n") + text(name) + struct.pack(order + "ii", 0, 0) + text("%.7E") + text("%.15E")
        return sized(head + struct.pack(order + "III", n_arrays, n_items, len(values))) + values

    out = b"#FileJBD JPartDataBi4".ljust(58) + b"\n\0" + bytes([order == ">", 0, 0, 0])
    out += item("JPartDataBi4", 0, 1) + item("PART_0007", len(arrays), 0)
    for name, kind, values in arrays:
        data = values.astype(values.dtype.newbyteorder(order)).tobytes()
        out += sized(text("\nARRAY") + text(name) + struct.pack(order + "iiII", 0, kind, len(values), len(data))) + data
    return out


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("position", [("Pos", 22, "f4"), ("Posd", 23, "f8")])
def test_dualsphysics_bi4(pellicle, tmp_path, cloud, order, position):
    name, kind, dtype = position
    positions, velocities, densities = cloud
    arrays = [("Idp", 8, np.arange(N, dtype="u4")), (name, kind, positions.astype(dtype))]
    arrays += [("Vel", 22, velocities.astype("f4")), ("Rhop", 11, densities.astype("f4"))]
    (tmp_path / "Part_0007.bi4").write_bytes(bi4(order, arrays))
    found = info(pellicle, tmp_path / "Part_0007.bi4")
    assert_holds(found, positions.astype(dtype), id=np.arange(N), velocity=velocities, density=densities)


@pytest.mark.witness("raw XYZ", "particles in", "numpy", "f32, f64")
@pytest.mark.parametrize("dtype, ending", [("<f4", ".xyz"), ("<f8", ".f64"), ("<f4", ".f32"), ("<f4", ".raw")])
def test_raw_numbers(pellicle, tmp_path, cloud, dtype, ending):
    path = tmp_path / f"a{ending}"
    cloud[0].astype(dtype).tofile(path)
    assert_holds(info(pellicle, path), cloud[0].astype(dtype))


def test_a_raw_file_of_odd_length_names_both_types(pellicle, tmp_path):
    (tmp_path / "a.raw").write_bytes(b"\0" * 37)
    assert_failed(pellicle("info", tmp_path / "a.raw"), "37 bytes", "f32", "f64", "a.raw")


def test_gzipped_text(pellicle, tmp_path, cloud):
    text = "x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in cloud[0].tolist())
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(text.encode()))
    assert_holds(info(pellicle, tmp_path / "a.csv.gz"), cloud[0])
