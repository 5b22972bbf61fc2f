"""Volumes that foreign programs write are read as they were meant: every sample in its place.

Each file holds a ramp, 3i + 5j + 11k at sample (i, j, k), which every type holds exactly and no two axes share. Its surfaces are
planes, and linear interpolation is exact on them: so each vertex of a contour must lie at the isovalue when it is led back
through the writer's own map from samples to the world. A swapped axis, a wrong byte order, a shifted or mirrored place shows.
"""

import gzip
import itertools
import json

import numpy as np
import pytest
from check_mesh import load
from conftest import assert_done, assert_failed

DIMS = (9, 8, 7)
WEIGHTS = np.array([3, 5, 11])
RAMP = np.einsum("a,aijk->ijk", WEIGHTS, np.indices(DIMS))  # [i][j][k]
ISO = 60.5

# Oblique, left-handed, of uneven spacing: columns are the steps along i, j, k, then the first sample.
OBLIQUE = np.array([[0.6, -1.6, 0.1, 10.0], [0.8, 1.2, 0.0, -20.0], [0.0, 0.2, -3.0, 5.0], [0.0, 0.0, 0.0, 1.0]])
STRAIGHT = np.array([[0.5, 0, 0, 10.0], [0, 2.0, 0, -20.0], [0, 0, 1.5, 0.25], [0, 0, 0, 1]])
NONE = np.eye(4)

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"]


def expected_vertices(values, iso=ISO):
    inside = values > iso
    return sum(int((np.diff(inside.astype("i1"), axis=axis) != 0).sum()) for axis in range(3))


def assert_ramp(pellicle, path, affine, *options, values=RAMP, tolerance=1e-4, weights=WEIGHTS, iso=ISO):
    """The file is of the ramp, in its place."""
    mesh = path.with_suffix(".ply") if path.is_absolute() else path
    assert_done(pellicle("contour", path, "--iso", iso, "--open", "-o", mesh, *options))
    vertices, triangles = load(mesh)
    assert len(vertices) == expected_vertices(values, iso), path
    index = np.linalg.solve(affine[:3, :3], (vertices - affine[:3, 3]).T).T
    assert np.abs(index @ weights - iso).max() < tolerance, path
    # Outside is where values are less, whatever the handedness of the axes.
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    gradient = np.linalg.solve(affine[:3, :3].T, weights)
    assert (normals @ gradient <= 1e-12).all() and (normals @ gradient < 0).any(), path
    mesh.unlink()


def info(pellicle, path, *options):
    process = pellicle("info", path, "--json", *options)
    assert_done(process)
    found = json.loads(process.stdout)
    assert found["kind"] == "volume"
    return found


# NumPy: array[z][y][x] by default, array[x][y][z] with --axes xyz.


@pytest.mark.witness("NumPy array", "volume in", "numpy", "all types, either byte order; C and Fortran order; components")
def test_npy(pellicle, out):
    for kind, order, axes in itertools.product(["<u1", ">i2", "<i4", ">u8", "<f2", "<f4", ">f8"], "CF", ["zyx", "xyz"]):
        array = RAMP.T if axes == "zyx" else RAMP
        path = out / "ramp.npy"
        np.save(path, np.asarray(array, dtype=kind, order=order))
        assert_ramp(pellicle, path, NONE, "--axes", axes)
    for order in "CF":
        four = np.stack([RAMP.T * 0, RAMP.T, RAMP.T * 0 + 9], axis=-1)
        np.save(out / "four.npy", np.asarray(four, dtype="<i2", order=order))
        assert_ramp(pellicle, out / "four.npy", NONE, "--component", 1)
        assert_failed(pellicle("contour", out / "four.npy", "--iso", 3), "3 components", "choose")
    np.save(out / "placed.npy", RAMP.T.astype("f4"))
    assert_ramp(pellicle, out / "placed.npy", STRAIGHT, "--spacing", "0.5,2,1.5", "--origin", "10,-20,0.25")


