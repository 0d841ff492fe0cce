"""Nearest point of an intersection of a few half-spaces: the projection step of the ball-centre polish."""

from __future__ import annotations

import math

import numba
import numpy as np

from .jit import jit, parallel_jit

#: Planes whose Gram determinant is below this are taken as dependent.
_DEPENDENT = 1e-9

#: A plane counts as kept if it is violated by less than this; lengths are in radii, from a place near the answer.
_FEASIBLE = 1e-9

#: Planes are of the same feature if their normals turned by less than this times the distance between the places they
#: were seen from, in radii (1 for a point, less for a curved face, 0 for a plane).
_SAME_TURN = 1.2


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
    for d in range(3):
        y[d] = x[d]
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
def nearest_feasible_many(which, x, n, b, count, fallback):
    """Do :func:`nearest_feasible` on the rows ``which`` of ``x (N, 3)``, ``n (N, P, 3)``, ``b (N, P)``, ``count (N,)``.

    Returns points and masks; where there is no answer the point of ``fallback (N, 3)`` and -1.
    """
    y, mask = np.zeros((len(which), 3)), np.zeros(len(which), np.int64)
    for q in numba.prange(len(which)):
        k = which[q]
        mask[q] = nearest_feasible(x[k], n[k], b[k], count[k], y[q])
        if mask[q] < 0:
            for d in range(3):
                y[q, d] = fallback[k, d]
    return y, mask


@jit
def add_plane(n, b, seen_from, count, k, normal, offset, place, held, same_normal):
    """Add to the set of row ``k`` the plane that its ``place (N, 3)`` gave, lengths in radii; tells whether it is new.

    It replaces the one of the same convex feature: the normal turns by no more than the place moves in radii, and the
    older plane cuts off more than the feature does; those of a concave one hold together. Or the one whose normal is
    within ``same_normal``. Else, if the set is full, it replaces the slackest of those that are not in the mask
    ``held (N,)``.
    """
    put, slack, slackest = -1, -math.inf, 0
    best = math.inf
    gap = -offset
    for d in range(3):
        gap += normal[d] * place[k, d]
    for i in range(count[k]):
        turned, moved, reach = 0.0, 0.0, -b[k, i]
        for d in range(3):
            turned += (n[k, i, d] - normal[d]) ** 2
            moved += (seen_from[k, i, d] - place[k, d]) ** 2
            reach += n[k, i, d] * place[k, d]
        stale = reach <= gap + _FEASIBLE and turned <= _SAME_TURN**2 * moved
        if turned < best and (stale or turned <= same_normal**2):
            best, put = turned, i
        if reach > slack and (held[k] < 0 or not (held[k] >> i) & 1):
            slack, slackest = reach, i
    new = put < 0
    if new:
        if count[k] < b.shape[1]:
            put = count[k]
            count[k] += 1
        else:
            put = slackest
    for d in range(3):
        n[k, put, d], seen_from[k, put, d] = normal[d], place[k, d]
    b[k, put] = offset
    return new
