"""The plane, k = 2: the same operations on planar curves, given by R-functions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cad_implicit import Function, contour_curves, fillet, offset, rectangle, sample, smooth
from cad_implicit import round as rounded
from cad_implicit.field import Field
from cad_implicit.grid import Grid
from cad_implicit.implicit import Implicit

Array = NDArray[np.float64]

RADIUS, SPACING = 0.2, 0.02


def bracket() -> Implicit:
    """Make an angle with a hole, of half-planes and circles joined by R-functions: no distance."""

    def both(a: Array, b: Array) -> Array:
        return a + b - np.sqrt(a * a + b * b)

    def either(a: Array, b: Array) -> Array:
        return a + b + np.sqrt(a * a + b * b)

    def plate(x: Array, y: Array, low: tuple[float, float], high: tuple[float, float]) -> Array:
        return both((x - low[0]) * (high[0] - x), (y - low[1]) * (high[1] - y))

    def values(points: Array) -> Array:
        x, y = points.T
        angle = either(plate(x, y, (-2, -1.5), (2, -0.5)), plate(x, y, (-2, -1.5), (-0.9, 1.7)))
        boss = 0.85**2 - (x - 1.1) ** 2 - (y + 0.55) ** 2
        hole = 0.4**2 - (x - 1.1) ** 2 - (y + 0.55) ** 2
        return both(either(angle, boss), -hole)

    return Function(values, [[-2, -1.5], [2.0, 1.7]])


def operations() -> tuple[Field, list[tuple[str, Field]]]:
    """Sample the shape, and its results by title."""
    shape = bracket()
    grid = Grid.cover(shape.bounds, SPACING, margin=0.6)
    r = RADIUS
    made = {
        f"offset by {r:g}": offset(shape, r, spacing=SPACING),
        f"round, r = {r:g}": rounded(shape, r, spacing=SPACING),
        f"fillet, r = {r:g}": fillet(shape, r, spacing=SPACING),
        f"smooth, r = {r:g}": smooth(shape, r, spacing=SPACING),
    }
    return sample(shape, grid), [(title, sample(result, grid)) for title, result in made.items()]


def corner_error() -> float:
    """Largest distance, in spacings, between a rounded corner of a rectangle and the true quarter circle."""
    result = rounded(rectangle((4.0, 3.0)), 0.5, spacing=SPACING)
    assert isinstance(result, Field)
    worst = 0.0
    for curve in contour_curves(result):
        corner = np.abs(curve) - [1.5, 1.0]
        arc = corner[(corner > 0.02).all(axis=1)]
        worst = max(worst, float(np.abs(np.linalg.norm(arc, axis=1) - 0.5).max()))
    assert math.isfinite(worst)
    return worst / SPACING
