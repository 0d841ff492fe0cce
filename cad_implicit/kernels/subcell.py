"""The nodes next to the interface: which they are, and how far from it (Russo and Smereka's sub-cell fix)."""

from __future__ import annotations

import numpy as np
from numba import prange

from .jit import jit, parallel_jit
from .normalization import gradient_length


@jit
def _sign(value):
    """-1, 0 or 1."""
    return (value > 0) - (value < 0)


@jit
def _next_to_interface(f, i, j, k):
    """Whether the node lies on the interface or one of its six edges crosses or touches it."""
    n0, n1, n2 = f.shape
    sign = _sign(f[i, j, k])
    return (
        sign == 0
        or _sign(f[max(i - 1, 0), j, k]) != sign
        or _sign(f[min(i + 1, n0 - 1), j, k]) != sign
        or _sign(f[i, max(j - 1, 0), k]) != sign
        or _sign(f[i, min(j + 1, n1 - 1), k]) != sign
        or _sign(f[i, j, max(k - 1, 0)]) != sign
        or _sign(f[i, j, min(k + 1, n2 - 1)]) != sign
    )


@jit
def _steepest(f, i, j, k, inverse):
    """Largest of the six one-sided difference quotients of a node."""
    n0, n1, n2 = f.shape
    c = np.float64(f[i, j, k])
    x = max(abs(c - f[max(i - 1, 0), j, k]), abs(c - f[min(i + 1, n0 - 1), j, k])) * inverse[0]
    y = max(abs(c - f[i, max(j - 1, 0), k]), abs(c - f[i, min(j + 1, n1 - 1), k])) * inverse[1]
    z = max(abs(c - f[i, j, max(k - 1, 0)]), abs(c - f[i, j, min(k + 1, n2 - 1)])) * inverse[2]
    return max(x, max(y, z))


@parallel_jit
def hold(f, values, rate, inverse):
    """Set ``values`` to the distance and ``rate`` to zero at the nodes next to the interface of ``f``.

    The distance is (3.2) with the longer of the central gradient and the steepest one-sided difference: at a crease
    the central gradient may vanish, the one-sided differences cannot, because one of them crosses the interface.
    """
    n0, n1, n2 = f.shape
    for line in prange(n0 * n1):
        i = line // n1
        j = line - i * n1
        for k in range(n2):
            if not _next_to_interface(f, i, j, k):
                continue
            rate[i, j, k] = 0
            values[i, j, k] = 0
            if f[i, j, k] != 0:
                slope = max(gradient_length(f, i, j, k, inverse), _steepest(f, i, j, k, inverse))
                values[i, j, k] = np.float64(f[i, j, k]) / slope