@pytest.mark.witness("NumPy archive", "volume in", "numpy", "stored and deflated; C and Fortran order")
def test_npz(pellicle, out):
    for save, order in itertools.product([np.savez, np.savez_compressed], "CF"):
        save(out / "ramp.npz", scan=np.asarray(RAMP.T, dtype="i2", order=order), spacing=np.ones(3))
        assert_ramp(pellicle, out / "ramp.npz", NONE)
        save(out / "two.npz", scan=np.asarray(RAMP.T, dtype="i2", order=order), mask=RAMP.T > 3)
        assert_ramp(pellicle, out / "two.npz", NONE, "--array", "scan")
        assert_failed(pellicle("contour", out / "two.npz", "--iso", 1), "not clear", "scan", "mask")


@pytest.mark.witness("raw XYZ", "volume in", "numpy", "dims on the command line; all types, either byte order")
def test_raw(pellicle, out):
    for kind, endian in itertools.product(TYPES, ["little", "big"]):
        data = RAMP.T.astype(("<" if endian == "little" else ">") + kind)
        (out / "ramp.bin").write_bytes(b"skip me" + data.tobytes())
        name = kind[0].replace("u", "u") + str(8 * int(kind[1]))
        dims = ["--dims", "9,8,7", "--type", name, "--endian", endian, "--skip", 7]
        assert_ramp(pellicle, out / "ramp.bin", NONE, *dims)
    pairs = np.stack([RAMP.T, RAMP.T * 0], axis=-1).astype("<f4")
    (out / "pairs.raw").write_bytes(pairs.tobytes())
    assert_ramp(pellicle, out / "pairs.raw", NONE, "--dims", "9,8,7,2", "--component", 0)
    assert_failed(pellicle("contour", out / "pairs.raw", "--iso", 1, "--dims", "9,8,7"), "4032", "2016")


# NIfTI, judged by nibabel.


def nifti(out, nibabel, kind, name, second=False, endian="<", sform=True, qform=False):
    header_type = nibabel.Nifti2Header if second else nibabel.Nifti1Header
    image_type = {
        (False, False): nibabel.Nifti1Image,
        (False, True): nibabel.Nifti2Image,
        (True, False): nibabel.Nifti1Pair,
        (True, True): nibabel.Nifti2Pair,
    }[(name.endswith(".img"), second)]
    header = header_type(endianness=endian)
    header.set_data_dtype(kind)
    header.set_xyzt_units("mm")
    rotation = np.linalg.qr(OBLIQUE[:3, :3])[0]
    affine = OBLIQUE.copy()
    if qform:
        affine[:3, :3] = rotation * [0.5, 2.0, 1.5]
    image = image_type(RAMP.astype(kind), affine, header)
    image.set_sform(affine if sform else None, code=1 if sform else 0)
    image.set_qform(affine if qform else None, code=1 if qform else 0)
    path = out / name
    nibabel.save(image, path)
    loaded = nibabel.load(path)
    assert np.array_equal(np.asarray(loaded.dataobj), RAMP) and np.allclose(loaded.affine, affine, atol=1e-5)
    return path, loaded.affine


