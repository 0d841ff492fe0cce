"""Regions: which part of space is worked on, so that large parts are done a piece at a time."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .implicit import FloatArray
from .mesh import IntArray

#: Boxes that touch a cell by less than this share of it do not overlap it.
_TOUCH = 1e-6


class Region:
    """Some of the cells of a regular grid in space.

    Parameters
    ----------
    origin : (3,) array_like
        Lower corner in mm of cell (0, 0, 0).
    cell : float
        Width of the cells in mm.
    mask : (I, J, K) array_like of bool
        Which cells belong to it.
    """

    def __init__(self, origin: ArrayLike, cell: float, mask: ArrayLike) -> None:
        self.origin, self.cell = np.asarray(origin, np.float64), float(cell)
        self.mask = np.asarray(mask, np.bool_)
        sums = np.zeros(np.add(self.mask.shape, 1), np.int32)
        inner = sums[1:, 1:, 1:]
        np.cumsum(self.mask, axis=0, out=inner)
        for axis in (1, 2):
            np.cumsum(inner, axis=axis, out=inner)
        self._sums = sums

    def overlaps(self, low: FloatArray, side: float) -> NDArray[np.bool_]:
        """Whether boxes of a width in mm, with lower corners (N, 3), have room in common with it."""
        return np.asarray(self._count(low, side)[0] > 0)

    def holds(self, low: FloatArray, side: float) -> NDArray[np.bool_]:
        """Whether it holds all of boxes of a width in mm, with lower corners (N, 3)."""
        found, all_of_them = self._count(low, side)
        return np.asarray(found == all_of_them)

    def contains(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points (N, 3) lie in it."""
        cell = np.floor((points - self.origin) / self.cell).astype(np.int64)
        inside = np.asarray(((cell >= 0) & (cell < self.mask.shape)).all(axis=1))
        inside[inside] = self.mask[tuple(cell[inside].T)]
        return inside

    def joined(self, points: FloatArray) -> Region:
        """Region with the cells of points (N, 3), too, and those around them."""
        cell = np.floor((points - self.origin) / self.cell).astype(np.int64)
        before = np.maximum(-cell.min(axis=0), 0) + 1
        after = np.maximum(cell.max(axis=0) + 1 - self.mask.shape, 0) + 1
        own = np.pad(self.mask, np.stack([before, after], axis=1))
        mask = np.zeros(own.shape, np.bool_)
        mask[tuple((cell + before).T)] = True
        return Region(self.origin - before * self.cell, self.cell, own | _widened(mask, 1))

    def grown(self, distance: float) -> Region:
        """Region that holds all points within a distance in mm of this one."""
        cells = int(np.ceil(distance / self.cell))
        mask = np.pad(self.mask, cells)
        mask = _widened(mask, cells)
        return Region(self.origin - cells * self.cell, self.cell, mask)

    def _count(self, low: FloatArray, side: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Numbers (N,) of its cells that boxes overlap, and of all cells, also beyond the grid, that they overlap."""
        first = np.floor((low - self.origin) / self.cell + _TOUCH).astype(np.int64)
        last = np.ceil((low + side - self.origin) / self.cell - _TOUCH).astype(np.int64)
        ends = np.clip([first, last], 0, self.mask.shape)
        found = np.zeros(len(low), np.int64)
        for corner in itertools.product((0, 1), repeat=3):
            i, j, k = (ends[corner[d], :, d] for d in range(3))
            found += (-1) ** (3 - sum(corner)) * self._sums[i, j, k].astype(np.int64)
        return found, (last - first).prod(axis=1)


def _widened(mask: NDArray[np.bool_], cells: int) -> NDArray[np.bool_]:
    """Mask (I, J, K) with all cells up to so many away along each axis."""
    for axis in range(3):
        sums = np.cumsum(np.moveaxis(mask, axis, 0), axis=0, dtype=np.int32)
        sums = np.concatenate([np.zeros_like(sums[:1]), sums])
        at = np.arange(mask.shape[axis])
        found = sums[np.minimum(at + cells + 1, len(at))] > sums[np.maximum(at - cells, 0)]
        mask = np.moveaxis(found, 0, axis)
    return mask


def box_region(origin: ArrayLike, cell: float, low: IntArray, high: IntArray) -> Region:
    """Box of the cells from ``low`` (3,) to those before ``high`` (3,) of the grid at ``origin``, in cells."""
    start = np.asarray(origin, np.float64) + cell * np.asarray(low)
    return Region(start, cell, np.ones(tuple(int(n) for n in np.subtract(high, low)), np.bool_))
