"""`contour --labels` and `check --field`: judged from outside."""

import json

import numpy as np
import pytest
from check_mesh import defects, judge, load
from conftest import assert_done, assert_failed


@pytest.fixture
def foam(out):
    """A ball of 12 grains, those of the nearest seeds, in 40 × 36 × 32 samples, and nothing around it."""
    at = np.stack(np.indices((32, 36, 40)), axis=-1).astype(float)
    seeds = np.random.default_rng(3).random((12, 3)) * [32, 36, 40]
    labels = 3 + 10 * ((at[..., None, :] - seeds) ** 2).sum(-1).argmin(-1)
    labels[((at - [15.5, 17.5, 19.5]) ** 2).sum(-1) > 15**2] = 0
    path = out / "foam.npy"
    np.save(path, labels.astype("i2"))
    return path


def surfaces(process):
    assert_done(process)
    return {surface["label"]: surface for surface in json.loads(process.stdout)["surfaces"]}


def test_each_label_is_closed_and_has_about_the_volume_of_its_samples(pellicle, out, foam):
    found = surfaces(pellicle("contour", foam, "--labels", "all", "--spacing", "0.5,1,2", "-o", out / "g.ply", "--json"))
    labels, counts = np.unique(np.load(foam), return_counts=True)
    assert labels[0] == 0 and list(found) == list(labels[1:]), "0 is the background"
    total = 0
    vertices = set()
    for label, count in zip(labels[1:], counts[1:]):
        path = out / f"g_{label}.ply"
        assert found[label]["output"] == str(path)
        mesh = judge(*load(path))
        assert not defects(mesh) and mesh["triangles"] == found[label]["triangles"]
        assert mesh["volume"] == pytest.approx(count, rel=0.1)
        total += mesh["volume"]
        vertices |= {tuple(v) for v in load(path)[0]}
    assert total == pytest.approx(counts[1:].sum(), rel=0.01)
    # Grains share vertices: there are far fewer than all files have together.
    assert len(vertices) < 0.8 * sum(surface["vertices"] for surface in found.values())
    one = pellicle("contour", foam, "--labels", "all", "--spacing", "0.5,1,2", "-o", out / "h.ply", "-n", 1)
    assert_done(one)
    assert all((out / f"g_{n}.ply").read_bytes() == (out / f"h_{n}.ply").read_bytes() for n in labels[1:])


def test_labels_are_chosen_by_name(pellicle, out, foam):
    found = surfaces(pellicle("contour", foam, "--labels", "13", "-o", out / "one.stl", "--png", out / "one.png", "--json"))
    assert found[13]["output"] == str(out / "one.stl") and (out / "one.png").stat().st_size > 1000
    process = pellicle("contour", foam, "--labels", "0,23,99", "-o", out / "some.obj", "--json")
    assert list(surfaces(process)) == [0, 23]
    assert any("labelled 99" in line for line in json.loads(process.stdout)["warnings"])
    # What is around the ball has the box and the ball as its surface.
    assert judge(*load(out / "some_0.obj"))["components"] == 2
    assert_failed(pellicle("contour", foam, "--labels", "1,x"), "whole numbers", code=2)
    assert_failed(pellicle("contour", foam, "--labels", "1,1"), "named twice", code=2)
    assert_failed(pellicle("contour", foam, "--labels", "all", "--iso", "1"), "--iso", code=2)


def test_what_is_no_label_is_told(pellicle, out, foam):
    np.save(out / "half.npy", np.load(foam) + 0.5)
    assert_failed(pellicle("contour", out / "half.npy", "--labels", "all"), "half.npy", "whole number")
    np.save(out / "whole.npy", np.load(foam).astype("f4"))
    assert_done(pellicle("contour", out / "whole.npy", "--labels", "all", "-o", out / "w.ply"))
    assert_done(pellicle("contour", foam, "--labels", "all", "-o", out / "v.ply"))
    # But for their headers, which name the file.
    body = lambda name: (out / name).read_bytes().partition(b"end_header\n")[2]
    assert body("w_13.ply") == body("v_13.ply")
    assert_failed(pellicle("contour", foam, "--labels", "all", "--max-memory", "100K"), "foam.npy", "need")


def distance(pellicle, mesh, *options):
    process = pellicle("check", mesh, "--json", *options)
    assert_done(process)
    return json.loads(process.stdout)["field"]


def test_the_distance_to_the_field_is_that_of_the_mesh(pellicle, out):
    z, y, x = np.indices((40, 40, 40))
    path = out / "ball.npy"
    np.save(path, (12 - np.sqrt((x - 19.5) ** 2 + (y - 19.5) ** 2 + (z - 19.5) ** 2)).astype("f4"))
    at = ["--spacing", "0.5,0.5,0.5", "--origin", "1,2,3"]
    assert_done(pellicle("contour", path, "--iso", "2", *at, "-o", out / "ball.ply"))
    field = ["--field", path, *at, "--iso"]
    own = distance(pellicle, out / "ball.ply", *field, "2")
    assert own["iso"] == 2 and own["skipped_samples"] == 0 and own["volume"] == str(path)
    assert 0 < own["mean"] < own["rms"] < own["max"] < 0.03
    # A cell further out.
    off = distance(pellicle, out / "ball.ply", *field, "1")
    assert off["mean"] == pytest.approx(0.5, abs=0.01) and off["max"] < 0.55
    said = pellicle("check", out / "ball.ply", *field, "1")
    assert_done(said)
    assert "distance to the field's surface: mean 0.4" in said.stdout or "mean 0.5" in said.stdout
    # Walls at the border are nowhere in the field.
    assert_done(pellicle("contour", path, "--iso", "-9", *at, "-o", out / "walls.ply"))
    walls = distance(pellicle, out / "walls.ply", *field, "-9")
    assert walls["skipped_samples"] > 100 and walls["max"] < 0.1
    assert_failed(pellicle("check", out / "ball.ply", "--field", path), "--iso", code=2)
    assert_failed(pellicle("check", out / "ball.ply", "--iso", "1"), "--field", code=2)
    assert_failed(pellicle("check", out / "ball.ply", "--field", out / "none.npy", "--iso", "1"), "none.npy")
