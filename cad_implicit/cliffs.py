"""Cliffs: where a face is narrower than a blend, the ball rolls on the face's border instead.

Beyond a sharp border that runs along the edge, the distance to the face is that to the border. The distance is as
smooth there as that to the face itself is: its gradient has no jump.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from .cad.edges import Edge
from .faces import FaceDistance
from .guides import Guide
from .implicit import FloatArray

#: Points along borders are this share of the radius apart.
_STEP = 0.05
_MOST = 2000

#: Feet are beyond a border only if that is nearer to them than so many times the edge: both are equally near where the
#: edge touches the border, as that of a boss tangent to a wall.
_NEARER = 1.2

#: Borders that run more across the edge than this cosine end it: the ball rolls past them.
_ALONG = 0.5

#: Borders farther from the edge than so many radii do not matter.
_FAR = 4.0


class Cliff(FaceDistance):
    """Signed distance to a face that ends at some of its borders.

    Parameters
    ----------
    face : FaceDistance
    borders : sequence of (Guide, FloatArray)
        Lines where it ends, and at their samples the unit directions (P, 3) that lead away from the face in its tangent
        plane.
    marks : sequence of (K, 3) float64
        Points along each border where it counts.
    edge : (K, 3) float64
        Points along the edge that is blended: what is nearer to it than to a border is not beyond that.
    """

    kind = "cliff"

    def __init__(
        self,
        face: FaceDistance,
        borders: Sequence[tuple[Guide, FloatArray]],
        marks: Sequence[FloatArray],
        edge: FloatArray,
    ) -> None:
        self._face, self._borders = face, tuple(borders)
        self._tree, self._edge = cKDTree(np.concatenate(marks)), cKDTree(edge)
        self._which = np.repeat(np.arange(len(marks)), [len(own) for own in marks])

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Signed distances (N,) and gradients (N, 3)."""
        x = np.asarray(points, np.float64)
        value, gradient = (array.copy() for array in self._face.value_and_gradient(x))
        nearest, beyond = self.border(x - value[:, None] * gradient)
        which = np.flatnonzero(beyond)
        away = x[which] - nearest[which]
        length = np.linalg.norm(away, axis=1)
        side = np.sign(value[which])
        value[which] = side * length
        gradient[which] = side[:, None] * away / np.where(length > 0, length, 1.0)[:, None]
        return value, gradient

    def border(self, feet: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Nearest points (N, 3) of the borders to points of the face, continued, and which (N,) of those are beyond."""
        far, sample = self._tree.query(feet)
        nearer = far < _NEARER * self._edge.query(feet)[0]
        start, which = self._tree.data[sample], self._which[sample]
        nearest, beyond = np.zeros_like(feet), np.zeros(len(feet), np.bool_)
        for number, (guide, outward) in enumerate(self._borders):
            own = np.flatnonzero(which == number)
            if len(own) == 0:
                continue
            at = guide.position(start[own])
            for _ in range(4):
                place, direction = guide.place(at)
                at = np.clip(at + ((feet[own] - place) * direction).sum(axis=1), guide.at[0], guide.at[-1])
            place, direction = guide.place(at)
            away = feet[own] - place
            out = np.stack([np.interp(at, guide.at, outward[:, k]) for k in range(3)], axis=1)
            across = (away * out).sum(axis=1)
            nearest[own] = place
            beyond[own] = nearer[own] & (across > 0) & (across > 0.9 * np.linalg.norm(away, axis=1))
        return nearest, beyond


def cliff(
    face: FaceDistance, members: Iterable[int], guide: Guide, edges: Sequence[Edge], barred: set[int], radius: float
) -> Cliff | None:
    """Face that ends at its sharp borders along a guide; None if it has none nearby.

    Parameters
    ----------
    face : FaceDistance
        Beside the guide.
    members : iterable of int
        Numbers of the part's faces that it consists of.
    guide : Guide
        The edge to be blended.
    edges : sequence of Edge
        All of the part's.
    barred : set of int
        Numbers of edges that are no such borders: the blended ones, and those at their ends.
    radius : float
        In mm.
    """
    own = set(members)
    found, marks = [], []
    count = int(np.clip(np.ceil(guide.length / (_STEP * radius)), 2, _MOST))
    line = guide.place(np.linspace(0, guide.length, count))[0]
    tree = cKDTree(line)
    for edge in edges:
        sides = [side for side, number in enumerate(edge.faces[:2]) if number in own]
        if edge.number in barred or edge.convexity not in ("convex", "concave", "mixed") or len(sides) != 1:
            continue
        if float(tree.query(edge.points)[0].min()) > _FAR * radius + edge.length:
            continue
        border = Guide.along(edge.points, edge.tangents, edge.closed)
        at = np.linspace(0, border.length, int(np.clip(np.ceil(border.length / (_STEP * radius)), 2, _MOST)))
        place, direction = border.place(at)
        near = guide.position(place)
        along = np.abs((guide.place(near)[1] * direction).sum(axis=1)) > _ALONG
        inside = along & (near >= 0) & (near <= guide.length) if not guide.closed else along
        close = np.linalg.norm(guide.place(near)[0] - place, axis=1) < _FAR * radius
        if (inside & close).any():
            out = np.cross(edge.tangents, edge.normals[:, sides[0]]) * (1.0 if sides[0] == 0 else -1.0)
            found.append((border, out))
            marks.append(place[inside & close])
    return Cliff(face, found, marks, line) if found else None
