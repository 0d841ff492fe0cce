"""Curves and surfaces for the kernel: lines, circles and splines through points, primitives, spline strips."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from OCP.Geom import (
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_Circle,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_Line,
    Geom_Plane,
    Geom_SphericalSurface,
    Geom_ToroidalSurface,
)
from OCP.Geom2d import Geom2d_BSplineCurve
from OCP.gp import gp_Ax2, gp_Ax3, gp_Dir, gp_Pnt, gp_Pnt2d
from scipy.interpolate import make_interp_spline

from cad_implicit.blend_surfaces import across
from cad_implicit.implicit import FloatArray
from cad_implicit.primitives import Primitive

try:  # OCP 7.9
    from OCP.TColgp import TColgp_Array1OfPnt as _Points
    from OCP.TColgp import TColgp_Array1OfPnt2d as _Points2d
    from OCP.TColgp import TColgp_Array2OfPnt as _Grid
    from OCP.TColStd import TColStd_Array1OfInteger as _Integers
    from OCP.TColStd import TColStd_Array1OfReal as _Reals
except ImportError:  # OCP 8.0
    from OCP.collections import Array1_double as _Reals
    from OCP.collections import Array1_gp_Pnt as _Points
    from OCP.collections import Array1_gp_Pnt2d as _Points2d
    from OCP.collections import Array1_int as _Integers
    from OCP.collections import Array2_gp_Pnt as _Grid

#: Points within so many mm of a line or circle make one: the kernel's own resolution is 1e-7.
_STRAIGHT = 2e-7

#: Splines go through points of a curve until they are within so many mm of it between them.
_SPLINE = 1e-6
_FIRST, _MOST = 9, 600

#: Axes of a sphere that are tried.
_AXES = 12

#: Pieces of a surface go on smoothly if that moves it by less than so many mm.
_SMOOTH = 1e-7

#: Curves of so many mm are lines whatever their points.
_SHORT = 1e-4


class Made:
    """A curve of the kernel between two parameters."""

    def __init__(self, geometry: Any, low: float, high: float) -> None:
        self.geometry, self.low, self.high = geometry, low, high

    def at(self, parameters: FloatArray) -> FloatArray:
        """Points (N, 3)."""
        return np.array([self.geometry.Value(float(t)).Coord() for t in parameters])


def curve_through(place: Callable[[FloatArray], FloatArray], knots: FloatArray) -> Made:
    """Line, circle or spline along a curve.

    Parameters
    ----------
    place : callable
        Points (N, 3) at parameters (N,).
    knots : (N,) float64
        Ascending parameters, at which the curve may bend differently.
    """
    fractions = np.unique(np.concatenate([knots, np.linspace(knots[0], knots[-1], _FIRST)]))
    points = place(fractions)
    fine = place((fractions[1:] + fractions[:-1]) / 2)
    everything = np.concatenate([points, fine])
    chord = points[-1] - points[0]
    length = float(np.linalg.norm(chord))
    if length > 0:
        off = everything - points[0] - np.outer((everything - points[0]) @ chord / length**2, chord)
        if length < _SHORT or float(np.linalg.norm(off, axis=1).max()) < _STRAIGHT:
            line = Geom_Line(gp_Pnt(*points[0].tolist()), gp_Dir(*(chord / length).tolist()))
            return Made(line, 0.0, length)
    circle = _circle(points, everything)
    return circle if circle is not None else _spline(place, fractions)


def _circle(points: FloatArray, everything: FloatArray) -> Made | None:
    first, middle, last = points[0], points[len(points) // 2], points[-1]
    if float(np.linalg.norm(first - last)) < _SHORT:
        last = points[len(points) // 4]
        first, middle, last = first, last, middle
    a, b = middle - first, last - first
    normal = np.cross(a, b)
    square = float(normal @ normal)
    if square <= 1e-12 * float(a @ a) * float(b @ b):
        return None
    to_centre = (np.cross(normal, a) * (b @ b) + np.cross(b, normal) * (a @ a)) / (2 * square)
    centre, radius = first + to_centre, float(np.linalg.norm(to_centre))
    normal /= np.sqrt(square)
    away = everything - centre
    if max(np.abs(away @ normal).max(), np.abs(np.linalg.norm(away, axis=1) - radius).max()) > _STRAIGHT * (1 + radius):
        return None
    x = (points[0] - centre) / radius
    y = np.cross(normal, x)
    turns = np.unwrap(np.arctan2((points - centre) @ y, (points - centre) @ x))
    if turns[-1] < 0:
        normal, turns = -normal, -turns
    high = float(turns[-1])
    if abs(high) < 1e-9:
        high = 2 * np.pi
    axes = gp_Ax2(gp_Pnt(*centre.tolist()), gp_Dir(*normal.tolist()), gp_Dir(*x.tolist()))
    return Made(Geom_Circle(axes, radius), 0.0, min(high, 2 * np.pi))


def _spline(place: Callable[[FloatArray], FloatArray], fractions: FloatArray) -> Made:
    while True:
        points = place(fractions)
        spline = make_interp_spline(fractions, points, k=3)
        middle = (fractions[1:] + fractions[:-1]) / 2
        off = np.linalg.norm(spline(middle) - place(middle), axis=1)
        rough = off > _SPLINE
        if not rough.any() or len(fractions) > _MOST:
            break
        fractions = np.sort(np.concatenate([fractions, middle[rough]]))
    return Made(_bspline(spline.t, spline.c), float(fractions[0]), float(fractions[-1]))


def _bspline(knots: FloatArray, poles: FloatArray) -> Any:
    unique, counts = np.unique(knots, return_counts=True)
    return Geom_BSplineCurve(_points(poles), _reals(unique), _integers(counts), 3)


def flat_curve(parameters: FloatArray, places: FloatArray) -> Any:
    """Spline through places (N, 2) of a surface at parameters (N,)."""
    straight = places[0] + np.outer((parameters - parameters[0]) / np.ptp(parameters), places[-1] - places[0])
    if float(np.abs(straight - places).max()) < 1e-12 * (1 + float(np.abs(places).max())) or len(places) < 4:
        poles, knots, counts, degree = places[[0, -1]], parameters[[0, -1]], np.array([2, 2]), 1
    else:
        spline = make_interp_spline(parameters, places, k=3)
        knots, counts = np.unique(spline.t, return_counts=True)
        poles, degree = spline.c, 3
    array = _Points2d(1, len(poles))
    for number, (u, v) in enumerate(poles.tolist(), 1):
        array.SetValue(number, gp_Pnt2d(u, v))
    return Geom2d_BSplineCurve(array, _reals(knots), _integers(counts), degree)


def away_from(made: Made, surface: Any, parameters: FloatArray, found: FloatArray) -> float:
    """Largest distance between a curve and places (N, 2) of a surface."""
    feet = np.array([surface.Value(float(u), float(v)).Coord() for u, v in found])
    return float(np.linalg.norm(feet - made.at(parameters), axis=1).max())


def unwrap(found: FloatArray, geometry: Any, centre: FloatArray) -> None:
    """Make places (N, 2) along an edge continuous where the surface is closed, in place."""
    low_u, high_u, low_v, high_v = geometry.Bounds()
    middle = len(found) // 2
    closed = (geometry.IsUClosed(), geometry.IsVClosed())
    for axis, period in ((0, high_u - low_u), (1, high_v - low_v)):
        if not closed[axis]:
            continue
        column = found[:, axis]
        steps = np.diff(column)
        steps -= np.round(steps / period) * period
        column[middle + 1 :] = column[middle] + np.cumsum(steps[middle:])
        column[:middle] = column[middle] - np.cumsum(steps[:middle][::-1])[::-1]
        column -= np.round((column[middle] - centre[axis]) / period) * period


def primitive_surface(primitive: Primitive, towards: FloatArray, border: FloatArray) -> Any:
    """Surface of a primitive whose seam lies opposite of a point (3,), and the poles far from a border (N, 3)."""
    axis = primitive.axis / np.linalg.norm(primitive.axis)
    away = towards - primitive.point
    if primitive.kind == "sphere":
        axis = _free_axis(away, border - primitive.point)
    across_axis = away - (away @ axis) * axis
    if float(np.linalg.norm(across_axis)) < 1e-9:
        across_axis = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x = -across_axis / np.linalg.norm(across_axis)
    frame = gp_Ax3(gp_Pnt(*primitive.point.tolist()), gp_Dir(*axis.tolist()), gp_Dir(*x.tolist()))
    if primitive.kind == "plane":
        return Geom_Plane(frame)
    if primitive.kind == "cylinder":
        return Geom_CylindricalSurface(frame, primitive.radius)
    if primitive.kind == "cone":
        return Geom_ConicalSurface(frame, primitive.radius, 0.0)
    if primitive.kind == "sphere":
        return Geom_SphericalSurface(frame, primitive.radius)
    return Geom_ToroidalSurface(frame, primitive.ring, primitive.radius)


def _free_axis(towards: FloatArray, border: FloatArray) -> FloatArray:
    """Axis (3,) at a right angle to a direction, whose poles are as far from a border (N, 3) on a sphere as can be."""
    direction = towards / np.linalg.norm(towards)
    x = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    x /= np.linalg.norm(x)
    turns = np.linspace(0.0, np.pi, _AXES, endpoint=False)
    axes = np.outer(np.cos(turns), x) + np.outer(np.sin(turns), np.cross(direction, x))
    sizes = np.linalg.norm(border, axis=1)
    return np.asarray(axes[np.abs(border @ axes.T / sizes[:, None]).max(axis=0).argmin()])


def strip_surface(ways: FloatArray, points: FloatArray, between: FloatArray) -> Any:
    """Spline surface of a grid: cubic pieces along (M) with inner control points (M - 1, 2), one polynomial across (K).

    Where the pieces before and after a way go on smoothly they share a knot of multiplicity 2, else one of 3.
    """
    count = points.shape[1]
    shares = across()
    basis = _bernstein(count - 1, (shares - shares[0]) / (shares[-1] - shares[0]))

    def poles(grid: FloatArray) -> FloatArray:
        flat = np.moveaxis(grid, -2, 0)
        solved = np.asarray(np.linalg.solve(basis, flat.reshape(count, -1)), np.float64)
        return np.moveaxis(solved.reshape(flat.shape), 0, -2)

    knots, inner = poles(points), poles(between)
    spans = np.diff(ways)
    share = (spans[:-1] / (spans[:-1] + spans[1:]))[:, None, None]
    middle = (1 - share) * inner[:-1, 1] + share * inner[1:, 0]
    smooth = np.abs(middle - knots[1:-1]).max(axis=(1, 2)) < _SMOOTH
    rows = [knots[0], inner[0, 0]]
    for number, good in enumerate(smooth.tolist()):
        rows += [inner[number, 1], *([] if good else [knots[number + 1]]), inner[number + 1, 0]]
    table = np.stack([*rows, inner[-1, 1], knots[-1]])
    grid = _Grid(1, len(table), 1, count)
    for i, row in enumerate(table.tolist(), 1):
        for j, point in enumerate(row, 1):
            grid.SetValue(i, j, gp_Pnt(*point))
    along = np.concatenate([[4], np.where(smooth, 2, 3), [4]])
    ends = np.array([count, count])
    return Geom_BSplineSurface(
        grid, _reals(ways), _reals(np.array([0.0, 1.0])), _integers(along), _integers(ends), 3, count - 1
    )


def _bernstein(degree: int, at: FloatArray) -> FloatArray:
    from scipy.special import comb

    k = np.arange(degree + 1)
    return np.asarray(comb(degree, k) * at[:, None] ** k * (1 - at[:, None]) ** (degree - k))


def _points(points: FloatArray) -> Any:
    array = _Points(1, len(points))
    for number, point in enumerate(points.tolist(), 1):
        array.SetValue(number, gp_Pnt(*point))
    return array


def _reals(values: FloatArray) -> Any:
    array = _Reals(1, len(values))
    for number, value in enumerate(values.tolist(), 1):
        array.SetValue(number, value)
    return array


def _integers(values: Any) -> Any:
    array = _Integers(1, len(values))
    for number, value in enumerate(values.tolist(), 1):
        array.SetValue(number, value)
    return array
