"""Files that VTK, meshio and h5py write are read as they were meant: counts, boxes, ranges of every attribute.

The wheels of vtk, meshio and h5py are large, so only `cargo xtask test --all` installs them (requirements-extra.txt); a
test whose wheel is missing is skipped.
"""

import itertools
import json

import numpy as np
import pytest
from conftest import assert_done, assert_failed

COUNT = 1000
RNG = np.random.default_rng(7)
POINTS = RNG.uniform(-3, 5, (COUNT, 3))

# What VTK and HDF5 have as numbers, by the name of the attribute. Names with blanks and signs must survive.
ARRAYS = {
    "velocity": RNG.normal(size=(COUNT, 3)).astype("f4"),
    "density": RNG.uniform(900, 1100, COUNT),
    "stress tensor": RNG.normal(size=(COUNT, 9)).astype("f4"),
    "id": np.arange(COUNT, dtype="i8") + 2**40,
    "u8": (np.arange(COUNT) % 256).astype("u1"),
    "i8": (np.arange(COUNT) % 256 - 128).astype("i1"),
    "i16": (np.arange(COUNT) * 7 - 3000).astype("i2"),
    "u16": (np.arange(COUNT) * 60).astype("u2"),
    "i32": (np.arange(COUNT) * 1000000 - 500000000).astype("i4"),
    "u32": (np.arange(COUNT) * 4000000).astype("u4"),
    "u64": np.arange(COUNT, dtype="u8") * 2**45,
}
# How far ASCII rounds: the digits that VTK writes.
ASCII = 1e-5


def info(pellicle, path, *options):
    process = pellicle("info", path, "--json", *options)
    assert_done(process)
    return json.loads(process.stdout)


def assert_holds(found, points=POINTS, arrays=ARRAYS, tolerance=0.0, but=()):
    """The report is of these points and arrays."""
    close = lambda a, b: np.allclose(a, b, rtol=tolerance or 1e-12, atol=tolerance)
    assert found["kind"] == "particles" and found["particles"] == len(points)
    assert close(found["box"], [points.min(0), points.max(0)])
    attributes = {a["name"]: a for a in found["attributes"]}
    for name, array in arrays.items():
        if name in but:
            continue
        values = array.reshape(len(array), -1)
        attribute = attributes.pop(name)
        assert attribute["components"] == values.shape[1], name
        assert close(attribute["min"], values.min(0).astype(float)), (name, attribute["min"], values.min(0))
        assert close(attribute["max"], values.max(0).astype(float)), (name, attribute["max"], values.max(0))
    assert not attributes


def vtk_data(vtk, kind, points=POINTS, arrays=ARRAYS, faces=()):
    """A vtkPolyData or vtkUnstructuredGrid: a vertex at each point, or these faces, as (type, corners)."""
    from vtk.util.numpy_support import numpy_to_vtk

    data = vtk.vtkPolyData() if kind == "PolyData" else vtk.vtkUnstructuredGrid()
    places = vtk.vtkPoints()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    data.SetPoints(places)
    lists = {vtk.VTK_VERTEX: vtk.vtkCellArray(), vtk.VTK_TRIANGLE_STRIP: vtk.vtkCellArray()}
    polygons = vtk.vtkCellArray()
    for cell, corners in faces or [(vtk.VTK_VERTEX, [i]) for i in range(len(points))]:
        if kind == "PolyData":
            lists.get(cell, polygons).InsertNextCell(len(corners), corners)
        else:
            data.InsertNextCell(cell, len(corners), corners)
    if kind == "PolyData":
        data.SetVerts(lists[vtk.VTK_VERTEX])
        data.SetStrips(lists[vtk.VTK_TRIANGLE_STRIP])
        data.SetPolys(polygons)
    for name, array in arrays.items():
        values = numpy_to_vtk(np.ascontiguousarray(array), deep=True)
        values.SetName(name)
        data.GetPointData().AddArray(values)
    extra = numpy_to_vtk(np.arange(data.GetNumberOfCells(), dtype="f8"), deep=True)
    extra.SetName("of the cells")
    data.GetCellData().AddArray(extra)
    labels = vtk.vtkStringArray()
    labels.SetName("label")
    for i in range(len(points)):
        labels.InsertNextValue(f"particle {i}")
    data.GetPointData().AddArray(labels)
    return data


