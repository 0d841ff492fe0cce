"""Creases that pass between the vertices of a dual contour: edges that go from face to face are split there.

A cell has its vertex on the crease only if edges of the grid cross both faces there. Where a crease clips the corner of
a cell, the mesh goes from face to face without a vertex on the crease, a small fraction of a spacing off. That counts
where a crease lies in another surface to which one of its faces is tangent, as at the border of a fillet: there the
surfaces cross somewhere else then, off by as much as sqrt(2 r d).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .creases import Edges, split_edges
from .implicit import FloatArray
from .kernels.intersections import intersecting
from .mesh import Mesh
from .seam_polish import Evaluate, Looks, follow

#: Faces whose normals differ by less than this cosine (25 degrees) have no crease between them.
_SHARP = 0.9

#: Some edges cross two creases, and some are made by splitting others. After two passes no more are found in practice.
_PASSES = 2

#: Halvings of an edge in search of the crease.
_HALVINGS = 6

#: Ends of an edge that are nearer to the crease than this share of the spacing are moved onto it instead.
_ON_CREASE = 0.1
_SNAP_ROUNDS = 4

#: Tries without what makes triangles run through each other.
_TRIES = 4

#: Triangles face less than 70 degrees (cosine) away from where they did, or halves from where the surface does.
_SAME_SIDE = 0.34


def split_at_creases(mesh: Mesh, look: Evaluate, spacing: float, threads: int | None = None) -> Mesh:
    """Split edges that go from one smooth face to another, and put the new vertices onto the crease.

    Parameters
    ----------
    mesh : Mesh
        Closed, with vertices on the surface of a function.
    look : callable
        Maps points (N, 3) to values (N,) and gradients (N, 3).
    spacing : float
        Size of the triangles in mm.
    threads : int, optional
        Default: all cores.

    Returns
    -------
    Mesh
        Closed; no triangles run through each other if none did.
    """
    gradient = _units(look(mesh.vertices)[1])
    for number in range(_PASSES):
        mesh = _pass(mesh, gradient, number % 2, look, spacing, threads)
        gradient = np.concatenate([gradient, _units(look(mesh.vertices[len(gradient) :])[1])])
    return mesh


def _pass(mesh: Mesh, gradient: FloatArray, side: int, look: Evaluate, spacing: float, threads: int | None) -> Mesh:
    """Split edges at the crease that is next to the one or the other end."""
    edges = _all_edges(mesh)
    chosen = np.flatnonzero((gradient[edges.ends[:, 0]] * gradient[edges.ends[:, 1]]).sum(axis=1) < _SHARP)
    ends = edges.ends[chosen]
    ends = ends[:, ::-1] if side else ends
    start, sharp = _next_crease(mesh.vertices[ends], gradient[ends[:, 0]], look)
    chosen, ends, start = chosen[sharp], ends[sharp], start[sharp]
    if len(chosen) == 0:
        return mesh
    point = _onto_crease(start, mesh.vertices[ends], look, spacing)
    away = np.linalg.norm(point[:, None] - mesh.vertices[ends], axis=2)
    near = away.min(axis=1) <= _ON_CREASE * spacing
    closest = ends[np.arange(len(ends)), away.argmin(axis=1)]
    for _ in range(_TRIES):
        result = _snapped(mesh, closest[near], point[near])
        rows = np.flatnonzero(~near)
        rows = rows[_unfolded(result, edges, chosen[rows], point[rows], look)]
        faces = split_edges(mesh.faces, edges, chosen[rows], len(mesh.vertices)) if len(rows) else mesh.faces
        result = Mesh(np.concatenate([result.vertices, point[rows]]), faces)
        with parallel.threads(threads, len(faces)):
            tangled = faces[intersecting(result.vertices, faces, spacing)]
        if len(tangled) == 0:
            return result
        number = np.full(len(chosen), -1, np.int64)
        number[rows] = len(mesh.vertices) + np.arange(len(rows))
        good = ~np.isin(np.column_stack([ends, number]), tangled).any(axis=1)
        chosen, ends, point, near, closest = chosen[good], ends[good], point[good], near[good], closest[good]
    return mesh


def _snapped(mesh: Mesh, which: NDArray[np.int64], point: FloatArray) -> Mesh:
    """Vertices (E,) moved to points (E, 3), as far as no triangle folds."""
    vertices = mesh.vertices.copy()
    vertices[which] = point
    for _ in range(_SNAP_ROUNDS):
        moved = (vertices != mesh.vertices).any(axis=1)
        touched = np.flatnonzero(moved[mesh.faces].any(axis=1))
        a, b, c = (vertices[mesh.faces[touched, k]] for k in range(3))
        turned = (_units(np.cross(b - a, c - a)) * _units(mesh.face_vectors[touched])).sum(axis=1) < _SAME_SIDE
        if not turned.any():
            return Mesh(vertices, mesh.faces)
        back = mesh.faces[touched[turned]].ravel()
        vertices[back] = mesh.vertices[back]
    return mesh


def _all_edges(mesh: Mesh) -> Edges:
    """Edges of a closed mesh, without normals."""
    start = mesh.faces.ravel().astype(np.int64)
    end = np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    count = len(mesh.vertices)
    order = np.argsort(np.minimum(start, end) * count + np.maximum(start, end), kind="stable")
    sides = order.reshape(-1, 2)
    first = sides[:, 0]
    return Edges(np.stack([start[first], end[first]], axis=1), np.zeros((len(first), 0)), sides // 3, sides % 3)


def _units(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def _next_crease(ends: FloatArray, normals: FloatArray, look: Evaluate) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Where the gradient first jumps between the ends (E, 2, 3), seen from the first of them, and whether it does."""
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    below, above = normals.copy(), np.zeros_like(normals)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        normal = _units(look(ends[:, 0] + middle[:, None] * (ends[:, 1] - ends[:, 0]))[1])
        same = (normal * below).sum(axis=1) > _SHARP
        low, high = np.where(same, middle, low), np.where(same, high, middle)
        below[same], above[~same] = normal[same], normal[~same]
    middle = (low + high) / 2
    between = (low > 0) & (high < 1) & ((below * above).sum(axis=1) < _SHARP)
    return ends[:, 0] + middle[:, None] * (ends[:, 1] - ends[:, 0]), between


