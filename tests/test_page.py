"""The page of a mesh, in a real browser: it comes up, shows the mesh, and says what it shows.

PELLICLE_BROWSER  a Chromium; by default the first of the usual names that is installed
"""

import io
import os
import shutil
import subprocess

import numpy as np
import pytest
from conftest import ROOT
from PIL import Image

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = """
--headless=new --no-sandbox --disable-quic --no-first-run --disable-background-networking --disable-component-update
--disable-sync --hide-scrollbars --window-size=800,600 --virtual-time-budget=20000
""".split()
SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="module")
def browser():
    found = os.environ.get("PELLICLE_BROWSER") or next(filter(None, map(shutil.which, NAMES)), None)
    if not found:
        pytest.skip(f"no browser: none of {', '.join(NAMES)} is installed, and PELLICLE_BROWSER is not set")
    return found


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page of a small splash, made by the library's example, and the number of its triangles."""
    cargo = shutil.which(os.environ.get("CARGO", "cargo"))
    if not cargo:
        pytest.skip("cargo is not installed: it runs the example that makes the page")
    path = tmp_path_factory.mktemp("page") / "splash.html"
    command = [cargo, "run", "--quiet", "--package", "pellicle-render", "--example", "page", "--", path, "4000", "A <b>drop</b> & more"]
    made = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900)
    assert made.returncode == 0, made.stderr
    return path, int(made.stdout)


@pytest.fixture
def visit(browser, tmp_path):
    """Opens an address with a new profile; gives what the browser wrote to stdout."""

    def run(address, *flags):
        profile = tmp_path / "profile"
        shutil.rmtree(profile, ignore_errors=True)
        command = [browser, *FLAGS, f"--user-data-dir={profile}", *flags, address]
        return subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=180).stdout

    return run


def pictured(visit, address, tmp_path):
    shot = tmp_path / "shot.png"
    visit(address, *SOFTWARE, f"--screenshot={shot}")
    return np.asarray(Image.open(io.BytesIO(shot.read_bytes())).convert("RGB")).astype(int)


def test_page_comes_up_and_counts(visit, page):
    path, triangles = page
    document = visit(path.as_uri(), *SOFTWARE, "--dump-dom")
    assert 'data-state="ready"' in document
    assert f'data-triangles="{triangles}"' in document
    assert "<h1>A &lt;b&gt;drop&lt;/b&gt; &amp; more</h1>" in document, "the title is text, not markup"


def test_page_shows_the_mesh_and_its_wires(visit, page, tmp_path):
    path, _ = page
    shaded = pictured(visit, path.as_uri(), tmp_path)
    # Water is blue, all else is grey.
    blue = shaded[..., 2] - shaded[..., 0] > 60
    assert 0.08 < blue.mean() < 0.6
    rows, columns = np.nonzero(blue)
    assert abs(columns.mean() - 400) < 60 and 200 < rows.mean() < 450, "in the middle of the window"
    wired = pictured(visit, path.as_uri() + "#wire", tmp_path)
    assert wired[blue].mean() < shaded[blue].mean() - 5, "dark lines"


def test_without_webgl_the_page_says_so(visit, page):
    path, _ = page
    document = visit(path.as_uri(), "--disable-gpu", "--disable-3d-apis", "--dump-dom")
    assert 'data-state="unsupported"' in document
    assert "does not offer WebGL 2" in document