@pytest.fixture
def vtk():
    return pytest.importorskip("vtk", reason="the wheel vtk is missing: cargo xtask test --all installs it")


@pytest.fixture
def h5py():
    return pytest.importorskip("h5py", reason="the wheel h5py is missing: cargo xtask test --all installs it")


@pytest.fixture
def hdf5(pellicle, h5py, tmp_path):
    """h5py, if the program reads HDF5."""
    with h5py.File(tmp_path / "probe.h5", "w") as file:
        file["positions"] = np.zeros((2, 3))
    if "--features hdf5" in (said := pellicle("info", tmp_path / "probe.h5").stderr):
        pytest.skip(f"the program was built without HDF5: {said}")
    return h5py


def write_xml(vtk, data, path, mode, encoded, compressor, header, order):
    writer = vtk.vtkXMLPolyDataWriter() if data.IsA("vtkPolyData") else vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    {"ascii": writer.SetDataModeToAscii, "inline": writer.SetDataModeToBinary, "appended": writer.SetDataModeToAppended}[mode]()
    writer.SetEncodeAppendedData(encoded)
    {
        "none": writer.SetCompressorTypeToNone,
        "zlib": writer.SetCompressorTypeToZLib,
        "lz4": writer.SetCompressorTypeToLZ4,
        "lzma": writer.SetCompressorTypeToLZMA,
    }[compressor]()
    {32: writer.SetHeaderTypeToUInt32, 64: writer.SetHeaderTypeToUInt64}[header]()
    {"little": writer.SetByteOrderToLittleEndian, "big": writer.SetByteOrderToBigEndian}[order]()
    assert writer.Write() == 1


@pytest.mark.witness("VTK XML polygons", "particles in", "vtk", "all types, encodings and compressors")
@pytest.mark.witness("VTK XML unstructured grid", "particles in", "vtk", "all types, encodings and compressors")
@pytest.mark.parametrize("compressor", ["none", "zlib", "lz4", "lzma"])
@pytest.mark.parametrize("mode, encoded", [("ascii", 0), ("inline", 0), ("appended", 0), ("appended", 1)])
def test_vtk_xml_in_every_encoding(pellicle, vtk, tmp_path, mode, encoded, compressor):
    for kind, header, order in itertools.product(["PolyData", "UnstructuredGrid"], [32, 64], ["little", "big"]):
        path = tmp_path / ("a.vtp" if kind == "PolyData" else "a.vtu")
        write_xml(vtk, vtk_data(vtk, kind), path, mode, encoded, compressor, header, order)
        assert_holds(info(pellicle, path), tolerance=ASCII if mode == "ascii" else 0)


@pytest.mark.witness("VTK legacy", "particles in", "vtk", "all types; versions 4.2 and 5.1")
@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("is_binary", [False, True])
@pytest.mark.parametrize("kind", ["PolyData", "UnstructuredGrid"])
def test_legacy_vtk_in_every_version(pellicle, vtk, tmp_path, kind, is_binary, version):
    path = tmp_path / "a.vtk"
    data = vtk_data(vtk, kind)
    point_data = data.GetPointData()
    point_data.SetActiveVectors("velocity")
    point_data.SetActiveScalars("density")
    point_data.SetActiveTensors("stress tensor")
    writer = vtk.vtkPolyDataWriter() if kind == "PolyData" else vtk.vtkUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetFileVersion(version)
    writer.SetFileTypeToBinary() if is_binary else writer.SetFileTypeToASCII()
    writer.SetInputData(data)
    assert writer.Write() == 1
    found = info(pellicle, path)
    assert_holds(found, tolerance=0 if is_binary else ASCII)


