"""Surfaces of blends in the terms of CAD: planes, cylinders, cones, tori, spheres, or grids of points for splines.

A local blend is made of strips along edges and of corners; each is told here as a surface with the curves at which it
begins: where its ball touches the faces, and where it ends at a corner.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .blend_curves import Arc, Curve, Rim, Segment
from .guides import hermite
from .implicit import FloatArray
from .primitives import ALIKE, Primitive, circle_through, cone_between, line_through, plane_between
from .strips import Strip

#: A ball that moves by less than this share of its radius stands still, as in the end of a slot.
_STILL = 1e-3

#: Spines are lines and circles only if their directions are within so many radians of those.
_TURN = 1e-3

#: Points between two ways that tell a primitive; stretches shorter than so many radii are like those before them; and
#: strips of more stretches than this stay in one.
_FEW = 9
_SHORTEST = 1e-4
_PIECES = 40

#: Spines of many curves are arcs of a circle from one sample to the next, of another one each time; those samples turn
#: by up to 0.12 radians. Such arcs are no tori.
_ARC = 0.13

#: Points of a rim that tell the nearest place: so far apart in radii, and no more than these.
_FINE = 0.05
_MOST = 4000

#: Grids have so many points across: an arc of a right angle is a polynomial of one degree less within 1e-8 radii.
_ACROSS = 9

#: Angle in radians by which a rim turns in a piece of a grid at most: a cubic misses an arc by 3e-8 radii then.
_PIECE = 0.06

#: Grids go on beyond the rims by this share of their width, so that edges lie inside.
_BEYOND = 0.04


class BlendSurface(Protocol):
    """One surface of a blend.

    Attributes
    ----------
    box : (2, 3) float64
        Holds what of it is seen.
    curves : list of Curve
        At which it begins.
    closed : bool
        Whether it goes around.
    """

    box: FloatArray
    curves: list[Curve]
    closed: bool

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances (N,) of points (N, 3) outside the ball, and their gradients (N, 3)."""

    def beyond(self, points: FloatArray) -> FloatArray:
        """How far (N,) points near the surface are beyond its borders in mm, negative within them."""

    def primitive(self) -> Primitive | None:
        """Its surface in closed form; None if it has none."""


