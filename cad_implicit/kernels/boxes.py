"""Which boxes hold points, and how far outside of the others they are."""

from __future__ import annotations

import math

import numba
import numpy as np

from .jit import jit, parallel_jit

_CHUNK = 1024

#: Boxes that follow one another are often neighbours: so many have a common one.
_GROUP = 8


@jit
def _outside(point, low, high):
    """How far a point is outside of a box along the axes; negative inside."""
    far = -math.inf
    for d in range(3):
        far = max(far, max(low[d] - point[d], point[d] - high[d]))
    return far


@parallel_jit
def around(points, boxes, margins, inside):
    """Set which boxes (R, 2, 3) hold which points (N, 3) in ``inside`` (R, N), false so far; returns values (N,).

    These are the distances, along the axes and negative, from the nearest other box when each sticks out by its margin
    (R,); minus infinity if there is none.
    """
    value = np.empty(len(points))
    groups = (len(boxes) + _GROUP - 1) // _GROUP
    common, least = np.empty((groups, 2, 3)), np.empty(groups)
    for g in range(groups):
        least[g] = margins[g * _GROUP : (g + 1) * _GROUP].min()
        for d in range(3):
            common[g, 0, d] = boxes[g * _GROUP : (g + 1) * _GROUP, 0, d].min()
            common[g, 1, d] = boxes[g * _GROUP : (g + 1) * _GROUP, 1, d].max()
    for chunk in numba.prange((len(points) + _CHUNK - 1) // _CHUNK):
        for n in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, len(points))):
            best = -math.inf
            for g in range(groups):
                far = _outside(points[n], common[g, 0], common[g, 1])
                if far > 0 and -far - least[g] <= best:
                    continue
                for r in range(g * _GROUP, min((g + 1) * _GROUP, len(boxes))):
                    outside = _outside(points[n], boxes[r, 0], boxes[r, 1])
                    inside[r, n] = outside <= 0
                    if outside > 0:
                        best = max(best, -outside - margins[r])
            value[n] = best
    return value
