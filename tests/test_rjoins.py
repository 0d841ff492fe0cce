"""R-functions: signs, symmetry, De Morgan, slopes, the order of normalization, and blends of shapes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import cad_implicit as ci
from cad_implicit.errors import EmptyResultError
from cad_implicit.rsystems import R_0, R_1, RAlpha, RPower, RSmooth, RSystem

SYSTEMS = [R_0, R_1, RAlpha(-0.5), RAlpha(0.5), RPower(4), RPower(8), RSmooth(1), RSmooth(2), RSmooth(3)]

values = st.floats(-1e3, 1e3).filter(lambda x: x == 0 or abs(x) > 1e-3)


def joined(system: RSystem, a: float, b: float, sign: float) -> float:
    return float(system.join(np.array([a]), np.array([b]), sign)[0][0])


@pytest.mark.parametrize("system", SYSTEMS, ids=str)
@given(values, values)
def test_signs_symmetry_and_de_morgan(system: RSystem, a: float, b: float) -> None:
    union, meet = joined(system, a, b, 1), joined(system, a, b, -1)
    slack = 1e-11 * max(abs(a), abs(b), 1) ** system.degree
    if max(a, b) != 0:
        assert np.sign(union if abs(union) > slack else 0) in (np.sign(max(a, b)), 0)
        assert union * np.sign(max(a, b)) > -slack
    if min(a, b) != 0:
        assert meet * np.sign(min(a, b)) > -slack
    assert joined(system, b, a, 1) == pytest.approx(union, abs=slack)
    assert joined(system, b, a, -1) == pytest.approx(meet, abs=slack)
    assert -joined(system, -a, -b, 1) == pytest.approx(meet, abs=slack)


@pytest.mark.parametrize("system", SYSTEMS, ids=str)
def test_sign_table(system: RSystem) -> None:
    a, b = (m.ravel() for m in np.meshgrid([-2.0, -0.3, 0.3, 2.0], [-1.0, -0.2, 0.4, 1.5]))
    np.testing.assert_array_equal(system.join(a, b, 1.0)[0] > 0, (a > 0) | (b > 0))
    np.testing.assert_array_equal(system.join(a, b, -1.0)[0] > 0, (a > 0) & (b > 0))
    np.testing.assert_allclose(system.join(np.zeros(2), np.array([3.0, -3.0]), 1.0)[0][1], 0, atol=1e-15)
    np.testing.assert_allclose(system.join(np.zeros(1), np.zeros(1), 1.0)[0], 0)


@pytest.mark.parametrize("system", SYSTEMS, ids=str)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_slopes_by_differences_and_their_bound(system: RSystem, sign: float) -> None:
    a, b = np.random.default_rng(1).uniform(-2, 2, (2, 1000))
    h = 1e-6
    _, with_a, with_b = system.join(a, b, sign)
    near = np.abs(a - b) < 2 * h  # the crease of the larger value
    for slope, da, db in ((with_a, h, 0.0), (with_b, 0.0, h)):
        expected = (system.join(a + da, b + db, sign)[0] - system.join(a - da, b - db, sign)[0]) / (2 * h)
        np.testing.assert_allclose(slope[~near], expected[~near], atol=2e-4 if system.degree > 1 else 3e-5)
        assert slope.min() >= -1e-12 or system.degree > 1
    if system.slope is not None:
        assert (with_a + with_b).max() <= system.slope + 1e-12
        assert (with_a + with_b).max() > 0.99 * system.slope


@pytest.mark.parametrize(
    ("system", "order"), [(R_0, 1), (RAlpha(-0.3), 1), (RAlpha(0.7), 1), (RPower(4), 3), (RPower(6), 5), (R_1, 6)]
)
@pytest.mark.parametrize("union", [True, False])
def test_order_of_normalization(system: RSystem, order: int, union: bool) -> None:
    """Along the normal of one of two oblique planes: the first derivative is 1, the others vanish up to the order."""
    first, second = ci.plane((1, 2, 2)), ci.plane((2, -1, 1), (0, 0, 0))
    join = ci.r_union if union else ci.r_intersection
    normal = np.array([1, 2, 2]) / 3
    inside = np.array([2, -1, 1]) / np.sqrt(6)
    start = (1.0 if union else -1.0) * (inside - (inside @ normal) * normal)  # where the second plane does not count
    t = np.linspace(-0.3, 0.3, 41)
    values = join(first, second, system)(start + np.outer(t, normal))
    series = np.polynomial.Polynomial.fit(t, values, 13).convert().coef
    derivatives = series[:8] * [1, 1, 2, 6, 24, 120, 720, 5040]
    assert derivatives[0] == pytest.approx(0, abs=1e-9)
    assert derivatives[1] == pytest.approx(-1, abs=1e-6)
    np.testing.assert_allclose(derivatives[2 : order + 1], 0, atol=1e-2)
    if system != R_1:
        assert abs(derivatives[order + 1]) > 0.1


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_smooth_system_is_smooth_where_both_vanish(order: int) -> None:
    """Homogeneous of degree order + 1: differences up to the order shrink faster than the step, in all directions."""
    for angle in np.linspace(0, np.pi, 7):
        for sign in (1.0, -1.0):
            differences = []
            for h in (1e-2, 1e-3):
                t = h * (np.arange(order + 1) - order / 2)
                f = RSmooth(order).join(t * np.cos(angle), t * np.sin(angle), sign)[0]
                differences.append(abs(np.diff(f, order)[0]) / h**order)
            assert differences[1] <= 0.11 * differences[0] + 1e-12


TWO = ci.sphere(1.2).moved((0.3, 0, 0)), ci.box((3, 1, 1)).turned("z", 20)


@pytest.mark.parametrize("system", SYSTEMS, ids=str)
def test_shapes_by_r_functions_have_the_surface_of_the_sharp_ones(system: RSystem) -> None:
    a, b = TWO
    x = np.random.default_rng(2).uniform(-2, 2, (2000, 3))
    for smooth, sharp in (
        (ci.r_union(a, b, system), a | b),
        (ci.r_intersection(a, b, system), a & b),
        (ci.r_subtraction(a, b, system), a - b),
    ):
        np.testing.assert_array_equal(smooth(x) > 0, sharp(x) > 0)
        np.testing.assert_array_equal(smooth.bounds, sharp.bounds)
        assert not smooth.exact_inside
        difference = (smooth(x + [0, 1e-6, 0]) - smooth(x - [0, 1e-6, 0])) / 2e-6
        assert np.percentile(np.abs(smooth.gradient(x)[:, 1] - difference), 99) < 1e-4
        if smooth.lipschitz is not None:
            assert np.linalg.norm(smooth.gradient(x), axis=1).max() <= smooth.lipschitz + 1e-9


def test_an_r_union_contours_like_the_sharp_one() -> None:
    a, b = TWO
    smooth, sharp = ci.contour(ci.r_union(a, b), 0.1), ci.contour(a | b, 0.1)
    assert smooth.is_watertight
    assert ci.compare(smooth, sharp).maximum < 0.02


@pytest.mark.parametrize("amount", [0.3, -0.2])
def test_blends(amount: float) -> None:
    a, b = TWO
    x = np.random.default_rng(2).uniform(-3, 3, (4000, 3))
    for blend, sharp in (
        (ci.blend_union(a, b, amount, (0.5, 0.8)), ci.r_union(a, b)),
        (ci.blend_intersection(a, b, amount, (0.5, 0.8), RPower(4)), ci.r_intersection(a, b, RPower(4))),
        (ci.blend_subtraction(a, b, amount, (0.5, 0.8)), ci.r_subtraction(a, b)),
    ):
        np.testing.assert_allclose(blend(x), sharp(x) + amount / (1 + (a(x) / 0.5) ** 2 + (b(x) / 0.8) ** 2))
        inside = x[blend(x) > 0]
        assert (inside >= blend.bounds[0]).all()
        assert (inside <= blend.bounds[1]).all()
        assert blend.lipschitz is not None
        assert np.linalg.norm(blend.gradient(x), axis=1).max() <= blend.lipschitz
        difference = (blend(x + [0, 0, 1e-6]) - blend(x - [0, 0, 1e-6])) / 2e-6
        assert np.percentile(np.abs(blend.gradient(x)[:, 2] - difference), 99) < 1e-4


def test_a_blend_fills_the_corner() -> None:
    """Of two half-spaces: on the bisector the surface moves to where R_0 and the displacement cancel."""
    a, b = ci.plane("x"), ci.plane("y")
    blend = ci.blend_union(a, b, 0.5, (1.0, 1.0), bounds=[[-2, -2, -1], [2, 2, 1]])
    t = np.linspace(0, 2, 2001)
    values = blend(np.stack([t, t, 0 * t], axis=1))
    expected = -(2 - np.sqrt(2)) * t + 0.5 / (1 + 2 * t**2)
    np.testing.assert_allclose(values, expected, atol=1e-12)
    assert 0.4 < t[values > 0].max() < 0.6
    np.testing.assert_array_equal(blend.bounds, [[-2, -2, -1], [2, 2, 1]])


def test_bad_input() -> None:
    a, b = TWO
    for call in (
        lambda: RAlpha(-1),
        lambda: RAlpha(1.1),
        lambda: RPower(3),
        lambda: RSmooth(0),
        lambda: ci.r_union(a, ci.circle(1)),
        lambda: ci.r_union(a, b, bounds=[[0, 0], [1, 1]]),
        lambda: ci.blend_union(a, b, 1, (1, 0)),
        lambda: ci.blend_union(a, b, float("nan"), (1, 1)),
    ):
        with pytest.raises(ValueError):
            call()
    with pytest.raises(EmptyResultError):
        ci.r_intersection(a, b.moved((9, 0, 0)))
