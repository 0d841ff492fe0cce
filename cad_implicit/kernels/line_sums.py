"""Cauchy kernels integrated along line segments: values alone, in vector instructions.

The formula of :mod:`.convolution`, with the difference of the two angles as one: for a segment from ``low`` to ``high``
it is the angle of ``(P + low high, (high - low) sqrt P)``, between 0 and pi. Everything is arithmetic and selection, so
that the loop over the points of a block is compiled for as many points at a time as the machine has lanes.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .jit import jit, parallel_jit

#: Points of a block: their coordinates stay in the nearest cache while all segments pass by.
_BLOCK = 256

#: atan(x) / x as a polynomial of x² up to tan(pi/8), right to 1.5e-16: interpolated at 11 Chebyshev nodes.
_A0, _A1, _A2, _A3, _A4, _A5, _A6, _A7, _A8, _A9, _A10 = (
    1.0,
    -0.3333333333332844,
    0.1999999999885511,
    -0.14285714180976467,
    0.11111106180455946,
    -0.09090773074808414,
    0.07689953496306857,
    -0.06640233930429408,
    0.0568834922680901,
    -0.043480522157164615,
    0.021135373157693236,
)

_TAN = math.sqrt(2) - 1


@jit
def _integral(along, high, p, root):
    """Integral over a segment from -along to high, seen from the foot of a point with P = ``p``, its root ``root``.

    One division serves the three quotients; it overflows for points some 1e38 widths away.
    """
    q0 = p + along * along
    q1 = p + high * high
    x = p - along * high
    y = (along + high) * root
    ax = abs(x)
    swap = y > ax
    small = ax if swap else y
    large = y if swap else ax
    turned = small > _TAN * large
    above = small - large if turned else small
    below = small + large if turned else large
    ends = q0 * q1
    inverse = 1 / (p * ends * below)
    share = inverse * ends * below
    t = above * (inverse * ends * p)
    z = t * t
    a = _A10
    a = a * z + _A9
    a = a * z + _A8
    a = a * z + _A7
    a = a * z + _A6
    a = a * z + _A5
    a = a * z + _A4
    a = a * z + _A3
    a = a * z + _A2
    a = a * z + _A1
    a = a * z + _A0
    a *= t
    a = a + math.pi / 4 if turned else a
    a = math.pi / 2 - a if swap else a
    a = math.pi - a if x < 0 else a
    return share * ((high * q0 + along * q1) * (inverse * p * below) + a * root * share) / 2


@parallel_jit
def sum_cauchy(points, starts, axes, lengths, weights, width, values):
    """Integrals of all segments, times their weights, in ``values``; ``axes`` are unit vectors."""
    scale = 1 / width
    blocks = (len(points) + _BLOCK - 1) // _BLOCK
    for b in prange(blocks):
        first = b * _BLOCK
        count = min(_BLOCK, len(points) - first)
        px = np.zeros(_BLOCK)
        py = np.zeros(_BLOCK)
        pz = np.zeros(_BLOCK)
        total = np.zeros(_BLOCK)
        for n in range(count):
            px[n] = points[first + n, 0] * scale
            py[n] = points[first + n, 1] * scale
            pz[n] = points[first + n, 2] * scale
        for m in range(len(starts)):
            sx, sy, sz = starts[m, 0] * scale, starts[m, 1] * scale, starts[m, 2] * scale
            ax, ay, az = axes[m, 0], axes[m, 1], axes[m, 2]
            length, weight = lengths[m] * scale, weights[m]
            for n in range(_BLOCK):
                x = px[n] - sx
                y = py[n] - sy
                z = pz[n] - sz
                along = x * ax + y * ay + z * az
                x -= along * ax
                y -= along * ay
                z -= along * az
                p = 1 + x * x + y * y + z * z
                total[n] += weight * _integral(along, length - along, p, math.sqrt(p))
        for n in range(count):
            values[first + n] = total[n]
