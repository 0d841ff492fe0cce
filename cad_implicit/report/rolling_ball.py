"""The rolling ball, looked for anew: how near to a point of a blend the centre of a free ball comes.

A global fillet (closing) is what no free ball of the radius reaches; so from each point of its blends the nearest
centre of a free ball is one radius away. That needs nothing of how the blend was made but the distance to the part.
Where a local blend, or the exact kernel's, goes deeper or less deep than the free balls do, as at open ends of edges
and on thin walls, the two differ by nature.
"""

from __future__ import annotations

import numpy as np

from cad_implicit.implicit import FloatArray, Implicit

#: Directions around the normal in which the search starts, and how far to the side, in radii.
_DIRECTIONS = 8
_ASIDE = 0.35

#: Steps of the search: each moves the centre towards the point by this share of what is left, then out of the part.
_STEPS = 40
_SHARE = 0.5
_PUSHES = 3


def nearest_centre(part: Implicit, points: FloatArray, normals: FloatArray, radius: float, sign: float) -> FloatArray:
    """Distances (N,) in mm from points of blends to the nearest centre of a free ball that was found.

    Parameters
    ----------
    part : Implicit
        Signed distance to the part, positive inside.
    points, normals : (N, 3) float64
        Of the blends; normals point towards the ball.
    radius : float
    sign : float
        -1 for balls outside of the part (fillets), 1 for balls inside (rounds).
    """
    starts = _starts(points, normals, radius)
    centres = starts.reshape(-1, 3)
    targets = np.repeat(points, starts.shape[1], axis=0)
    best = np.full(len(targets), np.inf)
    for _ in range(_STEPS):
        centres = _pushed(part, centres, radius, sign)
        free = sign * part(centres) >= radius * (1 - 1e-6)
        away = np.linalg.norm(centres - targets, axis=1)
        best = np.where(free, np.minimum(best, away), best)
        centres = (
            centres
            + _SHARE
            * np.maximum(away - 0.9 * radius, 0.0)[:, None]
            * (targets - centres)
            / np.maximum(away, 1e-300)[:, None]
        )
    return np.asarray(best.reshape(starts.shape[:2]).min(axis=1))


def _starts(points: FloatArray, normals: FloatArray, radius: float) -> FloatArray:
    """Centres (N, K, 3) to start from."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, np.array([[1.0, 0, 0]]), np.array([[0, 1.0, 0]]))
    u = np.cross(normals, helper)
    u /= np.linalg.norm(u, axis=1)[:, None]
    v = np.cross(normals, u)
    turns = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    around = np.cos(turns)[None, :, None] * u[:, None] + np.sin(turns)[None, :, None] * v[:, None]
    centre = points + radius * normals
    return np.concatenate([centre[:, None], centre[:, None] + _ASIDE * radius * around], axis=1)


def _pushed(part: Implicit, centres: FloatArray, radius: float, sign: float) -> FloatArray:
    """Centres moved along the distance's gradient until their balls are free."""
    for _ in range(_PUSHES):
        value, gradient = part.value_and_gradient(centres)
        lack = np.maximum(radius - sign * value, 0.0)
        if float(lack.max(initial=0.0)) < 1e-9 * radius:
            break
        size = np.maximum(np.linalg.norm(gradient, axis=1), 1e-12)
        centres = centres + (sign * lack / size)[:, None] * gradient
    return centres