def _onto_crease(points: FloatArray, ends: FloatArray, look: Evaluate, spacing: float) -> FloatArray:
    """Move points onto the crease between the faces at the ends of their edges."""
    count = len(points)
    vertex = np.repeat(np.arange(count), 2)
    along = ends[:, 1] - ends[:, 0]
    away = np.stack([-along, along], axis=1).reshape(-1, 3)
    room = np.linalg.norm(away, axis=1)
    looks = Looks(vertex, np.ones(2 * count, np.int64), _units(away), room, np.full((2 * count, 4), np.nan))
    return follow(points, looks, [None, look], spacing)


def _unfolded(
    mesh: Mesh, edges: Edges, chosen: NDArray[np.intp], point: FloatArray, look: Evaluate
) -> NDArray[np.bool_]:
    """Whether the halves of the triangles beside edges face as they did, or as the surface does."""
    good = np.ones(len(chosen), np.bool_)
    for side in (0, 1):
        triangle, corner = edges.triangle[chosen, side], edges.corner[chosen, side]
        before = _units(mesh.face_vectors[triangle])
        a, b, c = (mesh.vertices[mesh.faces[triangle, (corner + k) % 3]] for k in range(3))
        for x, y in ((a, point), (point, b)):
            after = _units(np.cross(y - x, c - x))
            surface = -_units(look((x + y + c) / 3)[1])
            good &= np.maximum((after * before).sum(axis=1), (after * surface).sum(axis=1)) > _SAME_SIDE
    return good