@pytest.mark.witness("NIfTI", "volume in", "nibabel", "all types, versions 1 and 2, pairs, gzip, either byte order; sform, qform, scaling, time steps")
def test_nifti(pellicle, out):
    nibabel = pytest.importorskip("nibabel")
    for kind, second, endian in itertools.product(TYPES, [False, True], "<>"):
        path, affine = nifti(out, nibabel, kind, "ramp.nii", second, endian)
        assert_ramp(pellicle, path, affine, tolerance=1e-3)
    for name, sform in itertools.product(["q.nii", "q.nii.gz", "q.img"], [True, False]):
        path, affine = nifti(out, nibabel, "i2", name, sform=sform, qform=True)
        assert_ramp(pellicle, path, affine, tolerance=1e-3)
    assert_ramp(pellicle, out / "q.hdr", affine, tolerance=1e-3)
    assert info(pellicle, path)["unit"] == "mm"
    # Samples that are scaled, up and down: nibabel does it.
    for slope, intercept in [(0.5, -3), (-0.25, 100)]:
        image = nibabel.Nifti1Image(RAMP.astype("i2"), STRAIGHT)
        image.header.set_slope_inter(slope, intercept)
        stored = np.round((RAMP - intercept) / slope).astype("i2")
        nibabel.Nifti1Image(stored, STRAIGHT, image.header).to_filename(out / "plain.nii")
        data = bytearray((out / "plain.nii").read_bytes())
        data[112:120] = np.array([slope, intercept], "<f4").tobytes()
        (out / "scaled.nii").write_bytes(data)
        assert np.allclose(nibabel.load(out / "scaled.nii").get_fdata(), RAMP)
        assert_ramp(pellicle, out / "scaled.nii", STRAIGHT, tolerance=1e-3)
        found = info(pellicle, out / "scaled.nii")
        assert np.allclose([found["min"], found["max"]], [RAMP.min(), RAMP.max()])
    steps = np.stack([RAMP * 0, RAMP * 0 + 7, RAMP], axis=-1).astype("f4")
    nibabel.save(nibabel.Nifti1Image(steps, STRAIGHT), out / "steps.nii.gz")
    assert_ramp(pellicle, out / "steps.nii.gz", STRAIGHT, "--step", 2)
    assert_failed(pellicle("contour", out / "steps.nii.gz", "--iso", 1, "--step", 3), "no time step 3", "holds 3")
    colours = np.zeros(DIMS, [("R", "u1"), ("G", "u1"), ("B", "u1")])
    colours["G"] = RAMP
    nibabel.save(nibabel.Nifti1Image(colours, STRAIGHT), out / "rgb.nii")
    assert_ramp(pellicle, out / "rgb.nii", STRAIGHT, "--component", 1)


# NRRD, judged by pynrrd.


@pytest.mark.witness("NRRD", "volume in", "nrrd", "all types, raw, gzip and text, either byte order; directions, detached data, components")
def test_nrrd(pellicle, out):
    nrrd = pytest.importorskip("nrrd")
    place = {"space": "left-posterior-superior", "space directions": OBLIQUE[:3, :3].T, "space origin": OBLIQUE[:3, 3]}
    for kind, encoding, endian in itertools.product(TYPES, ["raw", "gzip", "ascii"], ["little", "big"]):
        data = RAMP.astype(("<" if endian == "little" else ">") + kind)
        nrrd.write(str(out / "ramp.nrrd"), data, {**place, "encoding": encoding, "endian": endian})
        assert_ramp(pellicle, out / "ramp.nrrd", OBLIQUE)
    nrrd.write(str(out / "apart.nhdr"), RAMP.astype("i2"), {**place, "encoding": "gzip"}, detached_header=True)
    assert_ramp(pellicle, out / "apart.nhdr", OBLIQUE)
    spaced = {"spacings": [0.5, 2.0, 1.5], "axismins": [10.0, -20.0, 0.25], "centerings": ["node"] * 3, "encoding": "raw"}
    nrrd.write(str(out / "spaced.nrrd"), RAMP.astype("f4"), spaced, custom_field_map={"axismins": "double list"})
    text = (out / "spaced.nrrd").read_bytes().replace(b"axismins:=", b"axis mins: ").replace(b"axismins:", b"axis mins:")
    (out / "spaced.nrrd").write_bytes(text)
    if b"axis mins: " in text:
        assert_ramp(pellicle, out / "spaced.nrrd", STRAIGHT)
    vectors = np.stack([RAMP * 0, RAMP], axis=0).astype("f4")
    directions = np.vstack([[np.nan] * 3, OBLIQUE[:3, :3].T])
    header = {**place, "space directions": directions, "kinds": ["vector", "domain", "domain", "domain"], "encoding": "raw"}
    nrrd.write(str(out / "vectors.nrrd"), vectors, header)
    assert_ramp(pellicle, out / "vectors.nrrd", OBLIQUE, "--component", 1)
    nrrd.write(str(out / "bz.nrrd"), RAMP.astype("f4"), {**place, "encoding": "bzip2"})
    assert_failed(pellicle("contour", out / "bz.nrrd", "--iso", 1), "bzip2", "gzip")