@pytest.mark.parametrize("is_binary", [False, True])
def test_legacy_vtk_roles_of_arrays(pellicle, vtk, tmp_path, is_binary):
    """Normals, texture coordinates, colours with a lookup table, ids: each has a keyword of its own."""
    arrays = {
        "normal": np.tile(np.float32([0, 0.6, 0.8]), (COUNT, 1)),
        "uv": RNG.uniform(size=(COUNT, 2)).astype("f4"),
        "rgb": (RNG.uniform(size=(COUNT, 3)) * 255).astype("u1"),
    }
    data = vtk_data(vtk, "PolyData", arrays=arrays)
    point_data = data.GetPointData()
    point_data.SetActiveNormals("normal")
    point_data.SetActiveTCoords("uv")
    point_data.SetActiveScalars("rgb")
    writer = vtk.vtkPolyDataWriter()
    writer.SetFileName(str(tmp_path / "a.vtk"))
    writer.SetFileTypeToBinary() if is_binary else writer.SetFileTypeToASCII()
    writer.SetInputData(data)
    assert writer.Write() == 1
    assert_holds(info(pellicle, tmp_path / "a.vtk"), arrays=arrays, tolerance=0 if is_binary else ASCII)


def test_pieces_and_empty_ones_are_joined(pellicle, vtk, tmp_path):
    """VTK writes the points anew for each of several pieces; what its own reader finds is right."""
    data = vtk_data(vtk, "UnstructuredGrid")
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "a.vtu"))
    writer.SetInputData(data)
    writer.SetNumberOfPieces(5)
    assert writer.Write() == 1
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "a.vtu"))
    reader.Update()
    copies = reader.GetOutput().GetNumberOfPoints() // COUNT
    arrays = {name: np.concatenate([array] * copies) for name, array in ARRAYS.items()}
    assert_holds(info(pellicle, tmp_path / "a.vtu"), points=np.concatenate([POINTS] * copies), arrays=arrays)
    writer.SetInputData(vtk_data(vtk, "UnstructuredGrid", points=np.zeros((0, 3)), arrays={}))
    assert writer.Write() == 1
    assert info(pellicle, tmp_path / "a.vtu")["particles"] == 0


@pytest.mark.witness("ParaView list of files", "particles in", "vtk", "pieces and steps")
def test_parallel_pieces_and_steps(pellicle, vtk, tmp_path):
    halves = [slice(0, 300), slice(300, COUNT)]
    for step, shift in enumerate([0.0, 10.0]):
        for part, rows in enumerate(halves):
            arrays = {name: array[rows] for name, array in ARRAYS.items()}
            arrays |= {f"only in {part}": np.ones(len(POINTS[rows]))}
            data = vtk_data(vtk, "UnstructuredGrid", points=POINTS[rows] + shift, arrays=arrays)
            write_xml(vtk, data, tmp_path / f"s{step}_{part}.vtu", "appended", 0, "zlib", 32, "little")
    sets = [f'<DataSet timestep="{t}" part="{p}" file="s{s}_{p}.vtu"/>' for s, t in [(1, 2.5), (0, 0.5)] for p in (1, 0)]
    (tmp_path / "all.pvd").write_text(f'<?xml version="1.0"?><VTKFile type="Collection"><Collection>{"".join(sets)}</Collection></VTKFile>')
    assert_holds(info(pellicle, tmp_path / "all.pvd"))
    pieces = "".join(f'<Piece Source="s1_{p}.vtu"/>' for p in (0, 1))
    (tmp_path / "one.pvtu").write_text(f'<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid>{pieces}</PUnstructuredGrid></VTKFile>')
    assert_holds(info(pellicle, tmp_path / "one.pvtu"), points=POINTS + 10)


@pytest.mark.witness("VTK legacy", "particles in", "meshio", "all types")
@pytest.mark.witness("VTK XML unstructured grid", "particles in", "meshio", "all types")
@pytest.mark.parametrize("name", ["a.vtk", "ascii.vtk", "a.vtu", "ascii.vtu", "zlib.vtu", "lzma.vtu"])
def test_meshio(pellicle, tmp_path, name):
    meshio = pytest.importorskip("meshio", reason="the wheel meshio is missing: cargo xtask test --all installs it")
    arrays = {name: array for name, array in ARRAYS.items() if name != "stress tensor"}
    mesh = meshio.Mesh(POINTS, [("vertex", np.arange(COUNT)[:, None])], point_data=arrays)
    options = {"binary": not name.startswith("ascii")}
    if name.endswith("vtu"):
        options["compression"] = name.split(".")[0] if name[0] in "zl" else None
    mesh.write(tmp_path / name, file_format=None if name.endswith("vtu") else "vtk", **options)
    assert_holds(info(pellicle, tmp_path / name), arrays=arrays, tolerance=1e-9 if name == "ascii.vtu" else 0)


