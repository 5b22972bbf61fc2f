"""Everything that is written is read back by code that is not ours, and compared: counts, positions, attributes, axes."""

import csv
import gzip
import json
import struct
import subprocess
import sys

import meshio
import numpy as np
import pytest
import trimesh
from conftest import assert_done, assert_failed
from plyfile import PlyData


COUNT = 1000


@pytest.fixture
def particles(out):
    """Particles of single precision with a velocity, a density and a whole number, as a PLY file and as arrays."""
    random = np.random.default_rng(1)
    kinds = [(name, "<f4") for name in ("x", "y", "z", "vx", "vy", "vz", "density")] + [("id", "<i4")]
    table = np.zeros(COUNT, kinds)
    for name, _ in kinds[:-1]:
        table[name] = random.normal(size=COUNT)
    table["id"] = random.permutation(COUNT)
    path = out / "particles.ply"
    write_ply(path, [("vertex", table)])
    return path, columns(table)


def columns(table):
    join = lambda *names: np.stack([table[name] for name in names], axis=1)
    return {"position": join("x", "y", "z"), "velocity": join("vx", "vy", "vz"), "density": table["density"], "id": table["id"]}


def write_ply(path, elements, faces=None):
    names = {"<f4": "float", "<f8": "double", "<i4": "int"}
    text = "ply\nformat binary_little_endian 1.0\n"
    data = b""
    for name, table in elements:
        text += f"element {name} {len(table)}\n"
        text += "".join(f"property {names[table.dtype[n].str]} {n}\n" for n in table.dtype.names)
        data += table.tobytes()
    if faces is not None:
        text += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
        rows = np.zeros(len(faces), [("n", "u1"), ("v", "<i4", 3)])
        rows["n"], rows["v"] = 3, faces
        data += rows.tobytes()
    path.write_bytes((text + "end_header\n").encode() + data)


