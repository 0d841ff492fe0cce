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
from .implicit import Evaluate, FloatArray
from .kernels.edges import paired_sides
from .kernels.intersections import intersecting
from .mesh import Mesh
from .seam_polish import Looks, follow

#: Faces whose normals differ by less than this cosine (25 degrees) have no crease between them.
_SHARP = 0.9

#: Some edges cross two creases, and some are made by splitting others. After two passes no more are found in practice.
_PASSES = 2

#: Halvings of an edge in search of the crease.
_HALVINGS = 6

#: Ends of an edge that are nearer to the crease than this share of the spacing are moved onto it instead.
_ON_CREASE = 0.1
_SNAP_ROUNDS = 4

#: Edges along a crease that miss it by less, in spacings, stay; …
_STRAIGHT = 0.005

#: … points farther than this from the surface, in spacings, are beyond the end of their crease, at a corner.
_OFF = 1e-5

#: Those that are still farther off then, in spacings, are no points of a crease: within a sheet that is thinner than
#: the cells the gradient jumps, too. (Such points had 85 pairs of triangles of one sheet run through each other.)
_MISSED = 5e-3

#: How far beside a point, and how far outside of the surface, a crease must show, in spacings.
_ASIDE, _OUTSIDE = 0.05, 0.1

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
    gradient = units(look(mesh.vertices)[1])
    for number in range(_PASSES):
        mesh = _pass(mesh, gradient, number % 2, look, spacing, threads)
        gradient = np.concatenate([gradient, units(look(mesh.vertices[len(gradient) :])[1])])
    return mesh


def _pass(mesh: Mesh, gradient: FloatArray, side: int, look: Evaluate, spacing: float, threads: int | None) -> Mesh:
    """Split edges at the crease that is next to the one or the other end."""
    edges = paired_edges(mesh)
    ends = edges.ends[:, ::-1] if side else edges.ends
    chosen = np.flatnonzero((gradient[ends[:, 0]] * gradient[ends[:, 1]]).sum(axis=1) < _SHARP)
    beside = beside_ends(mesh.vertices[ends[chosen]], look)
    on_crease = np.zeros(len(gradient), np.bool_)
    on_crease[ends[chosen][(gradient[ends[chosen]] * beside).sum(axis=2) < _SHARP]] = True
    along = np.setdiff1d(np.flatnonzero(on_crease[ends].all(axis=1)), chosen)
    chosen = np.concatenate([chosen, along])
    beside = np.concatenate([beside, beside_ends(mesh.vertices[ends[along]], look)])
    between = (beside[:, 0] * beside[:, 1]).sum(axis=1) < _SHARP
    chosen = chosen[between]
    ends = ends[chosen]
    start, slopes = next_crease(mesh.vertices[ends], beside[between], look)
    sharp = (slopes[:, 0] * slopes[:, 1]).sum(axis=1) < _SHARP
    chosen, ends, start, slopes = chosen[sharp], ends[sharp], start[sharp], slopes[sharp]
    if len(chosen) == 0:
        return mesh
    point = onto_crease(start, mesh.vertices[ends], look, spacing)
    away = np.linalg.norm(point[:, None] - mesh.vertices[ends], axis=2)
    near = away.min(axis=1) <= _ON_CREASE * spacing
    closest = ends[np.arange(len(ends)), away.argmin(axis=1)]
    straight = _off_line(point, mesh.vertices[ends]) < _STRAIGHT * spacing
    wanted = ~(near & on_crease[closest]) & ~(straight & on_crease[ends].all(axis=1))
    wanted &= (np.abs(look(point)[0]) < _MISSED * spacing) & _turns(point, slopes, look, spacing)
    chosen, ends, point, near, closest = chosen[wanted], ends[wanted], point[wanted], near[wanted], closest[wanted]
    for _ in range(_TRIES):
        result = snapped(mesh, closest[near], point[near])
        rows = np.flatnonzero(~near)
        rows = rows[unfolded(result, edges, chosen[rows], point[rows], look)]
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


def snapped(mesh: Mesh, which: NDArray[np.int64], point: FloatArray) -> Mesh:
    """Vertices (E,) moved to points (E, 3), as far as no triangle folds."""
    vertices = mesh.vertices.copy()
    vertices[which] = point
    for _ in range(_SNAP_ROUNDS):
        moved = (vertices != mesh.vertices).any(axis=1)
        touched = np.flatnonzero(moved[mesh.faces].any(axis=1))
        a, b, c = (vertices[mesh.faces[touched, k]] for k in range(3))
        turned = (units(np.cross(b - a, c - a)) * units(mesh.face_vectors[touched])).sum(axis=1) < _SAME_SIDE
        if not turned.any():
            return Mesh(vertices, mesh.faces)
        back = mesh.faces[touched[turned]].ravel()
        vertices[back] = mesh.vertices[back]
    return mesh


