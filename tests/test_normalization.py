"""Normalization after Rvachev and Taubin: twins, units, vanishing gradients, extreme scales."""

from __future__ import annotations

import numpy as np
import pytest
import redistance_twins as twins

from cad_implicit.field import Field
from cad_implicit.grid import Grid
from cad_implicit.rfunctions import normalize, taubin

GRIDS = [Grid((0, 0, 0), (0.3, 0.2, 0.25), (7, 6, 8)), Grid((0, 0), (0.3, 0.2), (9, 7)), Grid((0, 0), (1, 1), (2, 2))]


def random_field(grid: Grid, dtype: type = np.float64) -> Field:
    return Field(grid, np.random.default_rng(3).normal(size=grid.shape).astype(dtype))


@pytest.mark.parametrize("grid", GRIDS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_twins(grid: Grid, dtype: type) -> None:
    field = random_field(grid, dtype)
    diagonal = float(np.linalg.norm(np.diff(grid.bounds, axis=0)))
    tolerance = 1e-6 if dtype is np.float32 else 1e-12
    f = field.values.astype(float)
    for result, rvachev, limit in ((normalize(field), True, 1.0), (taubin(field), False, diagonal)):
        expected = twins.normalized(f, grid.spacing, rvachev, limit)
        np.testing.assert_allclose(result.values, expected, rtol=tolerance)
        assert result.values.dtype == dtype
        assert result.grid == grid


@pytest.mark.parametrize("scale", [1e-30, 1e-3, 1.0, 1e3, 1e30])
def test_a_plane_becomes_its_distance(scale: float) -> None:
    grid = Grid((-0.4, -0.4, -0.4), (0.1, 0.1, 0.1), (9, 9, 9))
    normal = np.array([2, -1, 2]) / 3
    distance = (grid.nodes() @ normal).reshape(grid.shape)
    field = Field(grid, (scale * distance).astype(np.float32))
    np.testing.assert_allclose(taubin(field).values, distance, atol=1e-6)
    np.testing.assert_allclose(normalize(field).values, distance / np.sqrt(1 + distance**2), atol=1e-6)


def test_near_the_surface_the_gradient_is_one() -> None:
    grid = Grid.cover([[-1.5] * 3, [1.5] * 3], shape=49)
    radius = np.linalg.norm(grid.nodes(), axis=1).reshape(grid.shape)
    near = np.abs(1 - radius) < 0.1
    for function in (normalize, taubin):
        error = np.abs(function(Field(grid, 1 - radius**2)).values - (1 - radius))[near]
        assert error.max() < 0.0062  # measured 0.0057; half the square of the distance is 0.005


@pytest.mark.parametrize("constant", [0.0, 3.0, -2.0])
def test_without_a_gradient(constant: float) -> None:
    grid = Grid((0, 0, 0), (1, 1, 1), (3, 4, 5))
    field = Field(grid, np.full(grid.shape, constant))
    assert (normalize(field).values == np.sign(constant)).all()
    np.testing.assert_allclose(taubin(field).values, np.sign(constant) * np.sqrt(4 + 9 + 16))


@pytest.mark.parametrize("huge", [1e-300, 1e-200, 1e200, 1e307])
def test_extreme_values_do_not_overflow(huge: float) -> None:
    field = random_field(GRIDS[0])
    scaled = Field(field.grid, field.values * huge)
    for function in (normalize, taubin):
        np.testing.assert_allclose(function(scaled).values, function(field).values, rtol=1e-9)
