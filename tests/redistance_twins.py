"""Slow and plain NumPy twins of the kernels of normalization and re-initialization, for small grids."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
INF = np.inf


def gradient_lengths(f: Array, spacing: tuple[float, ...]) -> Array:
    parts = [np.gradient(f, h, axis=a) for a, h in enumerate(spacing) if f.shape[a] > 1]
    return np.sqrt(sum(p**2 for p in parts))


def normalized(f: Array, spacing: tuple[float, ...], rvachev: bool, limit: float) -> Array:
    length = gradient_lengths(f, spacing)
    if rvachev:
        length = np.sqrt(length**2 + f**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(f == 0, 0, np.clip(f / length, -limit, limit))


def advanced(p: Array, rate: Array, spacing: tuple[float, ...], node: tuple[int, ...]) -> float:
    """Equations (3.6) to (3.9) at a node, with the signs of the paper."""
    positive = rate[node] >= 0
    square = 0.0
    for axis, h in enumerate(spacing):
        before, after = stencil(p, node, axis, 1)[[0, 2]]
        plus, minus = (after - p[node]) / h, (p[node] - before) / h
        if positive:
            square += max(min(plus, 0) ** 2, max(minus, 0) ** 2)
        else:
            square += max(max(plus, 0) ** 2, min(minus, 0) ** 2)
    return p[node] - rate[node] * (np.sqrt(square) - 1)


def stencil(p: Array, node: tuple[int, ...], axis: int, reach: int) -> Array:
    """Values of the nodes up to ``reach`` before and after; past the border those of the border."""
    index = np.clip(np.arange(node[axis] - reach, node[axis] + reach + 1), 0, p.shape[axis] - 1)
    return np.array([p[(*node[:axis], i, *node[axis + 1 :])] for i in index])


def held(f: Array, spacing: tuple[float, ...], even: float) -> tuple[Array, NDArray[np.bool_]]:
    """Distances of the corners of cut cells, and which of them are held."""
    lengths = gradient_lengths(f, spacing)
    values, mask = np.zeros(f.shape), np.zeros(f.shape, bool)
    for node in np.ndindex(f.shape):
        around = [
            f[tuple(np.clip(np.add(node, d), 0, np.array(f.shape) - 1))]
            for d in itertools.product((-1, 0, 1), repeat=f.ndim)
        ]
        if len(set(np.sign(around))) == 1 and f[node] != 0:
            continue
        slopes, changes = [0.0], []
        for axis, h in enumerate(spacing):
            before, here, after = stencil(f, node, axis, 1)
            slopes += [abs(here - x) / h for x in (before, after) if np.sign(x) != np.sign(here)]
            changes += [abs(stencil(lengths, node, axis, 1) - lengths[node]).max()]
        if f[node] == 0:
            mask[node] = True
        elif max(slopes) > 0 or (lengths[node] > 0 and max(changes) <= even * lengths[node]):
            mask[node] = True
            values[node] = f[node] / max(lengths[node], *slopes)
    return values, mask


def minmod(a: float, b: float) -> float:
    return 0.0 if a * b <= 0 else min(a, b, key=abs)


def crossing(before: float, here: float, after: float, beyond: float) -> float:
    """Root between 0 and 1 of the parabola of Min and Gibou, by bisection."""
    second = minmod(after - 2 * here + before, beyond - 2 * after + here)
    low, high = 0.0, 1.0
    for _ in range(60):
        x = (low + high) / 2
        value = here + (after - here) * x - second / 2 * x * (1 - x)
        low, high = (x, high) if value * here > 0 else (low, x)
    return (low + high) / 2


def crossings(f: Array, spacing: tuple[float, ...], node: tuple[int, ...]) -> list[float]:
    """Distances to the crossings before and after along each axis."""
    found = []
    for axis, h in enumerate(spacing):
        b2, b1, here, a1, a2 = stencil(f, node, axis, 2)
        found.append(h * crossing(a1, here, b1, b2) if np.sign(b1) != np.sign(here) else INF)
        found.append(h * crossing(b1, here, a1, a2) if np.sign(a1) != np.sign(here) else INF)
    return found


def weno5(v: Array) -> float:
    """Fifth-order difference of Jiang and Peng from five one-sided ones, in matrix form."""
    candidates = np.array([[2, -7, 11, 0, 0], [0, -1, 5, 2, 0], [0, 0, 2, 5, -1]]) / 6 @ v
    curved = np.array([[1, -2, 1, 0, 0], [0, 1, -2, 1, 0], [0, 0, 1, -2, 1]]) @ v
    sloped = np.array([[1, -4, 3, 0, 0], [0, 1, 0, -1, 0], [0, 0, 3, -4, 1]]) @ v
    smoothness = 13 / 12 * curved**2 + sloped**2 / 4
    weights = np.array([1, 6, 3]) / 10 / (smoothness + 1e-6 * (v**2).max() + 1e-99) ** 2
    return float(candidates @ weights / weights.sum())


def advanced_high(
    p: Array, rate: float, spacing: tuple[float, ...], node: tuple[int, ...], ends: list[float], weno: bool
) -> float:
    """One Euler step of the ENO or WENO scheme at a node; ``ends`` are the distances to its crossings."""
    square = 0.0
    for axis, h in enumerate(spacing):
        if p.shape[axis] == 1:
            continue
        v = stencil(p, node, axis, 3)
        before, after = ends[2 * axis : 2 * axis + 2]
        if weno and before == after == INF:
            d = np.diff(v) / h
            minus, plus = weno5(d[:5]), weno5(d[:0:-1])
        else:
            second = np.diff(v, 2)[1:4] / h**2
            lower, upper = minmod(second[1], second[0]), minmod(second[1], second[2])
            minus = (v[3] - v[2]) / h + h / 2 * lower if before == INF else v[3] / before + before / 2 * lower
            plus = (v[4] - v[3]) / h - h / 2 * upper if after == INF else -v[3] / after - after / 2 * upper
        sign = 1 if rate >= 0 else -1
        square += max(sign * minus, -sign * plus, 0) ** 2
    return p[node] - rate * (np.sqrt(square) - 1)