def surface(vtk):
    """A cube of quads and triangles, with a strip for a lid, and its measures."""
    points = np.array(list(itertools.product([0.0, 1.0], repeat=3)))
    quad, triangle, strip, polygon = vtk.VTK_QUAD, vtk.VTK_TRIANGLE, vtk.VTK_TRIANGLE_STRIP, vtk.VTK_POLYGON
    faces = [
        (quad, [0, 1, 3, 2]), (polygon, [4, 6, 7, 5]), (triangle, [0, 4, 5]), (triangle, [0, 5, 1]),
        (quad, [2, 3, 7, 6]), (strip, [0, 2, 4, 6]), (strip, [1, 5, 3, 7]),
    ]  # fmt: skip
    return points, faces


@pytest.mark.witness("VTK legacy", "mesh in", "vtk", "triangles, quads, strips")
@pytest.mark.witness("VTK XML polygons", "mesh in", "vtk", "polygons, strips")
@pytest.mark.witness("VTK XML unstructured grid", "mesh in", "vtk", "triangles, quads")
@pytest.mark.parametrize("name", ["a.vtp", "a.vtu", "ascii.vtp", "polydata.vtk", "grid.vtk", "old.vtk"])
def test_meshes(pellicle, vtk, tmp_path, name):
    points, faces = surface(vtk)
    kind = "UnstructuredGrid" if name in ("a.vtu", "grid.vtk", "old.vtk") else "PolyData"
    data = vtk_data(vtk, kind, points=points, arrays={"height": points[:, 2]}, faces=faces)
    path = tmp_path / name
    if name.endswith("vtk"):
        writer = vtk.vtkPolyDataWriter() if kind == "PolyData" else vtk.vtkUnstructuredGridWriter()
        writer.SetFileName(str(path))
        writer.SetFileVersion(42 if name == "old.vtk" else 51)
        writer.SetFileTypeToBinary()
        writer.SetInputData(data)
        assert writer.Write() == 1
    else:
        write_xml(vtk, data, path, "ascii" if name.startswith("ascii") else "appended", 0, "lz4", 64, "big")
    found = info(pellicle, path)
    assert (found["kind"], found["vertices"], found["triangles"]) == ("mesh", 8, 12)
    assert found["box"] == [[0, 0, 0], [1, 1, 1]]
    assert [(a["name"], a["min"], a["max"]) for a in found["attributes"]] == [("height", [0], [1])]
    # Closed, and oriented the same way all over.
    checked = pellicle("check", path, "--json")
    assert_done(checked)
    assert json.loads(checked.stdout)["euler_characteristic"] == 2


@pytest.mark.parametrize("name", ["a.vtu", "a.vtk"])
def test_solids_are_refused_by_kind_and_count(pellicle, vtk, tmp_path, name):
    points, _ = surface(vtk)
    data = vtk_data(vtk, "UnstructuredGrid", points=points, arrays={}, faces=[(vtk.VTK_TETRA, [0, 1, 2, 4])] * 3)
    path = tmp_path / name
    if name.endswith("vtk"):
        writer = vtk.vtkUnstructuredGridWriter()
        writer.SetFileName(str(path))
        writer.SetInputData(data)
        assert writer.Write() == 1
    else:
        write_xml(vtk, data, path, "inline", 0, "zlib", 32, "little")
    for verb in ("check", "info"):
        assert_failed(pellicle(verb, path), "3 tetrahedra", "Extract Surface", code=1)
    # Its points may be particles all the same.
    assert_done(pellicle("mesh", path, "-r", "0.1", "-o", tmp_path / "out.ply"))


def put(group, arrays, **options):
    for name, array in arrays.items():
        group.create_dataset(name, data=array, **options)


CHUNKED = dict(chunks=True, compression="gzip", shuffle=True)


