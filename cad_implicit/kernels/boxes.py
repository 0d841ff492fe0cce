"""Which boxes hold points, and how far outside of the others they are."""

from __future__ import annotations

import math

import numba
import numpy as np

from .jit import parallel_jit

_CHUNK = 1024


@parallel_jit
def around(points, boxes, margins, inside):
    """Set which boxes (R, 2, 3) hold which points (N, 3) in ``inside`` (R, N); returns values (N,) of the other boxes.

    These are the distances, along the axes and negative, from the nearest box when each sticks out by its margin (R,);
    minus infinity if there is none.
    """
    value = np.empty(len(points))
    for chunk in numba.prange((len(points) + _CHUNK - 1) // _CHUNK):
        for n in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, len(points))):
            best = -math.inf
            for r in range(len(boxes)):
                outside = -math.inf
                for d in range(3):
                    outside = max(outside, max(boxes[r, 0, d] - points[n, d], points[n, d] - boxes[r, 1, d]))
                inside[r, n] = outside <= 0
                if outside > 0:
                    best = max(best, -outside - margins[r])
            value[n] = best
    return value
