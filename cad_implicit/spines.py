"""Spines: where the centre of a ball runs that rolls along an edge and touches the faces beside it.

The centre c of the ball for the point e of the edge, where the edge runs in direction t, solves::

    d1(c) = r,  d2(c) = r,  (c - e) . t = 0

with d1 and d2 the signed distances to the two faces, continued beyond their borders, positive on the ball's side. For
convex edges that is the side of the material, for concave ones the other; both are the same from here on. Newton's
method from small radii to the full one follows the right branch where there are several.

Not promised: edges whose faces turn by less than about a degree (c runs off to infinity).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .faces import FaceDistance
from .implicit import FloatArray

#: Radius (N,) in mm and its derivative, at positions (N,) along an edge in mm from its start.
Law = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

#: Steps by which the radius grows to its full size: crossing cylinders of like radii need more than two.
_GROWTH = (0.05, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0)
_NEWTON_ROUNDS = 30

#: A centre is found if both distances agree with the radius within this share of it.
_SOLVED = 1e-9

#: Step for the curvature of a guide, as a share of its length, and steps to find a position along it.
_BEND = 1e-4
_POSITION_ROUNDS = 20

#: Three planes meet in a point if their normals span at least this volume.
_REGULAR = 1e-3

#: Largest turn of contact directions between two samples, in radians, …
_TURN = 0.12

#: … and largest distance of the interpolated centre from the true one halfway, as a share of the radius.
_OFF = 2e-6
_REFINEMENTS = 10


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
        step = _BEND * self.length
        for _ in range(_POSITION_ROUNDS):
            place, direction = self.place(at)
            bend = (self.place(at + step)[1] - self.place(at - step)[1]) / (2 * step)
            away = points - place
            move = (away * direction).sum(axis=1) / np.maximum(1 - (away * bend).sum(axis=1), 0.2)
            at = at + move
            if float(np.abs(move).max(initial=0.0)) < _SOLVED * self.length:
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


@dataclass(frozen=True, eq=False)
class Spine:
    """Centres of a ball along a guide.

    Attributes
    ----------
    at : (N,) float64
        Positions along the guide in mm, ascending.
    edge : (N, 3) float64
        Points of the guide.
    centres, tangents : (N, 3) float64
        Centres of the ball, and unit directions in which it moves.
    radius, slope : (N,) float64
        Its radius, and by how much that grows per mm of the centre's way.
    contacts : (N, 2, 3) float64
        Outward unit normals of the faces where it touches them.
    solved : (N,) bool
        Whether there is such a ball.
    closed : bool
        Whether the last sample is the first one again.
    reaches : (N, 2, 3) float64
        From the centres to where the faces are touched.
    ball : bool
        False for a chamfer: then the centres are the points of the edge.
    """

    at: FloatArray
    edge: FloatArray
    centres: FloatArray
    tangents: FloatArray
    radius: FloatArray
    slope: FloatArray
    contacts: FloatArray
    solved: NDArray[np.bool_]
    closed: bool
    reaches: FloatArray
    ball: bool = True

    def touching(self) -> FloatArray:
        """Points (N, 2, 3) where the faces are touched."""
        return np.asarray(self.centres[:, None] + self.reaches)

    def part(self, which: slice | NDArray[np.intp] | NDArray[np.bool_]) -> Spine:
        """Give some of the samples."""
        return Spine(
            self.at[which], self.edge[which], self.centres[which], self.tangents[which], self.radius[which],
            self.slope[which], self.contacts[which], self.solved[which], self.closed, self.reaches[which], self.ball,
        )  # fmt: skip

    @property
    def length(self) -> float:
        """Of the centre's way, in mm."""
        return float(np.linalg.norm(np.diff(self.centres, axis=0), axis=1).sum())


def spine(guide: Guide, supports: Sequence[Support], law: Law, at: FloatArray) -> Spine:
    """Centres of a ball, at given positions along a guide and as many between as make them a smooth curve.

    Parameters
    ----------
    guide : Guide
    supports : two Supports
        The faces beside it.
    law : Law
    at : (N,) float64
        Positions in mm, ascending.
    """
    found = _samples(guide, supports, law, at)
    for _ in range(_REFINEMENTS):
        middle = (found.at[:-1] + found.at[1:]) / 2
        guess = halfway(found)
        doubtful = np.flatnonzero(found.solved[:-1] & found.solved[1:] & (np.diff(found.at) > 1e-9 * guide.length))
        if len(doubtful) == 0:
            break
        true = _samples(guide, supports, law, middle[doubtful], guess[doubtful])
        off = np.linalg.norm(_beside(true.centres - guess[doubtful], true.tangents), axis=1)
        turned = (found.contacts[doubtful] * found.contacts[doubtful + 1]).sum(axis=2).min(axis=1)
        rough = true.solved & ((off > _OFF * true.radius) | (turned < np.cos(_TURN)))
        if not rough.any():
            break
        found = _merged(found, true.part(rough))
    return found


def halfway(found: Spine) -> FloatArray:
    """Centres (N - 1, 3) halfway between neighbouring samples, by interpolation."""
    p, q = found.centres[:-1], found.centres[1:]
    length = speed(p, q, found.tangents[:-1], found.tangents[1:])[:, None]
    half = np.full((len(p), 1), 0.5)
    return hermite(p, q, length * found.tangents[:-1], length * found.tangents[1:], half)


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


