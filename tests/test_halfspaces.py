"""Projection onto a few half-spaces against a solver for convex problems."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from cad_implicit.kernels import halfspaces

pytestmark = pytest.mark.nojit


def twin(x: np.ndarray, n: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Nearest point with ``n y >= b`` by the dual problem: multipliers that are not negative (Lawson and Hanson)."""
    matrix = np.vstack([n.T, (b - n @ x)[None]])
    residual = matrix @ nnls(matrix, np.array([0, 0, 0, 1.0]))[0] - [0, 0, 0, 1]
    return x - residual[:3] / residual[3]


def feasible_problems(count: int, planes: int, spread: float) -> tuple[np.ndarray, ...]:
    """Half-spaces through or below a point near the origin, with normals within ``spread`` of each other or so."""
    rng = np.random.default_rng(planes)
    n = rng.normal(size=(count, planes, 3)) * spread + [0, 0, 1]
    n /= np.linalg.norm(n, axis=2)[:, :, None]
    inside = rng.normal(size=(count, 3)) * 0.1
    b = (n * inside[:, None]).sum(axis=2) - np.maximum(rng.normal(size=(count, planes)), 0) * 0.1
    x = inside + rng.normal(size=(count, 3)) - [0, 0, 1]
    return x, n, b


@pytest.mark.parametrize("planes", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("spread", [0.1, 1.0])
def test_nearest_point_is_the_solver_s(planes: int, spread: float) -> None:
    x, n, b = feasible_problems(40, planes, spread)
    which = np.arange(len(x))
    y, mask = halfspaces.nearest_feasible_many(which, x, n, b, np.full(len(x), planes), np.zeros_like(x))
    assert (mask >= 0).all()
    truth = np.array([twin(*problem) for problem in zip(x, n, b, strict=True)])
    assert np.abs(y - truth).max() < 1e-6
    held = ((mask[:, None] >> np.arange(planes)) & 1).astype(bool)
    assert held.sum(axis=1).max() <= 3
    assert np.abs(((n * y[:, None]).sum(axis=2) - b)[held]).max(initial=0) < 1e-8


def test_no_point_gives_the_fallback() -> None:
    n = np.array([[[0, 0, 1.0], [0, 0, -1.0]]])
    fallback = np.array([[1.0, 2.0, 3.0]])
    y, mask = halfspaces.nearest_feasible_many(
        np.array([0]), np.zeros((1, 3)), n, np.ones((1, 2)), np.array([2]), fallback
    )
    assert mask[0] == -1
    assert (y == fallback).all()


def test_planes_of_one_feature_replace_each_other() -> None:
    n, b, seen_from = np.zeros((1, 2, 3)), np.zeros((1, 2)), np.zeros((1, 2, 3))
    count = np.zeros(1, np.int64)

    def add(normal: list[float], offset: float, place: list[float], held: int = -1) -> bool:
        unit = np.array(normal) / np.linalg.norm(normal)
        return bool(
            halfspaces.add_plane(n, b, seen_from, count, 0, unit, offset, np.array([place]), np.array([held]), 1e-6)
        )

    assert add([0, 0, 1], 1.0, [0, 0, 0])
    assert not add([0.05, 0, 1], 0.9, [0.05, 0, 0])  # a point's normal turns as far as the place moves in radii
    assert (count[0], b[0, 0]) == (1, 0.9)
    assert add([-0.2, 0, 1], 1.0, [0.0501, 0, 0])  # the other side of a rim: turned, but hardly moved
    assert count[0] == 2
    assert add([0, 1, 0], -5.0, [0, 0, 0])  # full: takes the place of the slackest
    assert count[0] == 2
    assert sorted(b[0]) == [-5.0, 0.9] or sorted(b[0]) == [-5.0, 1.0]
    other = int(b[0].argmin() == 0)
    assert add([1, 0, 0], -7.0, [0, 0, 0], held=2 - other)  # … but not of one that holds the centre
    assert b[0, other] == -7.0


def test_planes_of_a_hollow_feature_hold_together() -> None:
    n, b, seen_from = np.zeros((1, 2, 3)), np.zeros((1, 2)), np.zeros((1, 2, 3))
    count, none = np.zeros(1, np.int64), np.array([-1])
    for number, turn in enumerate([0.0, 0.05]):
        unit, place = np.array([np.sin(turn), 0, np.cos(turn)]), np.array([[0.1 * number, 0, 0]])
        assert halfspaces.add_plane(n, b, seen_from, count, 0, unit, 0.02 * number, place, none, 1e-6)
    assert count[0] == 2
