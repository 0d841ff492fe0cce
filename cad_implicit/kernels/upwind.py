"""First-order upwind iterations of the re-initialization equation.

Arrays are ``(n0, n1, n2)`` and contiguous; a planar field is one node thick along the first axis. ``rate`` is the
time step times the smoothed sign of each node, zero where a node is held. ``weight`` holds the inverse squared
spacings. At the border the missing neighbour is the node itself: its difference is zero, so nothing flows in.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .jit import jit, parallel_jit


@jit
def _advance(center, a, b, c, d, e, f, rate, one, weight0, weight1, weight2):
    """Value of a node after one step of (3.6), from its neighbours a b, c d, e f along the three axes.

    With s = +1 or -1, the Godunov Hamiltonian (3.7) takes from each axis the larger of the differences
    ``s (center - neighbour)``, and nothing if both are negative. ``one`` is 1 in the type of the values: a literal
    would turn float32 into float64, which halves the speed.
    """
    zero = one - one
    sign = one if rate >= zero else -one
    x = max(max(sign * (center - a), sign * (center - b)), zero)
    y = max(max(sign * (center - c), sign * (center - d)), zero)
    z = max(max(sign * (center - e), sign * (center - f)), zero)
    return center - rate * (math.sqrt(x * x * weight0 + y * y * weight1 + z * z * weight2) - one)


@parallel_jit
def rates(values, out, time_step, epsilon):
    """Write the time step times the smoothed sign (3.5) of ``values``."""
    n0, n1, n2 = values.shape
    for line in prange(n0 * n1):
        i = line // n1
        j = line - i * n1
        for k in range(n2):
            value = np.float64(values[i, j, k])
            length = math.sqrt(value * value + epsilon * epsilon)
            out[i, j, k] = time_step * value / length if length > 0 else 0.0


@parallel_jit
def step(old, new, rate, weight0, weight1, weight2):
    """Write into ``new`` the values of ``old`` after one forward Euler step."""
    n0, n1, n2 = old.shape
    one = old.dtype.type(1)
    for line in prange(n0 * n1):
        i = line // n1
        j = line - i * n1
        a = old[max(i - 1, 0), j]
        b = old[min(i + 1, n0 - 1), j]
        c = old[i, max(j - 1, 0)]
        d = old[i, min(j + 1, n1 - 1)]
        here = old[i, j]
        speed = rate[i, j]
        out = new[i, j]
        for k in range(1, n2 - 1):
            out[k] = _advance(
                here[k], a[k], b[k], c[k], d[k], here[k - 1], here[k + 1], speed[k], one, weight0, weight1, weight2
            )
        for k in (0, n2 - 1):
            below, above = here[max(k - 1, 0)], here[min(k + 1, n2 - 1)]
            out[k] = _advance(here[k], a[k], b[k], c[k], d[k], below, above, speed[k], one, weight0, weight1, weight2)


@jit
def sweep(values, rate, weight0, weight1, weight2, order):
    """One Gauss-Seidel step: forward Euler in place, along the axes in the directions of the bits of ``order``."""
    n0, n1, n2 = values.shape
    one = values.dtype.type(1)
    for row in range(n0):
        i = n0 - 1 - row if order & 1 else row
        for column in range(n1):
            j = n1 - 1 - column if order & 2 else column
            a = values[max(i - 1, 0), j]
            b = values[min(i + 1, n0 - 1), j]
            c = values[i, max(j - 1, 0)]
            d = values[i, min(j + 1, n1 - 1)]
            here = values[i, j]
            speed = rate[i, j]
            for node in range(n2):
                k = n2 - 1 - node if order & 4 else node
                below, above = here[max(k - 1, 0)], here[min(k + 1, n2 - 1)]
                here[k] = _advance(
                    here[k], a[k], b[k], c[k], d[k], below, above, speed[k], one, weight0, weight1, weight2
                )
