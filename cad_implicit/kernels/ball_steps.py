"""Steps of the ball-centre polish (:mod:`cad_implicit.polish`) for rows ``which`` of its arrays; lengths in radii.

What is done for a row is a function of its own: the compiler takes much longer over the body of a parallel loop.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from .halfspaces import add_plane, nearest_feasible
from .jit import jit, parallel_jit


@parallel_jit
def step(which, base, goal, longest, reach, origin, radius, place):
    """Move places towards goals; which of them (W,) stay in reach, which arrive, and where in mm (W, 3) to look."""
    near, arrived = np.zeros(len(which), np.bool_), np.zeros(len(which), np.bool_)
    points = np.empty((len(which), 3))
    for q in numba.prange(len(which)):
        k = which[q]
        square, far = 0.0, 0.0
        for d in range(3):
            square += (goal[k, d] - base[k, d]) ** 2
        length = math.sqrt(square)
        arrived[q] = length <= longest
        share = 1.0 if arrived[q] else longest / length
        for d in range(3):
            place[k, d] = base[k, d] + share * (goal[k, d] - base[k, d])
            far += place[k, d] ** 2
            points[q, d] = origin[k, d] + radius * place[k, d]
        near[q] = math.sqrt(far) <= reach
    return near, arrived, points


@jit
def _look(
    k, r, value, gradient, radius, cut, same_normal, target, n, b, seen_from, count, held, place, base, gap, goal
):
    """Do :func:`look` for one row ``k`` with values and gradients of row ``r``; returns the mask."""
    new = False
    gap[k] = 0.0
    if r >= 0:
        gap[k] = -1.0 - value[r] / radius
        if gap[k] < -cut or count[k] == 0:
            normal, offset = np.empty(3), -gap[k]
            for d in range(3):
                normal[d] = -gradient[r, d]
                offset += normal[d] * place[k, d]
            new = add_plane(n, b, seen_from, count, k, normal, offset, place, held, same_normal)
    if not new:
        for d in range(3):
            base[k, d] = place[k, d]
    mask = nearest_feasible(target[k], n[k], b[k], count[k], goal[k])
    if mask < 0:
        for d in range(3):
            goal[k, d] = place[k, d]
    return mask


@parallel_jit
def look(
    which, row, value, gradient, radius, cut, same_normal, target, n, b, seen_from, count, held, place, base, gap, goal
):
    """Add the planes that places gave where balls cut in by more than ``cut``, and project; returns the masks (W,).

    ``row`` (W,) numbers the values and gradients of the part, -1 where balls are known to fit.
    """
    mask = np.empty(len(which), np.int64)
    for q in numba.prange(len(which)):
        mask[q] = _look(
            which[q], row[q], value, gradient, radius, cut, same_normal, target, n, b, seen_from, count, held, place,
            base, gap, goal,
        )  # fmt: skip
    return mask


@jit
def holding(which, mask, n, place, origin, radius, ahead):
    """Rows (H,) and numbers (H,) of the planes that hold places, and points in mm (H, 3) towards their features."""
    query, plane = np.empty(3 * len(which), np.int64), np.empty(3 * len(which), np.int64)
    points = np.empty((3 * len(which), 3))
    h = 0
    for q in range(len(which)):
        k = which[q]
        for i in range(n.shape[1] if mask[q] > 0 else 0):
            if (mask[q] >> i) & 1:
                query[h], plane[h] = k, i
                for d in range(3):
                    points[h, d] = origin[k, d] + radius * (place[k, d] - ahead * n[k, i, d])
                h += 1
    return query[:h], plane[:h], points[:h]


@jit
def linearize(query, plane, value, gradient, radius, ahead, same, n, b, seen_from, place):
    """Take planes anew from values and gradients of the part nearby, where those are of the same feature."""
    for h in range(len(query)):
        k, i = query[h], plane[h]
        cosine, offset = 0.0, 1.0 + value[h] / radius
        for d in range(3):
            cosine -= gradient[h, d] * n[k, i, d]
            offset -= gradient[h, d] * (place[k, d] - ahead * n[k, i, d])
        if cosine > same:
            for d in range(3):
                n[k, i, d] = -gradient[h, d]
                seen_from[k, i, d] = place[k, d]
            b[k, i] = offset


@jit
def _settle(
    k, cut, close, fits, farthest, target, n, b, count, place, gap, goal, before, before_goal, held, settled,
    best, shortest, best_n, best_b, best_count,
):  # fmt: skip
    """Do :func:`settle` for one row ``k``."""
    projected = np.empty(3)
    mask = nearest_feasible(target[k], n[k], b[k], count[k], projected)
    length, after, dot, square = 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        if mask < 0:
            projected[d] = place[k, d]
        length += (target[k, d] - place[k, d]) ** 2
        after += (target[k, d] - projected[d]) ** 2
        moved = projected[d] - place[k, d]
        change = moved - (before_goal[k, d] - before[k, d])
        dot += change * moved
        square += change * change
    length, after = math.sqrt(length), math.sqrt(after)
    settled[k] = gap[k] >= -cut and abs(length - after) <= close and mask > 0
    share = dot / max(square, 1e-300)
    usable = -farthest < share < 1 and mask == held[k]
    for d in range(3):
        goal[k, d] = projected[d] - (share * (projected[d] - before_goal[k, d]) if usable else 0.0)
        before[k, d], before_goal[k, d] = place[k, d], projected[d]
    held[k] = mask
    length += max(-gap[k], 0.0)  # depth counts as much as the distance it might save
    if settled[k] or (gap[k] >= -fits and length < shortest[k]):
        shortest[k] = length
        for d in range(3):
            best[k, d] = projected[d] if settled[k] else place[k, d]
        slot = 0
        for i in range(n.shape[1]):
            if mask > 0 and (mask >> i) & 1:
                best_b[k, slot] = b[k, i]
                for d in range(3):
                    best_n[k, slot, d] = n[k, i, d]
                slot += 1
        best_count[k] = slot


@parallel_jit
def settle(
    which, cut, close, fits, farthest, target, n, b, count, place, gap, goal, before, before_goal, held, settled,
    best, shortest, best_n, best_b, best_count,
):  # fmt: skip
    """Project places that arrived anew; settle those that this does not move, and remember the best."""
    for q in numba.prange(len(which)):
        _settle(
            which[q], cut, close, fits, farthest, target, n, b, count, place, gap, goal, before, before_goal, held,
            settled, best, shortest, best_n, best_b, best_count,
        )  # fmt: skip
