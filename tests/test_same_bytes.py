"""Same input, same bytes: whatever the threads, the vector unit, or the memory that the work is cut to fit."""

from pathlib import Path

import pytest
from conftest import assert_done, assert_failed, frame

FRAME = "drop_t0.30.xyz"


@pytest.fixture
def mesh_bytes(pellicle, out):
    """Bytes of the mesh of one frame, made with these further options."""
    path, radius = frame(FRAME)

    def make(*options, env=None):
        mesh = out / "out.ply"
        assert_done(pellicle("mesh", path, "-r", radius, "-c", "1.0", "-o", mesh, "-q", *options, env=env))
        return mesh.read_bytes()

    return make


def test_threads_do_not_matter(mesh_bytes):
    one = mesh_bytes("--threads", 1)
    assert one == mesh_bytes("--threads", 2)
    assert one == mesh_bytes("--threads", 7)


@pytest.mark.parametrize("lanes", ["avx512", "avx2", "portable"])
def test_vector_unit_does_not_matter(mesh_bytes, lanes):
    needs = {"avx512": "avx512f", "avx2": "avx2"}.get(lanes, "")
    flags = Path("/proc/cpuinfo")
    if needs and (not flags.exists() or needs not in flags.read_text().split()):
        pytest.skip(f"this machine is not known to have {lanes}")
    assert mesh_bytes() == mesh_bytes(env={"PELLICLE_LANES": lanes})


def test_memory_limit_gives_the_same_mesh_or_a_number(pellicle, mesh_bytes, out):
    free = mesh_bytes()
    path, radius = frame(FRAME)
    kept = 0
    for limit in ("512M", "256M", "128M", "96M", "64M", "48M", "32M"):
        mesh = out / "limited.ply"
        process = pellicle("mesh", path, "-r", radius, "-c", "1.0", "-o", mesh, "-q", "--max-memory", limit)
        if process.returncode == 0:
            assert mesh.read_bytes() == free, f"--max-memory {limit} changed the mesh"
            mesh.unlink()
            kept += 1
        else:
            assert_failed(process, "memory")
            assert any(c.isdigit() for c in process.stderr), f"no number needed in: {process.stderr}"
            assert not mesh.exists()
    assert kept > 0, "no limit was met"


def test_memory_limit_under_the_particles_is_refused(pellicle, out):
    path, radius = frame(FRAME)
    process = pellicle("mesh", path, "-r", radius, "-c", "1.0", "-o", out / "out.ply", "--max-memory", "1M")
    assert_failed(process, "memory")
    assert list(out.iterdir()) == []
