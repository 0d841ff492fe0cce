"""Contours: closed, outward, in place; in the plane and in space, by either method."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import shapes
from hypothesis import given, settings
from hypothesis import strategies as st

import cad_implicit as ci
from cad_implicit.errors import EmptyResultError, GeometryWarning, SpacingError


def is_manifold(mesh: ci.Mesh) -> bool:
    raw = manifold3d.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64))
    return bool(manifold3d.Manifold(raw).status() == manifold3d.Error.NoError)


def ball(radius: float, dim: int) -> ci.Function:
    bounds = np.array([[-radius] * dim, [radius] * dim]) * 1.2
    return ci.Function(lambda x: radius - np.linalg.norm(x - 0.05, axis=1), bounds, lipschitz=1.0)


def test_marching_cubes_of_a_ball() -> None:
    grid = ci.Grid.cover(ball(3, 3).bounds, (0.2, 0.15, 0.25))
    mesh = ci.contour(ci.sample(ball(3, 3), grid))
    assert mesh.is_watertight
    assert is_manifold(mesh)
    exact = 4 / 3 * np.pi * 27
    assert 0.99 * exact < mesh.volume < exact
    assert np.abs(np.linalg.norm(mesh.vertices - 0.05, axis=1) - 3).max() < 0.004


def test_dual_contouring_keeps_an_edge_that_marching_cubes_cuts() -> None:
    cube = shapes.as_mesh(shapes.box([0, 0, 0], [5, 5, 5]))
    distance = ci.MeshDistance(cube)
    corner = shapes.placed(np.array([[0.0, 0, 0], [5, 5, 5], [0, 5, 0]]))
    sharp = ci.MeshDistance(ci.contour(distance, 0.4))
    assert sharp.unsigned(corner).max() < 0.01
    grid = ci.Grid.cover(distance.bounds, 0.4, margin=2)
    blunt = ci.MeshDistance(ci.contour(ci.sample(distance, grid)))
    assert blunt.unsigned(corner).max() > 0.2
    with pytest.raises(SpacingError, match="give the spacing"):
        ci.contour(distance)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.booleans())
def test_any_values_give_a_closed_manifold(seed: int, rounded: bool) -> None:
    values = np.random.default_rng(seed).normal(size=(9, 8, 7)).astype(np.float32)
    values[[0, -1]] = values[:, [0, -1]] = values[:, :, [0, -1]] = -1
    values[4, 4, 4] = 1
    field = ci.Field(ci.Grid((0.1, 0.2, 0.3), (0.5, 0.4, 0.3), values.shape), np.round(values) if rounded else values)
    mesh = ci.contour(field)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert is_manifold(mesh)


def test_curves_in_the_plane() -> None:
    ring = ci.Function(lambda x: 1 - np.abs(np.linalg.norm(x, axis=1) - 3), [[-4.5, -4.5], [4.5, 4.5]])
    curves = ci.contour_curves(ci.sample(ring, ci.Grid.cover(ring.bounds, 0.1)))
    areas = sorted(shoelace(c) for c in curves)
    assert areas == pytest.approx([-np.pi * 4, np.pi * 16], rel=0.01)
    assert all((c[0] == c[-1]).all() for c in curves)


def shoelace(curve: np.ndarray) -> float:
    x, y = curve.T
    return float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2)


def test_a_shape_beyond_its_grid_is_closed_and_told() -> None:
    grid = ci.Grid((-2, -2, -2), (0.25, 0.25, 0.25), (17, 17, 17))
    with pytest.warns(GeometryWarning, match="border of its grid"):
        mesh = ci.contour(ci.sample(ball(3, 3), grid))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4.0**3, rel=0.1)


def test_nothing_and_the_wrong_dimension() -> None:
    grid = ci.Grid((0, 0, 0), (1, 1, 1), (4, 4, 4))
    with pytest.raises(EmptyResultError, match="nothing is left"):
        ci.contour(ci.Field(grid, np.full(grid.shape, -1.0)))
    flat = ci.sample(ball(3, 2), ci.Grid.cover(ball(3, 2).bounds, 0.5))
    with pytest.raises(SpacingError, match="contour_curves"):
        ci.contour(flat)
    with pytest.raises(SpacingError, match="use contour"):
        ci.contour_curves(ci.Field(grid, np.ones(grid.shape)))
