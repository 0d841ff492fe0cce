"""What holds for any function: signs, scale, slope, mirrors and exchanged axes."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cad_implicit.field import Field
from cad_implicit.grid import Grid
from cad_implicit.redistancing import redistance

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="too slow without the compiler")
examples = settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])


@st.composite
def fields(draw: st.DrawFn) -> Field:
    """A blend of balls on a small grid of any proportions, off its nodes."""
    dim = draw(st.sampled_from([2, 3]))
    shape = tuple(draw(st.integers(6, 16)) for _ in range(dim))
    spacing = tuple(draw(st.sampled_from([0.1, 0.15, 0.25])) for _ in range(dim))
    grid = Grid((0.0,) * dim, spacing, shape)
    size = np.array(grid.bounds[1])
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    values = np.full(grid.size, -np.inf)
    for _ in range(draw(st.integers(1, 3))):
        centre, radius = rng.uniform(0.2, 0.8, dim) * size, rng.uniform(0.2, 0.5) * size.min()
        values = np.maximum(values, radius**2 - ((grid.nodes() - centre) ** 2).sum(axis=1))
    return Field(grid, values.reshape(shape))


@examples
@given(fields(), st.sampled_from(["upwind", "eno2", "weno5"]), st.sampled_from(["euler", "rk2", "gauss-seidel"]))
def test_signs_are_kept(field: Field, scheme: str, time: str) -> None:
    result = redistance(field, distance=0.5, scheme=scheme, time=time)
    np.testing.assert_array_equal(np.sign(result.values), np.sign(field.values))


@examples
@given(fields(), st.floats(-6, 6))
def test_scale_does_not_matter(field: Field, exponent: float) -> None:
    result = redistance(field, distance=0.5)
    scaled = redistance(Field(field.grid, field.values * 10**exponent), distance=0.5)
    np.testing.assert_allclose(scaled.values, result.values, rtol=0, atol=1e-12)


@examples
@given(fields())
def test_inside_and_outside_are_alike(field: Field) -> None:
    result = redistance(field, distance=0.5)
    turned = redistance(Field(field.grid, -field.values), distance=0.5)
    np.testing.assert_allclose(turned.values, -result.values, rtol=0, atol=1e-12)


@examples
@given(fields())
def test_slopes_are_bounded_when_settled(field: Field) -> None:
    """Between neighbours; measured at most 1.64, next to creases on coarse grids of unequal spacing."""
    values = redistance(field).values
    if (field.values > 0).all() or (field.values < 0).all():
        return
    for axis, h in enumerate(field.grid.spacing):
        assert np.abs(np.diff(values, axis=axis)).max() <= 1.75 * h


@examples
@given(fields(), st.data())
def test_mirrors_and_exchanged_axes(field: Field, data: st.DataObject) -> None:
    result = redistance(field, distance=0.5).values
    axis = data.draw(st.integers(0, field.grid.dim - 1))
    mirrored = redistance(Field(field.grid, np.flip(field.values, axis)), distance=0.5).values
    np.testing.assert_allclose(np.flip(mirrored, axis), result, rtol=0, atol=1e-12)
    order = data.draw(st.permutations(range(field.grid.dim)))
    grid = Grid(*(tuple(t[a] for a in order) for t in (field.grid.origin, field.grid.spacing, field.grid.shape)))
    turned = redistance(Field(grid, field.values.transpose(order)), distance=0.5).values
    np.testing.assert_allclose(turned, result.transpose(order), rtol=0, atol=1e-12)
