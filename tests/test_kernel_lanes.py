"""Formulas on lanes: compiled and as NumPy they give the same as one number after the other."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from cad_implicit.kernels.lanes import bits_below, choose, lanes, larger, lowest_bit, root, smaller


@lanes(4)
def formula(rows, x, y, z):
    """A bit of everything."""
    a = larger(rows[0] - x, 0) * smaller(y - rows[1], 1.5) + rows[2]
    return choose(a > z, root(larger(a, 0)), 1 - a)


@numba.njit
def evaluate(table, x, y, z, out):
    formula(table, x, y, z, out)


@numba.njit
def marks(values, limit):
    return bits_below(values, limit)


@numba.njit
def lowest(bits):
    return lowest_bit(bits)


@pytest.mark.nojit
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_lane_is_computed_by_itself(dtype: type) -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        table, out = random.normal(0, 2, (3, 4)).astype(dtype), np.zeros(4, dtype)
        x, y, z = (dtype(v) for v in random.normal(size=3))
        evaluate(table, x, y, z, out)
        for c in range(4):
            p, q, r = table[:, c]
            a = max(p - x, 0) * min(y - q, 1.5) + r
            expected = np.sqrt(max(a, 0)) if a > z else 1 - a
            assert out[c] == pytest.approx(expected, rel=1e-5 if dtype is np.float32 else 1e-12, abs=1e-6)


@pytest.mark.nojit
def test_bits_tell_which_values_are_low() -> None:
    values = np.array([3, 1, 4, 1, 5, 9, 2, 6], np.float32)
    assert marks(values, np.float32(3.0)) == 0b01001011
    assert marks(values, np.float32(0.5)) == 0
    assert [lowest(bits) for bits in (1, 0b1000, 0b11010000)] == [0, 3, 4]
