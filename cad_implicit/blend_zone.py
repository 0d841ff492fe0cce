"""Where a closing may differ from its parent: only there are centres of the ball asked for.

Faces and convex edges far from concave ones stay as they are. So of a large part the surface of ball centres need only
be made around its blends. What is found here is a good guess: if centres are asked for elsewhere, that place is added
(:class:`Zoned`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .centres import Centres
from .distance import Surface
from .implicit import Affine, FloatArray, Implicit
from .parallel import Progress
from .regions import Region

#: Affine functions agree with the parent's within this share of the spacing.
_TOLERANCE = 2e-5

#: A pushed ball cuts in if the part is deeper in it than this many spacings: half of what counts later.
_CUT = 0.01

#: Blocks of so many cells a side are looked at first.
_COARSE = 8

#: Cells of 8 spacings near the part are looked at in so many points a side, others in their middles.
_POINTS = 4

#: Half the diagonal of a cube over its side, and slack for rounding.
_HALF = math.sqrt(3) / 2 * (1 + 1e-6)

#: Cells looked at together.
_BATCH = 1 << 13

Look = Callable[[FloatArray, float, float], Affine]


class Zoned(Surface):
    """Surface of centres that are made around a zone only, and made again around a larger one if asked elsewhere.

    Parameters
    ----------
    zone : Region
    make : callable
        Gives the centres for points of a zone.
    """

    def __init__(self, zone: Region, make: Callable[[Region], Centres]) -> None:
        self._zone, self._make = zone, make
        self._centres = make(zone)

    def closest(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Distances ``(N,)`` in mm and closest points ``(N, 3)``."""
        x = np.asarray(points, np.float64)
        outside = ~self._zone.contains(x)
        if outside.any():
            self._zone = self._zone.joined(x[outside])
            self._centres = self._make(self._zone)
        return self._centres.surface.closest(x)

    def fill_tight(self, points: FloatArray, value: FloatArray, gradient: FloatArray) -> None:
        """As :meth:`cad_implicit.centres.Centres.fill_tight`."""
        self._centres.fill_tight(points, value, gradient)


def blend_zone(
    parent: Implicit, radius: float, spacing: float, region: Region, affine: Look, progress: Progress
) -> Region:
    """Cells of a region, and those around them, in which a closing may differ from its parent near its surface.

    Parameters
    ----------
    parent : Implicit
        Exact distance in mm.
    radius, spacing : float
        In mm.
    region : Region
        Of cells of 8 spacings.
    affine : callable
        The closing's ``affine_within``.
    progress : callable
        May raise to cancel.
    """
    mask = np.zeros(region.mask.shape, np.bool_)
    cells = _cells_left(parent, radius, spacing, region, affine)
    for start in range(0, len(cells), _BATCH):
        progress("zone", start / len(cells))
        some = cells[start : start + _BATCH]
        cut = some[_cut(parent, radius, spacing, region, some)]
        mask[tuple(cut.T)] = True
    return Region(region.origin, region.cell, mask).grown(region.cell)


def _cells_left(parent: Implicit, radius: float, spacing: float, region: Region, affine: Look) -> NDArray[np.int64]:
    """Cells (N, 3) that the closing's surface may cross, and where no plane alone is near."""
    size = _COARSE
    counts = -(-np.array(region.mask.shape) // size)
    blocks = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    halves = np.array(list(itertools.product((0, 1), repeat=3)))
    while True:
        side = size * region.cell
        blocks = blocks[region.overlaps(region.origin + side * blocks, side)]
        middles = region.origin + side * (blocks + 0.5)
        value = parent(middles)
        near = (value < _HALF * side) & (value > -_HALF * side - radius)
        blocks, middles = blocks[near], middles[near]
        blocks = blocks[~affine(middles, _HALF * side, _TOLERANCE * spacing)[2]]
        if size == 1:
            return blocks
        size //= 2
        blocks = (2 * blocks[:, None] + halves).reshape(-1, 3)


def _cut(
    parent: Implicit, radius: float, spacing: float, region: Region, cells: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether a ball pushed against the part from points of cells (N, 3) cuts into it elsewhere."""
    middles = region.origin + region.cell * (cells + 0.5)
    value, gradient = parent.value_and_gradient(middles)
    cut = _cuts(parent, radius, spacing, middles, value, gradient)
    rest = np.flatnonzero(~cut & (np.abs(value) < _HALF * region.cell))
    at = (np.arange(_POINTS) + 0.5) / _POINTS - 0.5
    points = region.cell * np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1).reshape(-1, 3)
    x = (middles[rest, None] + points).reshape(-1, 3)
    inner = _cuts(parent, radius, spacing, x, *parent.value_and_gradient(x))
    cut[rest] = inner.reshape(len(rest), len(points)).any(axis=1)
    return cut


def _cuts(
    parent: Implicit, radius: float, spacing: float, x: FloatArray, value: FloatArray, gradient: FloatArray
) -> NDArray[np.bool_]:
    which = np.flatnonzero(value > -radius)
    pushed = x[which] - (value[which] + radius)[:, None] * gradient[which]
    result = np.zeros(len(x), np.bool_)
    result[which] = parent.within(pushed, radius - _CUT * spacing)
    return result
