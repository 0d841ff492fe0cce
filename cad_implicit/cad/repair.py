"""Repair of raw triangles where there is one way to do it; what was done is told.

Not repaired: holes, and edges shared by more than two triangles, where one would have to guess.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cad_implicit.mesh import FloatArray, Mesh

#: A vertex lies on an edge if it is within this share of the part's diagonal of it: ten times float32's resolution.
_ON_EDGE = 1e-6


def repaired(mesh: Mesh) -> tuple[Mesh, list[str]]:
    """Mesh that is closed where that takes no guess, and what was done to it.

    Parameters
    ----------
    mesh : Mesh
        Welded.

    Returns
    -------
    mesh : Mesh
        The same if nothing helps.
    done : list of str
        A sentence for each repair.
    """
    done: list[str] = []
    if not mesh.open_edges:
        return mesh, done
    split, count = _split(mesh)
    if count and split.open_edges < mesh.open_edges:
        mesh = split
        done.append(f"edges split at vertices of other triangles that lie on them (T-junctions): {count}")
    turned = _turned(mesh)
    if turned is not None and turned.any():
        faces = mesh.faces.copy()
        faces[turned] = faces[turned, ::-1]
        better = Mesh(mesh.vertices, faces, mesh.face_ids, mesh.source)
        if better.open_edges < mesh.open_edges:
            mesh = better
            done.append(f"triangles turned over that faced another way than their neighbours: {int(turned.sum())}")
    return mesh, done


def _turned(mesh: Mesh) -> NDArray[np.bool_] | None:
    """Triangles (F,) to turn so that all of a shell face one way, which most of its area does; None if there is none.

    Two triangles at an edge that both run along it in one direction must not both stay.
    """
    from cad_implicit.kernels.linked import linked

    faces = mesh.faces.astype(np.int64)
    count = len(faces)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end) * len(mesh.vertices) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    ends = np.flatnonzero(np.diff(key[order], append=-1) != 0)
    sizes = np.diff(ends, prepend=-1)
    if (sizes > 2).any():  # which of three triangles at an edge belong together is a guess
        return None
    pairs = np.stack([order[ends[sizes == 2] - 1], order[ends[sizes == 2]]], axis=1)
    differ = start[pairs[:, 0]] == start[pairs[:, 1]]
    one, other = pairs[:, 0] // 3, pairs[:, 1] // 3
    # each triangle is there twice, as it is and turned over; what must go together is linked
    rows = np.concatenate([one, one + count])
    columns = np.concatenate([other + count * differ, other + count * ~differ])
    label = linked(2 * count, np.stack([rows, columns], axis=1).astype(np.int32))
    kept, over = label[:count], label[count:]
    if (kept == over).any():  # a surface with one side
        return None
    area = np.linalg.norm(mesh.face_vectors, axis=1)
    weight = np.bincount(kept, area, int(label.max()) + 1)
    return np.asarray((weight[over] > weight[kept]) | ((weight[over] == weight[kept]) & (over < kept)))


def _split(mesh: Mesh) -> tuple[Mesh, int]:
    """Mesh whose open edges are split at vertices that lie on them, and the number of edges that were."""
    edges = _open_edges(mesh)
    vertices, tolerance = mesh.vertices, _ON_EDGE * mesh.diagonal
    rim = np.unique(edges[:, :2])
    from scipy.spatial import cKDTree

    tree = cKDTree(vertices[rim])
    replaced: dict[int, list[tuple[int, int, list[int]]]] = {}
    for a, b, face in edges.tolist():
        inside = _between(vertices, rim, tree, a, b, tolerance)
        if inside:
            replaced.setdefault(face, []).append((a, b, inside))
    faces, ids = [], []
    for face, cuts in replaced.items():
        parts = [mesh.faces[face].tolist()]
        for a, b, inside in cuts:
            own = next(part for part in parts if _has(part, a, b))
            parts.remove(own)
            apex = next(v for v in own if v not in (a, b))
            chain = [a, *inside, b]
            parts += [[p, q, apex] for p, q in pairwise(chain)]
        faces += parts
        ids += [face] * len(parts)
    if not faces:
        return mesh, 0
    keep = np.delete(np.arange(len(mesh.faces)), list(replaced))
    new_ids = None if mesh.face_ids is None else np.concatenate([mesh.face_ids[keep], mesh.face_ids[ids]])
    whole = np.concatenate([mesh.faces[keep], np.array(faces, np.int32)])
    return Mesh(vertices, whole, new_ids, mesh.source), sum(map(len, replaced.values()))


def _open_edges(mesh: Mesh) -> NDArray[np.int64]:
    """Start, end and triangle (E, 3) of the edges that have one triangle."""
    faces = mesh.faces.astype(np.int64)
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end) * len(mesh.vertices) + np.maximum(start, end)
    _, first, number = np.unique(key, return_index=True, return_counts=True)
    alone = first[number == 1]
    return np.stack([start[alone], end[alone], alone // 3], axis=1)


def _between(vertices: FloatArray, rim: NDArray[np.int64], tree: object, a: int, b: int, tolerance: float) -> list[int]:
    """Vertices of a rim that lie within an edge from a to b, in their order."""
    along = vertices[b] - vertices[a]
    length = float(np.linalg.norm(along))
    if length <= 2 * tolerance:
        return []
    near = rim[tree.query_ball_point((vertices[a] + vertices[b]) / 2, length / 2 + tolerance)]  # type: ignore[attr-defined]
    near = near[(near != a) & (near != b)]
    away = vertices[near] - vertices[a]
    way = away @ along / length
    off = np.linalg.norm(away - np.outer(way, along / length), axis=1)
    on = (off <= tolerance) & (way > tolerance) & (way < length - tolerance)
    return [int(v) for v in near[on][np.argsort(way[on])]]


def _has(triangle: list[int], a: int, b: int) -> bool:
    return any(triangle[i] == a and triangle[(i + 1) % 3] == b for i in range(3))
