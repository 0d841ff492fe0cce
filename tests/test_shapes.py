"""Primitives: exact distances by their defining properties, membership by plain predicates, gradients, bad input."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import cad_implicit as ci
from cad_implicit.errors import GeometryWarning, RadiusError, SpacingError
from cad_implicit.transforms import Placed

Points = NDArray[np.float64]

#: A pentagon with one reflex corner, clockwise.
ARROW = [(0.3, -2.0), (-2.1, -1.0), (-0.4, 0.2), (-1.5, 2.2), (2.4, 0.4)]


def radius(x: Points) -> Points:
    return np.asarray(np.hypot(x[:, 0], x[:, 1]))


def in_arrow(x: Points) -> NDArray[np.bool_]:
    from skimage.measure import points_in_poly

    return np.asarray(points_in_poly(x, ARROW))


EXACT: dict[str, tuple[ci.Implicit, Callable[[Points], NDArray[np.bool_]]]] = {
    "sphere": (ci.sphere(2.0), lambda x: (x**2).sum(axis=1) < 4),
    "box": (ci.box((4, 3, 2)), lambda x: (np.abs(x) < [2, 1.5, 1]).all(axis=1)),
    "cylinder": (ci.cylinder(1.5, 3), lambda x: (radius(x) < 1.5) & (abs(x[:, 2]) < 1.5)),
    "cone": (ci.cone(2, 3), lambda x: (radius(x) < 2 * (1.5 - x[:, 2]) / 3) & (x[:, 2] > -1.5)),
    "frustum": (
        ci.cone(0.5, 2, 1.5),
        lambda x: (radius(x) < 1 + 0.5 * x[:, 2]) & (abs(x[:, 2]) < 1),
    ),
    "torus": (ci.torus(2, 0.7), lambda x: np.hypot(radius(x) - 2, x[:, 2]) < 0.7),
    "plane": (ci.plane((1, 2, 2), (0.5, 0, 0)), lambda x: x @ [1, 2, 2] < 0.5),
    "slab": (ci.slab(1.4, (0, 3, 4)), lambda x: abs(x @ [0, 0.6, 0.8]) < 0.7),
    "prism": (ci.extruded(ci.polygon(ARROW), 2), lambda x: in_arrow(x[:, :2]) & (abs(x[:, 2]) < 1)),
    "circle": (ci.circle(1.3), lambda x: (x**2).sum(axis=1) < 1.69),
    "rectangle": (ci.rectangle((3, 1)), lambda x: (np.abs(x) < [1.5, 0.5]).all(axis=1)),
    "polygon": (ci.polygon(ARROW), in_arrow),
    "turned box": (
        ci.box((4, 3, 2)).turned((1, 2, 3), 40).moved((0.3, -0.2, 0.1)).scaled(0.8),
        lambda x: EXACT["box"][1](unturned(x)),
    ),
}


def unturned(x: Points) -> Points:
    from scipy.spatial.transform import Rotation

    axis = np.array([1, 2, 3]) / np.sqrt(14)
    return np.asarray(Rotation.from_rotvec(np.radians(40) * axis).inv().apply(x / 0.8 - [0.3, -0.2, 0.1]))


def points_for(shape: ci.Implicit, count: int = 4000) -> Points:
    return np.random.default_rng(7).uniform(-4, 4, (count, shape.dim))


@pytest.mark.parametrize("name", EXACT)
def test_exact_distances(name: str) -> None:
    shape, inside = EXACT[name]
    assert shape.exact
    assert shape.lipschitz == 1.0
    x = points_for(shape)
    value, gradient = shape.value_and_gradient(x)
    np.testing.assert_array_equal(value > 0, inside(x))
    np.testing.assert_allclose(shape(x), value, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-12)
    # no surface nearer than the value: it changes no faster than the point moves …
    assert (np.abs(np.diff(value)) <= np.linalg.norm(np.diff(x, axis=0), axis=1) + 1e-12).all()
    # … and some as near: at the end of the gradient
    assert np.abs(shape(x - value[:, None] * gradient)).max() < 1e-12


@pytest.mark.parametrize("name", EXACT)
def test_bounds_hold_the_surface_and_touch_it(name: str) -> None:
    shape, _ = EXACT[name]
    low, high = shape.bounds
    x = points_for(shape)
    value, gradient = shape.value_and_gradient(x)
    surface = x - value[:, None] * gradient
    assert (surface >= low - 1e-12).all()
    assert (surface <= high + 1e-12).all()
    if name not in ("plane", "slab", "turned box"):
        assert (np.ptp(surface, axis=0) > 0.97 * (high - low)).all()


@pytest.mark.parametrize(
    "shape",
    [
        ci.ellipsoid((1, 2, 3)),
        ci.superquadric((1, 2, 1.5), 0.2, 0.5),
        ci.superquadric((1, 2, 1.5), 2, 1.7),
        ci.superquadric((1, 2, 1.5), 0.01, 0.01),
    ],
)
def test_superquadrics(shape: ci.Implicit) -> None:
    x = points_for(shape)
    value, gradient = shape.value_and_gradient(x)
    assert shape.lipschitz is not None
    assert not shape.exact_inside
    slope = np.abs(np.diff(value)) / np.linalg.norm(np.diff(x, axis=0), axis=1)
    assert slope.max() <= shape.lipschitz
    assert np.linalg.norm(gradient, axis=1).max() <= shape.lipschitz + 1e-12
    # homogeneous of degree one, so Euler's relation holds
    shortest = np.diff(shape.bounds, axis=0).min() / 2
    np.testing.assert_allclose((gradient * x).sum(axis=1), value - shortest, atol=1e-10)


def test_superquadrics_by_their_equation() -> None:
    a, e1, e2 = np.array([1, 2, 1.5]), 0.6, 1.4
    x = points_for(ci.sphere(1))
    u = np.abs(x / a)
    f = (u[:, 0] ** (2 / e2) + u[:, 1] ** (2 / e2)) ** (e2 / e1) + u[:, 2] ** (2 / e1)
    np.testing.assert_array_equal(ci.superquadric(a, e1, e2)(x) > 0, f < 1)
    q = ((x / [1, 2, 3]) ** 2).sum(axis=1)
    np.testing.assert_array_equal(ci.ellipsoid((1, 2, 3))(x) > 0, q < 1)


@given(
    st.lists(st.floats(-5, 5), min_size=6, max_size=6),
    st.floats(0.1, 4),
    st.floats(-360, 360),
    st.sampled_from(["box", "cone", "torus", "prism"]),
)
@settings(deadline=None, max_examples=40)
def test_transforms_carry_points_with_them(numbers: list[float], factor: float, degrees: float, name: str) -> None:
    shape, by, normal = EXACT[name][0], np.array(numbers[:3]), np.array(numbers[3:]) + [0, 0, 6.0]
    placed = ci.mirrored(ci.turned(ci.moved(ci.scaled(shape, factor), by), normal, degrees), normal, by)
    assert placed.exact
    x = points_for(shape, 50)
    unit = normal / np.linalg.norm(normal)
    a = np.radians(degrees)
    y = factor * x + by
    y = y * np.cos(a) + np.cross(unit, y) * np.sin(a) + np.outer(y @ unit, unit) * (1 - np.cos(a))
    y -= 2 * np.outer((y - by) @ unit, unit)
    np.testing.assert_allclose(placed(y), factor * shape(x), atol=1e-9)
    value, gradient = placed.value_and_gradient(y)
    assert np.abs(placed(y - value[:, None] * gradient)).max() < 1e-9
    np.testing.assert_allclose(placed.gradient(y), gradient)
    np.testing.assert_array_equal(placed.within(y, 0.5), np.abs(value) < 0.5)
    inside = y[value > 0]
    assert (inside >= placed.bounds[0] - 1e-9).all()
    assert (inside <= placed.bounds[1] + 1e-9).all()


def test_uneven_scaling_keeps_the_lipschitz_constant() -> None:
    shape = ci.scaled(ci.sphere(1), (1, 2, 3))
    x = points_for(shape)
    assert (shape.lipschitz, shape.exact_inside, shape.exact_outside) == (1.0, False, False)
    np.testing.assert_array_equal(shape(x) > 0, ci.ellipsoid((1, 2, 3))(x) > 0)
    assert np.linalg.norm(shape.gradient(x), axis=1).max() <= 1 + 1e-12
    np.testing.assert_array_equal(shape.bounds, [[-1, -2, -3], [1, 2, 3]])


def test_boxes_at_infinity_stay_finite_where_they_can() -> None:
    upper = ci.plane("z", (0, 0, 2)).turned("x", 90)
    np.testing.assert_array_equal(upper.bounds, [[-np.inf, -2, -np.inf], [np.inf] * 3])
    assert upper([[0, -1, 0], [0, -3, 0]]) == pytest.approx([1, -1])
    half = ci.sphere(1) & ci.plane("x", (-0.5, 0, 0)).scaled(1.0, (3, 3, 3))
    np.testing.assert_array_equal(half.bounds, [[-1, -1, -1], [-0.5, 1, 1]])
    with pytest.raises(SpacingError, match="no end"):
        ci.contour(upper, 0.5)
    with pytest.raises(SpacingError, match="no end"):
        ci.fillet(ci.plane("z") | ci.sphere(2), 0.2)


def test_a_part_is_one_expression() -> None:
    part = ci.box((4, 2, 1)) - ci.cylinder(0.5, 3).moved((1, 0, 0)) | ci.sphere(1)
    mesh = ci.contour(part.turned("z", 30), 0.06)
    assert (mesh.is_watertight, mesh.components, mesh.genus) == (True, 1, 1)
    x = ci.Grid((-1.99, -0.99, -0.99), (0.02,) * 3, (200, 100, 100)).nodes()
    inside = (np.abs(x) < [2, 1, 0.5]).all(axis=1) & (np.hypot(x[:, 0] - 1, x[:, 1]) > 0.5) | ((x**2).sum(axis=1) < 1)
    assert mesh.volume == pytest.approx(0.02**3 * inside.sum(), rel=5e-3)


def test_moved_meshes() -> None:
    mesh = ci.contour(ci.box((4, 2, 1)), 0.2)
    shape = ci.moved(ci.MeshDistance(mesh), (1, 2, 3))
    assert shape.exact
    x = points_for(shape)
    np.testing.assert_allclose(shape(x), ci.box((4, 2, 1)).moved((1, 2, 3))(x), atol=1e-5)


@pytest.mark.parametrize("name", ["box", "plane", "turned box", "part"])
def test_flat_regions_are_flat(name: str) -> None:
    part = ci.box((4, 3, 2)) - ci.box((1, 4, 1)).moved((0, 0, 1)).turned("y", 10)
    shape = part if name == "part" else EXACT[name][0]
    rng = np.random.default_rng(5)
    x = rng.uniform(-3, 3, (3000, 3))
    radius = 0.3
    value, gradient, holds = shape.affine_within(x, radius, 1e-6)
    assert 0.01 < holds.mean() <= 1
    for _ in range(40):
        step = rng.normal(size=x.shape)
        step *= radius * rng.uniform(0.5, 1, (len(x), 1)) / np.linalg.norm(step, axis=1)[:, None]
        error = shape(x + step) - value - (gradient * step).sum(axis=1)
        assert np.abs(error[holds]).max() < 1e-9


def test_fillets_of_primitives_are_exact() -> None:
    """A cylinder on a plate: the fillet is a torus."""

    def placed(shape: ci.Implicit) -> ci.Implicit:
        return shape.turned((1, 2, 3), 25).moved((0.13, 0.37, 0.21))

    part = placed(ci.box((12, 12, 3)).moved((0, 0, -1.5)) | ci.cylinder(2.5, 8))
    filleted = ci.fillet(part, 1.0, spacing=0.25)
    assert filleted.exact
    mesh = ci.contour(filleted)
    assert (mesh.is_watertight, mesh.components, mesh.genus) == (True, 1, 0)
    frame = placed(ci.sphere(1))
    assert isinstance(frame, Placed)
    local = (mesh.vertices - frame.shift) @ frame.matrix
    rho = np.hypot(local[:, 0], local[:, 1])
    blend = (abs(rho - 3) < 0.48) & (abs(local[:, 2] - 0.5) < 0.48)
    assert blend.sum() > 300
    assert np.abs(np.hypot(rho[blend] - 3.5, local[blend, 2] - 1) - 1).max() < 1e-4 * 0.25


def test_every_implicit_can_be_moved() -> None:
    """Functions, meshes, fields and results have the transforms as methods, and booleans of them too."""
    ball = ci.sphere(1.0)
    mesh = ci.contour(ball, 0.2)
    grid = ci.Grid.cover(ball.bounds, shape=20, margin=0.3)
    shapes = (
        ci.Function(ball, ball.bounds),
        ci.MeshDistance(mesh),
        ci.sample(ball, grid),
        ci.fillet(mesh, 0.3, spacing=0.1),
        ci.shell(ball, 0.2, spacing=0.1),
    )
    x = np.random.default_rng(0).uniform(-0.8, 0.8, (50, 3))
    for shape in shapes:
        there = shape.moved((5, 0, 0)).turned("z", 90).mirrored("y").scaled(2.0)
        image = 2 * (x + [5, 0, 0])[:, [1, 0, 2]] * [-1, -1, 1]
        assert np.abs(there(image) - 2 * shape(x)).max() < 1e-6
        both = (shape | there) - ball
        assert isinstance(both.moved((1, 0, 0)), Placed)
        assert (there.bounded, there.rough) == (shape.bounded, shape.rough)


def test_booleans_of_primitives_are_worked_on_exactly() -> None:
    part = (ci.box((6, 4, 2)) - ci.cylinder(1, 3) | ci.sphere(1.4).moved((2, 0, 1))).turned("z", 20)
    assert not part.exact_inside
    assert not part.exact_outside
    filleted = ci.fillet(part, 0.4, spacing=0.15)
    assert filleted.exact
    plain = ci.Function(part, part.bounds, lipschitz=1.0)
    assert isinstance(ci.fillet(plain, 0.4, spacing=0.15), ci.Field)
    assert isinstance(ci.offset(ci.circle(3), 1, spacing=0.3), ci.Field)


def test_offsets_in_booleans_are_contoured_without_their_distances() -> None:
    grown = ci.offset(ci.box((3, 2, 1)), 0.5, spacing=0.2)
    part = ci.box((6, 4, 2)) - ci.moved(grown, (0, 0, 0.4))
    mesh = ci.contour(part, 0.2)
    assert "_distance" not in vars(grown)
    assert mesh.is_watertight
    assert np.abs(part(mesh.vertices)).max() < 1e-3 * 0.2


def test_thin_walls_of_primitives_are_told() -> None:
    part = ci.box((8, 8, 4)) - ci.box((6, 9, 3)).moved((0, 0, 1))
    with pytest.warns(GeometryWarning, match="material 1 mm wide"):
        ci.round(part, 0.6, spacing=0.2)


@pytest.mark.parametrize("x", [[[0.0, 0, 0]], [[1.5, 0, 1.5]], [[0, 0, 1.5]]])
def test_centres_edges_and_axes_have_finite_unit_gradients(x: list[list[float]]) -> None:
    for shape in (ci.sphere(1), ci.cylinder(1.5, 3), ci.box((3, 3, 3)), ci.cone(1.5, 3), ci.torus(1.5, 0.5)):
        assert np.linalg.norm(shape.gradient(x), axis=1) == pytest.approx(1)


def test_bad_input() -> None:
    for call in (
        lambda: ci.sphere(0),
        lambda: ci.box((1, -1, 1)),
        lambda: ci.box((1, 1)),
        lambda: ci.cone(0, 1),
        lambda: ci.torus(1, 1),
        lambda: ci.slab(float("nan")),
    ):
        with pytest.raises(RadiusError):
            call()
    for call in (
        lambda: ci.superquadric((1, 1, 1), 3),
        lambda: ci.polygon([(0, 0), (1, 1)]),
        lambda: ci.sphere(1).moved((1, 2)),
        lambda: ci.sphere(1).scaled(-1),
        lambda: ci.sphere(1).turned("w", 3),
        lambda: ci.circle(1).turned("x", 3),
        lambda: ci.sphere(1).mirrored((0, 0, 0)),
        lambda: ci.extruded(ci.sphere(1), 1),
        lambda: ci.revolved(ci.sphere(1)),
        lambda: ci.revolved(ci.circle(1).moved((-2, 0))),
    ):
        with pytest.raises(ValueError):
            call()
