"""Regions that local blends take off or fill in: strips along edges, and corners where strips meet.

Each is a function of points, positive inside. Inside it are the points beside an edge that the ball of a blend does not
reach, or that are beyond a chamfer; its other borders lie a margin outside of the part's surface, so that only the
blend itself, and the ends of strips, are cut into the part.

Not promised: values are no distances away from the blend.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import parallel
from .guides import Support, speed
from .implicit import FloatArray, Implicit
from .kernels import boxes, canal
from .spine_search import SpineSearch
from .spines import Spine

#: Where a strip ends at a corner both count up to this share of the radius past their common plane: a gap would be
#: a wall within the region; so would be values that sink towards the plane, onto which vertices are drawn.
_SLACK = 1e-9

#: Margins must be at least this many spacings: less is contoured only roughly.
SPACINGS = 2.0

#: Points farther than so many times its reach from the spine are outside of the strip by the rest at least.
_NEAR = 1.2

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
    """

    box: FloatArray
    margin: float

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
        touching = spine.touching()
        self._origins, self._reaches = spine.centres, spine.reaches
        directions = spine.tangents
        out = np.stack([-support(touching[:, side])[1] for side, support in enumerate(supports)], axis=1)
        self._directions = np.ascontiguousarray(directions)
        self._normals = spine.contacts
        self._turns, self._lines = _face_lines(spine, touching, self._normals, out, supports)
        self._spans = speed(self._origins[:-1], self._origins[1:], directions[:-1], directions[1:])
        self._ways = np.concatenate([[0.0], np.cumsum(self._spans)])
        slack = _SLACK * float(spine.radius.max())
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
        far = self._search.at_least(points)
        value, gradient, way = self._reach - far, np.zeros_like(points), np.zeros(len(points))
        near = np.flatnonzero(far < _NEAR * self._reach)
        away, piece = self._search.nearest(points[near], _NEAR * self._reach)
        value[near] = self._reach - np.minimum(away, _NEAR * self._reach)
        near, piece = near[np.isfinite(away)], piece[np.isfinite(away)]
        out = (np.zeros(len(near)), np.zeros((len(near), 3)), np.zeros(len(near)))
        with parallel.threads(None, len(near)):
            canal.strip(
                np.ascontiguousarray(points[near]), piece, self._origins, self._directions, self._spans,
                self._ways, self.spine.radius, self.spine.slope, self._reaches, self._normals, self._lines, self._turns,
                self.spine.closed, self.spine.ball, self.margin, self._slack, *out,
            )  # fmt: skip
        value[near], gradient[near], way[near] = out
        return value, gradient, way

    def from_ball(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """How far (N,) points are outside the ball, the gradient (N, 3) of that, how far (N, 2) beyond its contacts."""
        piece = self._search.nearest(points)[1]
        value, gradient, within = np.zeros(len(points)), np.zeros((len(points), 3)), np.zeros((len(points), 2))
        with parallel.threads(None, len(points)):
            canal.sectors(
                np.ascontiguousarray(points), piece, self._origins, self._directions, self._spans, self.spine.radius,
                self.spine.slope, self._normals, self._turns, self.spine.closed, value, gradient, within,
            )  # fmt: skip
        return value, gradient, within

    @cached_property
    def _search(self) -> SpineSearch:
        radius = float(self.spine.radius.min())
        return SpineSearch(self._origins, self._directions, self._spans, radius, self._reach)

    def _bulge(self) -> float:
        """How far the strip may bulge between samples."""
        chord = np.linalg.norm(np.diff(self._origins, axis=0), axis=1)
        return float((self._spans - chord).max(initial=0.0)) + 0.01 * float(chord.max(initial=0.0))


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
        self.box, self.margin = strip.box, strip.margin

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        value, gradient, ways = self.strip.evaluate(points)
        for cut in self.cuts:
            cut.limit(points, ways, value, gradient)
        return value, gradient


class Mitre(Region):
    """What two strips have in common beyond faces."""

    def __init__(self, regions: Sequence[Region], beyond: Sequence[Support]) -> None:
        self._regions, self._beyond = tuple(regions), tuple(beyond)
        low = np.max([region.box[0] for region in regions], axis=0)
        high = np.min([region.box[1] for region in regions], axis=0)
        self.box = np.stack([low, np.maximum(low, high)])
        self.margin = min(region.margin for region in regions)

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        value, gradient = self._regions[0].value_and_gradient(points)
        others = [region.value_and_gradient(points) for region in self._regions[1:]]
        for f, slope in (*others, *(support(points) for support in self._beyond)):
            less = f < value
            value, gradient = np.where(less, f, value), np.where(less[:, None], slope, gradient)
        return value, gradient


class Without(Region):
    """A region without others."""

    def __init__(self, region: Region, others: Sequence[Region]) -> None:
        self._region, self._others = region, Regions(others)
        self.box, self.margin = region.box, region.margin

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        value, gradient = self._region.value_and_gradient(points)
        f, slope = self._others.value_and_gradient(points)
        less = -f < value
        return np.where(less, -f, value), np.where(less[:, None], -slope, gradient)


class Corner(Region):
    """What a ball that touches three or more faces does not reach of their corner.

    Parameters
    ----------
    centre : (3,) float64
        Of the ball, in mm.
    radius : float
    contacts : (K, 3) float64
        Unit directions from the centre to where it touches, in order around the corner.
    tip : (3,) float64
        Where the faces meet.
    margins : (K,) float64
        How far in mm it goes beyond each of the faces.
    """

    def __init__(
        self, centre: FloatArray, radius: float, contacts: FloatArray, tip: FloatArray, margins: FloatArray
    ) -> None:
        self._centre, self._radius, self._contacts = centre, radius, contacts
        self.margin = float(margins.max())
        walls = np.cross(contacts, np.roll(contacts, -1, axis=0))
        walls *= np.sign(walls @ contacts.sum(axis=0))[:, None]
        self._walls = walls / np.linalg.norm(walls, axis=1)[:, None]
        # curved faces leave the tangent planes on the way to the tip
        heights = np.maximum(contacts @ (tip - centre) - radius, 0.0)
        self._heights = radius + 1.1 * heights + margins
        far = 1.2 * float(np.linalg.norm(tip - centre)) + 2 * self.margin
        self.box = np.stack([centre - far, centre + far])

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        away = points - self._centre
        length = np.linalg.norm(away, axis=1)
        value = length - self._radius
        gradient = away / np.where(length > 0, length, 1.0)[:, None]
        within = away @ self._walls.T
        within[within > -_SLACK * self._radius] = np.inf
        below = self._heights - away @ self._contacts.T
        for parts, slopes in ((within, self._walls), (below, -self._contacts)):
            which = parts.argmin(axis=1)
            least = parts[np.arange(len(parts)), which]
            less = least < value
            value[less], gradient[less] = least[less], slopes[which[less]]
        return value, gradient


class Regions(Implicit):
    """Several regions as one shape.

    Raises
    ------
    ValueError
        If there are none.
    """

    #: Sectors of bent spines change faster than distances.
    lipschitz = 2.0
    spacing: float

    def __init__(self, regions: Sequence[Region]) -> None:
        self.regions = tuple(regions)
        self._boxes = np.array([region.box for region in regions])
        self._margins = np.array([region.margin for region in regions])
        self.spacing = float(self._margins.min()) / SPACINGS
        self.bounds = np.stack([self._boxes[:, 0].min(axis=0), self._boxes[:, 1].max(axis=0)])

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients (N, 3) of the region that decides."""
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points: ArrayLike) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        x = np.ascontiguousarray(points, np.float64)
        inside = np.empty((len(self.regions), len(x)), np.bool_)
        with parallel.threads(None, len(x) * len(self.regions)):
            # boxes are padded by twice the margin: no false zeros beside them
            value = boxes.around(x, self._boxes, self._margins, inside)
        gradient = np.zeros_like(x)
        for region, own in zip(self.regions, inside, strict=True):
            near = np.flatnonzero(own)
            if len(near):
                f, slope = region.value_and_gradient(x[near])
                better = f > value[near]
                value[near[better]], gradient[near[better]] = f[better], slope[better]
        return value, gradient

    def clusters(self) -> list[Regions]:
        """Regions whose boxes do not overlap, apart."""
        low, high = self._boxes[:, 0], self._boxes[:, 1]
        meet = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
        label = _labels(np.asarray(meet))
        return [
            Regions([r for r, own in zip(self.regions, label, strict=True) if own == one]) for one in np.unique(label)
        ]


def _labels(meet: NDArray[np.bool_]) -> NDArray[np.int32]:
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    return np.asarray(connected_components(csr_array(meet), directed=False)[1])
