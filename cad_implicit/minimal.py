"""Triply periodic minimal surfaces, as walls of a true thickness.

Not the minimal surfaces themselves but their usual trigonometric approximations (H. von Schnering, R. Nesper, "Nodal
surfaces of Fourier series", Zeitschrift fuer Physik B 83 (1991), doi:10.1007/BF01313411); the wall's thickness is
exact all the same.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from . import parallel
from .errors import RadiusError
from .grading import Length, Size, as_length, constant
from .implicit import FloatArray, Implicit
from .kernels.minimal import DIAMOND, GYROID, IWP, SCHWARZ_P, feet, levels
from .walls import LONGEST, ON_SURFACE, ROUNDS, STILL, Feet, Level, Wall

Minimal = Literal["gyroid", "schwarz_p", "diamond", "iwp"]


class _Kind(NamedTuple):
    """Number of a surface in the kernels, and its smallest radius of curvature in cells."""

    number: int
    reach: float


#: Radii of curvature measured at 20,000 points, rounded down. Closer than that every point has one foot nearby;
#: beyond, other feet may be taken, up to 0.3 cells too far.
_KINDS: dict[Minimal, _Kind] = {
    "gyroid": _Kind(GYROID, 0.18),
    "schwarz_p": _Kind(SCHWARZ_P, 0.155),
    "diamond": _Kind(DIAMOND, 0.15),
    "iwp": _Kind(IWP, 0.10),
}

#: Thickest wall in units of the reach. Up to half of it from the middle distances are right to 3e-8 cells, at 0.9 of
#: the reach to 0.016; the surfaces of walls twice the reach thick fold.
_THICKEST = 1.6


def tpms(kind: Minimal, cell: Size | Length, wall: Size | Length) -> Implicit:
    """Wall around a triply periodic minimal surface, everywhere in space.

    Parameters
    ----------
    kind : "gyroid", "schwarz_p", "diamond" or "iwp"
    cell : float or callable
        Period in mm; a callable of points, such as :func:`cad_implicit.graded`, stretches the cells about the origin.
    wall : float or callable
        Thickness in mm; a callable of points grades it.

    Returns
    -------
    Implicit
        Without end: intersect it with a part. Values are distances in mm up to about an eighth of the cell outside.

    Raises
    ------
    RadiusError
        If a size is not positive and finite, or the wall so thick for the cell that its surface would fold.
    ValueError
        If the kind is none of those.

    Examples
    --------
    >>> from cad_implicit import sphere
    >>> ball = tpms("gyroid", 4.0, 0.6) & sphere(10)
    >>> round(float(ball([[0, 0, 0]])[0]), 9)  # the middle of the wall
    0.3
    """
    if kind not in _KINDS:
        raise ValueError(f"kind must be one of {', '.join(_KINDS)}, not {kind!r}")
    number, reach = _KINDS[kind]
    period, thickness = as_length("the cell", cell), as_length("the wall", wall)
    size, width = constant(period), constant(thickness)
    limit = _THICKEST * reach
    if size is not None and width is not None and width > limit * size:
        raise RadiusError(
            f"a wall of {width:g} mm is too thick for {kind} cells of {size:g} mm; use up to {limit * size:.3g} mm, "
            f"or cells from {width / limit:.3g} mm on"
        )
    nearest = Feet(Phased(_level(number), period), period, reach) if size is None else _Periodic(number, reach, size)
    return Wall(nearest, thickness)


class Phased:
    """A function with period 2 pi of points scaled by a cell that may change from place to place."""

    def __init__(self, level: Level, cell: Length) -> None:
        self._level, self._cell = level, cell

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (N,) and gradients (N, 3) per mm."""
        cell, slope = self._cell.value_and_gradient(points)
        frequency = (2 * math.pi / cell)[:, None]
        value, gradient = self._level(frequency * points)
        stretch = (gradient * points).sum(axis=1) / cell
        return value, frequency * (gradient - stretch[:, None] * slope)


def _level(number: int) -> Level:
    """Give a function with period 2 pi whose zero level is the surface."""

    def level(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        values, gradients = np.zeros(len(points)), np.zeros_like(points)
        with parallel.threads():
            levels(points, number, values, gradients)
        return values, gradients

    return level


class _Periodic:
    """Distances from a surface with a constant period, by the kernel."""

    def __init__(self, number: int, reach: float, cell: float) -> None:
        self._number, self._reach, self._frequency = number, 2 * math.pi * reach, 2 * math.pi / cell

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        distance, away = np.zeros(len(points)), np.zeros_like(points)
        turn = 2 * math.pi
        with parallel.threads():
            feet(
                self._frequency * points, self._number, self._reach, ROUNDS, turn * LONGEST, turn * ON_SURFACE,
                turn * STILL, distance, away,
            )  # fmt: skip
        return distance / self._frequency, away
