"""Implicit: a shape given by a function of points that is positive inside, zero on the surface, negative outside.

A plain function wrapped with its bounds, the exact distance to a mesh, a sampled field, the result of an
operation: all are Implicits, so operations nest.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from .transforms import Placed

FloatArray = NDArray[np.float64]

#: Maps points (N, 3) to values (N,) and gradients (N, 3).
Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

#: What :meth:`Implicit.affine_within` gives.
Affine = tuple[FloatArray, FloatArray, NDArray[np.bool_]]

#: A direction: the name of an axis, or a vector of any length.
Axis = str | Sequence[float] | FloatArray

#: Step of the central differences, relative to the diagonal of the bounds: the cube root of the machine epsilon
#: balances truncation against rounding.
_DIFFERENCE_STEP = 6e-6


class Implicit(ABC):
    """A shape as a function of points, positive inside, with the box that holds its surface.

    Attributes
    ----------
    bounds : (2, D) float64
        Lower and upper corner in mm of a box that holds the whole surface; D is 2 or 3.
    lipschitz : float or None
        A constant L with ``|f(x) - f(y)| <= L |x - y|``: 1 for distances, None if unknown. Sparse sampling
        skips what cannot hold surface by it.
    exact_inside, exact_outside : bool
        Whether values are exact signed distances everywhere on that side, not only near the surface.
    bounded : bool
        Whether the inside is finite; False for the complement of a part.
    spacing : float or None
        Grid spacing in mm that the shape was made with, and at which it is contoured unless told otherwise.
    radius : float or None
        Of the balls that rounded it, in mm, if it is known.
    rough : bool
        Whether ``polished`` gives better values than calls do.
    """

    bounds: FloatArray
    lipschitz: float | None = None
    exact_inside: bool = False
    exact_outside: bool = False
    bounded: bool = True
    spacing: float | None = None
    radius: float | None = None
    rough: bool = False

    @abstractmethod
    def __call__(self, points: ArrayLike) -> FloatArray:
        """Values ``(N,)`` at points ``(N, D)`` in mm."""

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, D)`` at points ``(N, D)``; by central differences unless a subclass knows better."""
        x = np.asarray(points, np.float64)
        step = _DIFFERENCE_STEP * float(np.linalg.norm(self.bounds[1] - self.bounds[0]))
        out = np.zeros_like(x)
        for axis in range(x.shape[1]):
            shift = np.zeros(x.shape[1])
            shift[axis] = step
            out[:, axis] = (self(x + shift) - self(x - shift)) / (2 * step)
        return out

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, D)`` at once; cheaper than one after the other for distances."""
        return self(points), self.gradient(points)

    def __or__(self, other: Implicit) -> Implicit:
        """Union."""
        from .booleans import Boolean

        return Boolean(self, other, union=True)

    def __and__(self, other: Implicit) -> Implicit:
        """Intersection."""
        from .booleans import Boolean

        return Boolean(self, other, union=False)

    def __sub__(self, other: Implicit) -> Implicit:
        """Difference: this shape without the other."""
        from .booleans import Boolean

        return Boolean(self, other, union=False, second_sign=-1.0)

    def moved(self, by: ArrayLike) -> Placed:
        """Shape moved by a vector ``(D,)`` in mm; see :func:`cad_implicit.moved`."""
        from .transforms import moved

        return moved(self, by)

    def turned(self, axis: Axis, degrees: float, about: ArrayLike | None = None) -> Placed:
        """Shape turned about an axis; see :func:`cad_implicit.turned`."""
        from .transforms import turned

        return turned(self, axis, degrees, about)

    def scaled(self, factor: ArrayLike, about: ArrayLike | None = None) -> Placed:
        """Shape scaled by one factor, or by one for each axis; see :func:`cad_implicit.scaled`."""
        from .transforms import scaled

        return scaled(self, factor, about)

    def mirrored(self, normal: Axis, about: ArrayLike | None = None) -> Placed:
        """Mirror image; see :func:`cad_implicit.mirrored`."""
        from .transforms import mirrored

        return mirrored(self, normal, about)

    def within(self, points: ArrayLike, radius: ArrayLike) -> NDArray[np.bool_]:
        """Whether the surface comes nearer to points ``(N, D)`` than a radius in mm, or may do so; for distances."""
        return np.asarray(np.abs(self(points)) < radius)

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where the function is linear, for certain: contouring need not look there again.

        Parameters
        ----------
        points : (N, 3) float64
        radius : float
            In mm.
        tolerance : float
            Largest error in mm.

        Returns
        -------
        values : (N,) float64
        gradients : (N, 3) float64
        holds : (N,) bool
            Whether the function is ``value + gradient * (x - point)`` for all x up to ``radius`` from the point. Values
            and gradients count only where it is.
        """
        return np.zeros(len(points)), np.zeros_like(points), np.zeros(len(points), np.bool_)

    def roughly(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds ``(N,)`` of the values that cost little."""
        value = self(points)
        return value, value

    @property
    def exact(self) -> bool:
        """Whether values are exact signed distances everywhere."""
        return self.exact_inside and self.exact_outside

    @property
    def dim(self) -> int:
        """Dimension of the points, 2 or 3."""
        return int(self.bounds.shape[1])


class Function(Implicit):
    """A plain function of points as an Implicit.

    Parameters
    ----------
    function : callable
        Maps points ``(N, D)`` to values ``(N,)``, positive inside.
    bounds : (2, D) array_like
        Box in mm that holds the whole surface.
    gradient : callable, optional
        Maps points ``(N, D)`` to gradients ``(N, D)``; central differences by default.
    lipschitz : float, optional
        Bound on the gradient's length, if known.

    Examples
    --------
    >>> ball = Function(lambda x: 1 - (x**2).sum(axis=1), [[-1, -1, -1], [1, 1, 1]])
    >>> ball([[0, 0, 0], [2, 0, 0]])
    array([ 1., -3.])
    """

    def __init__(
        self,
        function: Callable[[FloatArray], NDArray[np.floating]],
        bounds: ArrayLike,
        *,
        gradient: Callable[[FloatArray], FloatArray] | None = None,
        lipschitz: float | None = None,
    ) -> None:
        self.bounds = np.array(bounds, np.float64)
        if self.bounds.shape not in ((2, 2), (2, 3)) or not (self.bounds[1] > self.bounds[0]).all():
            raise ValueError(f"bounds must be a lower and a higher corner, (2, 2) or (2, 3), not {bounds!r}")
        self.lipschitz = lipschitz
        self._function = function
        self._gradient = gradient

    def __call__(self, points: ArrayLike) -> FloatArray:
        x = np.asarray(points, np.float64)
        return np.asarray(self._function(x), np.float64).reshape(len(x))

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, D)`` at points ``(N, D)``."""
        if self._gradient is None:
            return super().gradient(points)
        return np.asarray(self._gradient(np.asarray(points, np.float64)), np.float64)


def polished(shape: Implicit, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and gradients as exact as the shape knows them, for points of its surface."""
    better = getattr(shape, "polished", shape.value_and_gradient)
    value, gradient = better(points)
    return value, gradient
