"""Transforms: moved, turned, scaled and mirrored shapes, as new Implicits.

Every Implicit has them as methods.
Moved, turned, mirrored and evenly scaled distances stay exact distances; unevenly scaled ones keep their Lipschitz
constant only: their values are too small.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .implicit import Affine, Axis, FloatArray, Implicit, polished

#: Singular values that agree within this share make an even scaling: a composition of twenty turns loses 1e-15.
_EVEN = 1e-12


class Placed(Implicit):
    """A shape in another frame: the points ``matrix @ y + shift`` for the points y of the parent.

    Values are those of the parent times the smallest factor by which the matrix stretches.

    Parameters
    ----------
    parent : Implicit
    matrix : (D, D) float64
        Invertible.
    shift : (D,) float64
        In mm.
    """

    def __init__(self, parent: Implicit, matrix: FloatArray, shift: FloatArray) -> None:
        if isinstance(parent, Placed):
            matrix, shift, parent = matrix @ parent.matrix, matrix @ parent.shift + shift, parent.parent
        self.parent: Implicit = parent
        self.matrix: FloatArray = matrix
        self.shift: FloatArray = shift
        factors = np.linalg.svd(matrix, compute_uv=False)
        self._factor = float(factors.min())
        self._inverse = np.linalg.inv(matrix)
        even = bool(factors.max() <= self._factor * (1 + _EVEN))
        self.exact_inside, self.exact_outside = even and parent.exact_inside, even and parent.exact_outside
        self.lipschitz, self.rough, self.bounded = parent.lipschitz, parent.rough, parent.bounded
        self.spacing = None if parent.spacing is None else self._factor * parent.spacing
        self.bounds = _box(matrix, parent.bounds) + shift

    def __call__(self, points: ArrayLike) -> FloatArray:
        return np.asarray(self._factor * self.parent(self._back(points)))

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, D)`` at points ``(N, D)``."""
        return self._forth(self.parent.gradient(self._back(points)))

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, D)``."""
        value, gradient = self.parent.value_and_gradient(self._back(points))
        return self._factor * value, self._forth(gradient)

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients, as exact as the parent knows them."""
        value, gradient = polished(self.parent, self._back(points))
        return self._factor * value, self._forth(gradient)

    def within(self, points: ArrayLike, radius: ArrayLike) -> NDArray[np.bool_]:
        """Whether the surface comes nearer to points than a radius, or may do so."""
        return self.parent.within(self._back(points), np.asarray(radius, np.float64) / self._factor)

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where the parent is linear."""
        f = self._factor
        value, gradient, holds = self.parent.affine_within(self._back(points), radius / f, tolerance / f)
        return f * value, self._forth(gradient), holds

    def _back(self, points: ArrayLike) -> FloatArray:
        return np.ascontiguousarray((np.asarray(points, np.float64) - self.shift) @ self._inverse.T)

    def _forth(self, gradient: FloatArray) -> FloatArray:
        return np.asarray(self._factor * gradient @ self._inverse)


def moved(shape: Implicit, by: ArrayLike) -> Placed:
    """Move any shape by a vector ``(D,)`` in mm.

    Examples
    --------
    >>> from cad_implicit import sphere
    >>> moved(sphere(1), (5, 0, 0))([[5, 0, 0], [3, 0, 0]])
    array([ 1., -1.])
    """
    return Placed(shape, np.eye(shape.dim), _vector("by", by, shape.dim))


def turned(shape: Implicit, axis: Axis, degrees: float, about: ArrayLike | None = None) -> Placed:
    """Turn any shape about an axis, counter-clockwise seen against the axis.

    Parameters
    ----------
    shape : Implicit
    axis : "x", "y", "z" or (3,) array_like
        Direction of the axis. In the plane only "z".
    degrees : float
    about : (D,) array_like, optional
        A point of the axis in mm; the origin by default.
    """
    angle = math.radians(float(degrees))
    cosine, sine = _exactly(math.cos(angle)), _exactly(math.sin(angle))
    if shape.dim == 2:
        if not (isinstance(axis, str) and axis == "z"):
            raise ValueError(f'a shape in the plane is turned about the axis "z", not {axis!r}')
        matrix = np.array([[cosine, -sine], [sine, cosine]])
    else:
        x, y, z = direction(axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        matrix = np.eye(3) + sine * cross + (1 - cosine) * cross @ cross
    return _about(shape, matrix, about)


def scaled(shape: Implicit, factor: ArrayLike, about: ArrayLike | None = None) -> Placed:
    """Scale any shape.

    Parameters
    ----------
    shape : Implicit
    factor : float or (D,) array_like
        One factor, or one for each axis; positive.
    about : (D,) array_like, optional
        The point that stays, in mm; the origin by default.
    """
    factors = np.broadcast_to(np.asarray(factor, np.float64), (shape.dim,))
    if not (np.isfinite(factors).all() and (factors > 0).all()):
        raise ValueError(f"factors must be positive and finite, not {factor!r}; use mirrored() for a mirror image")
    return _about(shape, np.diag(factors), about)


def mirrored(shape: Implicit, normal: Axis, about: ArrayLike | None = None) -> Placed:
    """Mirror any shape.

    Parameters
    ----------
    shape : Implicit
    normal : "x", "y", "z" or (D,) array_like
        Normal of the mirror.
    about : (D,) array_like, optional
        A point of the mirror in mm; the origin by default.
    """
    n = direction(normal, shape.dim)
    return _about(shape, np.eye(shape.dim) - 2 * np.outer(n, n), about)


def direction(axis: Axis, dim: int = 3) -> FloatArray:
    """Give the unit vector ``(D,)`` of an axis."""
    if isinstance(axis, str):
        if axis not in ("x", "y", "z")[:dim]:
            raise ValueError(f"an axis is named {', '.join('xyz'[:dim])}, not {axis!r}")
        return np.asarray(np.eye(dim)["xyz".index(axis)])
    vector = _vector("a direction", axis, dim)
    length = float(np.linalg.norm(vector))
    if length == 0:
        raise ValueError("a direction must not be zero")
    return np.asarray(vector / length)


def _about(shape: Implicit, matrix: FloatArray, about: ArrayLike | None) -> Placed:
    centre = np.zeros(shape.dim) if about is None else _vector("about", about, shape.dim)
    return Placed(shape, matrix, centre - matrix @ centre)


def _vector(name: str, value: ArrayLike, dim: int) -> FloatArray:
    vector = np.array(value, np.float64)
    if vector.shape != (dim,) or not np.isfinite(vector).all():
        raise ValueError(f"{name} must be {dim} finite numbers for a shape in {dim}-D, not {value!r}")
    return vector


def _exactly(value: float) -> float:
    """Sine or cosine without the rounding error of a right angle, so that boxes stay tight."""
    nearest = float(round(value))
    return nearest if abs(value - nearest) < 1e-15 else value


def _box(matrix: FloatArray, bounds: FloatArray) -> FloatArray:
    """Box of a box's image under a matrix; sides may be at infinity."""
    with np.errstate(invalid="ignore"):
        ends = np.where(matrix == 0, 0.0, matrix * bounds[:, None, :])
    return np.stack([ends.min(axis=0).sum(axis=1), ends.max(axis=0).sum(axis=1)])