def paired_edges(mesh: Mesh) -> Edges:
    """Edges that two triangles share, without normals."""
    return edges_of(paired_sides(len(mesh.vertices), mesh.faces), mesh)


def edges_of(sides: NDArray[np.int32], mesh: Mesh) -> Edges:
    """Edges, without normals, of sides (E, 2) of a mesh's triangles; side s is of corner s % 3 of triangle s // 3."""
    triangle, corner = sides // 3, sides % 3
    first, at = triangle[:, 0], corner[:, 0]
    ends = np.stack([mesh.faces[first, at], mesh.faces[first, (at + 1) % 3]], axis=1).astype(np.int64)
    return Edges(ends, np.zeros((len(first), 0)), triangle.astype(np.int64), corner.astype(np.int64))


def units(vectors: FloatArray) -> FloatArray:
    """Vectors (…, 3) of length 1, or 0."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def beside_ends(ends: FloatArray, look: Evaluate) -> FloatArray:
    """Give the directions (E, 2, 3) of the gradient a little way from the ends (E, 2, 3) of edges towards each other.

    Just at the ends it may be of either side of a crease.
    """
    step = 0.5**_HALVINGS * (ends[:, 1] - ends[:, 0])
    return np.stack([units(look(ends[:, 0] + step)[1]), units(look(ends[:, 1] - step)[1])], axis=1)


def next_crease(
    ends: FloatArray, beside: FloatArray, look: Evaluate, sharp: float = _SHARP
) -> tuple[FloatArray, FloatArray]:
    """Where (E, 3) the gradient first jumps between ends, seen from the first of them; directions (E, 2, 3) there."""
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    below, above = beside[:, 0], beside[:, 1]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        normal = units(look(ends[:, 0] + middle[:, None] * (ends[:, 1] - ends[:, 0]))[1])
        same = (normal * below).sum(axis=1) > sharp
        low, high = np.where(same, middle, low), np.where(same, high, middle)
        below, above = np.where(same[:, None], normal, below), np.where(same[:, None], above, normal)
    place = ends[:, 0] + ((low + high) / 2)[:, None] * (ends[:, 1] - ends[:, 0])
    return place, np.stack([below, above], axis=1)


def _off_line(points: FloatArray, ends: FloatArray) -> FloatArray:
    """Distances (E,) from the lines through ends (E, 2, 3)."""
    return np.asarray(np.linalg.norm(np.cross(points - ends[:, 0], units(ends[:, 1] - ends[:, 0])), axis=1))


def onto_crease(points: FloatArray, ends: FloatArray, look: Evaluate, spacing: float) -> FloatArray:
    """Move points onto the crease between the faces at the ends of their edges; to its corner if it ends before."""
    count = len(points)
    along = units(ends[:, 1] - ends[:, 0])
    towards = np.stack([-along, along, np.zeros_like(along)], axis=1)
    moved = points
    for number in (2, 3):
        far = np.flatnonzero(np.abs(look(moved)[0]) > _OFF * spacing) if number == 3 else np.arange(count)
        looks = Looks(
            np.repeat(np.arange(len(far)), number),
            np.ones(number * len(far), np.int64),
            towards[far, :number].reshape(-1, 3),
            np.full(number * len(far), spacing),
            np.full((number * len(far), 4), np.nan),
        )
        moved = moved.copy()
        moved[far] = follow(moved[far], looks, [None, look], spacing)
    return moved


def _turns(points: FloatArray, slopes: FloatArray, look: Evaluate, spacing: float) -> NDArray[np.bool_]:
    """Whether the gradient jumps between slopes (E, 2, 3) also outside of points, on both sides of the crease.

    Inside of a union it also jumps where one shape goes on in the other.
    """
    above = points - _OUTSIDE * spacing * units(slopes.sum(axis=1))
    across = _ASIDE * spacing * units(slopes[:, 0] - slopes[:, 1])
    before, after = (units(look(above + shift)[1]) for shift in (-across, across))
    return np.asarray((before * after).sum(axis=1) < _SHARP)


def unfolded(
    mesh: Mesh, edges: Edges, chosen: NDArray[np.intp], point: FloatArray, look: Evaluate
) -> NDArray[np.bool_]:
    """Whether the halves of the triangles beside edges face as they did, or as the surface does."""
    good = np.ones(len(chosen), np.bool_)
    for side in (0, 1):
        triangle, corner = edges.triangle[chosen, side], edges.corner[chosen, side]
        before = units(mesh.face_vectors[triangle])
        a, b, c = (mesh.vertices[mesh.faces[triangle, (corner + k) % 3]] for k in range(3))
        for x, y in ((a, point), (point, b)):
            after = units(np.cross(y - x, c - x))
            surface = -units(look((x + y + c) / 3)[1])
            good &= np.maximum((after * before).sum(axis=1), (after * surface).sum(axis=1)) > _SAME_SIDE
    return good
