"""Kernels integrated along line segments: values and gradients at points, summed over segments.

Lengths are in units of the kernel's width. With the point at the distance rho from a segment's line and the segment
from -u to v as seen from its foot there, the integrals are, by P = 1 + rho² and Q(t) = P + t²,

- Cauchy, (1 + r²)⁻²: t / (2 P Q) + atan(t / sqrt P) / (2 P sqrt P) from -u to v;
- Gauss, exp(-r²): exp(-rho²) sqrt(pi) / 2 erf(t) from -u to v.
"""

from __future__ import annotations

import math

from numba import prange

from .jit import jit, parallel_jit

_HALF_ROOT_PI = math.sqrt(math.pi) / 2


@jit
def _cauchy(square, low, high):
    """Integral, its derivative with rho², and the kernel at the two ends."""
    p = 1 + square
    root = math.sqrt(p)
    q0, q1 = p + low * low, p + high * high
    angle = math.atan(high / root) - math.atan(low / root)
    value = (high / q1 - low / q0 + angle / root) / (2 * p)
    slope = -((high / (q1 * q1) - low / (q0 * q0)) / 2 + 1.5 * value) / p
    return value, slope, 1 / (q0 * q0), 1 / (q1 * q1)


@jit
def _gauss(square, low, high):
    """Integral, its derivative with rho², and the kernel at the two ends."""
    across = math.exp(-square)
    value = across * _HALF_ROOT_PI * (math.erf(high) - math.erf(low))
    return value, -value, across * math.exp(-low * low), across * math.exp(-high * high)


@parallel_jit
def add_segments(points, starts, axes, lengths, weights, width, gaussian, values, gradients):
    """Integrals of all segments, times their weights, in ``values``; derivatives in ``gradients``.

    ``axes`` are unit vectors; ``gradients`` may have no rows if they are not asked for. The integrals are in units of
    the width, the gradients per mm.
    """
    scale = 1 / width
    for n in prange(len(points)):
        total = 0.0
        gx = 0.0
        gy = 0.0
        gz = 0.0
        for m in range(len(starts)):
            x = (points[n, 0] - starts[m, 0]) * scale
            y = (points[n, 1] - starts[m, 1]) * scale
            z = (points[n, 2] - starts[m, 2]) * scale
            ax, ay, az = axes[m, 0], axes[m, 1], axes[m, 2]
            along = x * ax + y * ay + z * az
            x -= along * ax
            y -= along * ay
            z -= along * az
            square = x * x + y * y + z * z
            low, high = -along, lengths[m] * scale - along
            if gaussian:
                value, slope, first, last = _gauss(square, low, high)
            else:
                value, slope, first, last = _cauchy(square, low, high)
            w = weights[m]
            total += w * value
            radial = 2 * w * slope
            axial = w * (first - last)
            gx += radial * x + axial * ax
            gy += radial * y + axial * ay
            gz += radial * z + axial * az
        values[n] = total
        if len(gradients) > 0:
            gradients[n, 0] = gx * scale
            gradients[n, 1] = gy * scale
            gradients[n, 2] = gz * scale
