"""Closed forms of distances and gradients behind the primitives of :mod:`cad_implicit.shapes`, and what builds on them.

Where a gradient does not exist (centres, axes, ridges) one of its limits is given.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .implicit import Affine, FloatArray, Implicit


class _Analytic(Implicit):
    """A shape that computes value and gradient together; an exact distance unless it says otherwise."""

    lipschitz: float | None = 1.0
    exact_inside = exact_outside = True

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, D)`` at points ``(N, D)``."""
        return self.value_and_gradient(points)[1]


class Ball(_Analytic):
    """Ball or disc."""

    def __init__(self, radius: float, dim: int) -> None:
        self._radius = radius
        self.bounds = radius * np.array([[-1.0] * dim, [1.0] * dim])

    def __call__(self, points: ArrayLike) -> FloatArray:
        return np.asarray(self._radius - np.linalg.norm(np.asarray(points, np.float64), axis=1))

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and unit gradients ``(N, D)``."""
        x = np.asarray(points, np.float64)
        unit, length = _unit(x)
        return self._radius - length, -unit


class Box(_Analytic):
    """Cuboid or rectangle."""

    def __init__(self, size: FloatArray) -> None:
        self._half = size / 2
        self.bounds = np.stack([-self._half, self._half])

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and unit gradients ``(N, D)``."""
        x = np.asarray(points, np.float64)
        value, weight = _meet(self._half - np.abs(x))
        return value, -np.where(x < 0, -1.0, 1.0) * weight

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where one face alone decides."""
        value, gradient = self.value_and_gradient(points)
        distances = np.sort(self._half - np.abs(points), axis=1)
        nearest, next_one = distances[:, 0], distances[:, 1]
        holds = (next_one > radius) & (next_one - nearest > 2 * radius)
        face = np.abs(gradient).argmax(axis=1)
        holds &= np.abs(points[np.arange(len(points)), face]) > radius
        return value, gradient, holds


class HalfSpace(_Analytic):
    """Everything behind the plane ``normal · x = offset``."""

    def __init__(self, normal: FloatArray, offset: float) -> None:
        self._normal, self._offset = normal, offset
        self.bounds = np.array([[-np.inf] * 3, [np.inf] * 3])
        axis = int(np.abs(normal).argmax())
        if abs(normal[axis]) == 1:
            self.bounds[1 if normal[axis] > 0 else 0, axis] = offset * normal[axis]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and unit gradients ``(N, 3)``."""
        x = np.asarray(points, np.float64)
        return self._offset - x @ self._normal, np.tile(-self._normal, (len(x), 1))

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Everywhere."""
        return *self.value_and_gradient(points), np.ones(len(points), np.bool_)


class Slab(_Analytic):
    """Everything between two planes."""

    def __init__(self, normal: FloatArray, thickness: float) -> None:
        self._normal, self._half = normal, thickness / 2
        room = np.where(np.abs(normal) == 1, self._half, np.inf)
        self.bounds = np.stack([-room, room])

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and unit gradients ``(N, 3)``."""
        height = np.asarray(points, np.float64) @ self._normal
        return self._half - np.abs(height), -np.where(height < 0, -1.0, 1.0)[:, None] * self._normal


