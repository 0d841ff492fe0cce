"""Graded lengths: sizes in mm that change from place to place, as those of cells, walls and struts may.

A size is a number, or anything that maps points to numbers: a function, an Implicit, or a ramp made by :func:`graded`.

Not promised: whole lattices where cells vary. They are stretched about the origin, ``g(x / cell(x))``, and fold where
the cell changes too fast: by more than its own size over the distance from the origin. Lattices of constant cells that
halve from layer to layer always meet: ``slab_lattice(4, w) | (slab_lattice(2, w) - offset(part, -3))``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from .errors import RadiusError
from .implicit import FloatArray, Implicit

#: A length in mm, or a function from points ``(N, 3)`` to lengths ``(N,)``.
Size = float | Callable[[FloatArray], FloatArray]

#: Step in mm of the central differences of plain functions, for sizes of parts from 0.01 to 1000 mm.
_STEP = 1e-5


@runtime_checkable
class Length(Protocol):
    """What lattices see of a size: values and gradients, and how fast it changes at most (None if unknown)."""

    lipschitz: float | None

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lengths ``(N,)`` in mm and gradients ``(N, 3)``."""


class Ramp:
    """A length that changes with the depth below a surface; :func:`graded` makes it."""

    def __init__(self, surface: Implicit, near: float, far: float, depth: float) -> None:
        self._surface, self._near, self._far, self._depth = surface, near, far, depth
        self.lipschitz = None
        if surface.lipschitz is not None:
            self.lipschitz = abs(far - near) / depth * surface.lipschitz

    def __call__(self, points: ArrayLike) -> FloatArray:
        """Lengths ``(N,)`` in mm at points ``(N, 3)``."""
        share = np.clip(self._surface(points) / self._depth, 0.0, 1.0)
        return np.asarray(self._near + (self._far - self._near) * share)

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lengths ``(N,)`` in mm and gradients ``(N, 3)``."""
        value, gradient = self._surface.value_and_gradient(points)
        share = value / self._depth
        slope = np.where((share > 0) & (share < 1), (self._far - self._near) / self._depth, 0.0)
        return self._near + (self._far - self._near) * np.clip(share, 0.0, 1.0), slope[:, None] * gradient


class _Constant:
    lipschitz: float | None = 0.0

    def __init__(self, value: float) -> None:
        self.value = value

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.full(len(points), self.value), np.zeros_like(points)


class _Function:
    lipschitz: float | None = None

    def __init__(self, function: Callable[[FloatArray], FloatArray]) -> None:
        self._function = function

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        gradient = np.zeros_like(points)
        for axis, shift in enumerate(_STEP * np.eye(points.shape[1])):
            ahead, behind = self._function(points + shift), self._function(points - shift)
            gradient[:, axis] = (np.asarray(ahead) - np.asarray(behind)) / (2 * _STEP)
        return np.asarray(self._function(points), np.float64).reshape(len(points)), gradient


def graded(surface: Implicit, near: float, far: float, depth: float) -> Ramp:
    """Length that is ``near`` at a surface and outside, and ``far`` from ``depth`` mm inside on, linear between.

    Parameters
    ----------
    surface : Implicit
        Its values should be distances.
    near, far : float
        In mm, or whatever is graded; positive.
    depth : float
        In mm.

    Examples
    --------
    >>> from cad_implicit import sphere
    >>> graded(sphere(10), 1.0, 3.0, 5.0)([[10, 0, 0], [7.5, 0, 0], [0, 0, 0]])
    array([1., 2., 3.])
    """
    for name, value in (("near", near), ("far", far), ("depth", depth)):
        _positive(name, value)
    return Ramp(surface, float(near), float(far), float(depth))


def as_length(name: str, size: Size | Length) -> Length:
    """Size as something with values and gradients.

    Raises
    ------
    RadiusError
        If it is a number that is not positive and finite.
    """
    if isinstance(size, Length):
        return size
    return _Function(size) if callable(size) else _Constant(_positive(name, size))


def constant(length: Length) -> float | None:
    """Return the one value of a length that does not change, else None."""
    return length.value if isinstance(length, _Constant) else None


def _positive(name: str, value: float) -> float:
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise RadiusError(f"{name} must be a positive number of mm, not {number:g}")
    return number
