"""Multilinear interpolation on a grid, and its slope."""

from __future__ import annotations

import math

from numba import prange

from .jit import jit, parallel_jit


@jit
def _at(values, x, y, z):
    """Value at a place in spacings from the first node; outside the grid at its nearest place, less the way there."""
    nx, ny, nz = values.shape
    u = min(max(x, 0.0), nx - 1.0)
    v = min(max(y, 0.0), ny - 1.0)
    w = min(max(z, 0.0), nz - 1.0)
    i, j, k = int(u), int(v), int(w)
    a, b, c = min(i + 1, nx - 1), min(j + 1, ny - 1), min(k + 1, nz - 1)
    u, v, w = u - i, v - j, w - k
    low = (1 - v) * ((1 - w) * values[i, j, k] + w * values[i, j, c])
    low += v * ((1 - w) * values[i, b, k] + w * values[i, b, c])
    high = (1 - v) * ((1 - w) * values[a, j, k] + w * values[a, j, c])
    high += v * ((1 - w) * values[a, b, k] + w * values[a, b, c])
    return (1 - u) * low + u * high


@jit
def _outside(x, last, spacing):
    """Square of the way in mm to the nearest place of the grid along an axis."""
    away = max(-x, x - last, 0.0) * spacing
    return away * away


@jit
def _value(values, x, y, z, hx, hy, hz):
    nx, ny, nz = values.shape
    away = _outside(x, nx - 1.0, hx) + _outside(y, ny - 1.0, hy) + _outside(z, nz - 1.0, hz)
    return _at(values, x, y, z) - math.sqrt(away)


@parallel_jit
def interpolate(values, origin, spacing, points, out, slopes):
    """Values at points ``(N, 3)`` in ``out``, and differences over one spacing, half to each side, in ``slopes``.

    ``slopes`` may have no rows if they are not asked for. A planar field is one node thick along its first axis.
    """
    hx, hy, hz = spacing
    for n in prange(len(points)):
        x = (points[n, 0] - origin[0]) / hx
        y = (points[n, 1] - origin[1]) / hy
        z = (points[n, 2] - origin[2]) / hz
        out[n] = _value(values, x, y, z, hx, hy, hz)
        if len(slopes) > 0:
            sx = _value(values, x + 0.5, y, z, hx, hy, hz) - _value(values, x - 0.5, y, z, hx, hy, hz)
            sy = _value(values, x, y + 0.5, z, hx, hy, hz) - _value(values, x, y - 0.5, z, hx, hy, hz)
            sz = _value(values, x, y, z + 0.5, hx, hy, hz) - _value(values, x, y, z - 0.5, hx, hy, hz)
            slopes[n, 0], slopes[n, 1], slopes[n, 2] = sx / hx, sy / hy, sz / hz
