"""Values and gradients at points of a closing's surface, as exact as the ball's centre can be polished.

Where a ball pushed against the nearest point of the part fits, the part's own are right; elsewhere those of the ball,
whose rough centre is the nearest point of the contoured surface of centres (:mod:`cad_implicit.exact`).

A part that is itself a closing knows rough values (right within ``_DOUBT`` spacings, mostly within a hundredth) and
polished ones, at several times the cost. The rough ones decide wherever they can, and find the balls' centres; polished
ones are asked where nothing changes, and of the few features that hold each ball.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from .distance import Surface
from .implicit import FloatArray, Implicit, polished
from .polish import polish_centres

#: Rough distances are off by up to this many spacings. Where those of the closing and of the part agree within this,
#: beside the borders of fillets and on faces, a point counts as changed only if its ball is found.
_DOUBT = 0.07

#: A point counts as changed if the pushed ball cuts in by this many spacings; what that leaves out is less than 1e-3
#: spacings deep. The facets of holes stay below: at a tessellation of 0.005 spacings a pushed ball cuts into the
#: neighbours of its facet by at most 0.02.
_DOUBT_CUT = 0.02


def blended(
    part: Implicit,
    centres: Surface,
    radius: float,
    spacing: float,
    points: FloatArray,
    *,
    threads: int | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Values and gradients of the closing of a part.

    Parameters
    ----------
    part : Implicit
        Exact distance to the part in mm.
    centres : Surface
        Contoured surface of the ball's centres.
    radius : float
        Of the ball in mm.
    spacing : float
        Grid spacing in mm of the contoured surface.
    points : (N, 3) float64
        On or near the surface of the closing.
    threads : int, optional
        Default: all cores.

    Returns
    -------
    value : (N,) float64
    gradient : (N, 3) float64
    """
    value, gradient = (array.copy() for array in polished(part, points))
    which, unsure, pushed = _cut(part, radius, spacing, points, value, gradient)
    distance, centre = centres.closest(points[which])
    change = distance - radius - value[which]
    doubtful = change < _DOUBT * spacing
    likely = change > -_DOUBT * spacing
    ask = np.flatnonzero(unsure & likely & doubtful)
    likely[ask] = np.abs(polished(part, pushed[ask])[0]) < radius - _DOUBT_CUT * spacing
    which, centre, doubtful = which[likely], centre[likely], doubtful[likely]
    better = partial(polished, part) if part.rough else None
    within = None if part.rough else part.within
    centre, found = polish_centres(
        part.value_and_gradient, radius, spacing, points[which], centre, within=within, better=better, threads=threads
    )
    keep = found | ~doubtful
    which, centre = which[keep], centre[keep]
    arm = points[which] - centre
    length = np.linalg.norm(arm, axis=1)
    filled = length - radius > value[which]
    which, arm, length = which[filled], arm[filled], length[filled]
    value[which] = length - radius
    gradient[which] = arm / length[:, None]
    return value, gradient


def _cut(
    part: Implicit, radius: float, spacing: float, points: FloatArray, value: FloatArray, gradient: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.bool_], FloatArray]:
    """Numbers of the points whose balls, pushed against the nearest points of the part, cut into it elsewhere.

    Tells for which of them rough values leave a doubt, and the centres of those balls.
    """
    which = np.flatnonzero(value > -radius)
    pushed = points[which] - (value[which] + radius)[:, None] * gradient[which]
    fits = radius - _DOUBT_CUT * spacing
    cut = part.within(pushed, fits)
    which, pushed, unsure = which[cut], pushed[cut], np.zeros(int(cut.sum()), np.bool_)
    if part.rough:
        unsure = np.abs(part(pushed)) > fits - _DOUBT * spacing
    return which, unsure, pushed
