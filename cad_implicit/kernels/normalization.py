"""First-order normalization of sampled functions, equations (3.1) and (3.2)."""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .jit import jit, parallel_jit


@jit
def neighbours(index, count, inverse):
    """Return the indices before and after a node, and the factor that makes their difference a slope."""
    before, after = max(index - 1, 0), min(index + 1, count - 1)
    return before, after, inverse / max(after - before, 1)


@jit
def _first_order(value, x, y, z, rvachev, limit):
    """Normalize a value by its gradient x, y, z."""
    square = x * x + y * y + z * z + (value * value if rvachev else 0.0)
    length = math.sqrt(square)
    capped = limit if value > 0 else (-limit if value < 0 else 0.0)
    return value / length if abs(value) < limit * length else capped


@parallel_jit
def normalize(f, out, scale, inverse, rvachev, limit):
    """Write f / sqrt(f² + |∇f|²), or f / |∇f| unless ``rvachev``, into ``out``; at most ``limit`` in absolute value.

    ``f`` is multiplied by ``scale`` on the way, which changes nothing but keeps its square from overflowing.
    """
    n0, n1, n2 = f.shape
    for line in prange(n0 * n1):
        i = line // n1
        j = line - i * n1
        a, b, width0 = neighbours(i, n0, inverse[0] * scale)
        c, d, width1 = neighbours(j, n1, inverse[1] * scale)
        here, before0, after0, before1, after1 = f[i, j], f[a, j], f[b, j], f[i, c], f[i, d]
        width2 = inverse[2] * scale / 2
        for k in range(1, n2 - 1):
            x = (np.float64(after0[k]) - np.float64(before0[k])) * width0
            y = (np.float64(after1[k]) - np.float64(before1[k])) * width1
            z = (np.float64(here[k + 1]) - np.float64(here[k - 1])) * width2
            out[i, j, k] = _first_order(np.float64(here[k]) * scale, x, y, z, rvachev, limit)
        for k in (0, n2 - 1):
            x = (np.float64(after0[k]) - np.float64(before0[k])) * width0
            y = (np.float64(after1[k]) - np.float64(before1[k])) * width1
            e, g, width = neighbours(k, n2, inverse[2] * scale)
            z = (np.float64(here[g]) - np.float64(here[e])) * width
            out[i, j, k] = _first_order(np.float64(here[k]) * scale, x, y, z, rvachev, limit)
