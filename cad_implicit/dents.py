"""Dents of a contour: what is around edges off the surface is taken away, and closed by a cone on the surface.

Where two cells see the same corner and triangles would run through each other, vertices are taken back into their cells
(:mod:`cad_implicit.untangling`): an acute tip is lost, with triangles across its inside. Next to a corner its faces are
plane, so that a cone from there over a loop on the faces lies on them, if the loop crosses creases at vertices.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .implicit import Evaluate, FloatArray
from .mesh import IntArray, Mesh
from .missed_creases import units

#: What has vertices nearer than so many spacings to a dent is taken away with it. (Rings of triangles are large where
#: faces are plane, and their loops cross other creases: 152 of 300 tips of 28 degrees were lost, so it is 87.)
_REACHES = (1.0, 1.5, 2.0, 2.5)

#: The most edges that are tried: more are no tip.
_MOST = 24

#: New triangles face less than 70 degrees (cosine) away from where the surface does.
_SAME_SIDE = 0.34

#: Singular values of the faces' normals below this share of the largest are of no corner: the faces meet in a crease,
#: or are one.
_RANK = 0.1

#: The tip of a cone is nearer than so many spacings to the dent.
_AWAY = 2.0

#: Quick values are off by up to so many spacings: what they tell to be off by more is not looked at exactly.
_DOUBT = 0.1

#: Looks at the faces from a tip found so far.
_ROUNDS = 3


def without_dents(
    mesh: Mesh,
    dents: NDArray[np.int64],
    rough: Evaluate,
    look: Evaluate,
    spacing: float,
    limit: float,
    tangled: Callable[[Mesh], NDArray[np.bool_]],
) -> Mesh:
    """Replace what is around edges by cones, where those are on the surface and nothing folds or meets.

    Parameters
    ----------
    mesh : Mesh
    dents : (N, 2) int64
        Ends of edges whose middles are off the surface.
    rough, look : callable
        Map points (N, 3) to values (N,) and gradients (N, 3): quickly, and exactly.
    spacing : float
        In mm.
    limit : float
        How far the middles of edges and triangles may be off the surface, in mm.
    tangled : callable
        Tells which vertices (V,) are of triangles that run through others.

    Returns
    -------
    Mesh
        New vertices come last; vertices that were taken away are of no triangle.
    """
    ways = ((rough, limit + _DOUBT * spacing), (look, limit))
    for ends in dents[:_MOST]:
        if not (np.isin(mesh.faces, ends).sum(axis=1) == 2).any():
            continue
        dent = mesh.vertices[ends].mean(axis=0)
        away = np.linalg.norm(mesh.vertices - dent, axis=1)
        near = (away < 2 * _REACHES[-1] * spacing)[mesh.faces].any(axis=1)
        for reach in _REACHES:
            own = _filled(mesh.faces, (away < reach * spacing)[mesh.faces].any(axis=1), near)
            closed = _closed(mesh, own, dent, ways, _AWAY * spacing)
            new = len(mesh.vertices)
            if closed is not None and not tangled(closed)[closed.faces[(closed.faces == new).any(axis=1)]].any():
                mesh = closed
                break
    return mesh


def _filled(faces: IntArray, own: NDArray[np.bool_], near: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Triangles (F,) with those of the near ones (F,) that they surround: all but the largest piece of these."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    rest = np.flatnonzero(near & ~own)
    if len(rest) == 0:
        return own
    vertices, names = np.unique(faces[rest], return_inverse=True)
    side, count = np.repeat(np.arange(len(rest)), 3), len(rest) + len(vertices)
    joined = csr_matrix((np.ones(len(side), np.bool_), (side, len(rest) + names.ravel())), (count, count))
    piece = connected_components(joined, directed=False)[1][: len(rest)]
    filled = own.copy()
    filled[rest[piece != np.bincount(piece).argmax()]] = True
    return filled


def _closed(
    mesh: Mesh,
    own: NDArray[np.bool_],
    dent: FloatArray,
    ways: Sequence[tuple[Evaluate, float]],
    away: float,
) -> Mesh | None:
    """Mesh with a cone instead of some triangles (F,), if its tip is near the dent and all of it on the surface.

    It has to be by all ways to look, each with how far off middles may be then.
    """
    loop = _loop(mesh.faces[own])
    if loop is None:
        return None
    ends, tip = mesh.vertices[loop], dent
    for look, limit in ways:
        found = _tip(ends, dent, look)
        if found is None or np.linalg.norm(found - dent) > away:
            return None
        tip = found
        corners = np.concatenate([ends, np.broadcast_to(tip, (len(ends), 1, 3))], axis=1)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        surface = -units(look(corners.mean(axis=1))[1])
        if ((units(normal) * surface).sum(axis=1) < _SAME_SIDE).any() or _off(corners, look) > limit:
            return None
    cone = np.column_stack([loop, np.full(len(loop), len(mesh.vertices))]).astype(np.int32)
    return Mesh(np.concatenate([mesh.vertices, tip[None]]), np.concatenate([mesh.faces[~own], cone]))


def _loop(faces: IntArray) -> NDArray[np.int64] | None:
    """Edges (N, 2) around triangles that make a disc; None if they do not."""
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    twin = np.isin(start << 32 | end, end << 32 | start)
    border = np.stack([start[~twin], end[~twin]], axis=1)
    count = len(np.unique(faces))
    if len(border) < 3 or count - (len(start) + len(border)) // 2 + len(faces) != 1:
        return None
    following = dict(border.tolist())
    at, seen = int(border[0, 0]), 0
    while seen < len(border):
        at, seen = following[at], seen + 1
        if at == border[0, 0]:
            break
    return border if seen == len(border) == len(following) else None


def _tip(ends: FloatArray, dent: FloatArray, look: Evaluate) -> FloatArray | None:
    """Point (3,) where the faces beside a loop's edges (N, 2, 3) meet; None if they meet in no corner."""
    beside = ends.mean(axis=1)
    tip = dent
    for number in range(_ROUNDS):
        places = beside if number == 0 else tip + 0.2 * (beside - tip)
        value, gradient = look(places)
        size = np.linalg.norm(gradient, axis=1)
        if not (size > 0).all():
            return None
        normal = gradient / size[:, None]
        offset = (normal * places).sum(axis=1) - value / size
        tip, _, _, singular = np.linalg.lstsq(normal, offset, rcond=None)
        if singular[2] < _RANK * singular[0]:
            return None
    return np.asarray(tip)


def _off(corners: FloatArray, look: Evaluate) -> float:
    """How far the middles of triangles (T, 3, 3) and of their edges are off the surface, at most, in mm."""
    middles = (corners + np.roll(corners, -1, axis=1)) / 2
    value, gradient = look(np.concatenate([middles.reshape(-1, 3), corners.mean(axis=1)]))
    return float((np.abs(value) / np.maximum(np.linalg.norm(gradient, axis=1), 1e-12)).max())
