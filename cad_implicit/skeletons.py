"""Convolution surfaces: smooth skins around skeletons of line segments.

A kernel that falls with the distance is integrated along each segment, in closed form; the surface is where the sum
reaches a threshold. Segments that meet blend without a crease or a bulge. Line segments with a Cauchy kernel:
J. McCormack, A. Sherstyuk, "Creating and rendering convolution surfaces", Computer Graphics Forum 17 (1998),
doi:10.1111/1467-8659.00232; with a Gaussian: J. Bloomenthal, K. Shoemake, "Convolution surfaces", SIGGRAPH 91,
doi:10.1145/122718.122757.

Not promised: distances; nor the radius where segments are short or near others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import parallel
from .errors import EmptyResultError, RadiusError
from .grid import Grid
from .implicit import FloatArray, Implicit
from .kernels.convolution import add_segments
from .kernels.line_sums import sum_cauchy

Kernel = Literal["cauchy", "gauss"]

#: The integral over an endless line at a distance of some widths, for either kernel, in widths; …
_LINE: dict[Kernel, Callable[[FloatArray], FloatArray]] = {
    "cauchy": lambda r: math.pi / 2 * (1 + r * r) ** -1.5,
    "gauss": lambda r: math.sqrt(math.pi) * np.exp(-r * r),
}
#: … its slope and the distance at which that is steepest; …
_LINE_SLOPE: dict[Kernel, Callable[[FloatArray], FloatArray]] = {
    "cauchy": lambda r: -1.5 * math.pi * r * (1 + r * r) ** -2.5,
    "gauss": lambda r: -2 * math.sqrt(math.pi) * r * np.exp(-r * r),
}
_STEEPEST: dict[Kernel, float] = {"cauchy": 0.5, "gauss": math.sqrt(0.5)}
#: … the kernel itself, its slope, and the distance at which that is steepest.
_KERNEL: dict[Kernel, Callable[[FloatArray], FloatArray]] = {
    "cauchy": lambda r: (1 + r * r) ** -2.0,
    "gauss": lambda r: np.exp(-r * r),
}
_KERNEL_SLOPE: dict[Kernel, Callable[[FloatArray], FloatArray]] = {
    "cauchy": lambda r: -4 * r * (1 + r * r) ** -3.0,
    "gauss": lambda r: -2 * r * np.exp(-r * r),
}
_STEEPEST_KERNEL: dict[Kernel, float] = {"cauchy": math.sqrt(0.2), "gauss": math.sqrt(0.5)}

#: Nodes along each side of the grid for the Lipschitz constant. For 200 segments in a chain the bound falls from 898,
#: the sum over all segments, to 71.
_LIPSCHITZ_CELLS = 16


def convolution(
    segments: ArrayLike,
    radius: float,
    *,
    weights: ArrayLike = 1.0,
    kernel: Kernel = "cauchy",
    width: float | None = None,
    threads: int | None = None,
) -> Implicit:
    """Convolution surface of line segments.

    Parameters
    ----------
    segments : (M, 2, 3) array_like
        End points in mm.
    radius : float
        Of the surface around a long lone segment of weight 1, in mm.
    weights : float or (M,) array_like
        Of the segments; more than 1 thickens, less than 0 carves.
    kernel : "cauchy" or "gauss"
        ``(1 + (r / width)²)⁻²`` or ``exp(-(r / width)²)``; the Gaussian blends over shorter distances.
    width : float, optional
        In mm, the radius by default; the smaller, the less segments blend.
    threads : int, optional
        Default: all cores.

    Returns
    -------
    Implicit
        With values near the distance in mm close to a long lone segment's surface, and a bound on its slope.

    Raises
    ------
    RadiusError
        If radius or width is not positive and finite.
    ValueError
        If the segments are not (M, 2, 3), or one has no length.
    EmptyResultError
        If the segments are too short for the field to reach the threshold anywhere.

    Examples
    --------
    >>> bone = convolution([[[-20, 0, 0], [20, 0, 0]]], 1.0)
    >>> bone([[0, 0, 0.9], [0, 0, 1.1], [0, 2, 0]]).round(3)
    array([ 0.108, -0.093, -0.498])
    """
    ends = np.array(segments, np.float64)
    if ends.ndim != 3 or ends.shape[1:] != (2, 3) or len(ends) == 0 or not np.isfinite(ends).all():
        raise ValueError(f"segments must be finite, (M, 2, 3), not {ends.shape}")
    shares = np.array(np.broadcast_to(np.asarray(weights, np.float64), len(ends)))
    if not np.isfinite(shares).all():
        raise ValueError("weights must be finite")
    if kernel not in _LINE:
        raise ValueError(f'kernel must be "cauchy" or "gauss", not {kernel!r}')
    sigma = radius if width is None else width
    for name, value in (("radius", radius), ("width", sigma)):
        if not (math.isfinite(value) and value > 0):
            raise RadiusError(f"{name} must be a positive number of mm, not {value:g}")
    return Skeleton(ends, float(radius), shares, kernel, float(sigma), threads)


class Skeleton(Implicit):
    """Sum of kernels integrated along segments, less a threshold; :func:`convolution` makes it."""

    def __init__(
        self, ends: FloatArray, radius: float, weights: FloatArray, kernel: Kernel, width: float, threads: int | None
    ) -> None:
        along = ends[:, 1] - ends[:, 0]
        self._lengths = np.linalg.norm(along, axis=1)
        if (self._lengths == 0).any():
            raise ValueError(f"segment {int(np.flatnonzero(self._lengths == 0)[0])} has no length")
        self._starts = np.ascontiguousarray(ends[:, 0])
        self._axes = np.ascontiguousarray(along / self._lengths[:, None])
        self._weights, self._kernel, self._width, self._threads = weights, kernel, width, threads
        self._threshold = float(_LINE[kernel](np.array(radius / width)))
        self._scale = -width / float(_LINE_SLOPE[kernel](np.array(radius / width)))
        self.bounds = self._box(ends)
        self.lipschitz = self._steepest()

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self._look(points, slopes=False)[0]

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, 3)``."""
        return self._look(points, slopes=True)[1]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        return self._look(points, slopes=True)

    def _look(self, points: ArrayLike, *, slopes: bool) -> tuple[FloatArray, FloatArray]:
        x = np.ascontiguousarray(points, np.float64)
        values, gradients = np.zeros(len(x)), np.zeros((len(x) if slopes else 0, 3))
        with parallel.threads(self._threads):
            if not slopes and self._kernel == "cauchy":
                sum_cauchy(x, self._starts, self._axes, self._lengths, self._weights, self._width, values)
                return self._scale * (values - self._threshold), gradients
            add_segments(
                x, self._starts, self._axes, self._lengths, self._weights, self._width, self._kernel == "gauss",
                values, gradients,
            )  # fmt: skip
        return self._scale * (values - self._threshold), self._scale * gradients

    def _steepest(self) -> float:
        """Bound on the gradient's length: the largest, over the cells of a coarse grid, of the sum over the segments.

        Along a segment the integral changes by the difference of the kernel at its ends; across by less than that of
        the endless line; and by no more than its length times the kernel's slope. All fall with the distance, so that
        nothing outside the grid is steeper than its border.
        """
        grid = Grid.cover(self.bounds, shape=_LIPSCHITZ_CELLS)
        centres, reach = grid.nodes(), math.hypot(*grid.spacing) / 2
        steepest = np.zeros(len(centres))
        kernel, slopes, lines = _KERNEL[self._kernel], _KERNEL_SLOPE[self._kernel], _LINE_SLOPE[self._kernel]
        for start, axis, length, weight in zip(self._starts, self._axes, self._lengths, self._weights, strict=True):
            arm = centres - start
            arm -= np.clip(arm @ axis, 0, length)[:, None] * axis
            d = np.maximum(np.linalg.norm(arm, axis=1) - reach, 0.0) / self._width
            across = -lines(np.maximum(d, _STEEPEST[self._kernel]))
            most = -slopes(np.maximum(d, _STEEPEST_KERNEL[self._kernel])) * length / self._width
            steepest += abs(weight) * np.minimum(np.hypot(kernel(d), across), most)
        return self._scale / self._width * float(steepest.max())

    def _box(self, ends: FloatArray) -> FloatArray:
        """Box of the surface: beyond each of its sides all segments together stay below the threshold."""
        low, high = self._side(-ends.min(axis=1)), self._side(ends.max(axis=1))
        return np.asarray([-low, high], np.float64)

    def _side(self, extents: FloatArray) -> FloatArray:
        """Farthest coordinate ``(3,)`` that the surface can reach, from those ``(M, 3)`` of the segments."""
        low = extents.min(axis=0)
        if not self._reaches(low, extents).all():
            raise EmptyResultError("nothing is left: the segments are too short, or too light, to reach the threshold")
        high = extents.max(axis=0) + self._width
        while self._reaches(high, extents).any():
            high = high + 2 * (high - low)
        for _ in range(50):
            middle = (low + high) / 2
            reached = self._reaches(middle, extents)
            low, high = np.where(reached, middle, low), np.where(reached, high, middle)
        return np.asarray(high)

    def _reaches(self, place: FloatArray, extents: FloatArray) -> NDArray[np.bool_]:
        """Whether the segments' fields may together reach the threshold beyond a place on each axis.

        At the distance d from a segment its field is at most its length times the kernel, and at most that of the
        endless line.
        """
        d = np.maximum(place - extents, 0.0) / self._width
        most = np.minimum(self._lengths[:, None] / self._width * _KERNEL[self._kernel](d), _LINE[self._kernel](d))
        return np.asarray(np.maximum(self._weights, 0) @ most >= self._threshold)
