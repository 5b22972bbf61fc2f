"""Bad input: a clear message, the right exit code, nothing half-written, no panic."""

import os
import signal
import subprocess
import time

import numpy as np
import pytest
from check_mesh import defects, judge, load
from conftest import assert_done, assert_failed, frame

GRID = np.stack(np.meshgrid(*[np.arange(6)] * 3), -1).reshape(-1, 3).astype("<f4") * np.float32(0.05)


def write(path, positions):
    """A raw file of x y z."""
    path.write_bytes(np.asarray(positions, "<f4").tobytes())
    return path


def with_particle_7_at(x):
    positions = GRID.copy()
    positions[7, 1] = x
    return positions


@pytest.mark.parametrize("name", ["cbd_t0.00.npy", "drop_t0.20.bgeo", "hemi_t0.35.vtk", "hemi_t0.60.ply", "cbd_t4.00.vtu"])
@pytest.mark.parametrize("part", [0.0001, 0.5, 0.999])
def test_truncated_file_is_named(pellicle, tmp_path, out, name, part):
    path, radius = frame(name)
    whole = path.read_bytes()
    cut = tmp_path / f"cut_{name}"
    cut.write_bytes(whole[: int(len(whole) * part)])
    assert_failed(pellicle("mesh", cut, "-r", radius, "-o", out / "out.ply"), cut.name)
    assert list(out.iterdir()) == []


def test_raw_file_cut_within_a_particle_is_named(pellicle, tmp_path, out):
    cut = tmp_path / "cut.xyz"
    cut.write_bytes(GRID.tobytes()[:-5])
    assert_failed(pellicle("mesh", cut, "-r", 0.025, "-o", out / "out.ply"), cut.name)
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("x", [float("nan"), float("inf"), float("-inf"), 3e38])
def test_impossible_position_names_file_and_particle(pellicle, tmp_path, out, x):
    bad = write(tmp_path / "bad.xyz", with_particle_7_at(x))
    assert_failed(pellicle("mesh", bad, "-r", 0.025, "-o", out / "out.ply"), bad.name, "particle 7")
    assert list(out.iterdir()) == []


def test_invalid_positions_are_dropped_on_request(pellicle, tmp_path, out):
    bad = write(tmp_path / "bad.xyz", with_particle_7_at(float("nan")))
    good = write(tmp_path / "good.xyz", np.delete(GRID, 7, axis=0))
    assert_done(pellicle("mesh", bad, "-r", 0.025, "-o", out / "bad.ply", "--drop-invalid"))
    assert_done(pellicle("mesh", good, "-r", 0.025, "-o", out / "good.ply"))
    (v, f), (w, g) = load(out / "bad.ply"), load(out / "good.ply")
    assert np.array_equal(v, w) and np.array_equal(f, g)


@pytest.mark.parametrize("options", [["-r", 0.025], []])
def test_no_particles_give_an_empty_mesh_and_a_warning(pellicle, tmp_path, out, options):
    none = write(tmp_path / "none.xyz", [])
    process = pellicle("mesh", none, *options, "-o", out / "out.ply")
    assert_done(process)
    assert "warning" in process.stderr.lower() and none.name in process.stderr
    header = (out / "out.ply").read_bytes().split(b"end_header")[0]
    assert b"element vertex 0" in header and b"element face 0" in header


def test_one_particle_is_a_ball(pellicle, tmp_path, out):
    one = write(tmp_path / "one.xyz", [[0.3, -0.2, 0.1]])
    assert_done(pellicle("mesh", one, "-r", 0.025, "-o", out / "out.ply"))
    report = judge(*load(out / "out.ply"))
    assert defects(report) == [] and (report["components"], report["euler"]) == (1, 2)


def test_particles_at_one_point_are_a_ball(pellicle, tmp_path, out):
    heap = write(tmp_path / "heap.xyz", [[0.3, -0.2, 0.1]] * 1000)
    assert_done(pellicle("mesh", heap, "-r", 0.025, "-o", out / "out.ply"))
    report = judge(*load(out / "out.ply"))
    assert defects(report) == [] and (report["components"], report["euler"]) == (1, 2)