class StripSurface:
    """The surface of a strip: of the ball that rolls, or of the chamfer.

    Attributes
    ----------
    ways : (N,) float64
        Ways in mm along the spine of its samples.
    length : float
        Of the spine.
    radius : float
        The largest.
    """

    def __init__(self, strip: Strip) -> None:
        self.strip, self.spine = strip, strip.spine
        self.closed = self.spine.closed
        self.ways = strip.way(self.spine.at)
        self.length = float(self.ways[-1])
        self.box = strip.box
        self._known: dict[tuple[float, float], Primitive | None] = {}
        self._reaches = self.spine.reaches
        self.radius = float(self.spine.radius.max())
        self.curves: list[Curve] = [Rim(self, 0.0), Rim(self, 1.0)]
        if self.spine.ball and not self.closed:
            for end in (0, -1):
                reaches = self._reaches[end]
                if np.linalg.norm(np.cross(*reaches)) > 1e-9 * self.radius**2:
                    self.curves.append(Arc(self.spine.centres[end], reaches[0], reaches[1]))

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self.spine.ball:
            value, gradient, _ = self.strip.from_ball(points)
            return value, gradient
        return self.strip.value_and_gradient(points)

    def section(self, way: float) -> Curve:
        """Where the surface is cut across at a way."""
        if not self.spine.ball:
            return Segment(*self.place(np.array([way, way]), np.array([0.0, 1.0])))
        centre = self._centres(np.array([way]))[0]
        rims = self.place(np.array([way, way]), np.array([0.0, 1.0])) - centre
        return Arc(centre, rims[0], rims[1])

    def beyond(self, points: FloatArray) -> FloatArray:
        far = np.full(len(points), -np.inf)
        if self.spine.ball:
            far = -self.strip.from_ball(points)[2].min(axis=1)
        if not self.closed:
            way = self.strip.evaluate(points)[2]
            far = np.maximum(far, np.maximum(-way, way - self.length))
        return far

    def fine_ways(self) -> FloatArray:
        """Ways along the spine near enough to each other to tell the nearest one."""
        count = int(np.clip(np.ceil(self.length / (_FINE * self.radius)), 16, _MOST))
        return np.unique(np.concatenate([np.linspace(0, self.length, count), self.ways]))

    def place(self, ways: FloatArray, shares: FloatArray) -> FloatArray:
        """Points (N, 3) at ways (N,) along the spine and shares (N,) of the arc from the one rim to the other."""
        piece, span, t = self._parts(ways)
        centre, spine = self._centres(ways), self.spine
        first, last = ((1 - t) * self._reaches[piece, i] + t * self._reaches[piece + 1, i] for i in (0, 1))
        sizes = np.linalg.norm(self._reaches, axis=2)
        if not spine.ball:
            for side, own in enumerate((first, last)):
                size = (1 - t[:, 0]) * sizes[piece, side] + t[:, 0] * sizes[piece + 1, side]
                own *= (size / np.linalg.norm(own, axis=1))[:, None]
            return np.asarray(centre + (1 - shares[:, None]) * first + shares[:, None] * last)
        slopes = [(span * spine.slope[piece + i])[:, None] for i in (0, 1)]
        radius = hermite(spine.radius[piece][:, None], spine.radius[piece + 1][:, None], slopes[0], slopes[1], t)
        return np.asarray(centre + radius * _turned(first, last, shares))

    def primitive(self) -> Primitive | None:
        return self.primitive_between(0.0, self.length)

    def primitive_between(self, start: float, end: float) -> Primitive | None:
        """Surface in closed form from one way to another; None if it has none."""
        if (start, end) not in self._known:
            self._known[start, end] = self._told(start, end)
        return self._known[start, end]

    def _told(self, start: float, end: float) -> Primitive | None:
        fine = self.fine_ways()
        ways = np.concatenate([fine[(fine > start) & (fine < end)], np.linspace(start, end, _FEW)])
        if not self.spine.ball:
            low, high = (self.place(ways, np.full(len(ways), share)) for share in (0.0, 1.0))
            return plane_between(low, high, self.radius) or cone_between(low, high, self.radius)
        if float(np.ptp(self.spine.radius)) > ALIKE * self.radius:
            return None
        centres = self._centres(ways)
        tangents = self.spine.tangents[(self.ways >= start) & (self.ways <= end)]
        line = line_through(centres, self.radius)
        if line is not None and float(np.linalg.norm(np.cross(tangents, line), axis=1).max(initial=0.0)) < _TURN:
            return Primitive("cylinder", centres.mean(axis=0), line, self.radius)
        spread = float(np.linalg.norm(centres - centres.mean(axis=0), axis=1).max())
        if spread < _STILL * self.radius:
            return Primitive("sphere", centres.mean(axis=0), self.spine.tangents[0], self.radius)
        circle = circle_through(centres, self.radius)
        if circle is None or float(np.abs(tangents @ circle[1]).max(initial=0.0)) > _TURN:
            return None
        ends = self._centres(np.array([start, end])) - circle[0]
        turned = (ends * tangents[[0, -1]]).sum(axis=1) if len(tangents) else np.zeros(2)
        if float(np.abs(turned).max()) > _TURN * circle[2]:
            return None
        return Primitive("torus", circle[0], circle[1], self.radius, circle[2])

    def pieces(self) -> list[StripSurface | StripPiece]:
        """Give the strip, or stretches of it that each are one primitive, and what is between these."""
        if self.primitive() is not None:
            return [self]
        cuts: list[float] = [0.0]
        known: list[bool] = []
        for low, high in pairwise(self.ways.tolist()):
            if high - low < _SHORTEST * self.radius:
                good = bool(known) and known[-1]
            else:
                good = self.primitive_between(low, high) is not None
            joined = known and good == known[-1]
            if joined and good:
                joined = self.primitive_between(cuts[-2], high) is not None
            if joined:
                cuts[-1] = high
            else:
                cuts.append(high)
                known.append(good)
        cuts, free = self._without_short_arcs(cuts, known)
        if len(cuts) == 2 or len(cuts) > _PIECES + 1 or (self.closed and free):
            return [self]
        return [StripPiece(self, low, high) for low, high in pairwise(cuts)]

    def _without_short_arcs(self, cuts: list[float], known: list[bool]) -> tuple[list[float], bool]:
        """Cuts between stretches, short arcs of other circles one after another joined; and whether any has no name."""
        short = []
        for (low, high), good in zip(pairwise(cuts), known, strict=True):
            primitive = self.primitive_between(low, high) if good else None
            arc = primitive is not None and primitive.kind == "torus"
            short.append(arc and high - low < _ARC * primitive.ring)  # type: ignore[union-attr]
        beside = [b and (a or c) for a, b, c in zip([False, *short], short, [*short[1:], False], strict=False)]
        free = [one or not good for one, good in zip(beside, known, strict=True)]
        inner = [cut for cut, a, b in zip(cuts[1:-1], free, free[1:], strict=False) if not (a and b)]
        return [cuts[0], *inner, cuts[-1]], any(free)

    def _parts(self, ways: FloatArray) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """Pieces (N,) of the spine at ways along it, their lengths, and how far along them (N, 1) from 0 to 1."""
        x = np.mod(ways, self.length) if self.closed else np.asarray(ways)
        piece = np.clip(np.searchsorted(self.ways, x, side="right") - 1, 0, len(self.ways) - 2)
        span = self.ways[piece + 1] - self.ways[piece]
        return piece, span, ((x - self.ways[piece]) / np.where(span > 0, span, 1.0))[:, None]

    def _centres(self, ways: FloatArray) -> FloatArray:
        piece, span, t = self._parts(ways)
        spine = self.spine
        v, w = (span[:, None] * spine.tangents[piece + i] for i in (0, 1))
        return hermite(spine.centres[piece], spine.centres[piece + 1], v, w, t)

    def grid(self, low: float, high: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Ways (M,) from one to another and a little beyond, points (M, K, 3) of the surface there, and poles between.

        These (M - 1, 2, K, 3) are the inner control points of cubics from each way to the next through two more points.
        The points lie at the shares that :func:`across` gives.
        """
        width = high - low
        if self.closed:
            low, high = low - _BEYOND * width, high + _BEYOND * width
            turns = [self.ways[:-1] + k * self.length for k in range(-1, 3)]
            inner = np.concatenate(turns)
        else:
            low, high = max(low - _BEYOND * width, 0.0), min(high + _BEYOND * width, self.length)
            inner = self.ways
        inner = inner[(inner > low + 1e-3 * width) & (inner < high - 1e-3 * width)]
        ways = self._finer(np.concatenate([[low], inner, [high]]))
        shares = across()
        each, share = (a.ravel() for a in np.meshgrid(ways, shares, indexing="ij"))
        # spans are told from their insides: where the spine bends anew, slopes before and after differ
        span = np.diff(ways)[:, None]
        inner = np.repeat(shares[None], len(span), axis=0)
        size = (len(ways), len(shares), 3)
        found = self.place(each, share).reshape(size)
        thirds = []
        for part in (1 / 3, 2 / 3):
            at = np.broadcast_to(ways[:-1, None] + part * span, inner.shape)
            thirds.append(self.place(at.ravel(), inner.ravel()).reshape(len(span), len(shares), 3))
        low_third, high_third = thirds
        first, last = found[:-1], found[1:]
        start = (-11 * first + 18 * low_third - 9 * high_third + 2 * last) / 2
        end = (-2 * first + 9 * low_third - 18 * high_third + 11 * last) / 2
        return ways, found, np.stack([first + start / 3, last - end / 3], axis=1)

    def _finer(self, ways: FloatArray) -> FloatArray:
        """Ways with others between, so that neither rim turns by more than an angle in a piece of the grid."""
        counts = np.ones(len(ways) - 1, np.int64)
        step = 1e-4 * (ways[1:] - ways[:-1])
        for share in (0.0, 1.0):
            shares = np.full(len(step), share)
            starts = self.place(ways[:-1] + step, shares) - self.place(ways[:-1], shares)
            ends = self.place(ways[1:], shares) - self.place(ways[1:] - step, shares)
            sizes = np.maximum(np.linalg.norm(starts, axis=1) * np.linalg.norm(ends, axis=1), 1e-300)
            turn = np.arccos(np.clip((starts * ends).sum(axis=1) / sizes, -1.0, 1.0))
            counts = np.maximum(counts, np.ceil(turn / _PIECE).astype(np.int64))
        pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ways, ways[1:], counts, strict=False)]
        return np.concatenate([*pieces, ways[-1:]])


class StripPiece:
    """A stretch of the surface of a strip."""

    closed = False

    def __init__(self, whole: StripSurface, low: float, high: float) -> None:
        self.whole, self.low, self.high = whole, low, high
        self.length = high - low
        self.box = whole.box
        self.curves: list[Curve] = [*whole.curves[:2], *(whole.section(way) for way in (low, high))]

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self.whole.value_and_gradient(points)

    def beyond(self, points: FloatArray) -> FloatArray:
        way = self.whole.strip.evaluate(points)[2]
        return np.maximum(self.whole.beyond(points), np.maximum(self.low - way, way - self.high))

    def primitive(self) -> Primitive | None:
        return self.whole.primitive_between(self.low, self.high)


class CornerSurface:
    """The sphere in a corner."""

    closed = False

    def __init__(self, centre: FloatArray, radius: float, contacts: FloatArray, box: FloatArray) -> None:
        self._centre, self._radius, self.box = centre, radius, box
        around = np.roll(contacts, -1, axis=0)
        walls = np.cross(contacts, around)
        walls *= np.sign(walls @ contacts.sum(axis=0))[:, None]
        self._walls = walls / np.linalg.norm(walls, axis=1)[:, None]
        self.curves: list[Curve] = [
            Arc(centre, radius * a, radius * b) for a, b in zip(contacts, around, strict=True) if 1 - a @ b > 1e-12
        ]

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        away = points - self._centre
        length = np.linalg.norm(away, axis=1)
        return length - self._radius, away / np.where(length > 0, length, 1.0)[:, None]

    def beyond(self, points: FloatArray) -> FloatArray:
        return np.asarray(-((points - self._centre) @ self._walls.T).min(axis=1))

    def primitive(self) -> Primitive:
        return Primitive("sphere", self._centre, np.array([0.0, 0.0, 1.0]), self._radius)


class FlatSurface:
    """The plane in a corner of chamfers."""

    closed = False

    def __init__(self, point: FloatArray, normal: FloatArray, box: FloatArray) -> None:
        self._point, self._normal, self.box = point, normal, box
        self.curves: list[Curve] = []

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        return (points - self._point) @ self._normal, np.tile(self._normal, (len(points), 1))

    def beyond(self, points: FloatArray) -> FloatArray:
        return np.zeros(len(points))

    def primitive(self) -> Primitive:
        return Primitive("plane", self._point, self._normal)


def across() -> FloatArray:
    """Shares (K,) of the arc at which grids have points: Chebyshev's, from a little before 0 to a little beyond 1."""
    nodes = -np.cos((2 * np.arange(_ACROSS) + 1) * np.pi / (2 * _ACROSS))
    return np.asarray(0.5 + (0.5 + _BEYOND) * nodes / nodes[-1])


def _turned(first: FloatArray, last: FloatArray, shares: FloatArray) -> FloatArray:
    """Turn unit directions (N, 3) by shares (N,) of the way from the first to the last ones (N, 3)."""
    first = first / np.linalg.norm(first, axis=1)[:, None]
    last = last / np.linalg.norm(last, axis=1)[:, None]
    cosine = np.clip((first * last).sum(axis=1), -1.0, 1.0)
    side = last - cosine[:, None] * first
    size = np.linalg.norm(side, axis=1)
    side /= np.where(size > 0, size, 1.0)[:, None]
    turn = (shares * np.arctan2(size, cosine))[:, None]
    return np.asarray(np.cos(turn) * first + np.sin(turn) * side)
