"""The judge must be able to condemn: each defect on the smallest mesh that has it."""

import numpy as np
import pytest
from check_mesh import defects, judge
from conftest import DATA

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def names(vertices, faces):
    return [defect.split()[1] if defect[0].isdigit() else "inward" for defect in defects(judge(vertices, np.array(faces)))]


def test_tetrahedron_is_closed_and_outward():
    report = judge(CORNERS, FACES)
    assert defects(report) == []
    assert (report["components"], report["euler"], report["volume"]) == (1, 2, pytest.approx(1 / 6))


def test_empty_mesh_is_closed():
    assert defects(judge(np.zeros((0, 3)), np.zeros((0, 3), np.int64))) == []


def test_each_defect_is_found():
    flipped = FACES.copy()
    flipped[3] = flipped[3, ::-1]
    one_vertex = np.concatenate([FACES, np.where(FACES == 0, 0, FACES + 3)])
    one_edge = np.concatenate([FACES, np.where(FACES < 2, FACES, FACES + 2)])
    more = np.concatenate([CORNERS, -CORNERS[1:]])
    assert names(CORNERS, FACES[:, ::-1]) == ["inward"]
    assert names(CORNERS, FACES[:3]) == ["open_half_edges"]
    assert names(CORNERS, flipped)[:2] == ["doubled_half_edges", "open_half_edges"]
    assert "non_manifold_vertices" in names(more, one_vertex)
    assert "non_manifold_edges" in names(more, one_edge)
    assert names(CORNERS, [*FACES, [1, 1, 1]])[0] == "repeated_index"
    assert names(CORNERS, [[0, 1, 4]]) == ["out_of_range"]
    assert "not_finite" in names(np.where(CORNERS == 1, np.nan, CORNERS), FACES)


def test_judge_agrees_with_another_one():
    """Where the data folder has a judge of its own beside it, both say the same of meshes full of defects."""
    tools = DATA.parent / "tools"
    if not (tools / "check_mesh.py").exists():
        pytest.skip(f"{tools / 'check_mesh.py'} is missing")
    import importlib.util

    spec = importlib.util.spec_from_file_location("other_judge", tools / "check_mesh.py")
    other = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(other)
    same = {
        "duplicate_half_edges": "doubled_half_edges",
        "boundary_half_edges": "open_half_edges",
        "non_manifold_edges": "non_manifold_edges",
        "non_manifold_vertices": "non_manifold_vertices",
        "repeated_index_triangles": "repeated_index",
        "unused_vertices": "unused_vertices",
        "components": "components",
        "euler_characteristic": "euler",
    }
    random = np.random.default_rng(1)
    for _ in range(200):
        vertices = random.normal(size=(random.integers(2, 12), 3))
        faces = random.integers(0, len(vertices), size=(random.integers(1, 20), 3))
        ours, theirs = judge(vertices, faces), other.report(vertices, faces)
        assert {k: ours[v] for k, v in same.items()} == {k: theirs[k] for k in same}, faces
        assert ours["volume"] == pytest.approx(theirs["signed_volume"], abs=1e-9)
