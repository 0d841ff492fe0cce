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
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .guides import BEND, Guide, Support, hermite, speed
from .implicit import FloatArray

#: Radius (N,) in mm and its derivative, at positions (N,) along an edge in mm from its start.
Law = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

#: Steps by which the radius grows to its full size: crossing cylinders of like radii need more than two.
_GROWTH = (0.05, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0)
_NEWTON_ROUNDS = 30

#: A centre is found if both distances agree with the radius within this share of it.
_SOLVED = 1e-9

#: Largest turn of contact directions between two samples, in radians, …
_TURN = 0.12

#: … and largest distance of the interpolated centre from the true one halfway, as a share of the radius.
_OFF = 2e-6
_REFINEMENTS = 10


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


def _samples(
    guide: Guide, supports: Sequence[Support], law: Law, at: FloatArray, guess: FloatArray | None = None
) -> Spine:
    edge, along = guide.place(at)
    step = BEND * guide.length
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