@pytest.mark.witness("HDF5", "particles in", "h5py", "Gadget and SWIFT; chunked, shuffled, deflated")
@pytest.mark.parametrize("options", [{}, CHUNKED, dict(chunks=True, fletcher32=True), dict(chunks=True, compression="lzf")])
@pytest.mark.parametrize("libver", ["earliest", "latest"])
def test_hdf5_snapshots(pellicle, hdf5, tmp_path, options, libver):
    arrays = {name: array for name, array in ARRAYS.items() if name != "velocity"}
    path = tmp_path / "snap.hdf5"
    with hdf5.File(path, "w", libver=libver) as file:
        file.create_group("Header").attrs["NumPart_ThisFile"] = [COUNT, 0, 0, 0, 0, 0]
        put(file.create_group("PartType0"), arrays | {"Coordinates": POINTS, "Velocities": ARRAYS["velocity"]}, **options)
        put(file.create_group("PartType1"), {"Coordinates": POINTS[:10] + 100}, **options)
    if options.get("compression") == "lzf":
        assert_failed(pellicle("info", path), "snap.hdf5", "h5repack", code=1)
        return
    assert_holds(info(pellicle, path))


@pytest.mark.witness("HDF5", "particles in", "h5py", "PySPH")
def test_hdf5_of_pysph(pellicle, hdf5, tmp_path):
    x, y, z = POINTS.T
    u, v, w = ARRAYS["velocity"].T
    with hdf5.File(tmp_path / "a.hdf5", "w") as file:
        for name, rows in [("fluid", slice(None)), ("solid", slice(0, 50))]:
            columns = {"x": x, "y": y, "z": z, "u": u, "v": v, "w": w, "rho": ARRAYS["density"], "gid": ARRAYS["u32"]}
            put(file.create_group(f"particles/{name}/arrays"), {key: values[rows] for key, values in columns.items()}, **CHUNKED)
        file.create_group("solver_data").attrs["t"] = 0.5
    arrays = {"velocity": ARRAYS["velocity"], "rho": ARRAYS["density"], "gid": ARRAYS["u32"]}
    assert_holds(info(pellicle, tmp_path / "a.hdf5"), arrays=arrays)


def test_hdf5_of_other_shapes(pellicle, hdf5, tmp_path):
    with hdf5.File(tmp_path / "big.h5", "w") as file:
        file.create_dataset("positions", data=POINTS.astype(">f4"), chunks=(64, 2), compression="gzip")
        file.create_dataset("density", data=ARRAYS["density"].astype(">f8"))
        file["text"] = "not a number"
        file["records"] = np.zeros(COUNT, [("a", "f4"), ("b", "i4")])
    found = info(pellicle, tmp_path / "big.h5")
    assert_holds(found, points=POINTS.astype("f4").astype(float), arrays={"density": ARRAYS["density"]}, tolerance=1e-7)
    with hdf5.File(tmp_path / "odd.h5", "w") as file:
        file["one/thing"] = POINTS
        file["other/thing"] = POINTS
    assert_failed(pellicle("info", tmp_path / "odd.h5"), "one/thing", "other/thing", code=1)
    with hdf5.File(tmp_path / "none.h5", "w") as file:
        file.create_group("PartType0")["Coordinates"] = np.zeros((0, 3))
    assert info(pellicle, tmp_path / "none.h5")["particles"] == 0


@pytest.mark.witness("HDF5", "particles in", "h5py", "VTKHDF with steps")
def test_vtkhdf(pellicle, hdf5, tmp_path):
    """Two steps, of which the first has two parts."""
    path = tmp_path / "a.vtkhdf"
    with hdf5.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = [2, 0]
        root.attrs.create("Type", b"UnstructuredGrid", dtype=hdf5.string_dtype("ascii", 16))
        root["Points"] = np.concatenate([POINTS, POINTS[:100] + 50])
        root["NumberOfPoints"] = np.array([300, COUNT - 300, 100])
        put(root.create_group("PointData"), {name: np.concatenate([a, a[:100]]) for name, a in ARRAYS.items()}, **CHUNKED)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = 2
        put(steps, {"Values": [0.0, 1.0], "PartOffsets": [0, 2], "NumberOfParts": [2, 1], "PointOffsets": [0, COUNT]})
    assert_holds(info(pellicle, path))
