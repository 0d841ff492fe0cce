"""B-spline surfaces a point at a time: positions, derivatives, and closest points by Newton's method.

:class:`cad_implicit.splines.SplineSurface` says the same for many points at once in NumPy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import prange

from .jit import jit, parallel_jit

#: Points that one thread works through with the same memory.
_CHUNK = 256
#: Newton's steps at most; quadratic convergence takes 3 to 5, slower near centres of curvature.
_STEPS = 30
#: Times that a step is cut to a quarter where the distance grows.
_CUTS = 8


class Spline(NamedTuple):
    """Homogeneous control points ``(A, B, 4)``, knots of both directions, and four pairs of what is the same for all.

    Those are the degrees, the lower and upper borders of the rectangle, and whether it closes.
    """

    poles: np.ndarray
    u_knots: np.ndarray
    v_knots: np.ndarray
    degrees: np.ndarray
    low: np.ndarray
    high: np.ndarray
    closed: np.ndarray


@jit
def basis(knots, degree, t, out):
    """Last control point that matters; basis functions and two derivatives go to ``out (3, degree + 1)``."""
    last = len(knots) - degree - 2
    low, span = degree, last + 1
    while span - low > 1:  # the last knot that is not above t
        middle = (low + span) // 2
        if knots[middle] <= t:
            low = middle
        else:
            span = middle
    span = low
    while span > degree and knots[span] == knots[span + 1]:  # the upper end of the rectangle
        span -= 1
    values = out[0]
    values[0] = 1.0
    out[2, :] = 0.0
    for level in range(1, degree + 1):
        if level == degree - 1:
            out[2, :level] = values[:level]
        if level == degree:
            out[1, :level] = values[:level]
        carried = 0.0
        for r in range(level):
            below, above = knots[span + 1 + r - level], knots[span + 1 + r]
            share = values[r] / (above - below)
            values[r] = carried + (above - t) * share
            carried = (t - below) * share
        values[level] = carried
    _derive(knots, span, degree, out[1])
    if degree > 1:
        _derive(knots, span, degree - 1, out[2])
        _derive(knots, span, degree, out[2])
    return span


@jit
def _derive(knots, span, level, values):
    """Replace basis functions of the level below by the derivatives of those of a level."""
    carried = 0.0
    for r in range(level):
        share = level * values[r] / (knots[span + 1 + r] - knots[span + 1 + r - level])
        values[r] = carried - share
        carried = share
    values[level] = carried


@jit
def evaluate(spline, u, v, bu, bv, w, out):
    """Position and derivatives u, v, uu, uv, vv at any parameters go to ``out (6, 3)``; beyond its borders it is ruled.

    ``bu``, ``bv`` (3, degree + 1) and ``w`` (6, 4) are working memory.
    """
    if spline.closed[0]:
        u = spline.low[0] + (u - spline.low[0]) % (spline.high[0] - spline.low[0])
    if spline.closed[1]:
        v = spline.low[1] + (v - spline.low[1]) % (spline.high[1] - spline.low[1])
    iu = min(max(u, spline.low[0]), spline.high[0])
    iv = min(max(v, spline.low[1]), spline.high[1])
    p, q = spline.degrees[0], spline.degrees[1]
    i = basis(spline.u_knots, p, iu, bu) - p
    j = basis(spline.v_knots, q, iv, bv) - q
    for k in range(4):
        a0 = a1 = a2 = a3 = a4 = a5 = 0.0
        for a in range(p + 1):
            s0 = s1 = s2 = 0.0
            for b in range(q + 1):
                pole = spline.poles[i + a, j + b, k]
                s0 += bv[0, b] * pole
                s1 += bv[1, b] * pole
                s2 += bv[2, b] * pole
            a0 += bu[0, a] * s0
            a1 += bu[1, a] * s0
            a2 += bu[0, a] * s1
            a3 += bu[2, a] * s0
            a4 += bu[1, a] * s1
            a5 += bu[0, a] * s2
        w[0, k], w[1, k], w[2, k], w[3, k], w[4, k], w[5, k] = a0, a1, a2, a3, a4, a5
    whole = 1 / w[0, 3]
    wu, wv, wuu, wuv, wvv = w[1, 3], w[2, 3], w[3, 3], w[4, 3], w[5, 3]
    du, dv = u - iu, v - iv
    for k in range(3):
        s = w[0, k] * whole
        su, sv = (w[1, k] - wu * s) * whole, (w[2, k] - wv * s) * whole
        suu = (w[3, k] - 2 * wu * su - wuu * s) * whole
        suv = (w[4, k] - wu * sv - wv * su - wuv * s) * whole
        svv = (w[5, k] - 2 * wv * sv - wvv * s) * whole
        out[0, k] = s + du * su + dv * sv + du * dv * suv
        out[1, k] = su + dv * suv
        out[2, k] = sv + du * suv
        out[3, k] = suu if du == 0 else 0.0
        out[4, k] = suv
        out[5, k] = svv if dv == 0 else 0.0


@jit
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def _newton_step(at, way):
    """Step towards the closest point; Gauss and Newton's where the function is not convex."""
    gu, gv = _dot(way, at[1]), _dot(way, at[2])
    first_a, first_b, first_c = _dot(at[1], at[1]), _dot(at[1], at[2]), _dot(at[2], at[2])
    a, b, c = first_a + _dot(way, at[3]), first_b + _dot(way, at[4]), first_c + _dot(way, at[5])
    if not (a > 0.05 * first_a and a * c - b * b > 0.01 * (first_a * first_c - first_b * first_b)):
        a, b, c = first_a, first_b, first_c
    lift = 1e-14 * (a + c)
    a, c = a + lift, c + lift
    determinant = a * c - b * b
    if not determinant > 0:
        return 0.0, 0.0
    return (b * gv - c * gu) / determinant, (b * gu - a * gv) / determinant