# ITK's writers, by SimpleITK.


def itk_image(sitk, kind):
    image = sitk.GetImageFromArray(np.ascontiguousarray(RAMP.T.astype(kind)))
    spacing = np.linalg.norm(OBLIQUE[:3, :3], axis=0)
    # ITK wants directions at right angles.
    direction = np.linalg.qr(OBLIQUE[:3, :3])[0]
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(OBLIQUE[:3, 3].tolist())
    image.SetDirection(direction.ravel().tolist())
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = direction * spacing, OBLIQUE[:3, 3]
    return image, affine


@pytest.mark.parametrize("name, flips", [("MetaImage", False), ("NRRD", False), ("NIfTI", True)])
def test_files_of_itk(pellicle, out, witness, name, flips):
    sitk = pytest.importorskip("SimpleITK")
    witness(name, "volume in", sitk, "all types, plain and compressed; directions")
    ends = {"MetaImage": ["mha", "mhd"], "NRRD": ["nrrd", "nhdr"], "NIfTI": ["nii", "nii.gz"]}[name]
    # ITK's coordinates run to the left and to the back, NIfTI's to the right and to the front.
    flip = np.diag([-1, -1, 1, 1]) if flips else np.eye(4)
    for kind, end, packed in itertools.product(TYPES, ends, [False, True]):
        image, affine = itk_image(sitk, kind)
        path = out / f"ramp.{end}"
        sitk.WriteImage(image, str(path), packed)
        assert_ramp(pellicle, path, flip @ affine, tolerance=1e-3)
    vectors = sitk.GetImageFromArray(np.stack([RAMP.T * 0, RAMP.T], axis=-1).astype("f4"), isVector=True)
    path = out / f"vectors.{ends[0]}"
    sitk.WriteImage(vectors, str(path))
    assert_ramp(pellicle, path, flip, "--component", 1)


# VTK.


def vtk_image(vtk, arrays, cells=False, direction=None, kind="f4"):
    from vtk.util.numpy_support import numpy_to_vtk

    image = vtk.vtkImageData()
    extent = [n if cells else n - 1 for n in DIMS]
    image.SetExtent(2, 2 + extent[0], -1, -1 + extent[1], 0, extent[2])
    image.SetSpacing(0.5, 2.0, 1.5)
    image.SetOrigin(10.0, -20.0, 0.25)
    if direction is not None:
        image.SetDirectionMatrix(*direction.ravel())
    data = image.GetCellData() if cells else image.GetPointData()
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        data.AddArray(array)
    return image


def vtk_affine(direction=np.eye(3), cells=False):
    affine = np.eye(4)
    affine[:3, :3] = direction * [0.5, 2.0, 1.5]
    affine[:3, 3] = [10.0, -20.0, 0.25]
    first = np.array([2, -1, 0]) + (0.5 if cells else 0)
    affine[:3, 3] += affine[:3, :3] @ first
    return affine


def flat(kind):
    """x fastest."""
    return RAMP.T.astype(kind).ravel()


