r"""Systems of R-functions: real functions whose sign is a logical function of the signs of their arguments.

With union as "or" and intersection as "and" of positive values; complement is the change of sign. V. Shapiro,
"Semi-analytic geometry with R-functions", Acta Numerica 16 (2007), doi:10.1017/S096249290631001X; A. Pasko, V. Adzhiev,
A. Sourin, V. Savchenko, "Function representation in geometric modeling", The Visual Computer 11 (1995),
doi:10.1007/BF02464333.

A system is normalized to order m if joining distances gives a function that, at regular points of its surface, changes
like the distance along the normal up to the m-th derivative.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from .implicit import FloatArray


class RSystem(ABC):
    """A pair of R-functions, for union and for intersection.

    Attributes
    ----------
    slope : float or None
        The most by which a result changes if both arguments change by one; None if it is not bounded.
    degree : int
        Multiplying both arguments by t multiplies results by t to this power.
    """

    slope: float | None
    degree: int = 1

    @abstractmethod
    def join(self, a: FloatArray, b: FloatArray, sign: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Union (sign 1) or intersection (sign -1) of values (N,), and its slopes with a and with b."""


@dataclass(frozen=True)
class RAlpha(RSystem):
    r"""The system :math:`R_\alpha`: :math:`(a + b \pm \sqrt{a^2 + b^2 - 2 \alpha a b}) / (1 + \alpha)`.

    Parameters
    ----------
    alpha : float
        Above -1, at most 1. 1 gives the larger and the smaller value; 0, the system R_0, is analytic but where both
        arguments are zero. Below 1 the result is normalized to the first order.

    Examples
    --------
    >>> RAlpha(0).join(np.array([3.0]), np.array([-4.0]), 1.0)[0]
    array([4.])
    >>> RAlpha(1).join(np.array([3.0]), np.array([-4.0]), 1.0)[0]
    array([3.])
    """

    alpha: float = 0.0

    def __post_init__(self) -> None:
        if not -1 < self.alpha <= 1:
            raise ValueError(f"alpha must be above -1 and at most 1, not {self.alpha:g}")

    @property
    def slope(self) -> float:  # type: ignore[override]
        """Largest sum of the two slopes; taken at a = b."""
        return (2 + math.sqrt(2 * (1 - self.alpha))) / (1 + self.alpha)

    def join(self, a: FloatArray, b: FloatArray, sign: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Union (sign 1) or intersection (sign -1) of values (N,), and its slopes with a and with b."""
        alpha, whole = self.alpha, 1 + self.alpha
        # (a - b)² + 2 (1 - alpha) a b, without cancellation where a and b have one sign
        root = np.sqrt(np.maximum((a - b) ** 2 + 2 * (1 - alpha) * a * b, 0.0))
        over = np.where(root > 0, root, 1.0)
        return (
            (a + b + sign * root) / whole,
            (1 + sign * (a - alpha * b) / over) / whole,
            (1 + sign * (b - alpha * a) / over) / whole,
        )


@dataclass(frozen=True)
class RPower(RSystem):
    r"""The system :math:`R_p`: :math:`a + b \pm (a^p + b^p)^{1/p}`, normalized to the order ``power - 1``.

    Parameters
    ----------
    power : int
        Even; 2 gives R_0.
    """

    power: int = 4

    def __post_init__(self) -> None:
        if self.power < 2 or self.power % 2:
            raise ValueError(f"power must be an even number from 2 on, not {self.power}")

    @property
    def slope(self) -> float:  # type: ignore[override]
        """Largest sum of the two slopes; taken at a = b."""
        return float(2 + 2 ** (1 / self.power))

    def join(self, a: FloatArray, b: FloatArray, sign: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Union (sign 1) or intersection (sign -1) of values (N,), and its slopes with a and with b."""
        p = self.power
        largest = np.maximum(np.abs(a), np.abs(b))
        over = np.where(largest > 0, largest, 1.0)
        norm = ((a / over) ** p + (b / over) ** p) ** (1 / p)
        share = over * np.where(norm > 0, norm, 1.0)
        return a + b + sign * largest * norm, 1 + sign * (a / share) ** (p - 1), 1 + sign * (b / share) ** (p - 1)


@dataclass(frozen=True)
class RSmooth(RSystem):
    r"""The system :math:`R_0^m`: :math:`(a + b \pm \sqrt{a^2 + b^2}) (a^2 + b^2)^{m/2}`, m times differentiable.

    Everywhere, also where both arguments are zero; but it is not normalized, and its unit is mm to the m + 1.

    Parameters
    ----------
    order : int
        m, from 1 on.
    """

    order: int = 1

    def __post_init__(self) -> None:
        if self.order < 1:
            raise ValueError(f"order must be a number from 1 on, not {self.order}")
        object.__setattr__(self, "slope", None)
        object.__setattr__(self, "degree", self.order + 1)

    def join(self, a: FloatArray, b: FloatArray, sign: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Union (sign 1) or intersection (sign -1) of values (N,), and its slopes with a and with b."""
        m = self.order
        root = np.hypot(a, b)
        over = np.where(root > 0, root, 1.0)
        plain, factor = a + b + sign * root, root**m
        outer = m * plain * root ** (m - 1)
        return (
            plain * factor,
            (1 + sign * a / over) * factor + outer * a / over,
            (1 + sign * b / over) * factor + outer * b / over,
        )


#: The system R_0 of the paper's examples, and the larger and smaller value.
R_0, R_1 = RAlpha(0.0), RAlpha(1.0)
