"""Grid, Field and Implicit: where nodes lie, interpolation, gradients, sampling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import map_coordinates

from cad_implicit import Field, Function, Grid, sample
from cad_implicit.errors import SpacingError

BOX = [[-1.3, -2.1, 0.4], [1.7, 2.2, 3.1]]


def linear(x: np.ndarray) -> np.ndarray:
    return np.asarray(x @ np.arange(1, x.shape[1] + 1) - 0.7)


@given(st.floats(0.01, 1.0), st.floats(0, 2), arrays(np.float64, 3, elements=st.floats(-1e4, 1e4)))
def test_cover_holds_the_box(spacing: float, margin: float, corner: np.ndarray) -> None:
    bounds = np.stack([corner, corner + [3.3, 1.1, 2.7]])
    grid = Grid.cover(bounds, spacing, margin=margin)
    slack = 1e-9 * (1 + np.abs(corner).max())
    assert (grid.bounds[0] <= bounds[0] - margin + slack).all()
    assert (grid.bounds[1] >= bounds[1] + margin - slack).all()
    assert (grid.bounds[1] - grid.bounds[0] < bounds[1] - bounds[0] + 2 * margin + spacing * (1 + 1e-6) + slack).all()


def test_nodes_are_in_ij_order() -> None:
    grid = Grid((1.0, 2.0, 3.0), (0.5, 0.25, 2.0), (3, 4, 2))
    nodes = grid.nodes().reshape(3, 4, 2, 3)
    assert (nodes[2, 3, 1] == [2.0, 2.75, 5.0]).all()
    assert (grid.nodes(1, 2) == nodes[1].reshape(-1, 3)).all()
    wider = grid.padded(2)
    assert wider.shape == (7, 8, 6)
    assert wider.nodes().reshape(7, 8, 6, 3)[2, 2, 2] == pytest.approx([1, 2, 3])
    assert Grid.cover(BOX, shape=5).bounds == pytest.approx(np.array(BOX))


@pytest.mark.parametrize(
    ("origin", "spacing", "shape"),
    [((0, 0), (1, 1, 1), (2, 2)), ((0, 0), (1, 0), (2, 2)), ((0, 0), (1, np.nan), (2, 2)), ((0, 0), (1, 1), (1, 2))],
)
def test_bad_grids(origin: tuple[float, ...], spacing: tuple[float, ...], shape: tuple[int, ...]) -> None:
    with pytest.raises(SpacingError):
        Grid(origin, spacing, shape)


def test_a_grid_needs_spacing_or_shape() -> None:
    for arguments in ({}, {"spacing": 1.0, "shape": 3}, {"spacing": -1.0}):
        with pytest.raises(SpacingError):
            Grid.cover(BOX, **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("dim", [2, 3])
def test_interpolation_is_exact_for_linear_functions(dim: int) -> None:
    bounds = np.array(BOX)[:, :dim]
    field = sample(Function(linear, bounds), Grid.cover(bounds, (0.31, 0.17, 0.23)[:dim]), dtype=np.float64)
    low, high = field.grid.bounds
    x = np.random.default_rng(0).uniform(low, high, (500, dim))
    assert field(x) == pytest.approx(linear(x), abs=1e-12)
    inner = x[((x > low + 0.2) & (x < high - 0.2)).all(axis=1)]
    assert field.gradient(inner) == pytest.approx(np.tile(np.arange(1.0, dim + 1), (len(inner), 1)))


def test_outside_the_grid_values_fall_with_the_distance() -> None:
    grid = Grid.cover(BOX, 0.5)
    field = Field(grid, np.full(grid.shape, 2.0, np.float32))
    corner = grid.bounds[1]
    assert field([corner, corner + [3, 4, 0]]) == pytest.approx([2, -3])


def test_values_must_fit_and_stay() -> None:
    grid = Grid.cover(BOX, 0.5)
    with pytest.raises(SpacingError, match="do not fit"):
        Field(grid, np.zeros((2, 2, 2)))
    field = Field(grid, np.zeros(grid.shape, np.float32))
    with pytest.raises(ValueError, match="read-only"):
        field.values[0] = 1
    assert field.shifted(1.5).values.dtype == np.float32
    assert float(field.shifted(1.5).values.max()) == 1.5


def test_sampling_reports_progress_and_may_be_cancelled() -> None:
    grid = Grid.cover(BOX, 0.02)
    calls: list[float] = []
    sample(Function(linear, BOX), grid, progress=lambda stage, fraction: calls.append(fraction))
    assert calls[0] == 0
    assert calls[-1] == 1
    assert calls == sorted(calls)

    def cancel(stage: str, fraction: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sample(Function(linear, BOX), grid, progress=cancel)
    with pytest.raises(SpacingError, match="2-D"):
        sample(Function(linear, BOX), Grid((0, 0), (1, 1), (2, 2)))


def test_functions_know_their_gradient() -> None:
    def ball(x: np.ndarray) -> np.ndarray:
        return np.asarray(4 - (x**2).sum(axis=1))

    x = np.random.default_rng(1).normal(size=(50, 3))
    by_differences = Function(ball, BOX)
    given = Function(ball, BOX, gradient=lambda x: -2 * x)
    assert by_differences.gradient(x) == pytest.approx(given.gradient(x), abs=1e-8)
    value, gradient = given.value_and_gradient(x)
    assert (value == ball(x)).all()
    assert (gradient == -2 * x).all()
    with pytest.raises(ValueError, match="lower and a higher corner"):
        Function(ball, [[0, 0, 0], [1, 0, 1]])


@pytest.mark.nojit
@pytest.mark.parametrize("shape", [(7, 5), (6, 7, 4)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_interpolation_twin(shape: tuple[int, ...], dtype: type) -> None:
    """Inside against SciPy; outside the value at the nearest place less the way there; gradients by differences."""
    rng = np.random.default_rng(3)
    dim = len(shape)
    grid = Grid((0.3, -1.0, 2.0)[:dim], (0.5, 0.3, 0.7)[:dim], shape)
    field = Field(grid, rng.normal(size=shape).astype(dtype))
    low, high = grid.bounds
    x = np.concatenate([rng.uniform(low - 0.6, high + 0.6, (200, dim)), grid.nodes()])

    def twin(points: np.ndarray) -> np.ndarray:
        inside = np.clip(points, low, high)
        index = ((inside - low) / grid.spacing).T
        value = map_coordinates(field.values, index, output=np.float64, order=1, mode="nearest")
        return value - np.linalg.norm(points - inside, axis=1)

    slopes = [(twin(x + h / 2 * e) - twin(x - h / 2 * e)) / h for h, e in zip(grid.spacing, np.eye(dim), strict=True)]
    value, gradient = field.value_and_gradient(x)
    assert np.abs(value - twin(x)).max() < 1e-6
    assert np.abs(gradient - np.stack(slopes, axis=1)).max() < 1e-5
    assert (field(x) == value).all()
    assert (field.gradient(x) == gradient).all()
