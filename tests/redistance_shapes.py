"""Functions with a known distance, in the plane and in space, turned off the axes and moved off the nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cad_implicit.field import Field
from cad_implicit.grid import Grid

Array = NDArray[np.float64]
TURN = Rotation.from_euler("xyz", [23, 37, 11], degrees=True).as_matrix()
SHIFT = np.array([0.037, -0.071, 0.018])


def local(x: Array) -> Array:
    """Points in the frame of the shape."""
    dim = x.shape[1]
    turn = TURN if dim == 3 else Rotation.from_euler("z", 31, degrees=True).as_matrix()[:2, :2]
    return (x - SHIFT[:dim]) @ turn


def ball(x: Array) -> Array:
    return 1 - (local(x) ** 2).sum(axis=1)


def ball_distance(x: Array) -> Array:
    return 1 - np.linalg.norm(local(x), axis=1)


def torus_distance(x: Array) -> Array:
    u = local(x)
    return 0.35 - np.hypot(np.hypot(u[:, 0], u[:, 1]) - 0.8, u[:, 2] if u.shape[1] == 3 else 0)


def torus(x: Array) -> Array:
    u = local(x)
    height = u[:, 2] ** 2 if u.shape[1] == 3 else 0
    return 0.35**2 - (np.hypot(u[:, 0], u[:, 1]) - 0.8) ** 2 - height


def _past_faces(x: Array) -> Array:
    return np.abs(local(x)) - np.array([0.9, 0.7, 0.6])[: x.shape[1]]


def box(x: Array) -> Array:
    return -_past_faces(x).max(axis=1)


def box_distance(x: Array) -> Array:
    past = _past_faces(x)
    return -np.linalg.norm(np.maximum(past, 0), axis=1) - np.minimum(past.max(axis=1), 0)


def wedge(x: Array) -> Array:
    """Material between two planes that meet at 90 degrees."""
    u = local(x)
    return np.minimum(u[:, 0], u[:, 1])


def wedge_distance(x: Array) -> Array:
    u = local(x)[:, :2]
    inside = u.min(axis=1)
    return np.where(inside > 0, inside, -np.linalg.norm(np.minimum(u, 0), axis=1))


def badly_scaled(f: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """The function times a factor between a thousandth and a thousand."""
    return lambda x: f(x) * 10 ** (3 * np.tanh(1.5 * x[:, 0]))


@dataclass(frozen=True)
class Case:
    """A function, its distance, and the largest errors that are accepted, in spacings (measured plus a tenth).

    surface: of the interpolated distance at points of the surface; band: at nodes nearer than 4 spacings.
    """

    name: str
    function: Callable[[Array], Array]
    distance: Callable[[Array], Array]
    dim: int
    surface: float
    band: float
    spacing: tuple[float, ...] = ()

    @property
    def grid(self) -> Grid:
        """Grid over [-1.5, 1.5] with 0.04 (plane) or 0.08 (space) between nodes, or the spacing of the case."""
        spacing = self.spacing or ((0.04, 0.04) if self.dim == 2 else (0.08, 0.08, 0.08))
        return Grid.cover([[-1.5] * self.dim, [1.5] * self.dim], spacing)

    def field(self, dtype: type[np.floating] = np.float32) -> Field:
        """The sampled function."""
        grid = self.grid
        return Field(grid, self.function(grid.nodes()).reshape(grid.shape).astype(dtype))

    def surface_points(self) -> Array:
        """Random points projected on the surface, well inside the grid, away from where the distance has creases."""
        x = np.random.default_rng(1).uniform(-1.3, 1.3, (20_000, self.dim))
        x = x[np.abs(self.distance(x)) < 0.15]
        for _ in range(4):
            x = x - self.distance(x)[:, None] * gradient(self.distance, x)
        sharp = np.abs(np.linalg.norm(gradient(self.distance, x, 0.1 * min(self.grid.spacing)), axis=1) - 1) > 1e-2
        return x[~sharp & (np.abs(self.distance(x)) < 1e-9)]

    def errors(self, result: Field) -> tuple[float, float]:
        """Largest errors of a result on the surface and in the band, in units of the smallest spacing."""
        h = min(self.grid.spacing)
        x = self.grid.nodes()
        exact = self.distance(x)
        foot = x - exact[:, None] * gradient(self.distance, x)
        near = (np.abs(exact) < 4 * h) & (np.abs(foot) < 1.4).all(axis=1)
        surface = np.abs(result(self.surface_points())).max() / h
        return surface, np.abs(result.values.ravel() - exact)[near].max() / h


def gradient(f: Callable[[Array], Array], x: Array, step: float = 1e-6) -> Array:
    """Gradients by central differences."""
    shifts = step * np.eye(x.shape[1])
    return np.stack([(f(x + s) - f(x - s)) / (2 * step) for s in shifts], axis=1)


LONG = (0.08, 0.05, 0.11)
CASES = [
    Case("circle", ball, ball_distance, 2, 0.010, 0.05),
    Case("circle, badly scaled", badly_scaled(ball), ball_distance, 2, 0.038, 0.23),
    Case("circle, anisotropic", ball, ball_distance, 2, 0.012, 0.06, (0.03, 0.05)),
    Case("ring", torus, torus_distance, 2, 0.029, 0.20),
    Case("rectangle", box, box_distance, 2, 0.380, 0.56),
    Case("rectangle, badly scaled", badly_scaled(box), box_distance, 2, 0.370, 0.55),
    Case("corner", wedge, wedge_distance, 2, 0.406, 0.61),
    Case("sphere", ball, ball_distance, 3, 0.023, 0.15),
    Case("sphere, distance given", ball_distance, ball_distance, 3, 0.023, 0.14),
    Case("sphere, badly scaled", badly_scaled(ball), ball_distance, 3, 0.086, 0.47),
    Case("sphere, anisotropic", ball, ball_distance, 3, 0.049, 0.26, LONG),
    Case("torus", torus, torus_distance, 3, 0.042, 0.37),
    Case("torus, badly scaled", badly_scaled(torus), torus_distance, 3, 0.113, 0.82),
    Case("box", box, box_distance, 3, 0.398, 1.07),
    Case("box, badly scaled", badly_scaled(box), box_distance, 3, 0.405, 1.04),
    Case("box, anisotropic", box, box_distance, 3, 0.928, 1.30, LONG),
    Case("wedge", wedge, wedge_distance, 3, 0.375, 0.62),
    Case("wedge, badly scaled", badly_scaled(wedge), wedge_distance, 3, 0.381, 0.64),
]
