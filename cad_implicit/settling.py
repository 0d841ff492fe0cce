"""Settle: single vertices of a mesh that are off the shape it stands for, moved onto it, or taken out.

Not promised: vertices stay where they are if without them triangles would be farther from the shape, or run through
others.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .implicit import FloatArray, Implicit
from .kernels import slivers
from .kernels.intersections import intersecting
from .mesh import Mesh
from .refilling import compared, filled, ring
from .stitching import vertex_keys

#: Vertices farther from the surface than this are moved, in spacings, and none by more than this.
_OFF = 2e-3
_FARTHEST = 0.3
_STEPS = 6

#: Triangles may turn up to the first cosine, or so that they face as the shape does up to the second: seams leave
#: triangles between two sheets of facets that lie across.
_TURN = 0.1
_FACING = 0.5

#: Vertices that are still farther off are taken out, in spacings.
_FAR = 5e-3

#: Moves and removals, one after the other: so many times.
_ROUNDS = 2


def settled(mesh: Mesh, shape: Implicit, before: Mesh, spacing: float, threads: int | None = None) -> Mesh:
    """Give a mesh whose vertices are on a shape, but for those that another mesh has, too.

    Parameters
    ----------
    mesh : Mesh
    shape : Implicit
        Its values are distances near the surface.
    before : Mesh
        Vertices of this one stay.
    spacing : float
        Of the grid that the mesh was contoured on, in mm.
    threads : int, optional
        Default: all cores.
    """
    for _ in range(_ROUNDS):
        which, value = _off(mesh, shape, before, _OFF * spacing)
        target = _moved(mesh.vertices[which], shape, spacing)
        better = np.abs(shape(target)) < 0.5 * value
        better &= np.linalg.norm(target - mesh.vertices[which], axis=1) < _FARTHEST * spacing
        mesh = _unfolded(mesh, which[better], target[better], shape, spacing, threads)
        which, value = _off(mesh, shape, before, _FAR * spacing)
        if len(which) == 0:
            break
        mesh = _without(mesh, which, shape, spacing, threads)
    return mesh


def _off(mesh: Mesh, shape: Implicit, before: Mesh, least: float) -> tuple[NDArray[np.int64], FloatArray]:
    """Vertices (N,) that another mesh has not and that are farther from the shape, farthest first; how far (N,)."""
    new = np.flatnonzero(~np.isin(vertex_keys(mesh.vertices), vertex_keys(before.vertices)))
    value = np.abs(shape(mesh.vertices[new]))
    order = np.argsort(-value, kind="stable")
    order = order[value[order] > least]
    return new[order], value[order]


def _moved(points: FloatArray, shape: Implicit, spacing: float) -> FloatArray:
    """Points (N, 3) moved towards the surface."""
    x = points.copy()
    for _ in range(_STEPS):
        f, slope = shape.value_and_gradient(x)
        square = (slope * slope).sum(axis=1)
        step = -(f / np.where(square > 0, square, 1.0))[:, None] * slope
        length = np.linalg.norm(step, axis=1)
        x += step * np.minimum(1.0, 0.1 * spacing / np.where(length > 0, length, 1.0))[:, None]
    return x


def _unfolded(
    mesh: Mesh,
    which: NDArray[np.int64],
    target: FloatArray,
    shape: Implicit,
    spacing: float,
    threads: int | None,
) -> Mesh:
    """Mesh with some vertices moved, one after the other, where no triangle folds or meets another."""
    if len(which) == 0:
        return mesh
    faces = mesh.faces[np.isin(mesh.faces, which).any(axis=1)]
    vertices = mesh.vertices.copy()
    way = np.zeros(len(vertices))
    for vertex, place in zip(which.tolist(), target, strict=True):
        around = faces[(faces == vertex).any(axis=1)]
        vertices[vertex] = place
        if _face_well(mesh, vertices, around, shape):
            way[vertex] = np.linalg.norm(place - mesh.vertices[vertex])
        else:
            vertices[vertex] = mesh.vertices[vertex]
    while way.any():
        with parallel.threads(threads, len(mesh.faces)):
            bad = mesh.faces[intersecting(vertices, mesh.faces, spacing)]
        bad = bad[(way[bad] > 0).any(axis=1)]
        if len(bad) == 0:
            break
        # the shortest ways first: those that stay off the shape are the nearest to it then
        shortest = np.where(way[bad] > 0, way[bad], np.inf).argmin(axis=1)
        back = bad[np.arange(len(bad)), shortest]
        vertices[back], way[back] = mesh.vertices[back], 0.0
    return Mesh(vertices, mesh.faces, mesh.face_ids, mesh.source)


def _face_well(mesh: Mesh, vertices: FloatArray, faces: NDArray[np.int32], shape: Implicit) -> bool:
    """Whether triangles (N, 3) with new vertices face as they did, or as the shape does."""
    old, new = _normals(mesh.vertices, faces), _normals(vertices, faces)
    turned = (old * new).sum(axis=1) <= _TURN * np.linalg.norm(old, axis=1) * np.linalg.norm(new, axis=1)
    return not turned.any() or bool((compared(vertices[faces[turned]], shape)[1] > _FACING).all())


def _normals(vertices: FloatArray, faces: NDArray[np.int32]) -> FloatArray:
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def _without(mesh: Mesh, which: NDArray[np.int64], shape: Implicit, spacing: float, threads: int | None) -> Mesh:
    """Mesh without some vertices, where the triangles that are there instead are as near to the shape as the old."""
    vertices, faces = mesh.vertices, mesh.faces
    ids = np.zeros(len(faces), np.int32) if mesh.face_ids is None else mesh.face_ids
    for vertex in which.tolist():
        own = (faces == vertex).any(axis=1)
        around = ring(faces[own], vertex)
        if around is None:
            continue
        rows = filled(vertices, around, shape, vertices[faces[own]], spacing)
        if rows is None:
            continue
        new = around[rows].astype(np.int32)
        rest = np.concatenate([faces[~own], new])
        near = _near(vertices, rest, around)
        if _twice(rest[near]):
            continue
        with parallel.threads(threads, len(near)):
            some, local, _ = slivers.compact(vertices, rest[near])
            if intersecting(some, local, spacing).any():
                continue
        alike = _units(_normals(vertices, new)) @ _units(_normals(vertices, faces[own])).T
        alike[~_beside(new, faces[own])] -= 2.0
        faces, ids = rest, np.concatenate([ids[~own], ids[own][alike.argmax(axis=1)]])
    vertices, faces, _ = slivers.compact(vertices, faces)
    return Mesh(vertices, faces, None if mesh.face_ids is None else ids, mesh.source)


def _near(vertices: FloatArray, faces: NDArray[np.int32], around: NDArray[np.int64]) -> NDArray[np.intp]:
    """Triangles (N,) whose boxes meet that of some vertices."""
    low, high = vertices[around].min(axis=0), vertices[around].max(axis=0)
    corners = vertices[faces]
    return np.flatnonzero((corners.min(axis=1) <= high).all(axis=1) & (corners.max(axis=1) >= low).all(axis=1))


def _twice(faces: NDArray[np.int32]) -> bool:
    """Whether two triangles have an edge in the same direction."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    return len(np.unique(edges, axis=0)) < len(edges)


def _beside(some: NDArray[np.int32], others: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which of some triangles (N, 3) have two vertices in common with which of others (M, 3): (N, M)."""
    return np.asarray((some[:, None, :, None] == others[None, :, None, :]).sum(axis=(2, 3)) == 2)


def _units(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))
