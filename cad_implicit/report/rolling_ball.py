"""The rolling ball, looked for anew: how near to a point of a blend the centre of a free ball comes.

A global fillet (closing) is what no free ball of the radius reaches; so from each point of its blends the nearest
centre of a free ball is one radius away. That needs nothing of how the blend was made but the distance to the part.
Where a local blend, or the exact kernel's, goes deeper or less deep than the free balls do, as at open ends of edges
and on thin walls, the two differ by nature.
"""

from __future__ import annotations

import numpy as np

from cad_implicit.implicit import FloatArray, Implicit

#: Directions around the normal in which the search starts, and how far to the side, in radii. What starts farther off
#: does not step, or it would be back: a ball that rolls off the end of an edge of 90 degrees reaches deepest from 0.7
#: radii beyond the end, and on the way there it is farther away.
_DIRECTIONS = 8
_ASIDE = 0.35
_FARTHER = 0.8

#: Steps of the search: each moves the centre towards the point by this share of what is left over 0.9 radii, then out
#: of the part by so many pushes at most (three planes at 110 degrees need ten to 0.008 radii); a centre that a step
#: leaves within this share of the radius has arrived.
_STEPS = 15
_SHARE = 0.5
_PUSHES = 12
_ARRIVED = 1e-5

#: Then the nearest centre is tried in directions around it, so many radii aside (those that started near, and farther),
#: half of that if none is nearer.
_TRIES = 16
_WIDTH = (0.3, 0.1)
_AROUND = 6

#: … until that is less than this. (Distances of 4,800 points are those of all tries to 5e-5 radii.)
_NARROWEST = 2e-5

#: Where that leaves more than this share of the radius, it is tried once more, longer. (In the counter of a letter,
#: where the ball sits on three faces and the normal was off by 39 degrees, 16 tries left 0.022 radii.)
_DOUBTFUL = 2e-3
_LONGER = 40

#: A ball is free if it lacks no more than this share of the radius.
_FREE = 1e-6


