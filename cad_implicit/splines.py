"""B-spline surfaces: positions and derivatives at many parameters at once (The NURBS Book, Piegl and Tiller 1997)."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .implicit import FloatArray
from .kernels.nurbs import Spline

#: Ends of a closed direction meet within this share of the control points' diagonal, and their tangents within this
#: cosine (1 degree).
_MEETS = 1e-6
_TANGENT = 0.99985


@dataclass
class Derivatives:
    """Positions ``(N, 3)`` in mm and derivatives ``(N, 3)`` by the parameters."""

    s: FloatArray
    u: FloatArray
    v: FloatArray
    uu: FloatArray
    uv: FloatArray
    vv: FloatArray


class SplineSurface:
    """Rational B-spline surface over a rectangle of parameters, continued beyond it along its tangents.

    Parameters
    ----------
    poles : (A, B, 3) float64
        Control points in mm.
    weights : (A, B) float64
    knots : two of (K,) float64
        With repetitions: ``A + degree + 1`` and ``B + degree + 1`` of them, not periodic.
    degrees : two of int
    """

    def __init__(
        self,
        poles: FloatArray,
        weights: FloatArray,
        knots: tuple[FloatArray, FloatArray],
        degrees: tuple[int, int],
    ) -> None:
        self.poles = poles
        self.knots = knots
        self.degrees = degrees
        self._homogeneous = np.concatenate([poles * weights[..., None], weights[..., None]], axis=2)
        self.low = np.array([k[d] for k, d in zip(knots, degrees, strict=True)])
        self.high = np.array([k[-d - 1] for k, d in zip(knots, degrees, strict=True)])
        #: Whether the surface comes back smoothly to where it starts, in each direction.
        self.closed = (False, False)
        self.closed = (self._is_closed(0), self._is_closed(1))

    @property
    def spline(self) -> Spline:
        """The surface as kernels take it."""
        degrees, closed = np.array(self.degrees), np.array(self.closed)
        return Spline(self._homogeneous, *self.knots, degrees, self.low, self.high, closed)

    def spans(self, direction: int) -> FloatArray:
        """Distinct knots within the rectangle, and its borders."""
        low, high = self.low[direction], self.high[direction]
        k = self.knots[direction]
        return np.unique(np.concatenate([[low], k[(k > low) & (k < high)], [high]]))

    def restricted(self, direction: int, low: float, high: float) -> SplineSurface:
        """Give the surface over a smaller rectangle: between two parameters in one direction."""
        smaller = copy(self)
        smaller.low, smaller.high = self.low.copy(), self.high.copy()
        smaller.low[direction], smaller.high[direction] = low, high
        smaller.closed = (False, False)
        smaller.closed = (smaller._is_closed(0), smaller._is_closed(1))
        return smaller

    def extended(self, uv: FloatArray) -> Derivatives:
        """Positions and derivatives at any parameters ``(N, 2)``; third derivatives count as zero on continuations."""
        place = uv.copy()
        for direction in (0, 1):
            if self.closed[direction]:
                low, high = self.low[direction], self.high[direction]
                place[:, direction] = low + np.mod(uv[:, direction] - low, high - low)
        inside = np.clip(place, self.low, self.high)
        at = self._inside(inside)
        du, dv = (place - inside).T[..., None]
        if not (du.any() or dv.any()):
            return at
        return Derivatives(
            at.s + du * at.u + dv * at.v + du * dv * at.uv,
            at.u + dv * at.uv,
            at.v + du * at.uv,
            np.where(du == 0, at.uu, 0.0),
            at.uv,
            np.where(dv == 0, at.vv, 0.0),
        )

    def _inside(self, uv: FloatArray) -> Derivatives:
        """Positions and derivatives at parameters within the rectangle."""
        (i, bu), (j, bv) = (_basis(self.knots[d], self.degrees[d], uv[:, d]) for d in (0, 1))
        p, q = self.degrees
        rows = (i[:, None] + np.arange(-p, 1))[:, :, None]
        columns = (j[:, None] + np.arange(-q, 1))[:, None, :]
        poles = self._homogeneous[rows, columns]
        across = [np.einsum("nabk,nb->nak", poles, bv[order]) for order in range(3)]

        def mixed(du: int, dv: int) -> tuple[FloatArray, FloatArray]:
            both = np.einsum("nak,na->nk", across[dv], bu[du])
            return both[:, :3], both[:, 3:]

        (a, w), (au, wu), (av, wv) = mixed(0, 0), mixed(1, 0), mixed(0, 1)
        (auu, wuu), (auv, wuv), (avv, wvv) = mixed(2, 0), mixed(1, 1), mixed(0, 2)
        s = a / w
        su, sv = (au - wu * s) / w, (av - wv * s) / w
        return Derivatives(
            s,
            su,
            sv,
            (auu - 2 * wu * su - wuu * s) / w,
            (auv - wu * sv - wv * su - wuv * s) / w,
            (avv - 2 * wv * sv - wvv * s) / w,
        )

    def _is_closed(self, direction: int) -> bool:
        others = self.spans(1 - direction)
        others = np.unique(np.concatenate([others, (others[1:] + others[:-1]) / 2]))
        ends = []
        for end in (self.low[direction], self.high[direction]):
            uv = np.zeros((len(others), 2))
            uv[:, direction], uv[:, 1 - direction] = end, others
            ends.append(self._inside(uv))
        gap = np.linalg.norm(ends[0].s - ends[1].s, axis=1).max()
        if gap > _MEETS * np.linalg.norm(np.ptp(self.poles.reshape(-1, 3), axis=0)):
            return False
        first, second = ((end.u if direction == 0 else end.v) for end in ends)
        lengths = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
        return bool(((first * second).sum(axis=1) >= _TANGENT * lengths).all())


def _basis(knots: FloatArray, degree: int, t: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Last control point ``(N,)`` that matters, and the basis functions and two derivatives ``(3, N, degree + 1)``."""
    last = len(knots) - degree - 2
    span = np.clip(np.searchsorted(knots, t, side="right") - 1, degree, last)
    while (empty := (knots[span] == knots[span + 1]) & (span > degree)).any():  # the upper end of the rectangle
        span = np.where(empty, span - 1, span)
    levels = [np.ones((len(t), 1))]
    for level in range(1, degree + 1):
        raised = np.zeros((len(t), level + 1))
        for r in range(level):
            low, high = knots[span + 1 + r - level], knots[span + 1 + r]
            share = levels[-1][:, r] / (high - low)
            raised[:, r] += (high - t) * share
            raised[:, r + 1] += (t - low) * share
        levels.append(raised)

    def derived(values: FloatArray, level: int) -> FloatArray:
        raised = np.zeros((len(t), level + 1))
        for r in range(level):
            share = level * values[:, r] / (knots[span + 1 + r] - knots[span + 1 + r - level])
            raised[:, r] -= share
            raised[:, r + 1] += share
        return raised

    first = derived(levels[-2], degree)
    second = derived(derived(levels[-3], degree - 1), degree) if degree > 1 else np.zeros_like(first)
    return span, np.stack([levels[-1], first, second])