class Polygon(_Analytic):
    """Polygon with corners ``(M, 2)``."""

    def __init__(self, corners: FloatArray) -> None:
        self._start, self._edge = corners, np.roll(corners, -1, axis=0) - corners
        self.bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and unit gradients ``(N, 2)``."""
        x = np.asarray(points, np.float64)
        best = np.full(len(x), np.inf)
        nearest, across = np.zeros_like(x), np.zeros_like(x)
        inside = np.zeros(len(x), np.bool_)
        for start, edge in zip(self._start, self._edge, strict=True):
            arm = x - start
            along = np.clip(arm @ edge / max(float(edge @ edge), 1e-300), 0.0, 1.0)
            arm -= along[:, None] * edge
            square = (arm * arm).sum(axis=1)
            closer = square < best
            best[closer], nearest[closer] = square[closer], arm[closer]
            across[closer] = [-edge[1], edge[0]]
            # a ray towards +x crosses the edge
            over = (x[:, 1] >= start[1]) != (x[:, 1] >= start[1] + edge[1])
            if edge[1] != 0:
                inside ^= over & (x[:, 0] < start[0] + (x[:, 1] - start[1]) * edge[0] / edge[1])
        sign = np.where(inside, 1.0, -1.0)
        distance = np.sqrt(best)
        on_edge = distance == 0
        area = float((self._start[:, 0] * self._edge[:, 1] - self._start[:, 1] * self._edge[:, 0]).sum())
        nearest[on_edge] = np.where(area < 0, -1.0, 1.0) * across[on_edge]
        sign[on_edge] = 1.0
        return sign * distance, sign[:, None] * _unit(nearest)[0]


class Extrusion(_Analytic):
    """Prism over a profile in the plane."""

    def __init__(self, profile: Implicit, height: float) -> None:
        self._profile, self._half = profile, height / 2
        self.exact_inside, self.exact_outside = profile.exact_inside, profile.exact_outside
        self.lipschitz = None if profile.lipschitz is None else max(profile.lipschitz, 1.0)
        self.bounds = np.hstack([profile.bounds, [[-self._half], [self._half]]])

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        x = np.asarray(points, np.float64)
        section, slope = self._profile.value_and_gradient(x[:, :2])
        value, weight = _meet(np.stack([section, self._half - np.abs(x[:, 2])], axis=1))
        cap = -np.where(x[:, 2] < 0, -1.0, 1.0)
        return value, np.hstack([weight[:, :1] * slope, (weight[:, 1] * cap)[:, None]])


class Revolution(_Analytic):
    """Solid of revolution of a profile in the plane of the distance from the axis and z."""

    def __init__(self, profile: Implicit) -> None:
        self._profile = profile
        self.exact_inside, self.exact_outside = profile.exact_inside, profile.exact_outside
        self.lipschitz = profile.lipschitz
        low, high = profile.bounds
        reach = high[0]
        if reach <= 0:
            raise ValueError(f"the profile must reach beyond the axis, but ends at {reach:g} mm from it")
        self.bounds = np.array([[-reach, -reach, low[1]], [reach, reach, high[1]]])

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        x = np.asarray(points, np.float64)
        outward, distance = _unit(x[:, :2])
        value, slope = self._profile.value_and_gradient(np.stack([distance, x[:, 2]], axis=1))
        return value, np.hstack([slope[:, :1] * outward, slope[:, 1:]])


class Superquadric(_Analytic):
    """Superellipsoid: one less a norm of the points, times the shortest semi-axis."""

    exact_inside = exact_outside = False

    def __init__(self, semi_axes: FloatArray, north_south: float, east_west: float) -> None:
        self._axes = semi_axes
        self._powers = (2 / north_south, 2 / east_west)
        self.bounds = np.stack([-semi_axes, semi_axes])
        # |x|_p <= 2^(1/p - 1/2) |x|_2 for two numbers if p < 2, and |x|_p <= |x|_2 from there on
        self.lipschitz = float(np.prod([2 ** max(0.0, 1 / p - 0.5) for p in self._powers]))

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        u = np.asarray(points, np.float64) / self._axes
        ring, ring_slope = _norm(u[:, 0], u[:, 1], self._powers[1])
        norm, slope = _norm(ring, u[:, 2], self._powers[0])
        shortest = float(self._axes.min())
        gradient = np.hstack([slope[:, :1] * ring_slope, slope[:, 1:]])
        return shortest * (1 - norm), -shortest * gradient / self._axes


def _unit(vectors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give unit vectors and lengths; the first axis where there is no direction."""
    length = np.linalg.norm(vectors, axis=1)
    zero = length == 0
    unit = vectors / np.where(zero, 1.0, length)[:, None]
    unit[zero, 0] = 1.0
    return unit, np.asarray(length)


def _meet(distances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance to the intersection of shapes with perpendicular gradients, ``(N, K)`` to ``(N,)``, and its slopes.

    The smallest distance if at most one is negative, less the length of the negative ones otherwise.
    """
    beyond = np.minimum(distances, 0.0)
    length = np.linalg.norm(beyond, axis=1)
    outside = length > 0
    lowest = distances.argmin(axis=1)
    value = np.where(outside, -length, distances.min(axis=1))
    weight = -beyond / np.where(outside, length, 1.0)[:, None]
    weight[~outside, lowest[~outside]] = 1.0
    return value, weight


def _norm(a: FloatArray, b: FloatArray, power: float) -> tuple[FloatArray, FloatArray]:
    """p-norm ``(N,)`` of two numbers and its slopes ``(N, 2)``."""
    both = np.stack([a, b], axis=1)
    largest = np.abs(both).max(axis=1)
    share = np.abs(both) / np.where(largest > 0, largest, 1.0)[:, None]
    norm = (share**power).sum(axis=1) ** (1 / power)
    slope = np.sign(both) * (share / np.where(norm > 0, norm, 1.0)[:, None]) ** (power - 1)
    return largest * norm, slope