@pytest.fixture
def mesh(out):
    """An icosphere with normals, a velocity, a colour and a density, as a PLY file and as arrays."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    names = ("x", "y", "z", "nx", "ny", "nz", "vx", "vy", "vz", "density", "color_0", "color_1", "color_2")
    table = np.zeros(len(ball.vertices), [(name, "<f4") for name in names])
    for axis, name in enumerate("xyz"):
        table[name] = ball.vertices[:, axis] * (1, 2, 3)[axis]
        table["n" + name] = ball.vertices[:, axis]
        table["v" + name] = ball.vertices[:, (axis + 1) % 3]
        table[f"color_{axis}"] = (1 + ball.vertices[:, axis]) / 2
    table["density"] = np.arange(len(table))
    path = out / "mesh.ply"
    write_ply(path, [("vertex", table)], ball.faces)
    join = lambda *names: np.stack([table[name] for name in names], axis=1)
    arrays = {"position": join("x", "y", "z"), "normal": join("nx", "ny", "nz"), "velocity": join("vx", "vy", "vz")}
    arrays |= {"density": table["density"], "color": join("color_0", "color_1", "color_2")}
    return path, arrays, ball.faces


def convert(pellicle, source, target, *options):
    process = pellicle("convert", source, target, *options)
    assert_done(process)
    return process


def same(found, expected, names):
    for name in names:
        assert np.array_equal(np.asarray(found[name]).reshape(np.shape(expected[name])), expected[name]), name


def vtk_read(path):
    """Arrays and cells of a file, by VTK itself."""
    vtk = pytest.importorskip("vtk", reason="the wheel of VTK is not installed")
    from vtk.util.numpy_support import vtk_to_numpy

    kinds = {".vtp": vtk.vtkXMLPolyDataReader, ".vtu": vtk.vtkXMLUnstructuredGridReader, ".vtk": vtk.vtkPolyDataReader}
    reader = kinds[path.suffix]()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    data = reader.GetOutput()
    point_data = data.GetPointData()
    arrays = {point_data.GetArrayName(i): vtk_to_numpy(point_data.GetArray(i)) for i in range(point_data.GetNumberOfArrays())}
    if data.GetNumberOfPoints():
        arrays["position"] = vtk_to_numpy(data.GetPoints().GetData())
    cells = [[data.GetCell(i).GetPointId(k) for k in range(data.GetCell(i).GetNumberOfPoints())] for i in range(data.GetNumberOfCells())]
    return arrays, np.array(cells), data


VTK_FORMATS = {"vtk": "VTK legacy", "vtp": "VTK XML polygons", "vtu": "VTK XML unstructured grid"}


@pytest.mark.parametrize("kind", VTK_FORMATS)
def test_vtk_reads_particles(pellicle, out, particles, witness, kind):
    source, expected = particles
    convert(pellicle, source, out / f"a.{kind}")
    arrays, cells, _ = vtk_read(out / f"a.{kind}")
    same(arrays, expected, expected)
    assert np.array_equal(cells.ravel(), np.arange(COUNT)), "every particle is a cell, so that programs show it"
    witness(VTK_FORMATS[kind], "particles out", "vtk", "f32, i32")


@pytest.mark.parametrize("kind", VTK_FORMATS)
def test_vtk_reads_meshes(pellicle, out, mesh, witness, kind):
    source, expected, faces = mesh
    convert(pellicle, source, out / f"a.{kind}")
    arrays, cells, data = vtk_read(out / f"a.{kind}")
    same(arrays, expected, expected)
    assert np.array_equal(cells, faces)
    assert data.GetPointData().GetNormals() is not None
    witness(VTK_FORMATS[kind], "mesh out", "vtk", "normals, vectors, scalars")


@pytest.mark.parametrize("kind", ["vtu", "ply"])
def test_meshio_reads_meshes(pellicle, out, mesh, witness, kind):
    source, expected, faces = mesh
    convert(pellicle, source, out / f"a.{kind}")
    found = meshio.read(out / f"a.{kind}")
    assert np.array_equal(found.points, expected["position"])
    assert np.array_equal(found.cells_dict["triangle"], faces)
    if kind == "vtu":
        same(found.point_data, expected, ["normal", "velocity", "density", "color"])
    witness({**VTK_FORMATS, "ply": "PLY"}[kind], "mesh out", meshio, "normals, vectors, scalars" if kind == "vtu" else "")


def test_meshio_reads_particles(pellicle, out, particles, witness):
    source, expected = particles
    convert(pellicle, source, out / "a.vtu")
    found = meshio.read(out / "a.vtu")
    same({**found.point_data, "position": found.points}, expected, expected)
    witness("VTK XML unstructured grid", "particles out", meshio, "f32, i32")


def test_plyfile_reads_particles(pellicle, out, particles, witness):
    source, expected = particles
    convert(pellicle, source, out / "a.vtu")
    convert(pellicle, out / "a.vtu", out / "a.ply")
    same(columns(PlyData.read(out / "a.ply")["vertex"].data), expected, expected)
    witness("PLY", "particles out", "plyfile", "f32, i32")
    witness("PLY", "particles in", "numpy", "f32, i32")


def test_trimesh_reads_stl_obj_and_ply(pellicle, out, mesh, witness):
    source, expected, faces = mesh
    corners = expected["position"][faces]
    process = convert(pellicle, source, out / "a.stl")
    assert "density" in process.stderr and "left out" in process.stderr
    found = trimesh.load(out / "a.stl", process=False)
    assert np.array_equal(np.asarray(found.triangles, np.float32), corners)
    stored = np.frombuffer((out / "a.stl").read_bytes(), [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")], offset=84)["n"]
    np.testing.assert_allclose(stored, trimesh.triangles.normals(corners.astype(float))[0], atol=1e-6)
    witness("STL", "mesh out", trimesh, "face normals")
    for kind, name in (("obj", "Wavefront OBJ"), ("ply", "PLY")):
        # By way of another format, so that the PLY is ours.
        convert(pellicle, source, out / "way.glb")
        convert(pellicle, out / "way.glb", out / f"a.{kind}")
        found = trimesh.load(out / f"a.{kind}", process=False, maintain_order=True)
        assert np.array_equal(np.asarray(found.vertices, np.float32), expected["position"])
        assert np.array_equal(found.faces, faces)
        witness(name, "mesh out", trimesh)


def test_colours_are_those_of_each_format(pellicle, out, witness):
    """Bytes in PLY, `red green blue alpha`; parts from 0 to 1 elsewhere, under each format's own name."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    colors = np.random.default_rng(1).integers(0, 256, (len(ball.vertices), 4)).astype(np.uint8)
    ball.visual.vertex_colors = colors
    for encoding in ("binary", "ascii"):
        ball.export(out / f"{encoding}.ply", encoding=encoding)
        convert(pellicle, out / f"{encoding}.ply", out / "a.glb")
        convert(pellicle, out / "a.glb", out / "a.ply")
        found = trimesh.load(out / "a.ply", process=False)
        assert np.array_equal(found.visual.vertex_colors, colors)
        assert np.array_equal(trimesh.load(out / "a.glb", process=False, force="mesh").visual.vertex_colors, colors)
    witness("PLY", "mesh in", trimesh, "colours")
    witness("PLY", "mesh out", trimesh, "colours")
    points = out / "points.ply"
    table = np.zeros(5, [(name, "<f4") for name in "xyz"])
    write_ply(points, [("vertex", table)])
    text = points.read_bytes().replace(b"end_header", b"property uchar red\nproperty uchar green\nproperty uchar blue\nend_header")
    head, _, _ = text.partition(b"end_header\n")
    points.write_bytes(head + b"end_header\n" + b"".join(bytes(12) + bytes(colors[i, :3]) for i in range(5)))
    convert(pellicle, points, out / "a.bgeo")
    assert b"\x00\x02Cd\x00\x03" in (out / "a.bgeo").read_bytes()
    convert(pellicle, out / "a.bgeo", out / "a.npz")
    np.testing.assert_allclose(np.load(out / "a.npz")["color"], colors[:5, :3] / 255, atol=1e-6)
    convert(pellicle, out / "a.bgeo", out / "b.ply")
    back = PlyData.read(out / "b.ply")["vertex"].data
    assert np.array_equal(np.stack([back["red"], back["green"], back["blue"]], axis=1), colors[:5, :3])


