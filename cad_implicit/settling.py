"""Settle: single vertices of a mesh that are off the shape it stands for, moved onto it.

Not promised: vertices stay where they are if a triangle would fold, or run through another.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .implicit import FloatArray, Implicit
from .kernels.intersections import intersecting
from .mesh import Mesh
from .stitching import vertex_keys

#: Vertices farther from the surface than this are moved, in spacings, and none by more than this.
_OFF = 2e-3
_FARTHEST = 0.3
_STEPS = 6

#: Triangles may turn up to this cosine.
_TURN = 0.1


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
    new = np.flatnonzero(~np.isin(vertex_keys(mesh.vertices), vertex_keys(before.vertices)))
    value = shape(mesh.vertices[new])
    off = np.abs(value) > _OFF * spacing
    new, value = new[off], value[off]
    if len(new) == 0:
        return mesh
    target = _moved(mesh.vertices[new], shape, spacing)
    better = np.abs(shape(target)) < 0.5 * np.abs(value)
    better &= np.linalg.norm(target - mesh.vertices[new], axis=1) < _FARTHEST * spacing
    return _unfolded(mesh, new[better], target[better], spacing, threads)


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


def _unfolded(mesh: Mesh, which: NDArray[np.int64], target: FloatArray, spacing: float, threads: int | None) -> Mesh:
    """Mesh with some vertices moved, one after the other, where no triangle folds or meets another."""
    if len(which) == 0:
        return mesh
    row, _ = np.nonzero(np.isin(mesh.faces, which))
    touched = np.unique(row)
    faces = mesh.faces[touched]
    vertices = mesh.vertices.copy()
    moved: list[int] = []
    for vertex, place in zip(which.tolist(), target, strict=True):
        around = faces[(faces == vertex).any(axis=1)]
        old = _normals(vertices, around)
        kept = vertices[vertex].copy()
        vertices[vertex] = place
        new = _normals(vertices, around)
        sizes = np.linalg.norm(old, axis=1) * np.linalg.norm(new, axis=1)
        if not bool(((old * new).sum(axis=1) > _TURN * sizes).all()):
            vertices[vertex] = kept
        else:
            moved.append(vertex)
    if not moved:
        return mesh
    with parallel.threads(threads, len(mesh.faces)):
        bad = intersecting(vertices, mesh.faces, spacing)
    back = np.intersect1d(np.unique(mesh.faces[bad]), np.array(moved, np.int64))
    vertices[back] = mesh.vertices[back]
    return Mesh(vertices, mesh.faces, mesh.face_ids, mesh.source)


def _normals(vertices: FloatArray, faces: NDArray[np.int32]) -> FloatArray:
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)
