"""Curves and surfaces of the kernel, made of arrays, and look-ups of places on surfaces."""

from __future__ import annotations

from collections.abc import Iterable
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
from OCP.gp import gp_Ax2, gp_Ax3, gp_Dir, gp_Pnt, gp_Pnt2d, gp_Vec
from OCP.ShapeAnalysis import ShapeAnalysis_Surface

from cad_implicit.implicit import FloatArray

from .geometry import Circle, Framed, Line, Spline, SplinePatch, Surface

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

#: Places on surfaces are looked up to so many mm: the kernel's own resolution.
_RESOLUTION = 1e-7


class SurfaceLook:
    """A surface of the kernel; see :class:`cad_implicit.cad.geometry.Look`."""

    def __init__(self, surface: Any) -> None:
        self._look = ShapeAnalysis_Surface(surface)
        self._surface = surface
        self.plane = type(surface).__name__ == "Geom_Plane"
        low_u, high_u, low_v, high_v = surface.Bounds()
        self.bounds = np.array([[low_u, high_u], [low_v, high_v]])
        self.closed = (bool(surface.IsUClosed()), bool(surface.IsVClosed()))

    def places(self, points: FloatArray) -> FloatArray:
        found = np.zeros((len(points), 2))
        look, place = self._look, None
        for number, point in enumerate(points.tolist()):
            where = gp_Pnt(*point)
            place = (
                look.ValueOfUV(where, _RESOLUTION) if place is None else look.NextValueOfUV(place, where, _RESOLUTION)
            )
            found[number] = place.X(), place.Y()
        return found

    def at(self, places: FloatArray) -> FloatArray:
        return np.array([self._look.Value(u, v).Coord() for u, v in places.tolist()])

    def normal(self, place: FloatArray) -> FloatArray:
        point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
        self._surface.D1(*place.tolist(), point, du, dv)
        return np.array(du.Crossed(dv).Coord())


def curve_of(curve: Line | Circle | Spline) -> Any:
    """Curve of the kernel."""
    if isinstance(curve, Line):
        return Geom_Line(_point(curve.point), gp_Dir(*curve.direction.tolist()))
    if isinstance(curve, Circle):
        axes = gp_Ax2(_point(curve.centre), gp_Dir(*curve.normal.tolist()), gp_Dir(*curve.start.tolist()))
        return Geom_Circle(axes, curve.radius)
    poles = _filled(_Points(1, len(curve.poles)), map(_point, curve.poles))
    return Geom_BSplineCurve(poles, _reals(curve.knots), _integers(curve.counts), curve.degree)


def flat_curve_of(curve: Spline) -> Any:
    """Curve of the kernel in the plane of parameters."""
    poles = _filled(_Points2d(1, len(curve.poles)), (gp_Pnt2d(*pole) for pole in curve.poles.tolist()))
    return Geom2d_BSplineCurve(poles, _reals(curve.knots), _integers(curve.counts), curve.degree)


def surface_of(surface: Surface) -> Any:
    """Surface of the kernel."""
    return _framed(surface) if isinstance(surface, Framed) else _patch(surface)


def _framed(surface: Framed) -> Any:
    primitive = surface.primitive
    frame = gp_Ax3(_point(primitive.point), gp_Dir(*surface.axis.tolist()), gp_Dir(*surface.start.tolist()))
    if primitive.kind == "plane":
        return Geom_Plane(frame)
    if primitive.kind == "cylinder":
        return Geom_CylindricalSurface(frame, primitive.radius)
    if primitive.kind == "cone":
        return Geom_ConicalSurface(frame, primitive.radius, 0.0)
    if primitive.kind == "sphere":
        return Geom_SphericalSurface(frame, primitive.radius)
    return Geom_ToroidalSurface(frame, primitive.ring, primitive.radius)


def _patch(patch: SplinePatch) -> Any:
    rows, columns = patch.poles.shape[:2]
    grid = _Grid(1, rows, 1, columns)
    for i, row in enumerate(patch.poles, 1):
        for j, pole in enumerate(row, 1):
            grid.SetValue(i, j, _point(pole))
    knots, counts = map(_reals, patch.knots), map(_integers, patch.counts)
    return Geom_BSplineSurface(grid, *knots, *counts, *patch.degrees)


def _point(point: FloatArray) -> gp_Pnt:
    return gp_Pnt(*point.tolist())


def _filled(array: Any, values: Iterable[Any]) -> Any:
    for number, value in enumerate(values, 1):
        array.SetValue(number, value)
    return array


def _reals(values: FloatArray) -> Any:
    return _filled(_Reals(1, len(values)), values.tolist())


def _integers(values: Any) -> Any:
    return _filled(_Integers(1, len(values)), values.tolist())
