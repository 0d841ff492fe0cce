"""Curves at which the surfaces of blends begin: rims, where a ball touches faces, and arcs and lines across."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from .implicit import FloatArray

#: Rounds from the nearest known point of a rim to the nearest of all.
_ROUNDS = 12


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
        step = 1e-5 * length
        for _ in range(_ROUNDS):
            here = self.at(way)
            along = (self.at(way + step) - self.at(way - step)) / (2 * step)
            move = ((points - here) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-12)
            way = way + np.clip(move, -0.05 * length, 0.05 * length)
            if self.period is None:
                way = np.clip(way, 0.0, length)
            if float(np.abs(move).max(initial=0.0)) < 1e-12 * length:
                break
        return np.asarray(way if self.period is None else np.mod(way, length))


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
