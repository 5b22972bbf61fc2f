"""What the tests stand on: the built program, the data folder, and a way to run one on the other.

PELLICLE_BIN   the program; `cargo xtask test` builds it and sets this
PELLICLE_DATA  the folder of test data, with `particles/` in it; by default `shared/data` beside the repository
PELLICLE_SLOW  run what takes minutes, too (`cargo xtask test --all`)
"""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
DATA = Path(os.environ.get("PELLICLE_DATA") or ROOT.parent / "shared" / "data")

# Particle radius by the beginning of a file's name; the first that fits counts. The last row has no radius of its own
# (its particles are metaballs of reach 3): half a unit gives a surface.
RADII = {"cbd1m": 0.0125, "cbd": 0.025, "drop": 0.02, "hemi": 0.025, "blob": 0.5, "explosion": 0.5, "fountain": 0.5}

FRAMES = """
cbd_t0.00.npy cbd_t0.50.bgeo cbd_t1.10.xyz cbd_t1.75.vtk cbd_t4.00.vtu cbd_t6.00.ply cbd1m_t1.56.xyz
drop_t0.10.npy drop_t0.20.bgeo drop_t0.30.xyz drop_t0.80.xyz hemi_t0.35.vtk hemi_t0.60.ply hemi_t1.50.csv
blob.xyz explosion_t0.xyz explosion_t1.xyz explosion_t2.xyz fountain_f0.xyz fountain_f1.xyz
""".split()

slow = pytest.mark.skipif(not os.environ.get("PELLICLE_SLOW"), reason="takes minutes: cargo xtask test --all")


def frame(name):
    """The path of one file of particles and its radius; skips the test where the file is missing."""
    path = DATA / "particles" / name
    if not path.exists():
        pytest.skip(f"{path} is missing: set PELLICLE_DATA to the folder of test data")
    radius = next(radius for beginning, radius in RADII.items() if name.startswith(beginning))
    return path, radius


@pytest.fixture(scope="session")
def binary():
    path = os.environ.get("PELLICLE_BIN")
    if not path:
        pytest.skip("PELLICLE_BIN is not set: run by cargo xtask test, or name the built program")
    assert Path(path).exists(), f"PELLICLE_BIN: {path} does not exist"
    return path


@pytest.fixture
def pellicle(binary):
    """Runs the program: pellicle("mesh", file, "-r", 0.025, env={...}) gives the finished process, its output as text."""

    def run(*arguments, env=None, **options):
        command = [binary, *map(str, arguments)]
        environment = {**os.environ, **(env or {})}
        return subprocess.run(command, capture_output=True, text=True, errors="replace", env=environment, timeout=600, **options)

    return run


@pytest.fixture
def out(tmp_path):
    """An empty folder for output."""
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


def assert_done(process):
    assert process.returncode == 0, f"{process.args}\nexit {process.returncode}\n{process.stderr}"


def assert_failed(process, *said, code=1):
    """The program ended by its own will, with this exit code, and its message holds these words."""
    assert process.returncode == code, f"{process.args}\nexit {process.returncode}\n{process.stderr}"
    assert process.stderr.strip(), "no message"
    assert "panicked" not in process.stderr, process.stderr
    for word in said:
        assert str(word).lower() in process.stderr.lower(), f"no {word!r} in: {process.stderr}"


WITNESSES = pytest.StashKey()


@pytest.fixture
def witness(request):
    """Tells the table of formats what a test has shown: witness("STL", "mesh out", trimesh, "face normals").

    `format` as `pellicle_io::formats()` names it; `direction` is one of "particles in", "particles out", "mesh in",
    "mesh out", "volume in", "volume out"; `package` the module (its name and version are noted) or a string; `attributes` what was compared besides
    positions and triangles. Counts when the test passes. `cargo xtask formats` turns all of them into
    docs/src/formats.md. `@pytest.mark.witness` with the same words does it for a test that shows one thing.
    """

    def tell(format, direction, package, attributes=""):
        assert direction in ("particles in", "particles out", "mesh in", "mesh out", "volume in", "volume out"), direction
        name = package if isinstance(package, str) else package.__name__
        request.node.stash.setdefault(WITNESSES, []).append((format, direction, name, attributes))

    return tell


def pytest_addoption(parser):
    parser.addoption("--witnesses", action="store_true", help="run only the tests that use the fixture `witness`")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--witnesses"):
        tells = lambda item: "witness" in getattr(item, "fixturenames", ()) or item.get_closest_marker("witness")
        items[:] = [item for item in items if tells(item)]


def pytest_configure(config):
    config.addinivalue_line("markers", "witness(format, direction, package, attributes): what the fixture `witness` tells")


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    report = (yield).get_result()
    if call.when == "call":
        rows = item.stash.get(WITNESSES, []) + [mark.args for mark in item.iter_markers("witness")]
        item.session.stash.setdefault(WITNESSES, []).extend((*row, "agrees" if report.passed else "FAILS") for row in rows)


def pytest_sessionfinish(session):
    """Writes what was witnessed to the file that PELLICLE_WITNESSES names, one line each, in an order of its own."""
    path = os.environ.get("PELLICLE_WITNESSES")
    if path:
        rows = sorted(set(session.stash.get(WITNESSES, [])))
        Path(path).write_text("".join("\t".join(row) + "\n" for row in rows))
