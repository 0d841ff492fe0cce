"""Vertices on seams, where the surfaces of several shapes cross: from where facets cross to where the surfaces do.

Facets miss a surface of radius r by up to h² / 8 r, and where they cross others the vertex is off by as much. Each
vertex knows the facets that it lies on, and through them the surfaces: those of functions are looked at, once at the
vertex where they are smooth there, or beside it on each side of a crease; planes are known. Then it moves by the
shortest step onto the tangent planes, first onto those of the part, then within these onto the others (Newton's
method), so that what is flat stays flat.

Not promised: where surfaces touch each other, the vertex may be anywhere along the gap, which is next to nothing there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .implicit import Evaluate, FloatArray
from .mesh import Mesh

#: Nearest and farthest looks beside a vertex, in spacings: far enough to tell creases from curvature, then as near as
#: the last step was long (as for sharp vertices of dual contours).
_NEAR_PROBE, _FAR_PROBE = 0.02, 0.12

#: Surfaces whose normals differ by less than 14 degrees (cosine) on both sides of a vertex have no crease there.
_SMOOTH = 0.97

#: Planes of the part at smaller angles (radians) than the first make no edge: rounding errors of normals. Other
#: surfaces that cross at smaller angles than the second touch: the gap between them is 0.0002 radii or less there.
_PART_ANGLE = 1e-6
_ANGLE = 0.02

#: Longest step and farthest way, in spacings; a vertex that would go farther stays where it was.
_STEP = 0.3
_REACH = 0.6

#: A vertex has arrived if its step is shorter, in spacings. Where surfaces nearly touch, each round halves the way.
_ARRIVED = 1e-6
_ROUNDS = 12

#: Triangles of the part thinner than this share of its diagonal do not tell how they face.
_THIN = 1e-8


@dataclass(frozen=True, eq=False)
class Facets:
    """Which facets of which surface each vertex lies on.

    Attributes
    ----------
    vertex, surface, facet : (N,) int64
        Number of the vertex, of the surface (0 is the part), and of the triangle of that surface's mesh.
    """

    vertex: NDArray[np.int64]
    surface: NDArray[np.int64]
    facet: NDArray[np.int64]


@dataclass(eq=False)
class Looks:
    """Tangent planes seen from vertices; rows sorted by vertex.

    Attributes
    ----------
    vertex, surface : (N,) int64
    towards : (N, 3) float64
        Unit vectors to the side that is looked at; zero for the vertex itself.
    room : (N,) float64
        How far there is facet in that direction, in mm.
    plane : (N, 4) float64
        Normal and offset, where the plane is known; NaN elsewhere.
    """

    vertex: NDArray[np.int64]
    surface: NDArray[np.int64]
    towards: FloatArray
    room: FloatArray
    plane: FloatArray

    def some(self, which: NDArray[np.bool_]) -> Looks:
        """Keep some of them."""
        return Looks(self.vertex[which], self.surface[which], self.towards[which], self.room[which], self.plane[which])


def polish_seams(
    points: FloatArray,
    facets: Facets,
    meshes: Sequence[Mesh],
    surfaces: Sequence[Evaluate | None],
    spacing: float,
) -> FloatArray:
    """Move vertices onto the surfaces whose facets they lie on.

    Parameters
    ----------
    points : (V, 3) float64
        Vertices in mm.
    facets : Facets
        Every vertex has one at least.
    meshes : sequence of Mesh
        Of the surfaces; the first is the part.
    surfaces : sequence of callable or None
        Map points (N, 3) to values (N,) and gradients (N, 3). None: the triangles themselves are the surface.
    spacing : float
        Size of the facets in mm.

    Returns
    -------
    (V, 3) float64
        The new places; those of vertices that would have gone too far are the old ones.
    """
    looks = _first_looks(points, facets, meshes, surfaces)
    looks = _creases_apart(points, looks, surfaces, spacing)
    return follow(points, looks, surfaces, spacing)


def follow(points: FloatArray, looks: Looks, surfaces: Sequence[Evaluate | None], spacing: float) -> FloatArray:
    """Move points (V, 3) onto the tangent planes that they look at, over and over."""
    position, active = points.copy(), np.arange(len(points))
    last = np.full(len(points), np.inf)
    for _ in range(_ROUNDS):
        normal, height = _tangent_planes(position[active], last, looks, surfaces, spacing)
        step = _steps(len(active), looks, normal, height)
        length = np.linalg.norm(step, axis=1)
        last = np.minimum(length, _STEP * spacing)
        position[active] += step * (last / np.maximum(length, 1e-300))[:, None]
        lost = np.linalg.norm(position[active] - points[active], axis=1) > _REACH * spacing
        position[active[lost]] = points[active[lost]]
        going = (length > _ARRIVED * spacing) & ~lost
        if not going.any():
            break
        looks = looks.some(going[looks.vertex])
        looks.vertex = (np.cumsum(going) - 1)[looks.vertex]
        active, last = active[going], last[going]
    return position


def _first_looks(
    points: FloatArray, facets: Facets, meshes: Sequence[Mesh], surfaces: Sequence[Evaluate | None]
) -> Looks:
    """One look towards the middle of each facet."""
    order = np.lexsort((facets.facet, facets.surface, facets.vertex))
    vertex, surface, facet = facets.vertex[order], facets.surface[order], facets.facet[order]
    count = len(vertex)
    towards, room, plane = np.zeros((count, 3)), np.zeros(count), np.full((count, 4), np.nan)
    keep = np.ones(count, np.bool_)
    for number, mesh in enumerate(meshes):
        rows = np.flatnonzero(surface == number)
        corners = mesh.vertices[mesh.faces[facet[rows]]]
        away = corners.mean(axis=1) - points[vertex[rows]]
        length = np.linalg.norm(away, axis=1)
        towards[rows], room[rows] = away / np.where(length > 0, length, 1.0)[:, None], length
        if surfaces[number] is None:
            area2 = 2 * mesh.face_vectors[facet[rows]]
            size = np.linalg.norm(area2, axis=1)
            longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
            keep[rows] = size > _THIN * mesh.diagonal * longest
            normal = area2 / np.where(size > 0, size, 1.0)[:, None]
            plane[rows, :3], plane[rows, 3] = normal, (normal * corners[:, 0]).sum(axis=1)
    return Looks(vertex, surface, towards, room, plane).some(keep)


def _creases_apart(points: FloatArray, looks: Looks, surfaces: Sequence[Evaluate | None], spacing: float) -> Looks:
    """One look for each smooth piece of each surface around a vertex: at the vertex if there is but one."""
    known = np.isfinite(looks.plane[:, 3])
    normal, _ = _tangent_planes(points, np.full(len(points), np.inf), looks, surfaces, spacing)
    keep = known.copy()
    waiting = ~known
    group = looks.vertex * len(surfaces) + looks.surface
    pieces = np.zeros(len(points) * len(surfaces), np.int64)
    while waiting.any():
        rows = np.flatnonzero(waiting)
        _, first = np.unique(group[rows], return_index=True)
        leader = np.zeros(len(pieces), np.int64)
        leader[group[rows[first]]] = rows[first]
        keep[rows[first]] = True
        pieces[group[rows[first]]] += 1
        alike = (normal[rows] * normal[leader[group[rows]]]).sum(axis=1) > _SMOOTH
        waiting[rows[alike]] = False
        waiting[rows[first]] = False
    looks.towards[pieces[group] == 1] = 0.0
    return looks.some(keep)


def _tangent_planes(
    position: FloatArray, last: FloatArray, looks: Looks, surfaces: Sequence[Evaluate | None], spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Find unit normals (N, 3) of the planes that the looks see, and their heights (N,) above the vertices."""
    at = position[looks.vertex]
    normal = looks.plane[:, :3].copy()
    height = looks.plane[:, 3] - (normal * at).sum(axis=1)
    distance = np.clip(last, _NEAR_PROBE * spacing, _FAR_PROBE * spacing)[looks.vertex]
    probe = at + np.minimum(distance, 0.5 * looks.room)[:, None] * looks.towards
    for number, look in enumerate(surfaces):
        rows = np.flatnonzero(looks.surface == number)
        if look is None or len(rows) == 0:
            continue
        value, gradient = look(probe[rows])
        length = np.linalg.norm(gradient, axis=1)
        good = (length > 0) & np.isfinite(length) & np.isfinite(value)
        scale = np.where(good, length, 1.0)
        unit = np.where(good[:, None], gradient / scale[:, None], 0.0)
        normal[rows] = unit
        height[rows] = np.where(good, (unit * (probe[rows] - at[rows])).sum(axis=1) - value / scale, 0.0)
    return normal, height