def _samples(
    guide: Guide, supports: Sequence[Support], law: Law, at: FloatArray, guess: FloatArray | None = None
) -> Spine:
    edge, along = guide.place(at)
    step = _BEND * guide.length
    bend = (guide.place(at + step)[1] - guide.place(at - step)[1]) / (2 * step)
    radius, growth = law(at)
    centres = edge.copy() if guess is None else guess.copy()
    solved = np.zeros(len(at), np.bool_)
    if guess is not None:
        solved = newton(centres, supports, radius, edge, along)
    again = np.flatnonzero(~solved)
    if len(again):
        centres[again], solved[again] = _grown(edge[again], along[again], supports, radius[again])
    gradients = np.stack([support(centres)[1] for support in supports], axis=1)
    rows = np.concatenate([gradients, along[:, None]], axis=1)
    right = np.stack([growth, growth, 1 - ((centres - edge) * bend).sum(axis=1)], axis=1)
    way = np.cross(gradients[:, 0], gradients[:, 1])
    way *= np.where((way * along).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    varying = solved & (growth != 0) & (np.abs(np.linalg.det(rows)) > 1e-6)
    if varying.any():
        way[varying] = np.linalg.solve(rows[varying], right[varying][:, :, None])[:, :, 0]
    length = np.linalg.norm(way, axis=1)
    safe = np.where(length > 0, length, 1.0)
    tangents = np.where(length[:, None] > 1e-6, way / safe[:, None], along)
    slope = np.where(varying, growth / safe, 0.0)
    reaches = -radius[:, None, None] * gradients
    return Spine(at, edge, centres, tangents, radius, slope, -gradients, solved, guide.closed, reaches)


def _grown(
    edge: FloatArray, along: FloatArray, supports: Sequence[Support], radius: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Centres (N, 3) of balls that grow from the edge to their full radius; which (N,) got there."""
    before, now = edge, _first_guess(edge, supports, _GROWTH[0] * radius)
    done, solved = 0.0, newton(now, supports, _GROWTH[0] * radius, edge, along)
    for last, share in pairwise(_GROWTH):
        ahead = now + (now - before) * (share - last) / (last - done)
        before, now, done = now, ahead, last
        solved = newton(now, supports, share * radius, edge, along)
    return now, solved


def _first_guess(edge: FloatArray, supports: Sequence[Support], radius: FloatArray) -> FloatArray:
    """Centres of small balls: as between planes."""
    g, k = (support(edge)[1] for support in supports)
    return np.asarray(edge + (radius / np.maximum(1 + (g * k).sum(axis=1), 0.02))[:, None] * (g + k))


def newton(
    x: FloatArray, supports: Sequence[Support], radius: FloatArray, edge: FloatArray, along: FloatArray
) -> NDArray[np.bool_]:
    """Move points (N, 3) to the centres of balls, in place; tell which (N,) are found."""
    solved = np.zeros(len(x), np.bool_)
    pending = np.arange(len(x))
    for _ in range(_NEWTON_ROUNDS):
        if len(pending) == 0:
            break
        y, r = x[pending], radius[pending]
        (a, g), (b, k) = supports[0](y), supports[1](y)
        miss = np.stack([r - a, r - b, ((edge[pending] - y) * along[pending]).sum(axis=1)], axis=1)
        good = np.abs(miss).max(axis=1) <= _SOLVED * r
        solved[pending[good]] = True
        rows = np.stack([g, k, along[pending]], axis=1)
        regular = ~good & (np.abs(np.linalg.det(rows)) > 1e-8)
        pending, rows, miss, r = pending[regular], rows[regular], miss[regular], r[regular]
        move = np.linalg.solve(rows, miss[:, :, None])[:, :, 0]
        length = np.linalg.norm(move, axis=1)
        x[pending] += move * np.minimum(1.0, 0.7 * r / np.where(length > 0, length, 1.0))[:, None]
    return solved


def _beside(vectors: FloatArray, directions: FloatArray) -> FloatArray:
    """Parts (N, 3) of vectors across unit directions."""
    return np.asarray(vectors - (vectors * directions).sum(axis=1)[:, None] * directions)


def _merged(first: Spine, second: Spine) -> Spine:
    order = np.argsort(np.concatenate([first.at, second.at]), kind="stable")

    def both(a: FloatArray, b: FloatArray) -> FloatArray:
        return np.asarray(np.concatenate([a, b])[order])

    return Spine(
        both(first.at, second.at), both(first.edge, second.edge), both(first.centres, second.centres),
        both(first.tangents, second.tangents), both(first.radius, second.radius), both(first.slope, second.slope),
        both(first.contacts, second.contacts), np.concatenate([first.solved, second.solved])[order], first.closed,
        both(first.reaches, second.reaches), first.ball,
    )  # fmt: skip


def _arc_lengths(points: FloatArray, tangents: FloatArray) -> FloatArray:
    """Lengths (N - 1,) of the pieces between points (N, 3) of a curve with its unit directions (N, 3)."""
    chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
    half = np.arccos(np.clip((tangents[:-1] * tangents[1:]).sum(axis=1), -1.0, 1.0)) / 2
    return np.asarray(chord / np.sinc(half / np.pi))
