"""Strips along edges: most of the regions that local blends take off or fill in.

Each is a function of points, positive inside. Inside it are the points beside an edge that the ball of a blend does not
reach, or that are beyond a chamfer; its other borders lie a margin outside of the part's surface, so that only the
blend itself, and the ends of strips, are cut into the part.

Not promised: values are no distances away from the blend.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import parallel
from .guides import Support, speed
from .implicit import FloatArray
from .kernels import canal
from .spine_search import spine_samples
from .spines import Spine

#: Where a strip ends at a corner both count up to this share of the radius past their common plane: a gap would be
#: a wall within the region; so would be values that sink towards the plane, onto which vertices are drawn.
SLACK = 1e-9

#: Steepest line of a face over its tangent that is followed.
_STEEPEST = 5.0

Pair = tuple[FloatArray, FloatArray]


class Region(ABC):
    """A function of points, positive inside.

    Attributes
    ----------
    box : (2, 3) float64
        Lower and upper corner in mm of a box that holds its inside.
    margin : float
        How far in mm it goes beyond the part's surface.
    radius : float
        Of the blend in mm, the largest of it; infinite for a chamfer.
    """

    box: FloatArray
    margin: float
    radius: float

    @abstractmethod
    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3) at points (N, 3) in mm."""


@dataclass(frozen=True, eq=False)
class Cut:
    """Where a strip ends: at a face that the edge runs into.

    Attributes
    ----------
    support : Support
        The face, continued.
    side : float
        On which side of it, as a support tells, the strip is kept.
    end : 0 or 1
        At which end of the strip.
    way : float
        How far along the spine in mm it begins, or ceases, to matter.
    margin : float
        By how many mm the strip goes past it.
    """

    support: Support
    side: float
    end: Literal[0, 1]
    way: float
    margin: float

    def limit(self, points: FloatArray, ways: FloatArray, value: FloatArray, gradient: FloatArray) -> None:
        """Cut values (N,) and gradients (N, 3) of a strip at points so far along its spine, in place."""
        near = np.flatnonzero(ways <= self.way if self.end == 0 else ways >= self.way)
        if len(near) == 0:
            return
        f, slope = self.support(points[near])
        f = self.side * f + self.margin
        less = f < value[near]
        value[near[less]] = f[less]
        gradient[near[less]] = self.side * slope[less]


