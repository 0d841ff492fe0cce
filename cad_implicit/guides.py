"""Guides: lines along which a ball is rolled, and the faces that it touches on the way.

A guide is an edge, or a chain of them, as cubic pieces between samples with their directions, and is continued
where the faces beside it, continued too, meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .faces import FaceDistance
from .implicit import FloatArray

#: A position along a guide is found if the last step to it is less than this share of the length.
_FOUND = 1e-9

#: Step for the curvature of a guide, as a share of its length, and steps to find a position along it.
BEND = 1e-4
_POSITION_ROUNDS = 20

#: Three planes meet in a point if their normals span at least this volume.
_REGULAR = 1e-3

#: A guide goes straight on if that is off both faces by less than this share of the step, and as little turned: what
#: spines leave is 2e-6 of the radius.
_STRAIGHT = 1e-9


@dataclass(frozen=True, eq=False)
class Support:
    """A face that a ball touches, seen from the ball's side.

    Attributes
    ----------
    face : FaceDistance
    sign : float
        1 for convex edges, -1 for concave ones.
    height : float
        What is added to the distance, in mm.
    """

    face: FaceDistance
    sign: float
    height: float = 0.0

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances (N,) and gradients (N, 3), positive where the ball is."""
        value, gradient = self.face.value_and_gradient(points)
        return self.sign * value + self.height, self.sign * gradient

    def raised(self, by: float) -> Support:
        """Give the same face with ``by`` mm added to the distance."""
        return replace(self, height=self.height + by)


