"""Faces of a B-rep of FreeCAD as distances: what their surfaces are, and on which side the material lies."""

from __future__ import annotations

from typing import Any

import numpy as np

from cad_implicit.faces import AnalyticFace, ConeFace, CylinderFace, FaceDistance, PlaneFace, SphereFace, TorusFace
from cad_implicit.implicit import FloatArray
from cad_implicit.spline_faces import SplineFace
from cad_implicit.splines import SplineSurface

from .edges import Edge, aside
from .freecad import Shape

#: Points on the two sides of an edge are this share of its length away from it.
_ASIDE = 1e-3

#: Names of surfaces, as :mod:`cad_implicit.cad.occ_faces` gives them, where they are not those of FreeCAD.
_NAMES = {"toroid": "torus"}


def all_faces(shape: Shape) -> list[Shape]:
    """Faces of a shape in the order of their numbers, each as the shape holds it first."""
    return list(shape.Faces)


class ShapeFaces:
    """Faces of a shape by number.

    Parameters
    ----------
    shape : Part.Shape
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

    As :func:`cad_implicit.cad.occ_faces.face_distance`.

    Parameters
    ----------
    face : Part.Face
        As a solid holds it: its orientation says where the material is.
    reach : float
        How far in mm free-form surfaces are continued.
    """
    surface, window = face.Surface, face.ParameterRange
    middle = [(window[0] + window[1]) / 2, (window[2] + window[3]) / 2]
    point = _xyz(surface.value(*middle))
    normal = np.cross(_xyz(surface.getDN(*middle, 1, 0)), _xyz(surface.getDN(*middle, 0, 1)))
    outward = -normal if face.Orientation == "Reversed" else normal
    analytic = _analytic(surface, point, middle)
    if analytic is not None:
        return analytic.facing(point, outward)
    spline, offset = _spline(face, surface, window)
    made = SplineFace(spline, reach, offset=offset)
    turned = float(made.value_and_gradient(point[None])[1][0] @ outward) > 0
    return SplineFace(spline, reach, side=-1.0, offset=offset) if turned else made


def _analytic(surface: Any, point: FloatArray, middle: list[float]) -> AnalyticFace | None:
    """Face in closed form, its side not told yet; None for free-form surfaces."""
    kind = type(surface).__name__
    if kind == "Plane":
        return PlaneFace(_xyz(surface.Position), _xyz(surface.Axis))
    if kind == "Cylinder":
        return CylinderFace(_xyz(surface.Center), _xyz(surface.Axis), surface.Radius)
    if kind == "Cone":
        apex, axis = _xyz(surface.Apex), _xyz(surface.Axis)
        nappe = 1.0 if float((point - apex) @ axis) > 0 else -1.0
        return ConeFace(apex, nappe * axis, abs(surface.SemiAngle))
    if kind == "Sphere":
        return SphereFace(_xyz(surface.Center), surface.Radius)
    if kind == "Toroid":
        ring, tube = surface.MajorRadius, surface.MinorRadius
        outer = ring + tube * np.cos(middle[1]) > 0
        return TorusFace(_xyz(surface.Center), _xyz(surface.Axis), ring, tube, "outer" if outer else "inner")
    return None


def _spline(face: Shape | None, surface: Any, window: tuple[float, ...]) -> tuple[SplineSurface, float]:
    """Surface as a B-spline, and how far it is offset from that."""
    kind = type(surface).__name__
    if kind == "RectangularTrimmedSurface":
        return _spline(None, surface.BasisSurface, window)
    if kind == "OffsetSurface":
        basis, offset = _spline(None, surface.BasisSurface, window)
        return basis, offset + surface.OffsetValue
    if kind == "BezierSurface":
        return _bezier(surface), 0.0
    if kind != "BSplineSurface":
        bounds = np.array(surface.bounds())
        limits = np.where(
            np.abs(bounds).reshape(2, 2).max(axis=1, keepdims=True) > 1e50, _pairs(window), _pairs(bounds)
        )
        surface = surface.toShape(*limits.ravel().tolist()).toNurbs().Faces[0].Surface
    surface = surface.copy()
    if surface.isUPeriodic():
        surface.setUNotPeriodic()
    if surface.isVPeriodic():
        surface.setVNotPeriodic()
    poles = np.array([[_xyz(pole) for pole in row] for row in surface.getPoles()])
    knots = np.array(surface.UKnotSequence), np.array(surface.VKnotSequence)
    return SplineSurface(poles, np.array(surface.getWeights()), knots, (surface.UDegree, surface.VDegree)), 0.0


def _pairs(limits: Any) -> FloatArray:
    return np.array(limits, np.float64).reshape(2, 2)


def _bezier(surface: Any) -> SplineSurface:
    poles = np.array([[_xyz(pole) for pole in row] for row in surface.getPoles()])
    degrees = (poles.shape[0] - 1, poles.shape[1] - 1)
    knots = tuple(np.repeat([0.0, 1.0], degree + 1) for degree in degrees)
    return SplineSurface(poles, np.array(surface.getWeights()), (knots[0], knots[1]), degrees)


def _xyz(thing: Any) -> FloatArray:
    return np.array([thing.x, thing.y, thing.z])


def surface_name(face: Shape) -> str:
    """Name of the type of a face's surface: "plane", "cylinder", "bspline" and so on."""
    name = type(face.Surface).__name__.lower().removeprefix("surfaceof").removesuffix("surface")
    return _NAMES.get(name, name)
