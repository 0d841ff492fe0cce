"""The paper's operations on a regular grid against analytic answers, off the axes; errors in units of the spacing."""

from __future__ import annotations

import numpy as np
import pytest
import shapes

import cad_implicit as ci
from cad_implicit import reinit

H = 0.5


def error(result: ci.Implicit, truth: np.ndarray) -> float:
    """Largest distance of true surface points from the result, in spacings (its values are distances)."""
    return float(np.abs(result(truth)).max()) / H


@pytest.mark.parametrize(("angle", "bound"), [(60, 0.9), (90, 0.9), (120, 0.7)])
def test_fillet_of_a_straight_edge(angle: float, bound: float) -> None:
    result = ci.fillet(shapes.notch(angle, 20), 2.5, spacing=H, engine="reinit")
    assert error(result, shapes.notch_fillet(angle, 2.5, 12)) < bound


def test_fillet_of_a_corner_and_of_a_boss() -> None:
    assert error(ci.fillet(shapes.corner(12), 2.5, spacing=H, engine="reinit"), shapes.octant(2.5)) < 1.0
    result = ci.fillet(shapes.boss(5, 12, 10), 2.5, spacing=H, engine="reinit")
    assert error(result, shapes.boss_fillet(5, 2.5)) < 0.9


def test_round_of_a_cube() -> None:
    cube = shapes.as_mesh(shapes.box([0, 0, 0], [15, 15, 15]))
    result = ci.round(cube, 2.5, spacing=H, engine="reinit")
    assert error(result, shapes.octant(2.5)) < 1.0
    mesh = ci.contour(result)
    a, r = 10.0, 2.5  # a cube of side 10 grown by a ball (Steiner's formula)
    exact = a**3 + 6 * a**2 * r + 3 * np.pi * a * r**2 + 4 / 3 * np.pi * r**3
    assert mesh.is_watertight
    assert exact * 0.945 < mesh.volume < exact  # blends are low by half a spacing: the lost crease


@pytest.mark.parametrize("first", ["round", "fillet"])
def test_smooth_does_both(first: str) -> None:
    part = shapes.notch(90, 20)
    result = ci.smooth(part, 2.5, first=first, spacing=H, engine="reinit")
    assert error(result, shapes.notch_fillet(90, 2.5, 10)) < 1.2
    far_corner = shapes.placed(np.array([[-20.0, -20.0, 0.0]]))
    cut = 2.5 * (np.sqrt(2) - 1)  # the round's distance from a square edge
    assert float(result(far_corner)[0]) == pytest.approx(-cut, abs=1.2 * H)


def test_faces_stay_where_they_were() -> None:
    mesh = ci.contour(ci.fillet(shapes.notch(90, 20), 2.5, spacing=H, engine="reinit"))
    local = (mesh.vertices - shapes.SHIFT) @ shapes.TURN
    face = (np.abs(local[:, 1]) < 15) & (np.abs(local[:, 2]) < 10) & (local[:, 0] < -18)
    assert face.sum() > 1000
    assert np.abs(local[face, 0] + 20).max() < 0.03 * H


@pytest.mark.parametrize("distance", [1.5, -1.5])
def test_offset_of_a_sphere(distance: float) -> None:
    ball = ci.Function(lambda x: 25 - ((x - shapes.SHIFT) ** 2).sum(axis=1), [[-5.5] * 3, [5.5] * 3])
    mesh = ci.contour(ci.offset(ball, distance, spacing=0.2))
    radii = np.linalg.norm(mesh.vertices - shapes.SHIFT, axis=1)
    assert np.abs(radii - 5 - distance).max() < 0.3 * 0.2


def test_anisotropic_spacing_and_the_plane() -> None:
    back = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])

    def l_profile(x: np.ndarray) -> np.ndarray:
        u, v = ((x - 0.13) @ back).T
        leg = np.minimum.reduce([u + 10, 10 - u, v + 10, -2 - v])
        return np.maximum(leg, np.minimum.reduce([v + 10, 10 - v, u + 10, -2 - u]))

    grid = ci.Grid((-18, -18), (0.1, 0.15), (361, 241))
    phi = ci.redistance(ci.sample(ci.Function(l_profile, grid.bounds), grid), distance=3)
    result = reinit.closing(phi, 3.0)
    angle = np.linspace(np.pi + 0.05, 1.5 * np.pi - 0.05, 50)
    arc = 1.0 + 3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert np.abs(result(arc @ back.T + 0.13)).max() < 1.0 * 0.15
    curves = ci.contour_curves(result)
    assert len(curves) == 1
    assert (curves[0][0] == curves[0][-1]).all()


def test_nothing_left_is_an_error() -> None:
    plate = shapes.as_mesh(shapes.box([0, 0, 0], [15, 15, 3]))
    grid = ci.Grid.cover(plate.bounds, H, margin=4 * H)
    phi = reinit.distance_field(ci.MeshDistance(plate), grid, 2.0)
    with pytest.raises(ci.errors.EmptyResultError, match="nowhere 4 mm thick"):
        reinit.opening(phi, 2.0)


def test_operations_nest() -> None:
    part = shapes.notch(90, 20)
    once = ci.fillet(part, 2.5, spacing=H, engine="reinit")
    twice = ci.round(once, 1.5)
    assert error(twice, shapes.notch_fillet(90, 2.5, 10)) < 1.5
    assert ci.contour(twice).volume < ci.contour(once).volume