def test_trimesh_reads_glb_in_metres_with_y_up(pellicle, out, mesh, witness):
    source, expected, faces = mesh
    convert(pellicle, source, out / "a.glb")
    scene = trimesh.load(out / "a.glb", process=False)
    (found,) = scene.geometry.values()
    assert np.array_equal(np.asarray(found.vertices, np.float32), expected["position"])
    assert np.array_equal(found.faces, faces)
    np.testing.assert_allclose(found.vertex_normals, expected["normal"], atol=1e-6)
    same(found.vertex_attributes, {"_VELOCITY": expected["velocity"], "_DENSITY": expected["density"]}, ["_VELOCITY", "_DENSITY"])
    convert(pellicle, source, out / "b.glb", "--up", "z", "--metres-per-unit", 0.01)
    turned = trimesh.load(out / "b.glb", process=False).to_geometry()
    x, y, z = expected["position"].T
    np.testing.assert_allclose(turned.vertices, 0.01 * np.stack([x, z, -y], axis=1), atol=1e-6)
    assert turned.volume > 0, "still outward"
    witness("binary glTF", "mesh out", trimesh, "normals, vectors, scalars, axis, metres")


def test_glb_structure_follows_the_specification(pellicle, out, mesh):
    convert(pellicle, mesh[0], out / "a.glb")
    data = (out / "a.glb").read_bytes()
    magic, version, length, size, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, length, kind, size % 4) == (b"glTF", 2, len(data), b"JSON", 0)
    tree = json.loads(data[20 : 20 + size])
    attributes = tree["meshes"][0]["primitives"][0]["attributes"]
    assert set(attributes) == {"POSITION", "NORMAL", "COLOR_0", "_VELOCITY", "_DENSITY"}
    position = tree["accessors"][attributes["POSITION"]]
    assert np.allclose(position["max"], [1, 2, 3], atol=0.02) and "min" in position
    assert all(view["byteOffset"] % 4 == 0 for view in tree["bufferViews"])
    assert any("source mesh.ply" in line for line in tree["asset"]["extras"]["comments"])


def test_numpy_reads_npy_and_npz(pellicle, out, particles, mesh, witness):
    source, expected = particles
    process = convert(pellicle, source, out / "a.npy")
    assert "left out" in process.stderr
    assert np.array_equal(np.load(out / "a.npy"), expected["position"])
    witness("NumPy array", "particles out", np)
    convert(pellicle, source, out / "a.npz")
    found = np.load(out / "a.npz")
    same({**found, "position": found["positions"]}, expected, expected)
    assert found["id"].dtype == np.int32
    witness("NumPy archive", "particles out", np, "f32, i32")
    source, expected, faces = mesh
    convert(pellicle, source, out / "b.npz")
    found = np.load(out / "b.npz")
    same({**found, "position": found["vertices"], "normal": found["normals"]}, expected, expected)
    assert np.array_equal(found["triangles"], faces)
    witness("NumPy archive", "mesh out", np, "normals, vectors, scalars")