class Strip(Region):
    """The strip along an edge.

    Parameters
    ----------
    spine : Spine
        All of it solved.
    supports : two Supports
        The faces beside the edge.
    margin : float
        How far in mm it goes beyond the faces.
    corners : two bools
        Whether it starts, and ends, at a corner.
    """

    def __init__(
        self,
        spine: Spine,
        supports: Sequence[Support],
        margin: float,
        corners: tuple[bool, bool] = (False, False),
    ) -> None:
        self.spine, self.margin = spine, margin
        self.radius = float(spine.radius.max()) if spine.ball else math.inf
        touching = spine.touching()
        self._origins, self._reaches = spine.centres, spine.reaches
        directions = spine.tangents
        out = np.stack([-support(touching[:, side])[1] for side, support in enumerate(supports)], axis=1)
        self._directions = np.ascontiguousarray(directions)
        self._normals = spine.contacts
        self._turns, self._lines = _face_lines(spine, touching, self._normals, out, supports)
        self._spans = speed(self._origins[:-1], self._origins[1:], directions[:-1], directions[1:])
        self._ways = np.concatenate([[0.0], np.cumsum(self._spans)])
        slack = SLACK * float(spine.radius.max())
        self._slack = np.array([slack if corner else 0.0 for corner in corners])
        reach = np.linalg.norm(spine.edge - self._origins, axis=1)
        self._reach = float(np.maximum(reach, np.linalg.norm(self._reaches, axis=2).max(axis=1)).max()) + 2 * margin
        held = np.concatenate([touching.reshape(-1, 3), spine.edge])
        pad = 2 * margin + self._bulge()
        self.box = np.stack([held.min(axis=0) - pad, held.max(axis=0) + pad])

    def skin(self) -> list[FloatArray]:
        """Lines of points (N, 3) of its border beyond the faces, between where it touches them and the edge."""
        along = np.cross(self.spine.tangents[:, None], self._normals) * self._turns[:, None]
        along /= np.linalg.norm(along, axis=2)[:, :, None]
        length, height, start, end = np.moveaxis(self._lines, 2, 0)
        touching = self.spine.touching()
        points = []
        for share in (0.0, 0.5, 1.0):
            rest = 1 - share
            above = share * share * (1 + 2 * rest) * height + share * rest * length * (rest * start - share * end)
            above += self.margin
            line = touching + (share * length)[:, :, None] * along + above[:, :, None] * self._normals
            points += [line[:, 0], line[:, 1]]
        return points

    def way(self, at: ArrayLike) -> FloatArray:
        """Ways (N,) in mm along the spine for positions (N,) along the edge."""
        return np.asarray(np.interp(np.asarray(at, np.float64), self.spine.at, self._ways))

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        value, gradient, _ = self.evaluate(points)
        return value, gradient

    def evaluate(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Values (N,), gradients (N, 3), and how far (N,) along the spine in mm the points are."""
        every = np.arange(len(points))
        return evaluated(points, every, np.zeros_like(every), self.table)

    def from_ball(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """How far (N,) points are outside the ball, the gradient (N, 3) of that, how far (N, 2) beyond its contacts."""
        value, gradient, within = np.zeros(len(points)), np.zeros((len(points), 3)), np.zeros((len(points), 2))
        with parallel.threads(None, parallel.QUERY * len(points)):
            canal.sectors(np.ascontiguousarray(points), self.table, value, gradient, within)
        return value, gradient, within

    @cached_property
    def table(self) -> canal.Strips:
        """The strip as kernels see it."""
        spine = self.spine
        samples = spine_samples(self._origins, self._directions, self._spans, float(spine.radius.min()), self._reach)
        return canal.Strips(
            np.array([0, len(spine.at)]), np.ascontiguousarray(self._origins), self._directions,
            np.append(self._spans, 0.0), self._ways, np.ascontiguousarray(spine.radius),
            np.ascontiguousarray(spine.slope), np.ascontiguousarray(self._reaches), np.ascontiguousarray(self._normals),
            self._lines, self._turns[None], np.array([spine.closed]), np.array([spine.ball]), np.array([self.margin]),
            np.array([self._reach]), self._slack[None], np.array([0, len(samples.middles)]), samples.middles,
            samples.members, samples.points, samples.pieces, np.array([samples.gap]),
        )  # fmt: skip

    def _bulge(self) -> float:
        """How far the strip may bulge between samples."""
        chord = np.linalg.norm(np.diff(self._origins, axis=0), axis=1)
        return float((self._spans - chord).max(initial=0.0)) + 0.01 * float(chord.max(initial=0.0))


def evaluated(
    points: FloatArray, which: NDArray[np.intp], strip: NDArray[np.intp], table: canal.Strips
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values (M,) and gradients (M, 3) of strips (M,) of a table at some of the points, and ways (M,) along them."""
    value, gradient, way = np.zeros(len(which)), np.zeros((len(which), 3)), np.zeros(len(which))
    with parallel.threads(None, parallel.QUERY * len(which)):
        canal.strips(np.ascontiguousarray(points), which, strip, table, value, gradient, way)
    return value, gradient, way


def _face_lines(
    spine: Spine, touching: FloatArray, normals: FloatArray, out: FloatArray, supports: Sequence[Support]
) -> Pair:
    """Lines of the faces beyond the contacts (N, 2, 4), and which way (2,) is along them."""
    lines, turns = np.zeros((len(spine.at), 2, 4)), np.ones(2)
    size = np.linalg.norm(touching - spine.edge[:, None], axis=2)
    for side, support in enumerate(supports):
        to_edge = spine.edge - touching[:, side]
        along = np.cross(spine.tangents, normals[:, side])
        along /= np.linalg.norm(along, axis=1)[:, None]
        turns[side] = np.sign(np.median((along * to_edge).sum(axis=1)))
        along *= turns[side]
        lines[:, side, 0] = np.maximum((along * to_edge).sum(axis=1), 1e-3 * size[:, side] + 1e-12)
        lines[:, side, 1] = (normals[:, side] * to_edge).sum(axis=1)
        at_edge = -support(spine.edge)[1]
        for column, normal in ((2, out[:, side]), (3, at_edge)):
            rise = (normal * normals[:, side]).sum(axis=1)
            steep = -(normal * along).sum(axis=1) / np.maximum(rise, 1 / _STEEPEST)
            lines[:, side, column] = np.clip(steep, -_STEEPEST, _STEEPEST)
    return turns, lines


class Trimmed(Region):
    """A strip with its ends cut."""

    def __init__(self, strip: Strip, cuts: Sequence[Cut]) -> None:
        self.strip, self.cuts = strip, tuple(cuts)
        self.box, self.margin, self.radius = strip.box, strip.margin, strip.radius

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        value, gradient, ways = self.strip.evaluate(points)
        for cut in self.cuts:
            cut.limit(points, ways, value, gradient)
        return value, gradient
