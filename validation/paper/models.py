"""The shapes of the paper's examples as implicit functions, in its units.

Plain Python functions of a point, positive inside, made of R-functions and compiled; none has the distance property.
The paper gives pictures and radii, not the definitions: the shapes here are of the same kind, and of a size for which
its ten iterations (r / time step) are right on 128 nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import prange
from numpy.typing import NDArray

from cad_implicit import Function, parallel
from cad_implicit.implicit import Implicit
from cad_implicit.kernels.jit import jit, parallel_jit

Values = Callable[[NDArray[np.float64], NDArray[np.float64]], None]


@jit
def either(a, b):
    """Union by the R-function of the system R_0."""
    return a + b + math.sqrt(a * a + b * b)


@jit
def both(a, b):
    """Intersection by the R-function of the system R_0."""
    return a + b - math.sqrt(a * a + b * b)


@jit
def less(a, b):
    """First without second."""
    return both(a, -b)


@jit
def slab(x, half):
    """Points with |x| < half, normalized to first order."""
    return (half * half - x * x) / (2 * half)


@jit
def cuboid(x, y, z, a, b, c):
    """Cuboid with the half sides a, b, c."""
    return both(both(slab(x, a), slab(y, b)), slab(z, c))


@jit
def rod(x, y, radius):
    """Endless cylinder, normalized to first order."""
    return (radius * radius - x * x - y * y) / (2 * radius)


@jit
def _ball(x, y, z):
    return 1 - x * x - y * y - z * z


@jit
def _boxes(x, y, z):
    flat = cuboid(x, y, z + 0.14, 0.30, 0.18, 0.08)
    upright = cuboid(x + 0.10, y - 0.02, z, 0.12, 0.11, 0.22)
    return either(flat, upright)


@jit
def _mechanical(x, y, z):
    foot = cuboid(x, y, z + 1.15, 2.1, 1.2, 0.35)
    upright = cuboid(x, y - 0.5, z + 0.1, 0.95, 0.45, 0.95)
    boss = both(rod(x, z - 0.85, 0.95), slab(y - 0.2, 0.9))
    rib = cuboid(x, y + 0.25, z + 0.45, 0.25, 0.35, 0.45)
    solid = either(either(foot, upright), either(boss, rib))
    bore = rod(x, z - 0.85, 0.5)
    holes = rod(abs(x) - 1.48, y + 0.1, 0.3)
    return less(less(solid, bore), holes)


def _over_points(of_point: Callable[[float, float, float], float]) -> Values:
    """Compile the loop over points ``(N, 3)`` of a function of one."""

    @parallel_jit
    def fill(points, values):
        for n in prange(len(points)):
            values[n] = of_point(points[n, 0], points[n, 1], points[n, 2])

    return fill  # type: ignore[no-any-return]


_BALL, _BOXES, _MECHANICAL = _over_points(_ball), _over_points(_boxes), _over_points(_mechanical)


def _function(fill: Values, bounds: list[list[float]], threads: int | None) -> Implicit:
    def values(points: NDArray[np.float64]) -> NDArray[np.float64]:
        found = np.zeros(len(points))
        with parallel.threads(threads):
            fill(np.ascontiguousarray(points), found)
        return found

    return Function(values, bounds)


def sphere(threads: int | None = None) -> Implicit:
    """Give the defining function of section 5.3, f = 1 - x² - y² - z²."""
    return _function(_BALL, [[-1] * 3, [1] * 3], threads)


def two_boxes(threads: int | None = None) -> Implicit:
    """Union of two boxes, one flat and one upright (Figure 5)."""
    return _function(_BOXES, [[-0.3, -0.18, -0.22], [0.3, 0.18, 0.22]], threads)


def mechanical_part(threads: int | None = None) -> Implicit:
    """Bearing block of cuboids and cylinders: a foot with two holes, an upright, a bored boss and a rib (Figure 6)."""
    return _function(_MECHANICAL, [[-2.1, -1.2, -1.5], [2.1, 1.2, 1.8]], threads)
