"""B-spline surfaces: the kernel beside its NumPy twin and by differences, closest points, smaller rectangles."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit.implicit import FloatArray
from cad_implicit.kernels.nurbs import evaluate, feet
from cad_implicit.splines import SplineSurface


def surface(degrees: tuple[int, int], *, rational: bool = True) -> SplineSurface:
    """A bumpy sheet with single, double and end knots, of any degrees."""
    rng = np.random.default_rng(sum(degrees))
    knots = []
    for degree in degrees:
        inner = [0.2, 0.5, 0.5, 0.7] if degree > 1 else [0.2, 0.5, 0.7]
        knots.append(np.array([0.0] * (degree + 1) + inner + [1.0] * (degree + 1)))
    counts = [len(k) - d - 1 for k, d in zip(knots, degrees, strict=True)]
    poles = np.stack([*np.meshgrid(*(np.linspace(0, 4, n) for n in counts), indexing="ij"), np.zeros(counts)], axis=-1)
    poles += rng.uniform(-0.3, 0.3, poles.shape)
    weights = rng.uniform(0.6, 1.5, counts) if rational else np.ones(counts)
    return SplineSurface(poles, weights, (knots[0], knots[1]), degrees)


def by_kernel(spline: SplineSurface, uv: FloatArray) -> FloatArray:
    p, q = spline.degrees
    out = np.zeros((len(uv), 6, 3))
    for row, (u, v) in zip(out, uv, strict=True):
        evaluate(spline.spline, u, v, np.zeros((3, p + 1)), np.zeros((3, q + 1)), np.zeros((6, 4)), row)
    return out


DEGREES = [(1, 1), (2, 1), (3, 2), (5, 3)]


@pytest.mark.nojit
@pytest.mark.parametrize("degrees", DEGREES)
def test_kernel_and_twin(degrees: tuple[int, int]) -> None:
    """Within the rectangle, on its borders and knots, and beyond."""
    spline = surface(degrees)
    uv = np.random.default_rng(1).uniform(-0.3, 1.3, (40, 2))
    uv = np.concatenate([uv, [[0, 0], [1, 1], [0, 1], [0.5, 0.2], [0.7, 0.5], [1, 0.5], [-0.1, 1]]])
    at = spline.extended(uv)
    twin = np.stack([at.s, at.u, at.v, at.uu, at.uv, at.vv], axis=1)
    assert by_kernel(spline, uv) == pytest.approx(twin, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("degrees", DEGREES)
def test_derivatives_by_differences(degrees: tuple[int, int]) -> None:
    spline = surface(degrees)
    uv = np.random.default_rng(2).uniform(0.01, 0.99, (60, 2))
    uv = uv[(np.abs(uv[:, :, None] - [0.2, 0.5, 0.7]) > 1e-3).all(axis=(1, 2))]
    step = 1e-5
    at = by_kernel(spline, uv)
    for way, orders in (((step, 0.0), (1, 3, 4)), ((0.0, step), (2, 4, 5))):
        change = (by_kernel(spline, uv + way) - by_kernel(spline, uv - way)) / (2 * step)
        for of, order in zip((0, 1, 2), orders, strict=True):
            assert np.abs(change[:, of] - at[:, order]).max() < 2e-5 * (1 + np.abs(at[:, order]).max())


@pytest.mark.nojit
def test_feet_are_closest() -> None:
    spline = surface((3, 2))
    rng = np.random.default_rng(3)
    uv = rng.uniform(0.05, 0.95, (30, 2))
    at = spline.extended(uv)
    normal = np.cross(at.u, at.v)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    x = at.s + 0.05 * normal
    found, places = feet(spline.spline, x, uv + rng.uniform(-0.03, 0.03, uv.shape), 5.0, 1e-9)
    assert found == pytest.approx(uv, abs=1e-7)
    assert places[:, 0] == pytest.approx(at.s, abs=1e-7)
    assert places[:, 1] == pytest.approx(at.u, abs=1e-5)


def test_smaller_rectangle() -> None:
    """The same surface within, and its tangents beyond."""
    spline = surface((3, 2))
    part = spline.restricted(0, 0.3, 0.6)
    assert part.spans(0) == pytest.approx([0.3, 0.5, 0.6])
    assert part.spans(1) == pytest.approx(spline.spans(1))
    uv = np.random.default_rng(4).uniform((0.3, 0.0), (0.6, 1.0), (30, 2))
    assert (part.extended(uv).s == spline.extended(uv).s).all()
    border = spline.extended(np.array([[0.6, 0.4]]))
    assert part.extended(np.array([[0.9, 0.4]])).s == pytest.approx(border.s + 0.3 * border.u)