@parallel_jit
def feet(spline, points, guess, size, last):
    """Closest points by Newton's method on half the squared distance, damped where it does not go down.

    Parameters
    ----------
    points, guess : (N, 3) and (N, 2)
        Parameters to start from.
    size, last : float
        Longest step, and one that is the last, in mm.

    Returns
    -------
    uv, at : (N, 2) and (N, 3, 3)
        Parameters, and positions and first derivatives there.
    """
    count = len(points)
    uv, found = guess.copy(), np.zeros((count, 3, 3))
    for chunk in prange((count + _CHUNK - 1) // _CHUNK):
        bu, bv = np.zeros((3, spline.degrees[0] + 1)), np.zeros((3, spline.degrees[1] + 1))
        w, at, there, way = np.zeros((6, 4)), np.zeros((6, 3)), np.zeros((6, 3)), np.zeros(3)
        for n in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, count)):
            u, v = uv[n, 0], uv[n, 1]
            evaluate(spline, u, v, bu, bv, w, at)
            for _ in range(_STEPS):
                way[:] = at[0] - points[n]
                before = _dot(way, way)
                du, dv = _newton_step(at, way)
                length = math.sqrt(_dot(at[1], at[1])) * abs(du) + math.sqrt(_dot(at[2], at[2])) * abs(dv)
                share = min(1.0, size / max(length, 1e-300))
                stuck = True
                for _ in range(_CUTS):
                    evaluate(spline, u + share * du, v + share * dv, bu, bv, w, there)
                    way[:] = there[0] - points[n]
                    if _dot(way, way) <= before * (1 + 1e-14):
                        stuck = False
                        break
                    share /= 4
                if stuck:
                    break
                u, v = u + share * du, v + share * dv
                at[:] = there
                if length * share <= last:
                    break
            uv[n, 0], uv[n, 1] = u, v
            found[n] = at[:3]
    return uv, found