def nearest_centre(
    part: Implicit, points: FloatArray, normals: FloatArray, radius: float, sign: float
) -> tuple[FloatArray, FloatArray]:
    """Distances (N,) in mm from points of blends to the nearest centre of a free ball that was found, and these (N, 3).

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
    best, nearest = np.full(len(points), np.inf), points.copy()
    middle = (points + radius * normals)[:, None]
    around = radius * _around(normals, _DIRECTIONS)
    near = np.concatenate([middle, middle + _ASIDE * around], axis=1)
    for starts, steps, width in ((near, _STEPS, _WIDTH[0]), (middle + _FARTHER * around, 1, _WIDTH[1])):
        centres, away = _stepped(part, points, starts, radius, sign, steps)
        centres, away = _tried(part, points, centres, away, width, radius, sign)
        nearer = away < best
        best[nearer], nearest[nearer] = away[nearer], centres[nearer]
    doubt = np.flatnonzero(np.isfinite(best) & (np.abs(best - radius) > _DOUBTFUL * radius))
    nearest[doubt], best[doubt] = _tried(
        part, points[doubt], nearest[doubt], best[doubt], _WIDTH[0], radius, sign, _LONGER
    )
    return best, nearest


def _stepped(
    part: Implicit, points: FloatArray, starts: FloatArray, radius: float, sign: float, steps: int
) -> tuple[FloatArray, FloatArray]:
    """Nearest centres (N, 3) that steps from the starts (N, K, 3) pass, and their distances (N,), infinite if none."""
    centres = starts.reshape(-1, 3)
    targets = np.repeat(points, starts.shape[1], axis=0)
    best, found = np.full(len(targets), np.inf), centres.copy()
    on = np.arange(len(targets))
    for _ in range(steps):
        now, away = _fitted(part, centres[on], targets[on], radius, sign)
        nearer = away < best[on]
        best[on[nearer]], found[on[nearer]] = away[nearer], now[nearer]
        away = np.maximum(np.linalg.norm(now - targets[on], axis=1), 1e-300)
        left = _SHARE * np.maximum(away - 0.9 * radius, 0.0)
        after = now + (left / away)[:, None] * (targets[on] - now)
        going = np.linalg.norm(after - centres[on], axis=1) > _ARRIVED * radius
        centres[on] = after
        on = on[going]
        if len(on) == 0:
            break
    least = best.reshape(starts.shape[:2]).argmin(axis=1) + starts.shape[1] * np.arange(len(points))
    return found[least], best[least]


def _tried(
    part: Implicit,
    points: FloatArray,
    centres: FloatArray,
    away: FloatArray,
    aside: float,
    radius: float,
    sign: float,
    tries: int = _TRIES,
) -> tuple[FloatArray, FloatArray]:
    """Nearest centres (N, 3) around some that were found, and their distances (N,) from points."""
    centres, away = centres.copy(), away.copy()
    width = np.full(len(points), aside)
    for _ in range(tries):
        on = np.flatnonzero(width > _NARROWEST)
        if len(on) == 0:
            break
        arm = centres[on] - points[on]
        around = _around(arm / np.maximum(np.linalg.norm(arm, axis=1), 1e-300)[:, None], _AROUND)
        tried = arm[:, None] + (width[on] * radius)[:, None, None] * around
        reach = np.where(np.isfinite(away[on]), away[on], radius)[:, None, None]
        tried *= reach / np.maximum(np.linalg.norm(tried, axis=2), 1e-300)[:, :, None]
        targets = np.repeat(points[on], _AROUND, axis=0)
        now, length = _fitted(part, (points[on][:, None] + tried).reshape(-1, 3), targets, radius, sign)
        now, length = now.reshape(tried.shape), length.reshape(tried.shape[:2])
        which = length.argmin(axis=1)
        rows = np.arange(len(on))
        better = length[rows, which] < away[on]
        centres[on[better]], away[on[better]] = now[rows, which][better], length[rows, which][better]
        width[on[~better]] /= 2
    return centres, away


def ball_errors(
    part: Implicit, points: FloatArray, outward: FloatArray, radius: float, sides: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Errors (N,) in mm of points of a result as free balls tell them, positive where there is too much material.

    Gives the centres (N, 3) of the balls, too.

    Parameters
    ----------
    part : Implicit
        Signed distance to the part, positive inside.
    points, outward : (N, 3) float64
        Of the result, with normals that point out of the material.
    radius : float
    sides : (N,) float64
        -1 for points to be judged by balls outside of the part, 1 inside.
    """
    errors, centres = np.zeros(len(points)), points.copy()
    for side in (-1.0, 1.0):
        own = sides == side
        if own.any():
            near, centres[own] = nearest_centre(part, points[own], -side * outward[own], radius, side)
            errors[own] = side * (near - radius)
    return errors, centres


def _around(axes: FloatArray, count: int) -> FloatArray:
    """Directions (N, count, 3) across unit vectors (N, 3)."""
    helper = np.where(np.abs(axes[:, :1]) < 0.7, np.array([[1.0, 0, 0]]), np.array([[0, 1.0, 0]]))
    u = np.cross(axes, helper)
    u /= np.maximum(np.linalg.norm(u, axis=1), 1e-300)[:, None]
    v = np.cross(axes, u)
    turns = 2 * np.pi * np.arange(count) / count
    return np.asarray(np.cos(turns)[None, :, None] * u[:, None] + np.sin(turns)[None, :, None] * v[:, None])


def _fitted(
    part: Implicit, centres: FloatArray, targets: FloatArray, radius: float, sign: float
) -> tuple[FloatArray, FloatArray]:
    """Centres (N, 3) out of the part until their balls are free, towards targets as far as they surely stay so.

    Gives the distances to the targets, too, infinite for those that are not free.
    """
    moved, slack = centres.copy(), np.zeros(len(centres))
    on = np.arange(len(centres))
    for push in range(_PUSHES + 1):
        value, gradient = part.value_and_gradient(moved[on])
        slack[on] = sign * value - radius
        still = np.flatnonzero(slack[on] < -_FREE * radius)
        if len(still) == 0 or push == _PUSHES:
            break
        on = on[still]
        size = np.maximum(np.linalg.norm(gradient[still], axis=1), 1e-12)
        moved[on] -= (sign * slack[on] / size)[:, None] * gradient[still]
    arm = moved - targets
    away = np.maximum(np.linalg.norm(arm, axis=1), 1e-300)
    spare = np.clip(slack, 0.0, away)
    moved -= (spare / away)[:, None] * arm
    return moved, np.where(slack >= -_FREE * radius, away - spare, np.inf)