def _steps(count: int, looks: Looks, normal: FloatArray, height: FloatArray) -> FloatArray:
    """Shortest steps (count, 3) onto the planes of the part, and within these as near to the others as they allow."""
    part = looks.surface == 0
    first, wanted = _stacked(count, looks.vertex[part], normal[part], height[part])
    inverse = _inverse(first, _PART_ANGLE)
    step = (inverse @ wanted[:, :, None])[:, :, 0]
    free = np.eye(3) - inverse @ first
    second, wanted = _stacked(count, looks.vertex[~part], normal[~part], height[~part])
    wanted -= (second @ step[:, :, None])[:, :, 0]
    within = _inverse(second @ free, _ANGLE)
    return np.asarray(step + (free @ within @ wanted[:, :, None])[:, :, 0])


def _stacked(
    count: int, vertex: NDArray[np.int64], normal: FloatArray, height: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Planes (count, K, 3) and heights (count, K) of each vertex, with rows of zeros behind."""
    start = np.searchsorted(vertex, vertex)
    column = np.arange(len(vertex)) - start
    width = int(column.max(initial=0)) + 1
    planes, heights = np.zeros((count, width, 3)), np.zeros((count, width))
    planes[vertex, column], heights[vertex, column] = normal, height
    return planes, heights


def _inverse(planes: FloatArray, least: float) -> FloatArray:
    """Pseudo-inverses (N, 3, K) of planes (N, K, 3), without directions in which they hardly differ."""
    u, size, v = np.linalg.svd(planes, full_matrices=False)
    inverse = np.where(size > least, 1 / np.maximum(size, least), 0.0)
    return np.asarray(np.swapaxes(v, 1, 2) @ (inverse[:, :, None] * np.swapaxes(u, 1, 2)))
