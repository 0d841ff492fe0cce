"""The kernels of re-initialization against their slow twins; these tests also run without the compiler."""

from __future__ import annotations

import math

import numpy as np
import pytest
import redistance_twins as twins

from cad_implicit.kernels import crossing, highorder, subcell, upwind

SHAPES = [(7, 6, 8), (1, 9, 7), (2, 2, 2)]
SPACING = (0.3, 0.2, 0.25)


def bumpy(shape: tuple[int, ...], seed: int = 0) -> np.ndarray:
    """A random function of both signs, smooth enough to have even and uneven places, with zeros."""
    x = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"))
    rng = np.random.default_rng(seed)
    f = 0.5 + sum(np.sin(np.tensordot(rng.normal(0, 0.4, 3), x, 1) + a) for a in rng.uniform(0, 6, 3))
    f.flat[rng.integers(f.size)] = 0
    return f


def spacing_of(shape: tuple[int, ...]) -> tuple[float, ...]:
    return tuple(math.inf if n == 1 else h for n, h in zip(shape, SPACING, strict=True))


def signs_of(f: np.ndarray) -> np.ndarray:
    signs = np.zeros(f.shape, np.int8)
    subcell.signs(f, signs)
    return signs


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_step_is_the_papers_equation(shape: tuple[int, ...], dtype: type) -> None:
    p = bumpy(shape).astype(dtype)
    rate = (0.08 * np.sign(bumpy(shape, 1))).astype(dtype)
    spacing = spacing_of(shape)
    new = np.zeros_like(p)
    upwind.step(p, new, rate, *(dtype(h**-2) for h in spacing))
    expected = [twins.advanced(p.astype(float), rate, spacing, node) for node in np.ndindex(shape)]
    np.testing.assert_allclose(new.ravel(), expected, rtol=0, atol=1e-6 if dtype is np.float32 else 1e-13)
    assert new.dtype == dtype


@pytest.mark.parametrize("order", range(8))
def test_sweep_goes_in_each_direction(order: int) -> None:
    shape = (4, 5, 3)
    p, rate = bumpy(shape), 0.08 * np.sign(bumpy(shape, 1))
    expected = p.copy()
    lines = [range(n)[:: -1 if order >> a & 1 else 1] for a, n in enumerate(shape)]
    for node in ((i, j, k) for i in lines[0] for j in lines[1] for k in lines[2]):
        expected[node] = twins.advanced(expected, rate, SPACING, node)
    upwind.sweep(p, rate, *(h**-2 for h in SPACING), order)
    np.testing.assert_allclose(p, expected, rtol=0, atol=1e-13)


def test_rates_are_the_smoothed_sign() -> None:
    values = bumpy((5, 4, 6))
    rate = np.zeros_like(values)
    upwind.rates(values, rate, 0.3, 0.01)
    np.testing.assert_allclose(rate, 0.3 * values / np.sqrt(values**2 + 0.01**2), rtol=1e-12)
    upwind.rates(values, rate, 0.3, 0.0)
    np.testing.assert_allclose(rate, 0.3 * np.sign(values), rtol=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("seed", range(3))
def test_held_nodes(shape: tuple[int, ...], seed: int) -> None:
    f = bumpy(shape, seed)
    spacing = spacing_of(shape)
    values, rate = np.full(shape, 7.0), np.ones(shape)
    subcell.hold(f, signs_of(f), values, rate, tuple(1 / h for h in spacing))
    expected, mask = twins.held(f, spacing, subcell._EVEN)
    assert mask.any()
    np.testing.assert_array_equal(rate == 0, mask)
    np.testing.assert_allclose(values, np.where(mask, expected, 7.0), rtol=1e-12)


def test_crossings_are_roots() -> None:
    rng = np.random.default_rng(5)
    for before, here, after, beyond in rng.normal(size=(300, 4)):
        if here * after < 0:
            found = crossing.crossing(before, here, after, beyond)
            assert found == pytest.approx(twins.crossing(before, here, after, beyond), abs=2e-6)
    assert crossing.crossing(1.0, 1.0, 0.0, -1.0) == 1
    assert crossing.crossing(3.0, 1.0, -1.0, -3.0) == pytest.approx(0.5)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("weno", [False, True])
def test_higher_order_step(shape: tuple[int, ...], weno: bool) -> None:
    f, p, spacing = bumpy(shape, 2), bumpy(shape, 2) * 0.7, spacing_of(shape)
    slots, distances, rate = located(f, spacing)
    new = np.zeros_like(p)
    highorder.step(p, new, rate, slots, distances, spacing, weno)
    for node in np.ndindex(shape):
        ends = twins.crossings(f, spacing, node) if f[node] != 0 else [math.inf] * 6
        shortest = min(min(ends), min(spacing)) / min(spacing)
        full = 0.08 * np.sign(f[node])
        assert rate[node] == pytest.approx(full * shortest, rel=1e-5, abs=1e-9)
        expected = twins.advanced_high(p, rate[node], spacing, node, ends, weno)
        assert new[node] == pytest.approx(expected, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("order", [0, 3, 7])
def test_higher_order_sweep(order: int) -> None:
    shape = (4, 5, 4)
    f = bumpy(shape, 2)
    slots, distances, rate = located(f, SPACING)
    p = f.copy()
    highorder.sweep(p, rate, slots, distances, SPACING, True, order)
    expected = f.copy()
    lines = [range(n)[:: -1 if order >> a & 1 else 1] for a, n in enumerate(shape)]
    for node in ((i, j, k) for i in lines[0] for j in lines[1] for k in lines[2]):
        ends = twins.crossings(f, SPACING, node) if f[node] != 0 else [math.inf] * 6
        expected[node] = twins.advanced_high(expected, rate[node], SPACING, node, ends, True)
    np.testing.assert_allclose(p, expected, rtol=1e-5, atol=1e-7)


def located(f: np.ndarray, spacing: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slots, distances to crossings, and rates of a function."""
    signs = signs_of(f)
    counts = np.zeros(f.shape[0] * f.shape[1], np.int64)
    crossing.count(signs, counts)
    ends = np.cumsum(counts)
    slots, distances, rate = np.full(f.shape, -1, np.int32), np.zeros((ends[-1], 6)), 0.08 * np.sign(f)
    crossing.locate(f, signs, ends - counts, slots, distances, rate, spacing)
    return slots, distances, rate


@pytest.mark.parametrize("slopes", [np.full(5, 0.7), np.array([0.0, 0, 0, 1, 2]), np.array([1.0, 1.5, 2, 2.5, 3])])
def test_weno_of_straight_and_broken_lines(slopes: np.ndarray) -> None:
    assert highorder.weno5(*slopes) == pytest.approx(twins.weno5(slopes), rel=1e-12, abs=1e-14)
    if np.ptp(np.diff(slopes)) == 0:  # linear slopes: the derivative half-way between the third and the fourth
        assert highorder.weno5(*slopes) == pytest.approx((slopes[2] + slopes[3]) / 2, rel=1e-9)
