"""Convolution surfaces against quadrature, differences, and the plain sum of slow NumPy twins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

import cad_implicit as ci
from cad_implicit.errors import EmptyResultError, RadiusError
from cad_implicit.kernels.convolution import add_segments
from cad_implicit.skeletons import Kernel

Array = NDArray[np.float64]

#: A knee, a branch and a lone piece, off the axes.
BONE = np.array(
    [
        [[-8.3, 0.2, 0.4], [0.1, 1.3, -0.2]],
        [[0.1, 1.3, -0.2], [5.2, -4.1, 2.3]],
        [[0.1, 1.3, -0.2], [2.2, 6.4, -1.7]],
        [[9.0, 5.0, 3.0], [7.5, 8.5, 2.0]],
    ]
)
WEIGHTS = np.array([1.0, 1.2, 0.7, 1.5])
KERNELS: tuple[Kernel, ...] = ("cauchy", "gauss")


def kernel_at(kernel: Kernel, square: Array | float) -> Array | float:
    return (1 + square) ** -2.0 if kernel == "cauchy" else np.exp(-square)


def twin(points: Array, ends: Array, weights: Array, width: float, kernel: Kernel) -> Array:
    """Sum over segments of the kernel, by 200 Gauss points on each."""
    node, share = np.polynomial.legendre.leggauss(200)
    out = np.zeros(len(points))
    for (start, end), weight in zip(ends, weights, strict=True):
        at = start + np.outer((node + 1) / 2, end - start)
        square = ((points[:, None, :] - at) ** 2).sum(axis=2) / width**2
        out += weight * math.dist(start, end) / width / 2 * (kernel_at(kernel, square) @ share)
    return out


def run_kernel(points: Array, width: float, kernel: Kernel) -> tuple[Array, Array]:
    along = BONE[:, 1] - BONE[:, 0]
    lengths = np.linalg.norm(along, axis=1)
    values, gradients = np.zeros(len(points)), np.zeros_like(points)
    starts = np.ascontiguousarray(BONE[:, 0])
    axes = along / lengths[:, None]
    add_segments(points, starts, axes, lengths, WEIGHTS, width, kernel == "gauss", values, gradients)
    return values, gradients


def random_points(count: int) -> Array:
    return np.random.default_rng(5).uniform([-11, -7, -5], [12, 11, 6], (count, 3))


@pytest.mark.nojit
@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("width", [0.6, 1.7])
def test_twin(kernel: Kernel, width: float) -> None:
    x = np.concatenate([random_points(60), BONE[:, 0], BONE.mean(axis=1), 2 * BONE[:, 1] - BONE[:, 0]])
    values, gradients = run_kernel(x, width, kernel)
    np.testing.assert_allclose(values, twin(x, BONE, WEIGHTS, width, kernel), atol=1e-9)
    for axis, step in enumerate(1e-5 * np.eye(3)):
        higher, lower = run_kernel(x + step, width, kernel)[0], run_kernel(x - step, width, kernel)[0]
        np.testing.assert_allclose(gradients[:, axis], (higher - lower) / 2e-5, atol=1e-8)


@pytest.mark.parametrize("kernel", KERNELS)
def test_one_segment_by_adaptive_quadrature(kernel: Kernel) -> None:
    shape = ci.convolution([[[0, 0, 0], [0, 0, 3.0]]], 0.8, kernel=kernel, width=0.5)
    threshold, _ = quad(lambda t: kernel_at(kernel, 1.6**2 + t * t), -np.inf, np.inf)
    x = np.array([[0.7, 0.2, 1.0], [0.3, 0.1, -0.4], [0, 0, 1.0]])
    expected = [
        quad(lambda t, p=p: kernel_at(kernel, (p[0] ** 2 + p[1] ** 2 + (p[2] - t) ** 2) / 0.25) / 0.5, 0, 3)[0]
        for p in x
    ]
    ratio = shape(x) / (np.array(expected) - threshold)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_long_segment_has_its_radius_and_unit_gradients(kernel: Kernel) -> None:
    axis = np.array([2.0, 1.0, -2.0]) / 3
    shape = ci.convolution([[-500 * axis, 500 * axis]], 1.3, kernel=kernel, width=0.9)
    side = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
    x = 1.3 * side + np.outer([-20, 0.3, 15], axis)
    value, gradient = shape.value_and_gradient(x)
    np.testing.assert_allclose(value, 0, atol=1e-6)
    np.testing.assert_allclose(gradient, -np.tile(side, (3, 1)), atol=1e-6)


@pytest.mark.parametrize("kernel", KERNELS)
def test_bounds_lipschitz_constant_and_contour(kernel: Kernel) -> None:
    shape = ci.convolution(BONE, 1.0, weights=WEIGHTS, kernel=kernel)
    x = random_points(20000)
    value, gradient = shape.value_and_gradient(x)
    assert shape.lipschitz is not None
    assert np.linalg.norm(gradient, axis=1).max() < shape.lipschitz
    assert (x[value > 0] > shape.bounds[0]).all()
    assert (x[value > 0] < shape.bounds[1]).all()
    ends = BONE.reshape(-1, 3)
    assert (shape.bounds[0] > ends.min(axis=0) - 2.2).all()
    assert (shape.bounds[1] < ends.max(axis=0) + 2.2).all()
    mesh = ci.contour(shape.turned("x", 10), 0.3)
    assert (mesh.is_watertight, mesh.components, mesh.genus) == (True, 2, 0)
    assert np.abs(shape.turned("x", 10)(mesh.vertices)).max() < 3e-3


def test_two_halves_are_one_segment() -> None:
    """No bulge where collinear segments meet: the field is additive."""
    whole = ci.convolution([[[0, 0, 0], [4, 4, 2.0]]], 1.0)
    halves = ci.convolution([[[0, 0, 0], [1, 1, 0.5]], [[1, 1, 0.5], [4, 4, 2.0]]], 1.0)
    x = random_points(500)
    np.testing.assert_allclose(halves(x), whole(x), atol=1e-12)


def test_a_negative_weight_carves() -> None:
    segments = [[[-5, 0, 0], [5, 0, 0]], [[0, 0.5, -1], [0, 0.5, 1]]]
    plain = ci.convolution(segments[:1], 1.0)
    carved = ci.convolution(segments, 1.0, weights=[1, -0.8])
    assert plain([[0, 0.9, 0]]) > 0 > carved([[0, 0.9, 0]])


def test_bad_input() -> None:
    for segments in (np.zeros((0, 2, 3)), np.zeros((3, 3)), [[[0, 0, 0], [0, 0, 0]]], [[[0, 0, 0], [np.inf, 0, 0]]]):
        with pytest.raises(ValueError):
            ci.convolution(segments, 1.0)
    with pytest.raises(ValueError, match="kernel"):
        ci.convolution(BONE, 1.0, kernel="box")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="weights"):
        ci.convolution(BONE, 1.0, weights=np.nan)
    for radius, width in ((0, None), (1, -1.0), (math.inf, 1)):
        with pytest.raises(RadiusError):
            ci.convolution(BONE, radius, width=width)
    with pytest.raises(EmptyResultError, match="too short"):
        ci.convolution([[[0, 0, 0], [0, 0, 0.2]]], 1.0)


@pytest.mark.nojit
def test_values_alone_are_those_beside_gradients() -> None:
    """The same integrals, also beside the ends, on the axis, far off, and past a block of points."""
    bone = ci.convolution(BONE, 1.5, weights=WEIGHTS, width=1.1)
    special = [*BONE.reshape(-1, 3), *BONE.mean(axis=1), 3 * BONE[0, 1] - 2 * BONE[0, 0], [1e9, -3e8, 2.0]]
    x = np.concatenate([np.random.default_rng(0).uniform(-12, 12, (270, 3)), special])
    assert np.abs(bone(x) - bone.value_and_gradient(x)[0]).max() < 1e-13