@dataclass(frozen=True, eq=False)
class Guide:
    """The line along which a ball is rolled: an edge or a chain of edges, and its continuation.

    Attributes
    ----------
    at : (N,) float64
        Position along it in mm, ascending; the edge itself starts at 0.
    points, tangents : (N, 3) float64
        Points in mm and unit directions there.
    length : float
        Of the edge itself, in mm.
    closed : bool
        Whether the last point is the first one again.
    """

    at: FloatArray
    points: FloatArray
    tangents: FloatArray
    length: float
    closed: bool

    @classmethod
    def along(cls, points: FloatArray, tangents: FloatArray, closed: bool) -> Guide:
        """Guide along a polyline (N, 3) with its unit directions (N, 3)."""
        at = np.concatenate([[0.0], np.cumsum(_arc_lengths(points, tangents))])
        return cls(at, points, tangents, float(at[-1]), closed)

    def place(self, at: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points and unit directions (N, 3) at positions (N,); straight on beyond the ends."""
        if self.closed:
            at = np.mod(at, self.length)
        inside = np.clip(at, self.at[0], self.at[-1])
        segment = np.clip(np.searchsorted(self.at, inside, side="right") - 1, 0, len(self.at) - 2)
        span = self.at[segment + 1] - self.at[segment]
        t = ((inside - self.at[segment]) / span)[:, None]
        p, q = self.points[segment], self.points[segment + 1]
        v, w = self.tangents[segment] * span[:, None], self.tangents[segment + 1] * span[:, None]
        place = hermite(p, q, v, w, t)
        direction = hermite_slope(p, q, v, w, t)
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        return place + (at - inside)[:, None] * direction, direction

    def position(self, points: FloatArray, low: float = -np.inf, high: float = np.inf) -> FloatArray:
        """Positions (N,) of the normal planes of the guide that hold points (N, 3), those nearest to them.

        The search starts between the positions ``low`` and ``high``.
        """
        fine = np.linspace(max(low, self.at[0]), min(high, self.at[-1]), 8 * len(self.at) + 1)
        place, direction = self.place(fine)
        near = np.linalg.norm(points[:, None] - place, axis=2).argmin(axis=1)
        at = fine[near]
        step = BEND * self.length
        for _ in range(_POSITION_ROUNDS):
            place, direction = self.place(at)
            bend = (self.place(at + step)[1] - self.place(at - step)[1]) / (2 * step)
            away = points - place
            move = (away * direction).sum(axis=1) / np.maximum(1 - (away * bend).sum(axis=1), 0.2)
            at = at + move
            if float(np.abs(move).max(initial=0.0)) < _FOUND * self.length:
                break
        return np.asarray(at)


def extended(guide: Guide, supports: Sequence[Support], before: float, after: float, step: float) -> Guide:
    """Guide continued along the line where its faces, continued too, meet; straight on where they do not.

    Parameters
    ----------
    guide : Guide
        Not closed.
    supports : two Supports
    before, after : float
        By how much, in mm.
    step : float
        Distance between the new points in mm.
    """
    head = _continued(guide.points[0], -guide.tangents[0], supports, before, step)
    tail = _continued(guide.points[-1], guide.tangents[-1], supports, after, step)
    points = np.concatenate([head[0][::-1], guide.points, tail[0]])
    tangents = np.concatenate([-head[1][::-1], guide.tangents, tail[1]])
    at = np.concatenate([[0.0], np.cumsum(_arc_lengths(points, tangents))])
    return Guide(at - at[len(head[0])], points, tangents, guide.length, False)


def _continued(
    point: FloatArray, direction: FloatArray, supports: Sequence[Support], by: float, step: float
) -> tuple[FloatArray, FloatArray]:
    """Points (N, 3) of the line where two faces meet, beyond a point, and the directions (N, 3) there."""
    count = int(np.ceil(by / step)) if by > 0 else 0
    straight = point + step * np.arange(1, count + 1)[:, None] * direction
    if count and _on_both(straight, direction, supports, step):
        return straight, np.repeat(direction[None], count, axis=0)
    points, directions = np.zeros((count, 3)), np.zeros((count, 3))
    x, ahead = point, direction
    for number in range(count):
        guess = x + step * ahead
        found, turned = onto_line(guess, ahead, supports, step)
        if found is None or turned is None:
            found, turned = guess, ahead
        points[number], directions[number] = found, turned
        x, ahead = found, turned
    return points, directions


def _on_both(points: FloatArray, direction: FloatArray, supports: Sequence[Support], step: float) -> bool:
    """Whether points (N, 3) of a straight line lie on two faces that meet along it, as planes do."""
    (a, g), (b, k) = (support(points) for support in supports)
    line = np.cross(g, k)
    length = np.linalg.norm(line, axis=1)
    off = max(float(np.abs(a).max()), float(np.abs(b).max()))
    aside = float(np.linalg.norm(np.cross(line, direction), axis=1).max())
    return off < _STRAIGHT * step and float(length.min()) > _REGULAR and aside < _STRAIGHT * float(length.min())


def onto_line(
    x: FloatArray, ahead: FloatArray, supports: Sequence[Support], reach: float
) -> tuple[FloatArray | None, FloatArray | None]:
    """Give the point where two faces meet in the plane through a point, and the line's direction; None if not near."""
    start = x
    for _ in range(12):
        (a, b), (g, k) = zip(*((value[0], slope[0]) for value, slope in (s(x[None]) for s in supports)), strict=True)
        rows = np.array([g, k, ahead])
        if abs(float(np.linalg.det(rows))) < _REGULAR:
            return None, None
        move = np.linalg.solve(rows, np.array([-a, -b, (start - x) @ ahead]))
        x = x + move
        if float(np.linalg.norm(x - start)) > reach:
            return None, None
        if float(np.abs(move).max()) < 1e-12 * (1 + reach):
            break
    line = np.cross(g, k)
    line /= np.linalg.norm(line)
    line *= np.sign(line @ ahead)
    return (x, line) if float(line @ ahead) > 0.5 else (None, None)


def speed(p: FloatArray, q: FloatArray, t: FloatArray, u: FloatArray) -> FloatArray:
    """Length (N,) of the end tangents of cubic pieces between points (N, 3) with unit directions (N, 3).

    That of the cubic nearest to an arc: its error grows with the sixth power of the turn.
    """
    cosine = np.clip((t * u).sum(axis=1), -1.0, 1.0)
    return np.asarray(np.linalg.norm(q - p, axis=1) * 2 / (1 + np.cos(np.arccos(cosine) / 2)))


def hermite(p: FloatArray, q: FloatArray, v: FloatArray, w: FloatArray, t: FloatArray) -> FloatArray:
    """Points of cubic pieces from p to q with derivatives v and w there, at parameters t from 0 to 1."""
    s = 1 - t
    return np.asarray(s * s * (1 + 2 * t) * p + t * t * (1 + 2 * s) * q + t * s * (s * v - t * w))


def hermite_slope(p: FloatArray, q: FloatArray, v: FloatArray, w: FloatArray, t: FloatArray) -> FloatArray:
    """Give derivatives of the cubic pieces of :func:`hermite`."""
    s = 1 - t
    return np.asarray(6 * t * s * (q - p) + s * (1 - 3 * t) * v + t * (1 - 3 * s) * w)


def _arc_lengths(points: FloatArray, tangents: FloatArray) -> FloatArray:
    """Lengths (N - 1,) of the pieces between points (N, 3) of a curve with its unit directions (N, 3)."""
    chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
    half = np.arccos(np.clip((tangents[:-1] * tangents[1:]).sum(axis=1), -1.0, 1.0)) / 2
    return np.asarray(chord / np.sinc(half / np.pi))
