"""Tests of curves on surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit.cad.geometry import curve_through, flattened
from cad_implicit.implicit import FloatArray

TURN = np.linalg.qr(np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.1], [0.48, 0.64, 0.6]]))[0]
SHIFT = np.array([1.37, -2.91, 0.53])


class Torus:
    """A torus off the axes, with the kernel's parameters; its places are exact."""

    plane = False
    bounds = np.array([[0.0, 2 * np.pi], [0.0, 2 * np.pi]])
    closed = (True, True)

    def __init__(self, ring: float, radius: float) -> None:
        self.ring, self.radius = ring, radius

    def places(self, points: FloatArray) -> FloatArray:
        x, y, z = (TURN.T @ (points - SHIFT).T).tolist()
        away = np.hypot(x, y) - self.ring
        return np.column_stack([np.arctan2(y, x), np.arctan2(z, away)])

    def at(self, places: FloatArray) -> FloatArray:
        u, v = np.asarray(places).T
        far = self.ring + self.radius * np.cos(v)
        return np.column_stack([far * np.cos(u), far * np.sin(u), self.radius * np.sin(v)]) @ TURN.T + SHIFT

    def normal(self, place: FloatArray) -> FloatArray:
        u, v = place
        return TURN @ np.array([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)])


@pytest.mark.parametrize("waves", [2, 3, 5, 7])
def test_the_distance_told_of_a_curve_on_a_surface_holds_everywhere_along_it(waves: int) -> None:
    torus = Torus(7.3, 2.1)

    def place(ways: FloatArray) -> FloatArray:
        return torus.at(np.column_stack([ways, 1.1 + 0.7 * np.sin(waves * ways) ** 3]))

    span = curve_through(place, np.linspace(0.0, 5.9, 17))
    flat, told = flattened(span, torus, np.array([3.0, 1.1]))
    ways = np.linspace(span.low, span.high, 20_001)
    off = np.linalg.norm(torus.at(flat.at(ways)) - span.at(ways), axis=1).max()
    assert 0.95 * off <= told <= 1.0001 * off  # the planner adds a twentieth
