"""Shapes joined by R-functions: values and gradients by the chain rule.

Not promised: distances. Results are normalized as :mod:`cad_implicit.rsystems` says, if the shapes are.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from .booleans import Boolean
from .implicit import FloatArray, Implicit
from .rsystems import R_0, RSystem

#: Largest slope of 1 / (1 + u² + v²), at u² + v² = 1/3.
_DISPLACEMENT_SLOPE = 3 * math.sqrt(3) / 8


class RJoin(Implicit):
    """Two shapes joined by a system of R-functions; :func:`r_union` and the like make it."""

    def __init__(
        self,
        first: Implicit,
        second: Implicit,
        system: RSystem,
        *,
        union: bool,
        second_sign: float = 1.0,
        bounds: ArrayLike | None = None,
    ) -> None:
        self.first, self.second, self.system = first, second, system
        self._sign, self._second_sign = 1.0 if union else -1.0, second_sign
        plain = Boolean(first, second, union=union, second_sign=second_sign)
        self.bounds = plain.bounds if bounds is None else np.array(bounds, np.float64)
        if self.bounds.shape != plain.bounds.shape or not (self.bounds[1] > self.bounds[0]).all():
            raise ValueError(f"bounds must be a lower and a higher corner (2, {first.dim}), not {bounds!r}")
        self.spacing = plain.spacing
        if plain.lipschitz is not None and system.slope is not None:
            self.lipschitz = system.slope * plain.lipschitz

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self._joined(self.first(points), self._second_sign * self.second(points))[0]

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, D)``."""
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, D)``."""
        a, slope_a = self.first.value_and_gradient(points)
        b, slope_b = self.second.value_and_gradient(points)
        value, with_a, with_b = self._joined(a, self._second_sign * b)
        return value, with_a[:, None] * slope_a + (self._second_sign * with_b)[:, None] * slope_b

    def _joined(self, a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Values and their slopes with a and b."""
        return self.system.join(a, b, self._sign)


