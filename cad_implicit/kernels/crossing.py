"""Where grid edges cross the interface, to second order, for the higher-order schemes.

After C. Min and F. Gibou, "A second order accurate level set method on non-graded adaptive Cartesian grids", J.
Comput. Phys. 225 (2007), doi:10.1016/j.jcp.2006.11.034: along an edge the function is the parabola through its ends
whose second difference is the smaller of those at the two ends.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .jit import jit, parallel_jit
from .subcell import sign

#: Shortest distance to a crossing, relative to the spacing: keeps quotients finite, far below any error.
_SHORTEST = 1e-6


@jit
def minmod(a, b):
    """Return the number closer to zero if both have one sign, otherwise zero."""
    if a * b <= 0:
        return 0.0
    return a if abs(a) < abs(b) else b


@jit
def crossing(before, here, after, beyond):
    """Root in (0, 1] of the parabola from ``here`` at 0 to ``after`` at 1, which have different signs."""
    second = minmod(after - 2 * here + before, beyond - 2 * after + here)
    a = second / 2
    b = after - here - a
    root = math.sqrt(max(b * b - 4 * a * here, 0.0))
    q = -(b + root) / 2 if b >= 0 else -(b - root) / 2
    x = here / q
    if not 0 <= x <= 1 and a != 0:
        x = q / a
    return min(max(x, _SHORTEST), 1.0)


@parallel_jit
def count(signs, counts):
    """Write how many nodes of each line along the last axis have an edge that crosses or touches the interface."""
    n0, n1, n2 = signs.shape
    for line in prange(n0 * n1):
        i = line // n1
        j = line - i * n1
        total = 0
        for k in range(n2):
            total += _near(signs, i, j, k)
        counts[line] = total


@jit
def _near(signs, i, j, k):
    """Whether a node off the interface has an edge that crosses or touches it."""
    n0, n1, n2 = signs.shape
    s = signs[i, j, k]
    return s != 0 and (
        signs[max(i - 1, 0), j, k] != s
        or signs[min(i + 1, n0 - 1), j, k] != s
        or signs[i, max(j - 1, 0), k] != s
        or signs[i, min(j + 1, n1 - 1), k] != s
        or signs[i, j, max(k - 1, 0)] != s
        or signs[i, j, min(k + 1, n2 - 1)] != s
    )


@jit
def _both_ways(b2, b1, here, a1, a2, spacing):
    """Distances in mm to the crossings before and after a node along an axis, infinite where there is none."""
    before = after = np.inf
    if sign(b1) != sign(here):
        before = spacing * crossing(a1, here, b1, b2)
    if sign(a1) != sign(here):
        after = spacing * crossing(b1, here, a1, a2)
    return before, after


@parallel_jit
def locate(f, signs, starts, slots, distances, rate, spacing):
    """List the nodes next to the interface with the distances to their six crossings.

    ``slots`` gets the row of each such node in ``distances`` (before and after along each axis). ``rate`` becomes
    zero on the interface, and next to it shrinks with the shortest distance, as stability demands.
    """
    n0, n1, n2 = f.shape
    shortest = min(spacing[0], min(spacing[1], spacing[2]))
    for line in prange(n0 * n1):
        i = line // n1
        j = line - i * n1
        slot = starts[line]
        i2, i1, i3, i4 = max(i - 2, 0), max(i - 1, 0), min(i + 1, n0 - 1), min(i + 2, n0 - 1)
        j2, j1, j3, j4 = max(j - 2, 0), max(j - 1, 0), min(j + 1, n1 - 1), min(j + 2, n1 - 1)
        for k in range(n2):
            if signs[i, j, k] == 0:
                rate[i, j, k] = 0
            if not _near(signs, i, j, k):
                continue
            k2, k1, k3, k4 = max(k - 2, 0), max(k - 1, 0), min(k + 1, n2 - 1), min(k + 2, n2 - 1)
            c = f[i, j, k]
            x = _both_ways(f[i2, j, k], f[i1, j, k], c, f[i3, j, k], f[i4, j, k], spacing[0])
            y = _both_ways(f[i, j2, k], f[i, j1, k], c, f[i, j3, k], f[i, j4, k], spacing[1])
            z = _both_ways(f[i, j, k2], f[i, j, k1], c, f[i, j, k3], f[i, j, k4], spacing[2])
            row = distances[slot]
            row[0], row[1], row[2], row[3], row[4], row[5] = x[0], x[1], y[0], y[1], z[0], z[1]
            rate[i, j, k] *= min(row.min(), shortest) / shortest
            slots[i, j, k] = slot
            slot += 1
