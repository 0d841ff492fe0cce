"""Curves at which the surfaces of blends begin: rims, where a ball touches faces, and arcs and lines across."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from .implicit import FloatArray

#: Rounds from the nearest known point of a rim to the nearest of all.
_ROUNDS = 12

#: Of the rim's length: its tangents are taken between places so far apart, steps are no longer than that, and those
#: shorter than this end the search.
_DIFFERENCE = 1e-5
_STRIDE = 0.05
_STILL = 1e-12


class Curve(Protocol):
    """A curve with a parameter in mm or radians.

    Attributes
    ----------
    period : float or None
        Of the parameter, if the curve is closed.
    bends : (N,) float64
        Parameters at which it may bend differently.
    """

    period: float | None
    bends: FloatArray

    def at(self, ways: FloatArray) -> FloatArray:
        """Points (N, 3) at parameters (N,)."""

    def way(self, points: FloatArray) -> FloatArray:
        """Parameters (N,) of the nearest places to points (N, 3)."""


class Swept(Protocol):
    """What rims are borders of.

    Attributes
    ----------
    closed : bool
    length : float
        In mm.
    ways : (N,) float64
        At which it may bend differently.
    """

    closed: bool
    length: float
    ways: FloatArray

    def fine_ways(self) -> FloatArray:
        """Ways near enough to each other to tell the nearest one."""

    def place(self, ways: FloatArray, shares: FloatArray) -> FloatArray:
        """Points (N, 3) at ways (N,) along it and shares (N,) of the arc across."""


class Rim:
    """Where the ball of a strip touches one of its faces, by the way in mm along the spine."""

    def __init__(self, surface: Swept, share: float) -> None:
        self._surface, self._share = surface, share
        self.period = surface.length if surface.closed else None
        self.bends = surface.ways
        ways = surface.fine_ways()
        self._ways, self._tree = ways, cKDTree(self.at(ways))

    def at(self, ways: FloatArray) -> FloatArray:
        return self._surface.place(ways, np.full(len(ways), self._share))

    def way(self, points: FloatArray) -> FloatArray:
        way = self._ways[self._tree.query(points)[1]].copy()
        length = self._surface.length
        left = np.arange(len(points))
        for _ in range(_ROUNDS):
            before = way[left]
            after = before + np.clip(self._step(before, points[left]), -_STRIDE * length, _STRIDE * length)
            if self.period is None:
                after = np.clip(after, 0.0, length)
            way[left] = after
            left = left[np.abs(after - before) > _STILL * length]
            if len(left) == 0:
                break
        return np.asarray(way if self.period is None else np.mod(way, length))

    def _step(self, ways: FloatArray, points: FloatArray) -> FloatArray:
        """Go (N,) towards the nearest places, by the tangents at ways."""
        count, step = len(ways), _DIFFERENCE * self._surface.length
        here, after, before = self.at(np.concatenate([ways, ways + step, ways - step])).reshape(3, count, 3)
        along = (after - before) / (2 * step)
        return np.asarray(((points - here) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-12))


class Arc:
    """Where the surface of a ball ends: the arc between its contacts, by the angle."""

    period: float | None = None
    bends = np.zeros(0)

    def __init__(self, centre: FloatArray, first: FloatArray, last: FloatArray) -> None:
        self._centre, self._radius = centre, float(np.linalg.norm(first))
        self._first = first / self._radius
        across = last - (last @ self._first) * self._first
        self._across = across / np.linalg.norm(across)

    def at(self, ways: FloatArray) -> FloatArray:
        turn = np.asarray(ways)[:, None]
        return np.asarray(self._centre + self._radius * (np.cos(turn) * self._first + np.sin(turn) * self._across))

    def way(self, points: FloatArray) -> FloatArray:
        away = points - self._centre
        return np.asarray(np.arctan2(away @ self._across, away @ self._first))


class Segment:
    """Where a chamfer is cut across: a straight line, by the length."""

    period: float | None = None
    bends = np.zeros(0)

    def __init__(self, start: FloatArray, end: FloatArray) -> None:
        self._start = start
        self._along = (end - start) / np.linalg.norm(end - start)

    def at(self, ways: FloatArray) -> FloatArray:
        return self._start + np.asarray(ways)[:, None] * self._along

    def way(self, points: FloatArray) -> FloatArray:
        return np.asarray((points - self._start) @ self._along)