def test_text_formats_are_read_by_the_standard_library(pellicle, out, particles, witness):
    source, expected = particles
    convert(pellicle, source, out / "a.csv")
    with open(out / "a.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    table = {name: np.array([row[name] for row in rows], np.float32) for name in rows[0]}
    same(columns(table), expected, expected)
    witness("CSV", "particles out", "csv", "f32, i32")
    convert(pellicle, source, out / "a.json")
    found = json.loads((out / "a.json").read_text())
    same({name: np.asarray(found[name], np.float32) for name in found if name != "comments"} | {"position": np.asarray(found["positions"], np.float32)}, expected, expected)
    witness("JSON", "particles out", "json", "f32, i32")
    convert(pellicle, source, out / "a.extxyz")
    lines = (out / "a.extxyz").read_text().splitlines()
    assert int(lines[0]) == COUNT == len(lines) - 2
    assert "Properties=species:S:1:pos:R:3:velocity:R:3:density:R:1:id:I:1" in lines[1]
    numbers = np.array([line.split()[1:] for line in lines[2:]], np.float32)
    same({"position": numbers[:, :3], "velocity": numbers[:, 3:6], "density": numbers[:, 6], "id": numbers[:, 7]}, expected, expected)


def test_ase_reads_extended_xyz(pellicle, out, particles, witness):
    io = pytest.importorskip("ase.io", reason="ASE is not installed")
    source, expected = particles
    convert(pellicle, source, out / "a.extxyz")
    atoms = io.read(out / "a.extxyz")
    same({**atoms.arrays, "position": atoms.positions.astype(np.float32), "velocity": atoms.arrays["velocity"].astype(np.float32), "density": atoms.arrays["density"].astype(np.float32)}, expected, expected)
    witness("text and extended XYZ", "particles out", "ase", "f32, i32")


def test_raw_and_bgeo_have_the_bytes_that_their_formats_ask_for(pellicle, out, particles, witness):
    source, expected = particles
    convert(pellicle, source, out / "a.xyz")
    assert np.array_equal(np.fromfile(out / "a.xyz", "<f4").reshape(-1, 3), expected["position"])
    convert(pellicle, source, out / "a.f64")
    assert np.array_equal(np.fromfile(out / "a.f64", "<f8").reshape(-1, 3), expected["position"].astype(float))
    witness("raw XYZ", "particles out", np, "f32, f64")
    convert(pellicle, source, out / "a.bgeo")
    convert(pellicle, source, out / "a.bgeo.gz")
    data = (out / "a.bgeo").read_bytes()
    assert gzip.decompress((out / "a.bgeo.gz").read_bytes()) == data
    assert struct.unpack(">5s9i", data[:41]) == (b"BgeoV", 5, COUNT, 0, 0, 0, 3, 0, 0, 0)
    at = 41
    found = []
    for _ in range(3):
        (length,) = struct.unpack_from(">H", data, at)
        name = data[at + 2 : at + 2 + length].decode()
        size, kind = struct.unpack_from(">Hi", data, at + 2 + length)
        found.append((name, size, kind))
        at += 2 + length + 6 + 4 * size
    assert found == [("v", 3, 5), ("density", 1, 0), ("id", 1, 1)]
    table = np.frombuffer(data, [("position", ">f4", 3), ("w", ">f4"), ("velocity", ">f4", 3), ("density", ">f4"), ("id", ">i4")], COUNT, at)
    same(table, expected, expected)
    assert (table["w"] == 1).all() and data[at + table.nbytes :] == b"\0\xff"
    witness("Houdini BGEO classic", "particles out", np, "f32, i32")


@pytest.mark.parametrize("ascii", [False, True])
def test_stl_of_trimesh_is_read(pellicle, out, witness, ascii):
    ball = trimesh.creation.icosphere(subdivisions=3)
    (out / "a.stl").write_bytes(trimesh.exchange.stl.export_stl_ascii(ball).encode() if ascii else trimesh.exchange.stl.export_stl(ball))
    assert_done(pellicle("check", out / "a.stl"))
    convert(pellicle, out / "a.stl", out / "a.npz")
    found = np.load(out / "a.npz")
    assert len(found["vertices"]) == len(ball.vertices), "corners are welded"
    np.testing.assert_allclose(found["vertices"][found["triangles"]], ball.triangles, atol=1e-6)
    witness("STL", "mesh in", trimesh, "text" if ascii else "binary")


def test_obj_of_trimesh_is_read(pellicle, out, witness):
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.visual.vertex_colors = np.random.default_rng(2).integers(0, 256, (len(ball.vertices), 4)).astype(np.uint8)
    (out / "a.obj").write_text(trimesh.exchange.obj.export_obj(ball, include_normals=True, include_color=True, digits=9))
    convert(pellicle, out / "a.obj", out / "a.npz")
    found = np.load(out / "a.npz")
    np.testing.assert_allclose(found["vertices"][found["triangles"]], ball.vertices[ball.faces], atol=1e-6)
    np.testing.assert_allclose(found["color"][found["triangles"]], ball.visual.vertex_colors[ball.faces][..., :3] / 255, atol=1e-6)
    assert found["normals"].shape == found["vertices"].shape
    witness("Wavefront OBJ", "mesh in", trimesh, "normals, colours")


def test_glb_of_trimesh_is_read(pellicle, out, witness):
    scene = trimesh.Scene()
    for i in range(3):
        ball = trimesh.creation.icosphere(subdivisions=2)
        ball.vertex_attributes["_MASS"] = np.full(len(ball.vertices), i, np.float32)
        move = trimesh.transformations.rotation_matrix(0.3 * i, [1, 2, 3]) @ trimesh.transformations.translation_matrix([3 * i, 0, 0])
        scene.add_geometry(ball, transform=move @ np.diag([1, 1, 0.5, 1]))
    (out / "a.glb").write_bytes(scene.export(file_type="glb"))
    assert_done(pellicle("check", out / "a.glb"))
    convert(pellicle, out / "a.glb", out / "a.npz")
    found, expected = np.load(out / "a.npz"), scene.to_geometry()
    assert len(found["vertices"]) == len(expected.vertices)
    key = lambda corners: corners.reshape(-1, 9)[np.lexsort(np.round(corners.reshape(-1, 9), 3).T)]
    np.testing.assert_allclose(key(found["vertices"][found["triangles"]]), key(expected.triangles), atol=1e-4)
    assert set(found["mass"]) == {0, 1, 2}
    witness("binary glTF", "mesh in", trimesh, "transforms, several meshes, scalars")


@pytest.mark.parametrize("kind", ["ply", "obj", "stl", "vtk", "vtp", "vtu", "glb", "npz"])
def test_empty_meshes_are_valid(pellicle, out, kind):
    write_ply(out / "none.ply", [("vertex", np.zeros(0, [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]))], np.zeros((0, 3)))
    (out / "none.obj").write_text("")
    convert(pellicle, out / "none.obj", out / f"a.{kind}") if kind != "obj" else None
    path = out / f"a.{kind}"
    if kind in ("vtp", "vtu", "vtk"):
        assert vtk_read(path)[2].GetNumberOfPoints() == 0
    elif kind == "npz":
        assert np.load(path)["vertices"].shape == (0, 3) == np.load(path)["triangles"].shape
    elif kind == "glb":
        assert not trimesh.load(path).geometry
    elif kind == "stl":
        assert path.stat().st_size == 84
    elif kind == "ply":
        assert PlyData.read(path)["vertex"].count == 0


def test_convert_scales_drops_and_refuses(pellicle, out):
    positions = np.arange(12, dtype=np.float64).reshape(4, 3)
    positions[2, 1] = np.nan
    np.save(out / "a.npy", positions)
    process = convert(pellicle, out / "a.npy", out / "b.npy", "--scale", 2, "--drop-invalid")
    assert "1 particle" in process.stderr
    assert np.array_equal(np.load(out / "b.npy"), 2 * positions[[0, 1, 3]])
    assert_failed(pellicle("convert", out / "a.npy", out / "a.npy"), "overwrite", code=2)
    assert_failed(pellicle("convert", out / "a.npy", out / "a.what"), "not known", code=2)
    assert_failed(pellicle("convert", out / "a.npy", out / "c.json"), "particle 2", "NaN")
    assert_failed(pellicle("convert", out / "a.npy", out / "c.stl"), ".stl")
    assert sorted(file.name for file in out.iterdir()) == ["a.npy", "b.npy"]


@pytest.mark.parametrize("kind", ["bgeo", "vtk", "ply"])
def test_splashsurf_reads_the_same_particles(pellicle, out, witness, kind):
    pytest.importorskip("pysplashsurf", reason="splashsurf is not installed")
    grid = np.stack(np.meshgrid(*[np.arange(8)] * 3), axis=-1).reshape(-1, 3).astype("<f4")
    grid.tofile(out / "a.xyz")
    convert(pellicle, out / "a.xyz", out / f"b.{kind}")
    for name in ("a.xyz", f"b.{kind}"):
        call = ["reconstruct", str(out / name), "-r", "0.5", "-l", "2", "-c", "1", "-t", "0.6", "-o", str(out / (name + ".obj"))]
        subprocess.run([sys.executable, "-c", f"import pysplashsurf; pysplashsurf.run_splashsurf(['splashsurf', *{call}])"], check=True, capture_output=True)
    assert (out / "a.xyz.obj").read_text() == (out / f"b.{kind}.obj").read_text() != ""
    names = {"bgeo": "Houdini BGEO classic", "ply": "PLY", **VTK_FORMATS}
    witness(names[kind], "particles out", "splashsurf")
