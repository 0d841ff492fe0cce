"""Regions that local blends take off or fill in as one: strips, and what is put between them at corners."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import parallel
from .guides import Support
from .implicit import FloatArray, Implicit
from .kernels import boxes, canal
from .strips import SLACK, Pair, Region, Strip, Trimmed, evaluated

#: Margins must be at least this many spacings: less is contoured only roughly.
SPACINGS = 2.0


def _least(first: Pair, others: Iterable[Pair]) -> Pair:
    """Least of some values (N,), and the gradients (N, 3) that go with them."""
    value, gradient = first
    for f, slope in others:
        less = f < value
        value, gradient = np.where(less, f, value), np.where(less[:, None], slope, gradient)
    return value, gradient


class Mitre(Region):
    """What two strips have in common beyond faces."""

    def __init__(self, regions: Sequence[Region], beyond: Sequence[Support]) -> None:
        self._regions, self._beyond = tuple(regions), tuple(beyond)
        low = np.max([region.box[0] for region in regions], axis=0)
        high = np.min([region.box[1] for region in regions], axis=0)
        self.box = np.stack([low, np.maximum(low, high)])
        self.margin = min(region.margin for region in regions)
        self.radius = min(region.radius for region in regions)

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        first, *others = (region.value_and_gradient(points) for region in self._regions)
        return _least(first, (*others, *(support(points) for support in self._beyond)))


class Without(Region):
    """A region without others."""

    def __init__(self, region: Region, others: Sequence[Region]) -> None:
        self._region, self._others = region, Regions(others)
        self.box, self.margin, self.radius = region.box, region.margin, region.radius

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        value, gradient = self._others.value_and_gradient(points)
        return _least(self._region.value_and_gradient(points), [(-value, -gradient)])


class Cleared(Region):
    """A region without the balls that roll along other edges."""

    def __init__(self, region: Region, strips: Sequence[Strip]) -> None:
        self._region, self._strips = region, tuple(strips)
        self.box, self.margin, self.radius = region.box, region.margin, region.radius

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        balls = (strip.from_ball(points)[:2] for strip in self._strips)
        return _least(self._region.value_and_gradient(points), balls)


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
        self._centre, self.radius, self._contacts = centre, radius, contacts
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
        value = length - self.radius
        gradient = away / np.where(length > 0, length, 1.0)[:, None]
        within = away @ self._walls.T
        within[within > -SLACK * self.radius] = np.inf
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
        self._strips = [number for number, region in enumerate(regions) if isinstance(region, Trimmed)]
        self._others = [number for number, region in enumerate(regions) if not isinstance(region, Trimmed)]
        self._trimmed = [region for region in regions if isinstance(region, Trimmed)]
        self.spacing = float(self._margins.min()) / SPACINGS
        radius = min(region.radius for region in regions)
        self.radius = radius if math.isfinite(radius) else None
        self.bounds = np.stack([self._boxes[:, 0].min(axis=0), self._boxes[:, 1].max(axis=0)])

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients (N, 3) of the region that decides."""
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points: ArrayLike) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        x = np.ascontiguousarray(points, np.float64)
        inside = np.zeros((len(self.regions), len(x)), np.bool_)
        with parallel.threads(None, len(x) * len(self.regions)):
            # boxes are padded by twice the margin: no false zeros beside them
            value = boxes.around(x, self._boxes, self._margins, inside)
        gradient = np.zeros_like(x)
        if self._strips:
            self._unite_strips(x, inside[self._strips], value, gradient)
        for number in self._others:
            near = np.flatnonzero(inside[number])
            if len(near):
                canal.unite(near, *self.regions[number].value_and_gradient(x[near]), value, gradient)
        return value, gradient

    def _unite_strips(self, x: FloatArray, inside: NDArray[np.bool_], value: FloatArray, gradient: FloatArray) -> None:
        """Replace values (N,) and gradients (N, 3) where those of strips (S, N) are larger."""
        strip, point = np.nonzero(inside)
        f, slope, ways = evaluated(x, point, strip, self._table)
        starts = np.searchsorted(strip, np.arange(len(inside) + 1))
        for region, start, stop in zip(self._trimmed, starts[:-1], starts[1:], strict=True):
            for cut in region.cuts if stop > start else ():
                cut.limit(x[point[start:stop]], ways[start:stop], f[start:stop], slope[start:stop])
        canal.unite(point, f, slope, value, gradient)

    @cached_property
    def _table(self) -> canal.Strips:
        return canal.joined([region.strip.table for region in self._trimmed])

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
