"""Edges whose convexity changes, cut where the faces beside them are tangent.

Between the points of a B-rep's edge it runs on as cubics through points and tangents, and its normals as a spline;
edges of a mesh are straight there, and their normals linear.

Not promised: turns below 1 degree over a stretch shorter than a tenth of the distance between two points, with no point
in it. Places of cuts are as good as the splines: at 0.2 radians between points, turns of 20 degrees are good to 1e-3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cad_implicit.mesh import FloatArray

from .edges import TANGENT_DEGREES, Edge, turns, unit

#: Places between two points of an edge at which its turn is looked at.
_BETWEEN = 10
#: Halvings that find where it is 1 degree.
_HALVINGS = 50
#: Pieces shorter than this share of the edge are dropped.
_SHORTEST = 1e-6


class _Places(NamedTuple):
    """Points ``(N, 3)`` of an edge, unit tangents ``(N, 3)`` and normals ``(N, 2, 3)``."""

    points: FloatArray
    tangents: FloatArray
    normals: FloatArray


def pieces(edge: Edge) -> tuple[Edge, ...]:
    """Parts of an edge that are each convex or concave; those where the faces turn by less than 1 degree are left out.

    Parameters
    ----------
    edge : Edge
        One that is not convex, concave or mixed comes back as it is, and so does one that is nowhere tangent.

    Returns
    -------
    tuple of Edge
        In order along the edge, with its number, faces and chain. An end that is no vertex of the part is 0 in
        ``ends``. The piece around the vertex of a closed edge is the last.
    """
    if edge.convexity not in ("convex", "concave", "mixed"):
        return (edge,)
    course = _Course(edge)
    spans = list(_spans(course, edge.closed))
    if len(spans) == 1 and spans[0] == (0.0, course.last):
        return (edge,)
    shortest = _SHORTEST * course.last
    return tuple(_piece(edge, course, low, high) for low, high in spans if high - low > shortest)


class _Course:
    """An edge by a parameter that counts its points; a closed one can be gone around more than once."""

    def __init__(self, edge: Edge) -> None:
        self._edge = edge
        self._straight = edge.curve == "polyline" or len(edge.points) < 3
        self.last = float(len(edge.points) - 1)
        count = len(edge.points)
        if not self._straight:
            from scipy.interpolate import CubicSpline

            length = np.linalg.norm(np.diff(edge.points, axis=0), axis=1)
            self._length = np.concatenate([[0.0], np.cumsum(np.maximum(length, 1e-300))])
            self._normals = CubicSpline(self._length, edge.normals.reshape(count, 6))

    def at(self, where: FloatArray) -> _Places:
        """Places at parameters ``(N,)``."""
        edge, t = self._edge, np.asarray(where, np.float64)
        if edge.closed:
            t = np.where((t < 0) | (t > self.last), np.mod(t, self.last), t)
        start = np.clip(t.astype(np.int64), 0, len(edge.points) - 2)
        share = (t - start)[:, None]
        a, b = edge.points[start], edge.points[start + 1]
        if self._straight:
            tangents = edge.tangents[start] + share * (edge.tangents[start + 1] - edge.tangents[start])
            normals = edge.normals[start] + share[..., None] * (edge.normals[start + 1] - edge.normals[start])
            return _Places(a + share * (b - a), unit(tangents), unit(normals))
        chord = np.linalg.norm(b - a, axis=1, keepdims=True)
        # the arc is longer than its chord; for circles the cubic is best with this length of tangents
        cosine = (edge.tangents[start] * edge.tangents[start + 1]).sum(axis=1, keepdims=True)
        way = chord * 2 / (1 + np.sqrt(np.maximum((1 + cosine) / 2, 0.25)))
        first, second = way * edge.tangents[start], way * edge.tangents[start + 1]
        s, r = share, 1 - share
        points = a + s * s * (3 - 2 * s) * (b - a) + s * r * (r * first - s * second)
        slope = 6 * s * r * (b - a) + r * (1 - 3 * s) * first + s * (3 * s - 2) * second
        along = self._length[start] + share[:, 0] * (self._length[start + 1] - self._length[start])
        return _Places(points, unit(slope), unit(np.asarray(self._normals(along)).reshape(-1, 2, 3)))

    def turn(self, where: FloatArray) -> FloatArray:
        """Give turns ``(N,)`` over the edge in degrees at parameters ``(N,)``."""
        places = self.at(where)
        return turns(places.tangents, places.normals)


def _spans(course: _Course, closed: bool) -> Iterator[tuple[float, float]]:
    """Ranges of the parameter with one convexity; of a closed edge one may go on beyond its end."""
    t = np.linspace(0, course.last, int(course.last) * _BETWEEN + 1)
    turn = course.turn(t)
    kind = _kind(turn)
    changes = np.flatnonzero(kind[1:] != kind[:-1])
    if not len(changes):
        if kind[0]:
            yield 0.0, course.last
        return
    starts, ends = [], []
    for change in changes.tolist():
        low, high = t[change], t[change + 1]
        if kind[change]:
            ends.append(_cut(course, low, high, int(kind[change])))
        if kind[change + 1]:
            starts.append(_cut(course, high, low, int(kind[change + 1])))
    around = closed and kind[0] and kind[0] == kind[-1]
    if kind[-1]:
        ends.append(ends[0] + course.last if around else course.last)
    if kind[0]:
        starts = starts if around else [0.0, *starts]
        ends = ends[1:] if around else ends
    yield from zip(starts, ends, strict=True)


def _kind(turn: FloatArray) -> NDArray[np.int64]:
    """1 where convex, -1 where concave, 0 where tangent."""
    return np.asarray((turn > TANGENT_DEGREES).astype(np.int64) - (turn < -TANGENT_DEGREES), np.int64)


def _cut(course: _Course, inside: float, outside: float, kind: int) -> float:
    """Last parameter of a kind between one that has it and one that has not."""
    for _ in range(_HALVINGS):
        middle = (inside + outside) / 2
        if _kind(course.turn(np.array([middle])))[0] == kind:
            inside = middle
        else:
            outside = middle
    return float(inside)


def _piece(edge: Edge, course: _Course, low: float, high: float) -> Edge:
    """Part of an edge between two parameters."""
    inner = np.arange(np.floor(low) + 1, np.ceil(high))
    gap = 1e-6
    inner = inner[(inner > low + gap) & (inner < high - gap)]
    t = np.concatenate([[low], inner, [high]])
    if len(t) < 3:
        t = np.linspace(low, high, 3)
    places = course.at(t)
    fine = course.at(np.concatenate([np.linspace(a, b, _BETWEEN, endpoint=False) for a, b in _pairs(t)] + [t[-1:]]))
    lengths = np.linalg.norm(np.diff(fine.points, axis=0), axis=1)
    if edge.curve != "polyline":  # arcs are longer than their chords by a 24th of the square of their angle
        lengths *= 1 + (1 - (fine.tangents[1:] * fine.tangents[:-1]).sum(axis=1)) / 12
    middles = (fine.points[1:] + fine.points[:-1]) / 2
    turn = turns(places.tangents[1:-1], places.normals[1:-1])
    return replace(
        edge,
        convexity="convex" if float(turn.sum()) > 0 else "concave",
        closed=False,
        length=float(lengths.sum()),
        centre=np.average(middles, axis=0, weights=lengths),
        ends=(edge.ends[0] if low == 0 else 0, edge.ends[1] if high == course.last else 0),
        points=places.points,
        tangents=places.tangents,
        normals=places.normals,
    )


def _pairs(t: FloatArray) -> Iterator[tuple[float, float]]:
    return zip(t[:-1].tolist(), t[1:].tolist(), strict=True)
