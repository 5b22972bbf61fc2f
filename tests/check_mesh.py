"""Is a triangle mesh closed, oriented and 2-manifold? Judged from its indices alone, nothing is welded or repaired.

It shares no code and no method with the judge in the library (crates/pellicle/src/mesh/check.rs), so that one can
catch the other's mistakes: there the stars of vertices are sorted, here components of sparse graphs are counted.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def load(path):
    """Vertices and triangles of a PLY or OBJ file, in the file's order."""
    import trimesh

    mesh = trimesh.load(path, process=False, maintain_order=True, force="mesh")
    return np.asarray(mesh.vertices, float).reshape(-1, 3), np.asarray(mesh.faces, np.int64).reshape(-1, 3)


def judge(vertices, triangles):
    """Counts of defects, topology and measures of one indexed mesh, as a dictionary."""
    n = len(vertices)
    report = {
        "vertices": n,
        "triangles": len(triangles),
        "not_finite": int((~np.isfinite(vertices)).any(axis=1).sum()),
        "out_of_range": int(((triangles < 0) | (triangles >= n)).any(axis=1).sum()),
    }
    if report["out_of_range"]:
        return report
    first, second = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    low, high = np.minimum(first, second), np.maximum(first, second)
    forward, uses = np.unique(first * n + second, return_counts=True)
    edges, edge, sides = np.unique(low * n + high, return_inverse=True, return_counts=True)
    used = np.zeros(n, bool)
    used[first] = True
    label = _pieces(first, second, n)
    report |= {
        "unused_vertices": int((~used).sum()),
        "repeated_index": int((triangles == np.roll(triangles, -1, axis=1)).any(axis=1).sum()),
        "doubled_half_edges": int((uses > 1).sum()),
        "open_half_edges": int((~np.isin(forward % max(n, 1) * n + forward // max(n, 1), forward)).sum()),
        "non_manifold_edges": int((sides > 2).sum()),
        "non_manifold_vertices": _vertices_with_many_fans(first, low, edge, len(edges)),
        "components": len(np.unique(label[used])),
        "euler": int(used.sum()) - len(edges) + len(triangles),
    }
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    report["area"] = float(np.linalg.norm(normals, axis=1).sum() / 2)
    report["volume"] = float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)
    return report


DEFECTS = (
    "not_finite",
    "out_of_range",
    "repeated_index",
    "doubled_half_edges",
    "open_half_edges",
    "non_manifold_edges",
    "non_manifold_vertices",
)


def defects(report):
    """What keeps a mesh from being a closed, outward 2-manifold of numbers; empty when nothing does."""
    found = [f"{report[name]} {name}" for name in DEFECTS if report.get(name)]
    if report.get("volume", 0) < 0:
        found.append(f"inward: volume {report['volume']}")
    return found


def _pieces(a, b, count):
    """The component of each of `count` nodes, joined by the pairs (a, b)."""
    graph = coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _vertices_with_many_fans(first, low, edge, edges):
    """Corners hang on spokes: an edge has one at each end. Corners that hang together form a fan."""
    corners = np.arange(len(first))
    before = corners - corners % 3 + (corners + 2) % 3
    leaving = 2 * edge + (first != low)
    arriving = 2 * edge[before] + (first != low[before])
    hanging = np.concatenate([corners, corners])
    spokes = len(first) + np.concatenate([leaving, arriving])
    fan = _pieces(hanging, spokes, len(first) + 2 * edges)[: len(first)]
    owners = first[np.unique(fan, return_index=True)[1]]
    return int((np.unique(owners, return_counts=True)[1] > 1).sum())
