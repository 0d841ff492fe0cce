"""Facets of blends in more pieces: edges that miss the surface, and do not run along a crease, are split.

The triangles of a coarse grid miss a blend by the sagitta of their edges, which the normals at an edge's ends tell: no
look at the surface is needed to find those. Each gets a vertex midway, above the edge by its sagitta, that is moved
onto the surface from there; then edges are turned again (:mod:`cad_implicit.kernels.sagitta`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .creases import cut
from .implicit import FloatArray
from .kernels import sagitta
from .projecting import Projector

Faces = NDArray[np.int32]

#: Edges of a blend are split if their middle misses it by more than this share of the spacing's square over the radius,
#: an eighth of what edges miss that a grid of cubes leaves, … (Half of this share makes a third more triangles, for a
#: quarter of the RMS error less.)
_SAGITTA = 1 / 32

#: … but not below so many spacings, and always above so many. Halves miss the surface by a quarter.
_LEAST, _MOST = 0.004, 0.0125
_PASSES = 3

#: Where spacings are larger than this share of the radius, the middles of edges longer than so many spacings are looked
#: at whose normals tell a sagitta above this share of what is allowed: below these, surfaces may turn both ways.
#: Where two cylinders cross, at half their rolling ball's radius, one edge misses by three times what it tells.
_COARSE = 0.3
_LONG_EDGE = 2.0
_DOUBTFUL = 0.25

#: Edges shorter than so many spacings that miss a surface by as much are no chords of a blend.
_SHORTEST = 0.5

#: Farthest that a vertex may be from where it was expected, of the sagitta: farther where an edge runs over more than
#: one face, or where surfaces nearly touch.
_ASTRAY = 1.0

#: The same where the middle was looked at, and the vertex is expected there: of how far that is off.
_ASTRAY_LOOKED = 1.5

#: Newton's steps end where one is shorter than this share of the sagitta: less than a thousandth of it is left.
_ENOUGH = 0.02

#: Largest sagitta of a half, of that of the whole; a quarter on a circle. Edges across may have that of the triangle.
_HALF = 0.7

#: Least cosine between the normal there and the direction from the edge.
_ALIKE = 0.7


def tolerance(spacing: float, radius: float) -> float:
    """How far in mm edges of blends may miss the surface, at a spacing and a radius in mm."""
    return spacing * min(max(_LEAST, _SAGITTA * spacing / radius), _MOST)


def refined_facets(
    vertices: FloatArray, faces: Faces, normals: FloatArray, rank: NDArray[np.int8], projector: Projector, radius: float
) -> tuple[FloatArray, Faces]:
    """Split edges of curved facets.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int32
        Of a mesh; open at a region's border at most.
    normals : (V, 3) float64
        Outward unit normals of the vertices on smooth faces, zero for those on creases.
    rank : (V,) int8
        ``slivers.FIXED`` for vertices whose edges stay.
    projector : Projector
        Moves points onto the surface.
    radius : float
        Of the blends in mm.

    Returns
    -------
    vertices : (N, 3) float64
        The given ones come first.
    faces : (M, 3) int32
    """
    most = tolerance(projector.spacing, radius)
    doubtful = most * _DOUBTFUL if projector.spacing > _COARSE * radius else most
    with projector.kernels(len(faces)):
        near = sagitta.around_curved(vertices, faces, normals, doubtful)
    others, faces = np.delete(faces, near, axis=0), faces[near]
    for _ in range(_PASSES):
        with projector.kernels(len(faces)):
            told = sagitta.curved_edges(vertices, faces, normals, rank, doubtful, _SHORTEST * projector.spacing)
        row, corner = np.nonzero(told)
        split = _curved(row, corner, vertices, normals, faces, most, projector)
        doubtful = most
        if len(split.row) == 0:
            break
        middle, normal, found = split.middles(projector)
        if not found.any():
            break
        name = np.full(len(found), -1, np.int32)
        name[found] = len(vertices) + np.arange(found.sum())
        between = np.full((len(faces), 3), -1, np.int32)
        between[split.row, split.corner] = name[split.number]
        faces, _ = cut(faces, between)
        vertices, normals = np.concatenate([vertices, middle[found]]), np.concatenate([normals, normal[found]])
        rank = np.concatenate([rank, np.ones(found.sum(), np.int8)])
        with projector.kernels(len(faces)):
            sagitta.turn_edges(vertices, faces, normals, rank, most)
    return vertices, np.concatenate([others, faces])


def _curved(
    row: NDArray[np.int64],
    corner: NDArray[np.int64],
    vertices: FloatArray,
    normals: FloatArray,
    faces: Faces,
    most: float,
    projector: Projector,
) -> _Split:
    """Edges between two triangles that miss the surface by more than ``most``, of those at some corners (S,)."""
    start, end = faces[row, corner].astype(np.int64), faces[row, (corner + 1) % 3].astype(np.int64)
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, first, number, count = np.unique(
        low * len(vertices) + high, return_index=True, return_inverse=True, return_counts=True
    )
    ends = np.stack([low[first], high[first]], axis=1)
    missed = _missed(vertices[ends], normals[ends])
    along = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    length = np.sqrt(np.einsum("ed,ed->e", along, along))
    unsure = np.flatnonzero((missed <= most) & (length > _LONG_EDGE * projector.spacing))
    looked = np.zeros(len(ends), np.bool_)
    if len(unsure):
        truly = projector.misses(vertices[ends[unsure]].mean(axis=1))
        unsure, truly = unsure[truly > most], truly[truly > most]
        missed[unsure], looked[unsure] = truly, True
    taken = (missed > most) & (count == 2)
    sides = taken[number]
    number = (np.cumsum(taken) - 1)[number[sides]]
    return _Split(
        ends[taken], missed[taken], looked[taken], row[sides], corner[sides], number, vertices, normals, faces
    )


@dataclass(frozen=True, eq=False)
class _Split:
    """Edges with ends (E, 2), how far they miss the surface in mm (E,), and whether by a look (E,) at their middles.

    Then the triangles (S,), corners (S,) and edges (S,) of their sides; and the mesh.
    """

    ends: NDArray[np.int64]
    missed: FloatArray
    looked: NDArray[np.bool_]
    row: NDArray[np.int64]
    corner: NDArray[np.int64]
    number: NDArray[np.int64]
    vertices: FloatArray
    normals: FloatArray
    faces: Faces

    def middles(self, projector: Projector) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Points (E, 3) of the surface above the edges, the normals there, and whether they are usable."""
        ends, normals = self.vertices[self.ends], self.normals[self.ends]
        along, most = ends[:, 1] - ends[:, 0], self.missed
        sign = np.sign(((normals[:, 1] - normals[:, 0]) * along).sum(axis=1))
        sign[self.looked] = 0  # nothing tells on which side the surface is
        upward = normals.sum(axis=1)
        upward -= ((upward * along).sum(axis=1) / (along * along).sum(axis=1))[:, None] * along
        upward /= np.maximum(np.linalg.norm(upward, axis=1, keepdims=True), 1e-12)
        expected = ends.mean(axis=1) + (sign * most)[:, None] * upward
        point, normal, found = projector.onto_face(expected, _ENOUGH * most)
        found &= (normal * upward).sum(axis=1) > _ALIKE
        found &= np.linalg.norm(point - expected, axis=1) < np.where(self.looked, _ASTRAY_LOOKED, _ASTRAY) * most
        found[self._bulging(point, normal, found, projector)] = False
        return point, normal, found

    def _bulging(
        self, point: FloatArray, normal: FloatArray, found: NDArray[np.bool_], projector: Projector
    ) -> NDArray[np.int64]:
        """Numbers of found edges whose halves, or the edges from their middles across, would miss the surface by more.

        Where one of these ends on a crease its own middle is looked at: the surface may be folded there.
        """
        most = self.missed
        corners = self.faces[self.row]
        sides = [corners[:, [c, c - 1]] for c in range(3)]
        worst = np.max([_missed(self.vertices[side], self.normals[side]) for side in sides], axis=0)
        apex = corners[np.arange(len(corners)), (self.corner + 2) % 3]
        edge = np.concatenate([np.repeat(np.arange(len(most)), 2), self.number])
        other = np.concatenate([self.ends.ravel(), apex])
        limit = np.concatenate([np.repeat(_HALF * most, 2), worst])
        new = np.flatnonzero(found[edge])
        edge, other, limit = edge[new], other[new], limit[new]
        ends = np.stack([point[edge], self.vertices[other]], axis=1)
        missed = _missed(ends, np.stack([normal[edge], self.normals[other]], axis=1))
        on_crease = np.flatnonzero((self.normals[other] == 0).all(axis=1))
        missed[on_crease] = projector.misses(ends[on_crease].mean(axis=1))
        return edge[~(missed < limit)]


def _missed(ends: FloatArray, normals: FloatArray) -> FloatArray:
    """Sagittas (E,) of edges with ends and normals (E, 2, 3), zero where none of them is known."""
    one, other = np.abs(np.einsum("eij,ej->ie", normals, ends[:, 1] - ends[:, 0]))
    return np.asarray(np.maximum(one, other) / 4)
