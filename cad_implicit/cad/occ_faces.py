"""Faces of a B-rep as distances: what their surfaces are, and on which side the material lies."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.Geom import Geom_OffsetSurface, Geom_RectangularTrimmedSurface
from OCP.GeomAbs import GeomAbs_Cone, GeomAbs_Cylinder, GeomAbs_Plane, GeomAbs_Sphere, GeomAbs_Torus
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Pnt, gp_Vec
from OCP.Precision import Precision
from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED

from cad_implicit.faces import (
    AnalyticFace,
    ConeFace,
    CylinderFace,
    FaceDistance,
    PlaneFace,
    SphereFace,
    TorusFace,
)
from cad_implicit.implicit import FloatArray
from cad_implicit.spline_faces import SplineFace
from cad_implicit.splines import SplineSurface

from .edges import Edge, aside
from .occ import Shape, as_face, distinct
from .occ_edges import type_name

#: Points on the two sides of an edge are this share of its length away from it.
_ASIDE = 1e-3


def all_faces(shape: Shape) -> list[Shape]:
    """Faces of a shape in the order of their numbers, each as the shape holds it first."""
    return list(distinct(shape, TopAbs_FACE))


class ShapeFaces:
    """Faces of a shape by number.

    Parameters
    ----------
    shape : TopoDS_Shape
    reach : float
        How far in mm free-form faces are continued.

    Attributes
    ----------
    count : int
        Number of faces.
    """

    def __init__(self, shape: Shape, reach: float) -> None:
        self._shapes = all_faces(shape)
        self._reach = reach
        self.count = len(self._shapes)

    def face(self, number: int) -> FaceDistance:
        """Signed distance to one face and its continuation."""
        return face_distance(self._shapes[number - 1], self._reach)

    def halves(self, number: int, edge: Edge) -> tuple[FaceDistance, FaceDistance]:
        """Signed distances to the halves of a face beside an edge at which it meets itself."""
        face = self.face(number)
        return face.halves(*aside(edge, _ASIDE * edge.length)) if isinstance(face, SplineFace) else (face, face)


def face_distance(face: Shape, reach: float) -> FaceDistance:
    """Signed distance to a face and its continuation, positive on the side of the material.

    Planes, cylinders, cones, spheres and tori go on as what they are. B-spline, Bézier, extruded, revolved and offset
    surfaces become B-splines, which is exact for all of them (an offset surface by its basis), and go on along their
    tangents.

    Parameters
    ----------
    face : TopoDS_Face
        As a solid holds it: its orientation says where the material is.
    reach : float
        How far in mm free-form surfaces are continued.
    """
    surface = BRepAdaptor_Surface(as_face(face), True)
    middle = [
        (surface.FirstUParameter() + surface.LastUParameter()) / 2,
        (surface.FirstVParameter() + surface.LastVParameter()) / 2,
    ]
    point, outward = _outward(face, surface, middle)
    analytic = _analytic(surface, point, middle)
    if analytic is not None:
        return analytic.facing(point, outward)
    spline, offset = _spline(BRep_Tool.Surface_s(as_face(face)), surface)
    made = SplineFace(spline, reach, offset=offset)
    turned = float(made.value_and_gradient(point[None])[1][0] @ outward) > 0
    return SplineFace(spline, reach, side=-1.0, offset=offset) if turned else made


def _outward(face: Shape, surface: Any, place: list[float]) -> tuple[FloatArray, FloatArray]:
    """Point of the surface and the outward normal there."""
    point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    surface.D1(*place, point, du, dv)
    normal = du.Crossed(dv)
    sign = -1.0 if face.Orientation() == TopAbs_REVERSED else 1.0
    if face.Location().Transformation().IsNegative():
        sign = -sign
    return _xyz(point), sign * _xyz(normal)


def _analytic(surface: Any, point: FloatArray, middle: list[float]) -> AnalyticFace | None:
    """Face in closed form, its side not told yet; None for free-form surfaces."""
    kind = surface.GetType()
    if kind == GeomAbs_Plane:
        plane = surface.Plane()
        return PlaneFace(_xyz(plane.Location()), _xyz(plane.Axis().Direction()))
    if kind == GeomAbs_Cylinder:
        cylinder = surface.Cylinder()
        return CylinderFace(_xyz(cylinder.Location()), _xyz(cylinder.Axis().Direction()), cylinder.Radius())
    if kind == GeomAbs_Cone:
        cone = surface.Cone()
        apex, axis = _xyz(cone.Apex()), _xyz(cone.Axis().Direction())
        nappe = 1.0 if float((point - apex) @ axis) > 0 else -1.0
        return ConeFace(apex, nappe * axis, abs(cone.SemiAngle()))
    if kind == GeomAbs_Sphere:
        sphere = surface.Sphere()
        return SphereFace(_xyz(sphere.Location()), sphere.Radius())
    if kind == GeomAbs_Torus:
        torus = surface.Torus()
        ring, tube = torus.MajorRadius(), torus.MinorRadius()
        outer = ring + tube * np.cos(middle[1]) > 0
        axis = _xyz(torus.Axis().Direction())
        return TorusFace(_xyz(torus.Location()), axis, ring, tube, "outer" if outer else "inner")
    return None


def _spline(surface: Any, adaptor: Any) -> tuple[SplineSurface, float]:
    """Surface as a B-spline, and how far it is offset from that."""
    if isinstance(surface, Geom_RectangularTrimmedSurface):
        surface = surface.BasisSurface()
    if isinstance(surface, Geom_OffsetSurface):
        basis, offset = _spline(surface.BasisSurface(), adaptor)
        return basis, offset + surface.Offset()
    low_u, high_u, low_v, high_v = surface.Bounds()
    ranges = [
        (low_u, high_u, adaptor.FirstUParameter(), adaptor.LastUParameter()),
        (low_v, high_v, adaptor.FirstVParameter(), adaptor.LastVParameter()),
    ]
    endless = [Precision.IsInfinite_s(low) or Precision.IsInfinite_s(high) for low, high, *_ in ranges]
    if any(endless):
        u, v = (own[2:] if without else own[:2] for own, without in zip(ranges, endless, strict=True))
        surface = Geom_RectangularTrimmedSurface(surface, *u, *v)
    made = GeomConvert.SurfaceToBSplineSurface_s(surface)
    if made.IsUPeriodic():
        made.SetUNotPeriodic()
    if made.IsVPeriodic():
        made.SetVNotPeriodic()
    rows, columns = range(1, made.NbUPoles() + 1), range(1, made.NbVPoles() + 1)
    poles = np.array([[_xyz(made.Pole(i, j)) for j in columns] for i in rows])
    weights = np.array([[made.Weight(i, j) for j in columns] for i in rows])
    u_knots = [made.UKnot(i) for i in range(1, made.NbUKnots() + 1) for _ in range(made.UMultiplicity(i))]
    v_knots = [made.VKnot(i) for i in range(1, made.NbVKnots() + 1) for _ in range(made.VMultiplicity(i))]
    knots = np.array(u_knots), np.array(v_knots)
    return SplineSurface(poles, weights, knots, (made.UDegree(), made.VDegree())), 0.0


def _xyz(thing: Any) -> FloatArray:
    return np.array([thing.X(), thing.Y(), thing.Z()])


def surface_name(face: Shape) -> str:
    """Name of the type of a face's surface: "plane", "cylinder", "bspline" and so on."""
    return type_name(BRepAdaptor_Surface(as_face(face), False).GetType())
