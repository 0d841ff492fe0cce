"""Roots of a function along grid edges, with the foot point and the normal there (Hermite data).

The caller evaluates the function at all unsettled points at once; the kernel then narrows each bracket and says
where to look next.
"""

import math

import numba
import numpy as np

from .crossings import axis_steps, decode_edge
from .jit import parallel_jit

#: A step along the edge this short, in spacings, ends the search whatever the function does (jumps, flat spots).
_SHORTEST_STEP = 1e-9

#: How far beside the expected root to look, in spacings. Gradients of distances are differences of points, all
#: rounding error on the surface itself; the foot point makes up for it, and it is within the tolerance.
_ASIDE = 3e-4


@parallel_jit
def first_guess(values):
    """Fractions (N,) of the edges beside the zero of the line through the end values (N, 2)."""
    at = np.empty(len(values))
    for n in numba.prange(len(values)):
        low, high = values[n, 0], values[n, 1]
        if abs(low) == math.inf or abs(high) == math.inf or low == high:
            at[n] = 0.5
        else:
            at[n] = min(max(low / (low - high), 1e-3), 1 - 1e-3) + _ASIDE
    return at


@parallel_jit
def narrow(pending, code, values, bracket, at, points, f, gradient, spacing, tolerance, foot, normal):
    """Take in the values at ``points`` of the edges ``pending``; returns which of them are not settled yet.

    ``values`` and ``bracket`` (E, 2) hold the two ends around each root, ``at`` (E,) the fraction to look at next.
    An edge is settled if the first-order distance ``|f| / |gradient|`` is below ``tolerance`` spacings. Foot and
    outward unit normal (E, 3) are always set to the latest ones.
    """
    unsettled = np.zeros(len(pending), np.bool_)
    for q in numba.prange(len(pending)):
        n = pending[q]
        axis = decode_edge(code[n])[1]
        along = axis_steps(axis)[0]
        gx, gy, gz = gradient[q, 0], gradient[q, 1], gradient[q, 2]
        squared = gx * gx + gy * gy + gz * gz
        if not (squared > 0 and squared < math.inf):
            # No slope: the edge itself is the best normal there is.
            sign = 1.0 if values[n, 0] <= 0 else -1.0
            gx, gy, gz = sign * along[0], sign * along[1], sign * along[2]
            squared = math.inf
        length = math.sqrt(squared) if squared < math.inf else 1.0
        distance = f[q] / length if squared < math.inf else 0.0
        if not abs(distance) <= spacing:
            distance = 0.0
        normal[n, 0], normal[n, 1], normal[n, 2] = -gx / length, -gy / length, -gz / length
        for d in range(3):
            foot[n, d] = points[q, d] + distance * normal[n, d]
        if squared < math.inf and abs(f[q]) <= tolerance * spacing * length:
            continue
        side = 0 if (f[q] > 0) == (values[n, 0] > 0) else 1
        bracket[n, side] = at[n]
        values[n, side] = f[q]
        low, high = bracket[n, 0], bracket[n, 1]
        slope = (gx * along[0] + gy * along[1] + gz * along[2]) * spacing
        step = at[n] - f[q] / slope + _ASIDE if slope != 0 else -1.0
        if not (step > low and step < high):
            # The secant of the bracket; halving one end's weight when the other one does not move (Illinois).
            a, b = values[n, 0], values[n, 1]
            step = 0.5 * (low + high)
            if abs(a) < math.inf and abs(b) < math.inf:
                step = low + (high - low) * a / (a - b)
            values[n, 1 - side] *= 0.5
            if not (step > low and step < high):
                step = 0.5 * (low + high)
        unsettled[q] = abs(step - at[n]) > _SHORTEST_STEP
        at[n] = step
    return unsettled