class Blend(RJoin):
    """Two shapes joined with a displacement where both are small; :func:`blend_union` and the like make it."""

    def __init__(
        self,
        first: Implicit,
        second: Implicit,
        system: RSystem,
        amount: float,
        widths: tuple[float, float],
        *,
        union: bool,
        second_sign: float = 1.0,
        bounds: ArrayLike | None = None,
    ) -> None:
        super().__init__(first, second, system, union=union, second_sign=second_sign, bounds=bounds)
        self._amount, self._widths = float(amount), (float(widths[0]), float(widths[1]))
        if not (math.isfinite(self._amount) and all(math.isfinite(w) and w > 0 for w in self._widths)):
            raise ValueError(f"a blend needs a finite amount and two positive widths, not {amount!r} and {widths!r}")
        if self.lipschitz is not None and first.lipschitz is not None and second.lipschitz is not None:
            slopes = first.lipschitz / self._widths[0], second.lipschitz / self._widths[1]
            self.lipschitz += abs(self._amount) * _DISPLACEMENT_SLOPE * math.hypot(*slopes)
        if bounds is None:
            growth = self._growth(union)
            self.bounds = self.bounds + [[-growth], [growth]]

    def _joined(self, a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        value, with_a, with_b = super()._joined(a, b)
        u, v = a / self._widths[0], b / self._widths[1]
        below = 1 + u * u + v * v
        push = -2 * self._amount / below**2
        return value + self._amount / below, with_a + push * u / self._widths[0], with_b + push * v / self._widths[1]

    def _growth(self, union: bool) -> float:
        """How far in mm outside the box of two distances the displacement can outweigh them.

        At a depth t outside, both (union) or one of them (intersection) are at most -t.
        """
        if self._amount <= 0:
            return 0.0
        if union:
            one = np.array([-1.0])
            fall, width = -float(self.system.join(one, one, 1.0)[0][0]), 1 / math.hypot(*(1 / w for w in self._widths))
        else:
            fall, width = 1.0, max(self._widths)
        degree = self.system.degree
        low, high = 0.0, math.pow(self._amount / fall, 1 / degree)
        for _ in range(60):
            t = (low + high) / 2
            if fall * t**degree < self._amount / (1 + (t / width) ** 2):
                low = t
            else:
                high = t
        return high


def r_union(first: Implicit, second: Implicit, system: RSystem = R_0, *, bounds: ArrayLike | None = None) -> Implicit:
    """Union of two shapes by R-functions.

    Unlike that of ``|``, the function is smooth but on the curves where the surfaces meet, and for that no distance.

    Parameters
    ----------
    first, second : Implicit
        Both in the plane or both in space.
    system : RSystem
        ``RAlpha(alpha)``, ``RPower(p)`` or ``RSmooth(m)`` of :mod:`cad_implicit.rsystems`; R_0 by default.
    bounds : (2, D) array_like, optional
        Box in mm that holds the surface; by default from the boxes of the two.

    Notes
    -----
    The operation that the paper makes its parts and shells with; V. Shapiro, "Semi-analytic geometry with
    R-functions", Acta Numerica 16 (2007), doi:10.1017/S096249290631001X.

    Examples
    --------
    >>> from cad_implicit import sphere
    >>> r_union(sphere(1), sphere(1).moved((1, 0, 0)))([[0.5, 0, 0], [3, 0, 0]]).round(3)
    array([ 1.707, -0.764])
    """
    return RJoin(first, second, system, union=True, bounds=bounds)


def r_intersection(
    first: Implicit, second: Implicit, system: RSystem = R_0, *, bounds: ArrayLike | None = None
) -> Implicit:
    """Intersection of two shapes by R-functions; see :func:`r_union`."""
    return RJoin(first, second, system, union=False, bounds=bounds)


def r_subtraction(
    first: Implicit, second: Implicit, system: RSystem = R_0, *, bounds: ArrayLike | None = None
) -> Implicit:
    """First shape without the second by R-functions; see :func:`r_union`."""
    return RJoin(first, second, system, union=False, second_sign=-1.0, bounds=bounds)


def blend_union(
    first: Implicit,
    second: Implicit,
    amount: float,
    widths: tuple[float, float],
    system: RSystem = R_0,
    *,
    bounds: ArrayLike | None = None,
) -> Implicit:
    r"""Union of two shapes with material added where they meet: a fillet of no constant radius, without a ball.

    Parameters
    ----------
    first, second : Implicit
    amount : float
        a0 of the displacement :math:`a_0 / (1 + (f_1/a_1)^2 + (f_2/a_2)^2)`, in mm if the shapes are distances;
        negative cuts a groove.
    widths : (float, float)
        a1 and a2: at which values of the two shapes the displacement has fallen to a half. Positive.
    system : RSystem
        R_0 by default.
    bounds : (2, D) array_like, optional
        Box in mm that holds the surface. By default the box of the two, grown by as much as the displacement can grow
        distances; shapes that fall more slowly than a distance may stick out.

    Notes
    -----
    A. Pasko, V. Savchenko, "Blending operations for the functionally based constructive geometry", CSG 94.
    """
    return Blend(first, second, system, amount, widths, union=True, bounds=bounds)


def blend_intersection(
    first: Implicit,
    second: Implicit,
    amount: float,
    widths: tuple[float, float],
    system: RSystem = R_0,
    *,
    bounds: ArrayLike | None = None,
) -> Implicit:
    """Intersection with material added (or taken, for a negative amount) where shapes meet; see :func:`blend_union`."""
    return Blend(first, second, system, amount, widths, union=False, bounds=bounds)


def blend_subtraction(
    first: Implicit,
    second: Implicit,
    amount: float,
    widths: tuple[float, float],
    system: RSystem = R_0,
    *,
    bounds: ArrayLike | None = None,
) -> Implicit:
    """First shape without the second, with material added where they meet; see :func:`blend_union`."""
    return Blend(first, second, system, amount, widths, union=False, second_sign=-1.0, bounds=bounds)
