"""Curves where two surfaces cross."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from .blend_labels import Outward
from .implicit import FloatArray
from .outlines import Place

#: Rounds of Newton's method towards both surfaces, the least square of the sine between them by which steps are
#: divided, and the step in mm that ends them.
_ROUNDS = 12
_SINE = 1e-6
_STILL = 1e-11

#: Points of the mesh tell such a curve if they are within so many spacings of both surfaces.
_ON = 0.05

#: Curves of fewer spacings than this are points.
POINT = 2e-3

#: Fewest and most points by which splines are made.
_FEWEST, _MOST = 9, 65

#: Gaps between points of these wider than so many spacings are filled, by steps of so many.
_GAP = 0.6
_STEP = 0.3

#: Steps along a curve come ahead by at least this share of their length, or it ends there.
_AHEAD = 0.5

#: Points on them are looked for within so many spacings of a spline.
_REACH = 0.05

#: Points nearer to each other than so many spacings are one.
_NEAR = 0.2


class Crossing:
    """Where two surfaces cross.

    Parameters
    ----------
    first, second : Outward
    spacing : float
        In mm, of the mesh that tells where to look.
    """

    def __init__(self, first: Outward, second: Outward, spacing: float) -> None:
        self._first, self._second, self._h = first, second, spacing

    def border(self, start: FloatArray, inner: FloatArray, end: FloatArray) -> tuple[Place, FloatArray]:
        """Curve from one point (3,) to another near others (N, 3), and its first and last parameter (2,)."""
        off = np.maximum(*(np.abs(surface.value_and_normal(inner)[0]) for surface in (self._first, self._second)))
        inner = self.points(inner[off < _ON * self._h])
        rough = self._filled(self._onward(np.concatenate([start[None], inner, end[None]])))
        if lengths(rough)[-1] < POINT * self._h:
            return straight(rough[0], rough[-1]), np.array([0.0, 1.0])
        count = int(np.clip(len(rough), _FEWEST, _MOST))
        for shape in (PchipInterpolator, CubicSpline):  # the first does not swing where points are far apart
            length = lengths(rough)
            even = shape(length, rough)(np.linspace(0.0, length[-1], count))
            even[1:-1] = self.points(even[1:-1], _REACH * self._h)
            even[[0, -1]] = rough[[0, -1]]
            rough = even
        length = lengths(rough)
        spline = CubicSpline(length, rough)

        def place(ways: FloatArray) -> FloatArray:
            x = np.asarray(spline(ways))
            inside = (ways > length[0]) & (ways < length[-1])
            if inside.any():
                x[inside] = self.points(x[inside], _REACH * self._h)
            return x

        return place, length[[0, -1]]

    def points(self, near: FloatArray, reach: float = np.inf) -> FloatArray:
        """Points (N, 3) of the curve near given ones; these themselves if those are farther than a reach in mm.

        Where two surfaces cross at a small angle another branch of their curve may be near.
        """
        x = near.copy()
        for _ in range(_ROUNDS):
            (f, n), (g, m) = self._first.value_and_normal(x), self._second.value_and_normal(x)
            c = (n * m).sum(axis=1)
            square = np.maximum(1 - c * c, _SINE)
            move = -((f - c * g) / square)[:, None] * n - ((g - c * f) / square)[:, None] * m
            size = np.linalg.norm(move, axis=1)[:, None]
            x += move * np.minimum(1.0, self._h / np.maximum(size, 1e-300))
            if float(size.max(initial=0.0)) < _STILL:
                break
        astray = np.linalg.norm(x - near, axis=1) > reach
        x[astray] = near[astray]
        return x

    def _along(self, points: FloatArray) -> FloatArray:
        """Directions (N, 3) of the curve, as long as the sine of the angle between the surfaces."""
        return np.cross(self._first.value_and_normal(points)[1], self._second.value_and_normal(points)[1])

    def _onward(self, points: FloatArray) -> FloatArray:
        """Leave out points that go back along the curve."""
        along = self._along(points)
        turn = _turn(points, along)
        kept = [0]
        last = len(points) - 1
        for place in range(1, last):
            step = points[place] - points[kept[-1]]
            if min(np.linalg.norm(step), np.linalg.norm(points[last] - points[place])) < _NEAR * self._h:
                continue
            ahead = float(step @ (along[place] + along[kept[-1]]))
            if abs(ahead) < 1e-12 or ahead * turn > 0:
                kept.append(place)
        return np.asarray(points[[*kept, last]])

    def _filled(self, points: FloatArray) -> FloatArray:
        """Fill wide gaps by following the curve from where the surfaces cross at the wider angle."""
        width = np.linalg.norm(self._along(points), axis=1)
        result = [points[:1]]
        for place, gap in enumerate(np.linalg.norm(np.diff(points, axis=0), axis=1).tolist()):
            a, b = points[place], points[place + 1]
            if gap > _GAP * self._h:
                forward = bool(width[place] >= width[place + 1])
                between = self._followed(a if forward else b, b if forward else a)
                result.append(between if forward else between[::-1])
            result.append(b[None])
        return np.concatenate(result)

    def _followed(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Points (N, 3) of the curve from one point on it towards another, without both."""
        step = _STEP * self._h
        x, ahead, found = start[None], end - start, []
        for _ in range(int(4 * np.linalg.norm(ahead) / step) + 1):
            along = self._along(x)[0]
            size = float(np.linalg.norm(along))
            if size < 1e-9 or float(np.linalg.norm(end - x[0])) < 1.5 * step:
                break
            along *= np.sign(along @ ahead) / size
            after = self.points(x + step * along)
            if float(np.linalg.norm(after - x)) < _AHEAD * step:
                break  # at the tip of a cone
            x, ahead = after, along
            found.append(x[0])
        return np.array(found).reshape(-1, 3)


def _turn(points: FloatArray, along: FloatArray) -> float:
    """1 if points (N, 3) run along directions (N, 3), as most of their steps do; -1 if against them."""
    steps = np.diff(points, axis=0)
    return float(np.sign(((along[1:] + along[:-1]) * steps).sum()) or 1.0)


def straight(start: FloatArray, end: FloatArray) -> Place:
    """Straight line by its share from 0 to 1."""

    def place(shares: FloatArray) -> FloatArray:
        return start + np.asarray(shares)[:, None] * (end - start)

    return place


def lengths(points: FloatArray) -> FloatArray:
    """Lengths (N,) of a polyline from its start to each of its points (N, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