@pytest.mark.witness("VTK XML image", "volume in", "vtk", "all types, encodings and compressors; points and cells, pieces, directions")
def test_vti(pellicle, out):
    vtk = pytest.importorskip("vtk")
    path = out / "ramp.vti"

    def write(image, mode="raw", compressor=None, big=False, wide=True, pieces=1):
        writer = vtk.vtkXMLImageDataWriter()
        writer.SetInputData(image)
        writer.SetFileName(str(path))
        {"ascii": writer.SetDataModeToAscii, "base64": writer.SetDataModeToBinary}.get(mode, writer.SetDataModeToAppended)()
        writer.SetEncodeAppendedData(mode == "appended base64")
        writer.SetCompressor(getattr(vtk, f"vtk{compressor}DataCompressor")() if compressor else None)
        (writer.SetByteOrderToBigEndian if big else writer.SetByteOrderToLittleEndian)()
        (writer.SetHeaderTypeToUInt64 if wide else writer.SetHeaderTypeToUInt32)()
        writer.SetNumberOfPieces(pieces)
        assert writer.Write() == 1

    modes, compressors = ["ascii", "base64", "raw", "appended base64"], [None, "ZLib", "LZ4", "LZMA"]
    for mode, compressor, big, wide in itertools.product(modes, compressors, [False, True], [False, True]):
        write(vtk_image(vtk, {"ramp": flat("i2"), "other": flat("f4") * 0}), mode, compressor, big, wide)
        assert_ramp(pellicle, path, vtk_affine(), "--array", "ramp")
    for kind in TYPES:
        write(vtk_image(vtk, {"ramp": flat(kind)}))
        assert_ramp(pellicle, path, vtk_affine())
    write(vtk_image(vtk, {"ramp": flat("f4")}, cells=True), compressor="ZLib")
    assert_ramp(pellicle, path, vtk_affine(cells=True))
    assert info(pellicle, path)["of"] == "cells"
    direction = np.array([[0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [0.8, 0.0, -0.6]])
    write(vtk_image(vtk, {"ramp": flat("f4")}, direction=direction))
    assert_ramp(pellicle, path, vtk_affine(direction))
    vectors = np.stack([flat("f4") * 0, flat("f4"), flat("f4") * 0], axis=-1)
    image = vtk_image(vtk, {"scalar": flat("f4") * 0, "vectors": vectors})
    image.GetPointData().SetActiveVectors("vectors")
    write(image)
    assert_ramp(pellicle, path, vtk_affine(), "--array", "vectors", "--component", 1)
    assert_failed(pellicle("contour", path, "--iso", 1, "--array", "none"), "point/scalar", "point/vectors")
    image.GetPointData().SetActiveScalars("scalar")
    image.GetPointData().GetArray("scalar").Fill(3)
    write(image)
    assert info(pellicle, path)["array"] == "scalar"
    for pieces in (2, 5):
        write(vtk_image(vtk, {"ramp": flat("u1")}), pieces=pieces)
        assert path.read_bytes().count(b"<Piece") == pieces
        assert_ramp(pellicle, path, vtk_affine())


@pytest.mark.witness("VTK XML image", "volume in", "vtk", "pieces in files, with ghost levels")
@pytest.mark.parametrize("cells", [False, True])
@pytest.mark.parametrize("pieces, ghosts", [(1, 0), (4, 0), (7, 2)])
def test_pvti(pellicle, out, cells, pieces, ghosts):
    vtk = pytest.importorskip("vtk")
    writer = vtk.vtkXMLPImageDataWriter()
    writer.SetInputData(vtk_image(vtk, {"ramp": flat("i2")}, cells=cells))
    writer.SetFileName(str(out / "ramp.pvti"))
    writer.SetNumberOfPieces(pieces)
    writer.SetStartPiece(0)
    writer.SetEndPiece(pieces - 1)
    writer.SetGhostLevel(ghosts)
    assert writer.Write() == 1
    assert len(list(out.glob("**/*.vti"))) == pieces
    assert_ramp(pellicle, out / "ramp.pvti", vtk_affine(cells=cells))
    first = sorted(out.glob("**/*.vti"))[0]
    first.unlink()
    assert_failed(pellicle("contour", out / "ramp.pvti", "--iso", 1), "ramp.pvti", first.name)


@pytest.mark.witness("VTK legacy", "volume in", "vtk", "all types, text and binary; points and cells; several arrays")
def test_legacy_vtk(pellicle, out):
    vtk = pytest.importorskip("vtk")
    path = out / "ramp.vtk"
    for kind, text, cells in itertools.product(TYPES, [False, True], [False, True]):
        image = vtk_image(vtk, {"ramp": flat(kind), "rest": np.stack([flat("f4")] * 2, axis=-1)}, cells)
        (image.GetCellData() if cells else image.GetPointData()).SetActiveScalars("ramp")
        writer = vtk.vtkStructuredPointsWriter()
        writer.SetInputData(image)
        writer.SetFileName(str(path))
        (writer.SetFileTypeToASCII if text else writer.SetFileTypeToBinary)()
        assert writer.Write() == 1
        # Text holds the spacing to six digits.
        close = {"tolerance": 2e-4 if text else 1e-4}
        assert_ramp(pellicle, path, vtk_affine(cells=cells), **close)
        assert_ramp(pellicle, path, vtk_affine(cells=cells), "--array", "rest", "--component", 1, **close)


@pytest.mark.witness("MetaImage", "volume in", "vtk", "all types, compressed")
def test_meta_images_of_vtk(pellicle, out):
    vtk = pytest.importorskip("vtk")
    for kind, end, packed in itertools.product(["u1", "i2", "u2", "i4", "f4", "f8"], ["mha", "mhd"], [False, True]):
        image = vtk_image(vtk, {"ramp": flat(kind)})
        image.GetPointData().SetActiveScalars("ramp")
        image.SetExtent(0, DIMS[0] - 1, 0, DIMS[1] - 1, 0, DIMS[2] - 1)
        path = out / f"ramp.{end}"
        writer = vtk.vtkMetaImageWriter()
        writer.SetInputData(image)
        writer.SetFileName(str(path))
        writer.SetCompression(packed)
        writer.Write()
        assert_ramp(pellicle, path, STRAIGHT)


def test_gzip_of_many_members_is_one_stream(pellicle, out):
    nibabel = pytest.importorskip("nibabel")
    path, affine = nifti(out, nibabel, "i4", "ramp.nii")
    data = path.read_bytes()
    parts = [gzip.compress(data[i : i + 700]) for i in range(0, len(data), 700)]
    packed = out / "members.nii.gz"
    packed.write_bytes(b"".join(parts))
    assert_ramp(pellicle, packed, affine, tolerance=1e-3)
    packed.write_bytes(b"".join(parts)[:-200])
    assert_failed(pellicle("contour", packed, "--iso", 1), packed)


# What `convert` writes, by foreign readers.


@pytest.mark.parametrize("kind", TYPES)
def test_written_volumes_are_read_by_others(pellicle, out, witness, kind):
    nibabel, nrrd = pytest.importorskip("nibabel"), pytest.importorskip("nrrd")
    source = out / "ramp.nii"
    nibabel.Nifti1Image(RAMP.astype(kind), OBLIQUE, dtype=kind).to_filename(source)
    for name in ["r.nii", "r.nii.gz", "r.nrrd", "r.npy"]:
        assert_done(pellicle("convert", source, out / name))
    for name in ["r.nii", "r.nii.gz"]:
        image = nibabel.load(out / name)
        assert image.get_data_dtype() == np.dtype(kind) and np.array_equal(np.asarray(image.dataobj), RAMP)
        assert np.allclose(image.affine, OBLIQUE, atol=1e-6)
    values, header = nrrd.read(str(out / "r.nrrd"))
    assert values.dtype == np.dtype(kind) and np.array_equal(values, RAMP)
    assert header["space"] == "right-anterior-superior"
    assert np.allclose(header["space directions"], OBLIQUE[:3, :3].T, atol=1e-6)
    assert np.allclose(header["space origin"], OBLIQUE[:3, 3], atol=1e-5)
    values = np.load(out / "r.npy")
    assert values.dtype == np.dtype(kind) and np.array_equal(values, RAMP.T)
    witness("NIfTI", "volume out", nibabel, "all types; affine")
    witness("NRRD", "volume out", nrrd, "all types; directions")
    witness("NumPy array", "volume out", np, "all types")


@pytest.mark.parametrize("kind", TYPES)
def test_written_volumes_are_read_by_itk(pellicle, out, witness, kind):
    sitk = pytest.importorskip("SimpleITK")
    image, affine = itk_image(sitk, kind)
    source = out / "ramp.nrrd"
    sitk.WriteImage(image, str(source))
    for name in ["r.mha", "r.nrrd", "r.nii"]:
        assert_done(pellicle("convert", source, out / name))
        found = sitk.ReadImage(str(out / name))
        # ITK turns NIfTI's directions into its own.
        assert np.array_equal(sitk.GetArrayFromImage(found), RAMP.T), name
        assert found.GetPixelID() == image.GetPixelID()
        assert np.allclose(found.GetSpacing(), image.GetSpacing(), atol=1e-5)
        assert np.allclose(found.GetOrigin(), image.GetOrigin(), atol=1e-4)
        assert np.allclose(found.GetDirection(), image.GetDirection(), atol=1e-5)
    for name in ["MetaImage", "NRRD", "NIfTI"]:
        witness(name, "volume out", sitk, "all types; directions")


@pytest.mark.parametrize("kind", TYPES)
def test_written_volumes_are_read_by_vtk(pellicle, out, witness, kind):
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    writer = vtk.vtkXMLImageDataWriter()
    direction = np.array([[0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [0.8, 0.0, -0.6]])
    for name, reader, turn in [
        ("r.vti", vtk.vtkXMLImageDataReader(), direction),
        ("r.vtk", vtk.vtkStructuredPointsReader(), np.eye(3)),
    ]:
        writer.SetInputData(vtk_image(vtk, {"ramp": flat(kind)}, direction=turn))
        writer.SetFileName(str(out / "ramp.vti"))
        assert writer.Write() == 1
        assert_done(pellicle("convert", out / "ramp.vti", out / name))
        reader.SetFileName(str(out / name))
        reader.Update()
        image = reader.GetOutput()
        values = vtk_to_numpy(image.GetPointData().GetArray("ramp"))
        assert image.GetDimensions() == DIMS and np.array_equal(values, flat(kind)) and values.dtype == np.dtype(kind)
        matrix = image.GetIndexToPhysicalMatrix()
        found = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
        assert np.allclose(found, vtk_affine(turn), atol=1e-9)
    witness("VTK XML image", "volume out", vtk, "all types; directions")
    witness("VTK legacy", "volume out", vtk, "all types")


def test_a_part_of_a_volume_is_written(pellicle, out):
    np.save(out / "ramp.npy", RAMP.T.astype("f4"))
    place = ["--spacing", "0.5,2,1.5", "--origin", "10,-20,0.25"]
    process = pellicle("convert", out / "ramp.npy", out / "part.nrrd", *place, "--crop", "11,-,1", "13,-10,-", "--json")
    assert_done(process)
    report = json.loads(process.stdout)["frames"][0] if "frames" in json.loads(process.stdout) else json.loads(process.stdout)
    assert report["dims"] == [5, 6, 6] and report["kind"] == "volume"
    part = RAMP[2:7, :6, 1:7]
    values = part.astype("f4")
    process = pellicle("convert", out / "part.nrrd", out / "part.npy")
    assert_done(process)
    assert "spacing and origin" in process.stderr
    assert np.array_equal(np.load(out / "part.npy"), values.T)
    info_of = info(pellicle, out / "part.nrrd")
    assert info_of["origin"] == [11.0, -20.0, 1.75] and info_of["dims"] == [5, 6, 6]
    assert_failed(pellicle("convert", out / "part.nrrd", out / "part.vti", "--where", "x>0"), "--where")
    assert_failed(pellicle("convert", out / "part.nrrd", out / "part.mhd"), ".mha")
    assert_failed(pellicle("convert", out / "part.nrrd", out / "part.ply"), "part.nrrd")
    assert_failed(pellicle("convert", out / "part.npy", out / "part.ply", "--dims", "5,6,6"), "--dims")
