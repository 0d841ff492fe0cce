"""Higher-order iterations of the re-initialization equation: ENO of second and WENO of fifth order.

Next to the interface the one-sided differences end where the edge crosses it, not at the node behind (Min and Gibou
2007; A. du Chéné, C. Min, F. Gibou, "Second-order accurate computation of curvatures in a level set framework using
novel high-order reinitialization schemes", J. Sci. Comput. 35 (2008), doi:10.1007/s10915-007-9177-1). Arrays are as
in :mod:`.upwind`; the border is treated alike.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .crossing import minmod
from .jit import jit, parallel_jit

#: Keeps the WENO weights finite on constant data, relative to the largest squared difference (Osher and Fedkiw,
#: "Level Set Methods and Dynamic Implicit Surfaces", section 3.4).
_WENO_RELATIVE = 1e-6
_WENO_ABSOLUTE = 1e-99


@jit
def weno5(a, b, c, d, e):
    """Fifth-order difference from five successive one-sided ones, the upwind end first."""
    s1 = 13 / 12 * (a - 2 * b + c) ** 2 + (a - 4 * b + 3 * c) ** 2 / 4
    s2 = 13 / 12 * (b - 2 * c + d) ** 2 + (b - d) ** 2 / 4
    s3 = 13 / 12 * (c - 2 * d + e) ** 2 + (3 * c - 4 * d + e) ** 2 / 4
    small = _WENO_RELATIVE * max(a * a, max(b * b, max(c * c, max(d * d, e * e)))) + _WENO_ABSOLUTE
    w1, w2, w3 = 0.1 / (s1 + small) ** 2, 0.6 / (s2 + small) ** 2, 0.3 / (s3 + small) ** 2
    p1 = a / 3 - 7 * b / 6 + 11 * c / 6
    p2 = -b / 6 + 5 * c / 6 + d / 3
    p3 = c / 3 + 5 * d / 6 - e / 6
    return (w1 * p1 + w2 * p2 + w3 * p3) / (w1 + w2 + w3)


@jit
def eno2(b2, b1, here, a1, a2, spacing, before, after):
    """Second-order backward and forward differences, cut off at the crossings at ``before`` and ``after``."""
    square = spacing * spacing
    middle = (a1 - 2 * here + b1) / square
    lower = minmod(middle, (here - 2 * b1 + b2) / square)
    upper = minmod(middle, (a2 - 2 * a1 + here) / square)
    backward = (here - b1) / spacing + spacing / 2 * lower if before == np.inf else here / before + before / 2 * lower
    forward = (a1 - here) / spacing - spacing / 2 * upper if after == np.inf else -here / after - after / 2 * upper
    return backward, forward


@jit
def _upwind_square(b3, b2, b1, here, a1, a2, a3, spacing, before, after, weno, sign):
    """Square of the difference along one axis that the Godunov Hamiltonian takes."""
    if weno and before == np.inf and after == np.inf:
        d0, d1, d2, d3, d4, d5 = b2 - b3, b1 - b2, here - b1, a1 - here, a2 - a1, a3 - a2
        backward = weno5(d0, d1, d2, d3, d4) / spacing
        forward = weno5(d5, d4, d3, d2, d1) / spacing
    else:
        backward, forward = eno2(b2, b1, here, a1, a2, spacing, before, after)
    upwind = max(max(sign * backward, -sign * forward), 0.0)
    return upwind * upwind


@jit
def _advance(p, i, j, k, rate, slot, distances, spacing, weno):
    """Value of a node after one forward Euler step."""
    n0, n1, n2 = p.shape
    c = p[i, j, k]
    sign = 1.0 if rate >= 0 else -1.0
    x0 = x1 = y0 = y1 = z0 = z1 = np.inf
    if slot >= 0:
        row = distances[slot]
        x0, x1, y0, y1, z0, z1 = row[0], row[1], row[2], row[3], row[4], row[5]
    square = 0.0
    if n0 > 1:
        b3, b2, b1 = p[max(i - 3, 0), j, k], p[max(i - 2, 0), j, k], p[max(i - 1, 0), j, k]
        a1, a2, a3 = p[min(i + 1, n0 - 1), j, k], p[min(i + 2, n0 - 1), j, k], p[min(i + 3, n0 - 1), j, k]
        square += _upwind_square(b3, b2, b1, c, a1, a2, a3, spacing[0], x0, x1, weno, sign)
    b3, b2, b1 = p[i, max(j - 3, 0), k], p[i, max(j - 2, 0), k], p[i, max(j - 1, 0), k]
    a1, a2, a3 = p[i, min(j + 1, n1 - 1), k], p[i, min(j + 2, n1 - 1), k], p[i, min(j + 3, n1 - 1), k]
    square += _upwind_square(b3, b2, b1, c, a1, a2, a3, spacing[1], y0, y1, weno, sign)
    b3, b2, b1 = p[i, j, max(k - 3, 0)], p[i, j, max(k - 2, 0)], p[i, j, max(k - 1, 0)]
    a1, a2, a3 = p[i, j, min(k + 1, n2 - 1)], p[i, j, min(k + 2, n2 - 1)], p[i, j, min(k + 3, n2 - 1)]
    square += _upwind_square(b3, b2, b1, c, a1, a2, a3, spacing[2], z0, z1, weno, sign)
    return c - rate * (math.sqrt(square) - 1)


@parallel_jit
def step(old, new, rate, slots, distances, spacing, weno):
    """Write into ``new`` the values of ``old`` after one forward Euler step."""
    n0, n1, n2 = old.shape
    for line in prange(n0 * n1):
        i = line // n1
        j = line - i * n1
        for k in range(n2):
            new[i, j, k] = _advance(old, i, j, k, rate[i, j, k], slots[i, j, k], distances, spacing, weno)


@jit
def sweep(values, rate, slots, distances, spacing, weno, order):
    """One Gauss-Seidel step: forward Euler in place, along the axes in the directions of the bits of ``order``."""
    n0, n1, n2 = values.shape
    for row in range(n0):
        i = n0 - 1 - row if order & 1 else row
        for column in range(n1):
            j = n1 - 1 - column if order & 2 else column
            for node in range(n2):
                k = n2 - 1 - node if order & 4 else node
                values[i, j, k] = _advance(values, i, j, k, rate[i, j, k], slots[i, j, k], distances, spacing, weno)
