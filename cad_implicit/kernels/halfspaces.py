"""Nearest point of an intersection of a few half-spaces: the projection step of the ball-centre polish."""

from __future__ import annotations

import math

import numba

from .jit import jit, parallel_jit

#: Planes whose Gram determinant is below this are taken as dependent.
_DEPENDENT = 1e-9

#: A plane counts as kept if it is violated by less than this (planes are given relative to the radius, about 1).
_FEASIBLE = 1e-9


@jit
def _one(x, n, b, i):
    """Multiplier of the projection of ``x`` onto plane ``i``."""
    return b[i] - (n[i, 0] * x[0] + n[i, 1] * x[1] + n[i, 2] * x[2])


@jit
def _dot(n, i, j):
    return n[i, 0] * n[j, 0] + n[i, 1] * n[j, 1] + n[i, 2] * n[j, 2]


@jit
def _feasible(y, n, b, count):
    worst = 0.0
    for k in range(count):
        worst = min(worst, n[k, 0] * y[0] + n[k, 1] * y[1] + n[k, 2] * y[2] - b[k])
    return worst >= -_FEASIBLE


@jit
def _move(x, n, i, a, j, c, k, e, y):
    """Write ``x + a n_i + c n_j + e n_k`` to ``y``."""
    for d in range(3):
        y[d] = x[d] + a * n[i, d] + c * n[j, d] + e * n[k, d]


@jit
def _three(g01, g02, g12, r0, r1, r2):
    """Multipliers of three planes with unit normals; (-1, -1, -1) if they are dependent."""
    det = 1.0 + 2.0 * g01 * g02 * g12 - g01 * g01 - g02 * g02 - g12 * g12
    if det < _DEPENDENT:
        return -1.0, -1.0, -1.0
    a = ((1.0 - g12 * g12) * r0 + (g02 * g12 - g01) * r1 + (g01 * g12 - g02) * r2) / det
    c = ((g02 * g12 - g01) * r0 + (1.0 - g02 * g02) * r1 + (g01 * g02 - g12) * r2) / det
    e = ((g01 * g12 - g02) * r0 + (g01 * g02 - g12) * r1 + (1.0 - g01 * g01) * r2) / det
    return a, c, e


@jit
def nearest_feasible(x, n, b, count, y):
    """Nearest point to ``x`` with ``n_i . y >= b_i`` for all ``i < count``, written to ``y``.

    Returns the bit mask of the planes that hold it (at most three), or -1 if no choice of three satisfies all.
    """
    y[:] = x
    if _feasible(y, n, b, count):
        return 0
    for i in range(count):
        a = _one(x, n, b, i)
        if a >= 0.0:
            _move(x, n, i, a, i, 0.0, i, 0.0, y)
            if _feasible(y, n, b, count):
                return 1 << i
    for i in range(count):
        for j in range(i):
            g = _dot(n, i, j)
            det = 1.0 - g * g
            if det < _DEPENDENT:
                continue
            ri, rj = _one(x, n, b, i), _one(x, n, b, j)
            a, c = (ri - g * rj) / det, (rj - g * ri) / det
            if a >= 0.0 and c >= 0.0:
                _move(x, n, i, a, j, c, j, 0.0, y)
                if _feasible(y, n, b, count):
                    return (1 << i) | (1 << j)
    for i in range(count):
        for j in range(i):
            for k in range(j):
                a, c, e = _three(
                    _dot(n, i, j), _dot(n, i, k), _dot(n, j, k), _one(x, n, b, i), _one(x, n, b, j), _one(x, n, b, k)
                )
                if a >= 0.0 and c >= 0.0 and e >= 0.0:
                    _move(x, n, i, a, j, c, k, e, y)
                    if _feasible(y, n, b, count):
                        return (1 << i) | (1 << j) | (1 << k)
    return -1


@parallel_jit
def nearest_feasible_many(x, n, b, count, y, mask):
    """Do :func:`nearest_feasible` for ``x (N, 3)``, normals ``n (N, P, 3)``, offsets ``b (N, P)``, ``count (N,)``."""
    for q in numba.prange(len(x)):
        mask[q] = nearest_feasible(x[q], n[q], b[q], count[q], y[q])


@parallel_jit
def add_plane(n, b, count, normal, offset, wanted, similar, violated):
    """Add a plane to the set of each wanted point, in place of the most similar one, or of the slackest if full.

    A plane is similar if the cosine between the normals is above ``similar``; ``violated (N, 3)`` is the point at
    which slack is measured.
    """
    for q in numba.prange(len(wanted)):
        if not wanted[q]:
            continue
        best, place = similar, -1
        slack, slackest = -math.inf, 0
        for i in range(count[q]):
            cosine = 0.0
            reach = -b[q, i]
            for d in range(3):
                cosine += n[q, i, d] * normal[q, d]
                reach += n[q, i, d] * violated[q, d]
            if cosine > best:
                best, place = cosine, i
            if reach > slack:
                slack, slackest = reach, i
        if place < 0:
            if count[q] < b.shape[1]:
                place = count[q]
                count[q] += 1
            else:
                place = slackest
        n[q, place] = normal[q]
        b[q, place] = offset[q]
