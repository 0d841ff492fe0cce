"""Weld and clean raw triangles: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cad_implicit import parallel
from cad_implicit.mesh import FloatArray, IntArray, Mesh

from .repair import repaired

#: Vertices closer than this share of the diagonal are one vertex when the exact topology leaves the mesh open:
#: ten times the relative resolution of float32 (1.2e-7), far below any tolerance a part is made to.
NEAR = 1e-6


def groups(count: int, pairs: NDArray[np.integer]) -> tuple[IntArray, IntArray]:
    """Join items by pairs.

    Parameters
    ----------
    count : int
        Number of items.
    pairs : (P, 2) int
        Items that are the same.

    Returns
    -------
    label : (count,) int32
        Group of each item.
    first : (G,) int32
        One item of each group.
    """
    from cad_implicit.kernels.linked import linked

    parallel.compiler()  # often the first kernel of all
    label = linked(count, np.array(pairs, np.int32, order="C").reshape(-1, 2))
    return label, np.asarray(np.unique(label, return_index=True)[1], np.int32)


def equal_points(points: FloatArray) -> tuple[IntArray, IntArray]:
    """Group exactly equal points ``(N, 3)``; returns as :func:`groups`."""
    points = points + 0.0  # -0.0 and 0.0 are the same place
    order = np.lexsort(points.T)
    same = (points[order[1:]] == points[order[:-1]]).all(axis=1)
    rank = np.concatenate([[0], np.cumsum(~same)])
    label = np.zeros(len(points), np.int32)
    label[order] = rank
    return label, np.asarray(np.unique(label, return_index=True)[1], np.int32)


def near_points(points: FloatArray, distance: float) -> tuple[IntArray, IntArray]:
    """Group points ``(N, 3)`` closer than ``distance`` in mm; returns as :func:`groups`."""
    from scipy.spatial import cKDTree

    return groups(len(points), cKDTree(points).query_pairs(distance, output_type="ndarray"))


def clean(
    vertices: FloatArray, faces: NDArray[np.integer], face_ids: NDArray[np.integer] | None = None
) -> tuple[FloatArray, NDArray[np.integer], NDArray[np.integer] | None]:
    """Drop triangles with repeated corners, duplicate triangles and unused vertices.

    Of several triangles on the same three corners one is left, or none if they cancel (a flap of no thickness).
    A triangle of no area but with three corners stays: without it the mesh would be open.
    """
    keep = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces = faces[keep]
    ids = None if face_ids is None else face_ids[keep]
    keep = _distinct(faces)
    faces = faces[keep]
    ids = None if ids is None else ids[keep]
    used, index = np.unique(faces, return_inverse=True)
    return vertices[used], index.reshape(faces.shape), ids


def _distinct(faces: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Mark the triangles to keep so that each set of three corners is left once, or not at all if they cancel."""
    if not len(faces):
        return np.zeros(0, bool)
    corners = np.sort(faces, axis=1)
    turned = (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3
    sign = np.where((np.take_along_axis(faces, turned, axis=1) == corners).all(axis=1), 1, -1)
    order = np.lexsort(corners.T)
    new = np.concatenate([[True], (corners[order[1:]] != corners[order[:-1]]).any(axis=1)])
    label = np.zeros(len(faces), np.int64)
    label[order] = np.cumsum(new) - 1
    if new.all():
        return np.ones(len(faces), bool)
    total = np.bincount(label, sign)[label]
    candidates = np.flatnonzero(sign * total > 0)
    keep = np.zeros(len(faces), bool)
    keep[candidates[np.unique(label[candidates], return_index=True)[1]]] = True
    return keep


def welded(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    share: bool = False,
    source: dict[str, object] | None = None,
) -> Mesh:
    """Mesh of raw triangles: cleaned, welded as far as it helps, repaired where that takes no guess, turned outward.

    ``source["repairs"]`` tells what was done that changes more than which corners are shared.

    Parameters
    ----------
    vertices : (V, 3) array_like
        Positions in mm.
    faces : (F, 3) array_like
        Vertex indices.
    share : bool
        The file has no shared vertices (STL): weld equal ones in any case; else only if the mesh is open.
    source : dict, optional
        For :attr:`Mesh.source`.

    Raises
    ------
    InvalidMeshError
        If the arrays are no triangles, or none is left.
    """
    raw = Mesh(vertices, faces, source=source)
    best = _cleaned(raw)
    if share or best.open_edges:
        label, first = equal_points(raw.vertices)
        equal = _cleaned(Mesh(raw.vertices[first], label[raw.faces], source=source))
        best = equal if share or equal.open_edges < best.open_edges else best
    mesh, done = repaired(closer(best))
    left_out = len(raw.faces) - len(best.faces)
    if left_out:
        done.insert(0, f"triangles left out that are there twice or have no area: {left_out} of {len(raw.faces)}")
    turned = outward(mesh)
    if turned is not mesh:
        done.append("all triangles were turned over: the part was inside out")
    if done:
        turned.source["repairs"] = done
    return turned


def closer(mesh: Mesh) -> Mesh:
    """Mesh with vertices nearer than :data:`NEAR` joined if it is open and that closes edges; else the same mesh."""
    if not mesh.open_edges:
        return mesh
    label, first = near_points(mesh.vertices, NEAR * mesh.diagonal)
    vertices, faces, ids = clean(mesh.vertices[first], label[mesh.faces], mesh.face_ids)
    if not len(faces):
        return mesh
    near = Mesh(vertices, faces, ids, mesh.source)
    return near if near.open_edges < mesh.open_edges else mesh


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one, without welding them to each other."""
    start = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = np.concatenate([mesh.faces + n for mesh, n in zip(meshes, start[:-1], strict=True)])
    ids = np.concatenate([np.full(len(m.faces), -1) if m.face_ids is None else m.face_ids for m in meshes])
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), faces, ids)


def parted(mesh: Mesh) -> Mesh:
    """Mesh in which shells that touch in single vertices have vertices of their own; the same mesh if none do.

    Parameters
    ----------
    mesh : Mesh
        Closed.
    """
    corners = mesh.faces.ravel().astype(np.int64)
    order = np.argsort(
        np.minimum(corners, ahead := np.roll(mesh.faces, -1, axis=1).ravel()) * len(mesh.vertices)
        + np.maximum(corners, ahead),
        kind="stable",
    )
    shell, _ = groups(len(mesh.faces), (order // 3).reshape(-1, 2))
    pairs, label = np.unique(corners * len(mesh.faces) + np.repeat(shell, 3), return_inverse=True)
    if len(pairs) == len(np.unique(corners)):
        return mesh
    return Mesh(mesh.vertices[pairs // len(mesh.faces)], label.reshape(-1, 3), mesh.face_ids, mesh.source)


def outward(mesh: Mesh) -> Mesh:
    """Mesh with all triangles turned if it encloses a negative volume; else the same mesh."""
    return mesh if mesh.volume >= 0 else Mesh(mesh.vertices, mesh.faces[:, ::-1], mesh.face_ids, mesh.source)


def _cleaned(mesh: Mesh) -> Mesh:
    return Mesh(*clean(mesh.vertices, mesh.faces, mesh.face_ids), mesh.source)
