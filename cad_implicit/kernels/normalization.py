"""First-order normalization of sampled functions, equations (3.1) and (3.2)."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .jit import jit, parallel_jit


@jit
def _slope(before, after, steps, inverse):
    """Difference quotient over 0, 1 or 2 spacings; zero along an axis of one node."""
    if steps == 0:
        return 0.0
    return (np.float64(after) - np.float64(before)) * inverse / steps


@jit
def gradient_length(f, i, j, k, inverse):
    """Length of the gradient at a node by central differences, one-sided at the border; no overflow on the way."""
    n0, n1, n2 = f.shape
    i0, i1, j0, j1, k0, k1 = (
        max(i - 1, 0),
        min(i + 1, n0 - 1),
        max(j - 1, 0),
        min(j + 1, n1 - 1),
        max(k - 1, 0),
        min(k + 1, n2 - 1),
    )
    x = _slope(f[i0, j, k], f[i1, j, k], i1 - i0, inverse[0])
    y = _slope(f[i, j0, k], f[i, j1, k], j1 - j0, inverse[1])
    z = _slope(f[i, j, k0], f[i, j, k1], k1 - k0, inverse[2])
    return math.hypot(math.hypot(x, y), z)


@parallel_jit
def normalize(f, out, inverse, rvachev, limit):
    """Write f / sqrt(f² + |∇f|²), or f / |∇f| unless ``rvachev``, into ``out``; at most ``limit`` in absolute value."""
    n0, n1, n2 = f.shape
    for line in prange(n0 * n1):
        i = line // n1
        j = line - i * n1
        for k in range(n2):
            value = np.float64(f[i, j, k])
            length = gradient_length(f, i, j, k, inverse)
            if rvachev:
                length = math.hypot(length, value)
            if abs(value) < limit * length:
                out[i, j, k] = value / length
            elif value > 0:
                out[i, j, k] = limit
            elif value < 0:
                out[i, j, k] = -limit
            else:
                out[i, j, k] = 0
