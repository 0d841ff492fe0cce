"""Booleans of Implicits: union, intersection and difference as the larger or smaller of two values.

``a | b``, ``a & b`` and ``a - b``. The surface is exact, with its sharp intersection curves; the values of exact
distances stay exact outside a union and inside an intersection, and are too small elsewhere, so that further operations
compute the distance anew.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import EmptyResultError
from .implicit import Affine, FloatArray, Implicit, polished


class Boolean(Implicit):
    """Union or intersection of two shapes, or the difference of the first less the second.

    Made by the operators ``|``, ``&`` and ``-`` of Implicits.

    Raises
    ------
    EmptyResultError
        If the boxes of an intersection do not meet.
    ValueError
        If one shape is in the plane and the other in space.
    """

    def __init__(self, first: Implicit, second: Implicit, *, union: bool, second_sign: float = 1.0) -> None:
        if first.dim != second.dim:
            raise ValueError(f"a shape in {first.dim}-D and one in {second.dim}-D cannot be joined")
        self.first, self.second = first, second
        self._union, self._sign = union, second_sign
        self.bounds = _bounds(first, second, union, second_sign)
        if first.lipschitz is not None and second.lipschitz is not None:
            self.lipschitz = max(first.lipschitz, second.lipschitz)
        second_inside, second_outside = second.exact_inside, second.exact_outside
        if second_sign < 0:
            second_inside, second_outside = second_outside, second_inside
        self.exact_outside = union and first.exact_outside and second_outside
        self.exact_inside = not union and first.exact_inside and second_inside
        self.rough = first.rough or second.rough
        second_bounded = second.bounded == (second_sign > 0)
        self.bounded = first.bounded and second_bounded if union else first.bounded or second_bounded
        spacings = [s.spacing for s in (first, second) if s.spacing is not None]
        self.spacing = min(spacings, default=None)

    def __call__(self, points: ArrayLike) -> FloatArray:
        choose = np.maximum if self._union else np.minimum
        return np.asarray(choose(self.first(points), self._sign * self.second(points)))

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, D)`` of the shape that decides."""
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, D)``."""
        return self._join(self.first.value_and_gradient(points), self.second.value_and_gradient(points))

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients, as exact as both shapes know them."""
        return self._join(polished(self.first, points), polished(self.second, points))

    def within(self, points: ArrayLike, radius: ArrayLike) -> NDArray[np.bool_]:
        """Whether the surface comes nearer to points than a radius, or may do so where values are too small."""
        value, limit = self(points), np.asarray(radius, np.float64)
        return np.asarray(value > -limit if self._union else value < limit)

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where one shape decides alone, and is linear."""
        value, gradient, holds = super().affine_within(points, radius, tolerance)
        if self.first.lipschitz is None or self.second.lipschitz is None:
            return value, gradient, holds
        lead = (self.first(points) - self._sign * self.second(points)) * (1.0 if self._union else -1.0)
        margin = (self.first.lipschitz + self.second.lipschitz) * radius
        for shape, sign, which in (
            (self.first, 1.0, np.flatnonzero(lead > margin)),
            (self.second, self._sign, np.flatnonzero(-lead > margin)),
        ):
            own, slope, holds[which] = shape.affine_within(points[which], radius, tolerance)
            value[which], gradient[which] = sign * own, sign * slope
        return value, gradient, holds

    def _join(
        self, first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        (a, da), (b, db) = first, (self._sign * second[0], self._sign * second[1])
        take = a >= b if self._union else a <= b
        return np.where(take, a, b), np.where(take[:, None], da, db)


def _bounds(first: Implicit, second: Implicit, union: bool, second_sign: float) -> FloatArray:
    a, b = first.bounds, second.bounds
    if second_sign < 0:
        return a
    if union:
        return np.stack([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])
    low, high = np.maximum(a[0], b[0]), np.minimum(a[1], b[1])
    if not (high > low).all():
        raise EmptyResultError("nothing is left: the boxes of the two shapes do not meet")
    return np.stack([low, high])