def test_radius_that_cannot_be_inferred_is_asked_for(pellicle, tmp_path, out):
    heap = write(tmp_path / "heap.xyz", [[0.3, -0.2, 0.1]] * 1000)
    process = pellicle("mesh", heap, "-o", out / "out.ply")
    assert_failed(process, "radius", code=process.returncode or 1)
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("option", ["-r", "-c", "-l", "-t"])
@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf"])
def test_parameter_out_of_range_is_refused(pellicle, tmp_path, out, option, value):
    grid = write(tmp_path / "grid.xyz", GRID)
    radius = [] if option == "-r" else ["-r", "0.025"]
    process = pellicle("mesh", grid, *radius, f"{option}={value}", "-o", out / "out.ply")
    assert process.returncode in (1, 2), process.stderr
    assert_failed(process, code=process.returncode)
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("value", ["1e-30", "1e-12"])
def test_lattice_too_fine_is_refused_with_a_number(pellicle, tmp_path, out, value):
    grid = write(tmp_path / "grid.xyz", GRID)
    process = pellicle("mesh", grid, "-r", value, "-o", out / "out.ply")
    assert_failed(process)
    assert any(c.isdigit() for c in process.stderr)
    assert list(out.iterdir()) == []


def test_cell_of_a_hundred_radii_gives_a_closed_mesh_or_a_warning(pellicle, tmp_path, out):
    grid = write(tmp_path / "grid.xyz", GRID)
    process = pellicle("mesh", grid, "-r", 0.025, "-c", 100, "-o", out / "out.ply")
    assert_done(process)
    report = judge(*load(out / "out.ply")) if b"element face 0\n" not in (out / "out.ply").read_bytes() else {}
    assert defects(report) == []
    assert report or "warning" in process.stderr.lower(), "an empty surface of particles deserves a word"


def test_missing_input_is_named(pellicle, tmp_path, out):
    assert_failed(pellicle("mesh", tmp_path / "nowhere.xyz", "-r", 1, "-o", out / "out.ply"), "nowhere.xyz")


def test_missing_output_folder_is_named(pellicle, tmp_path):
    grid = write(tmp_path / "grid.xyz", GRID)
    assert_failed(pellicle("mesh", grid, "-r", 0.025, "-o", tmp_path / "nowhere" / "out.ply"), "nowhere")
    assert [file.name for file in tmp_path.iterdir()] == ["grid.xyz"]


def test_full_disk_leaves_nothing(pellicle, tmp_path, out):
    """A limit on the size of files stands for a full disk."""
    import resource

    grid = write(tmp_path / "grid.xyz", GRID)

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    process = pellicle("mesh", grid, "-r", 0.025, "-o", out / "out.ply", preexec_fn=limit, restore_signals=False)
    assert_failed(process, "out.ply")
    assert list(out.iterdir()) == []


def test_unknown_kinds_of_file_are_named(pellicle, tmp_path, out):
    grid = write(tmp_path / "grid.xyz", GRID)
    odd = write(tmp_path / "grid.odd", GRID)
    for process in (
        pellicle("mesh", odd, "-r", 0.025, "-o", out / "out.ply"),
        pellicle("mesh", grid, "-r", 0.025, "-o", out / "out.odd"),
    ):
        assert process.returncode in (1, 2)
        assert_failed(process, "odd", code=process.returncode)
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("arguments", [["mesh"], ["mesh", "--nonsense"], ["nonsense"], ["mesh", "x.xyz", "-c", "abc"], []])
def test_usage_error_exits_with_2(pellicle, arguments):
    assert_failed(pellicle(*arguments), code=2)


def test_interrupt_leaves_nothing_half_written(binary, out):
    """Interrupted at several moments: stopped with nothing left, or done with a whole mesh."""
    path, radius = frame("cbd1m_t1.56.xyz")
    mesh = out / "out.ply"
    codes = []
    for delay in (0.05, 0.1, 0.2, 0.4, 0.8):
        process = subprocess.Popen([binary, "mesh", path, "-r", str(radius), "-c", "0.5", "-o", mesh, "-q"], stderr=subprocess.PIPE)
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
        codes.append(process.returncode)
        assert b"panicked" not in said
        assert process.returncode in (0, 130), (process.returncode, said)
        left = [file.name for file in out.iterdir()]
        assert left == (["out.ply"] if process.returncode == 0 else []), (process.returncode, left)
        if left:
            os.unlink(mesh)
    assert 130 in codes, f"never interrupted in time: {codes}"
