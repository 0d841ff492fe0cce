"""Which sample along a curve is nearest to a point: samples are looked at in groups, of which one tells enough mostly.

Groups are neighbours along the curve; the middle of a group is one of its samples, and none of the curve it stands for
is farther from it than a gap.
"""

from __future__ import annotations

import math

from .jit import jit


@jit
def _square(x, point):
    return (x[0] - point[0]) ** 2 + (x[1] - point[1]) ** 2 + (x[2] - point[2]) ** 2


@jit
def nearest_sample(x, middles, members, points, gap, most):
    """How far a point is at least from the curve, and the distance and number of the nearest sample.

    Parameters
    ----------
    x : (3,) float64
    middles : (G, 3) float64
        Of the groups.
    members : (G + 1,) int64
        Samples of each group: ``members[g]:members[g + 1]``.
    points : (M, 3) float64
        Samples.
    gap : float
        How far the curve may be from the middles.
    most : float
        If all samples are as far as this, the distance is infinite and the number -1.
    """
    first, least = 0, math.inf
    for g in range(len(middles)):
        square = _square(x, middles[g])
        if square < least:
            first, least = g, square
    near = math.sqrt(least)
    if near - gap >= most:
        return near - gap, math.inf, -1
    best, found = most * most, -1
    for turn in range(-1, len(middles)):
        g = turn if turn >= 0 else first
        limit = math.sqrt(best) + gap
        if turn == first or _square(x, middles[g]) >= limit * limit:
            continue
        for k in range(members[g], members[g + 1]):
            square = _square(x, points[k])
            if square < best:
                best, found = square, k
    return near - gap, (math.sqrt(best) if found >= 0 else math.inf), found
