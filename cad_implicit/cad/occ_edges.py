"""Edges of a B-rep: sampled along their curves, with the normals of the faces beside them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp
from OCP.GCPnts import GCPnts_TangentialDeflection
from OCP.GeomAbs import GeomAbs_Line, GeomAbs_Plane
from OCP.gp import gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_VERTEX
from OCP.TopExp import TopExp

from cad_implicit.mesh import FloatArray

from .edges import Edge, convexity, unit
from .occ import Shape, as_edge, as_face, bounds, explore, shape_map

#: Largest distance between an edge and its polyline, over the diagonal, and largest angle in radians between its
#: pieces: those of the triangles.
_DEFLECTION = 1 / 2000
_ANGLE = 0.2
#: Fewest points along an edge: enough to see its convexity change.
_POINTS = 5
#: Where a surface has no normal (a pole, an apex) it is taken this share of the edge farther in.
_STEP = 1e-4


class _Use(NamedTuple):
    """An edge in the boundary of a face."""

    number: int
    face: Shape
    edge: Shape
    left: bool


def shape_edges(shape: Shape, tolerance: float | None = None) -> list[Edge]:
    """Edges of a shape, numbered as :func:`cad_implicit.cad.occ.shape_map` does, chains not told.

    Parameters
    ----------
    shape : TopoDS_Shape
    tolerance : float, optional
        Largest distance in mm between an edge and its polyline; the diagonal / 2000 by default.
    """
    if tolerance is None:
        low, high = bounds(shape)
        tolerance = float(np.linalg.norm(high - low)) * _DEFLECTION
    found, vertices = shape_map(shape, TopAbs_EDGE), shape_map(shape, TopAbs_VERTEX)
    uses: dict[int, list[_Use]] = {}
    for use in _uses(shape):
        uses.setdefault(found.FindIndex(use.edge), []).append(use)
    edges = []
    for number in range(1, found.Extent() + 1):
        edge = as_edge(found.FindKey(number))
        if not BRep_Tool.Degenerated_s(edge):
            edges.append(_edge(edge, number, uses.get(number, []), vertices, tolerance))
    return edges


def number_of(shape: Shape, edge: Shape) -> int:
    """Give the number of an edge of a shape, 0 if the shape does not hold it."""
    return int(shape_map(shape, TopAbs_EDGE).FindIndex(edge))


def points_along(edge: Shape) -> FloatArray:
    """Points ``(5, 3)`` in mm along an edge."""
    curve = BRepAdaptor_Curve(as_edge(edge))
    return _along(curve, np.linspace(curve.FirstParameter(), curve.LastParameter(), _POINTS))[0]


def _uses(shape: Shape) -> Iterator[_Use]:
    """Every use of an edge by the boundary of a face that bounds the material."""
    numbers = shape_map(shape, TopAbs_FACE)
    for found in explore(shape, TopAbs_FACE):
        face = as_face(found)
        if face.Orientation() not in (TopAbs_FORWARD, TopAbs_REVERSED):
            continue
        mirrored = face.Location().Transformation().IsNegative()
        for edge in explore(face, TopAbs_EDGE):
            if edge.Orientation() in (TopAbs_FORWARD, TopAbs_REVERSED):
                left = (edge.Orientation() == TopAbs_FORWARD) != mirrored
                yield _Use(numbers.FindIndex(face), face, as_edge(edge), left)


def _edge(edge: Shape, number: int, uses: list[_Use], vertices: Any, tolerance: float) -> Edge:
    curve = BRepAdaptor_Curve(edge)
    parameters = _parameters(curve, tolerance)
    points, tangents = _along(curve, parameters)
    uses = sorted(uses, key=lambda use: not use.left)
    if len(uses) == 2 and uses[0].left == uses[1].left:
        uses = [*uses, uses[0]]  # inside out beside each other: counted as nonmanifold
    normals = np.full((len(points), 2, 3), np.nan)
    for side, use in enumerate(uses[:2]):
        normals[:, side] = _normals(use, parameters)
    faces = tuple(use.number for use in uses)
    properties = GProp_GProps()
    BRepGProp.LinearProperties_s(edge, properties)
    first, last = (vertices.FindIndex(end(edge)) for end in (TopExp.FirstVertex_s, TopExp.LastVertex_s))
    return Edge(
        number=number,
        convexity=convexity(tangents, normals, faces),
        curve=type_name(curve.GetType()),
        closed=bool(curve.IsClosed()) if first == last else False,
        length=float(properties.Mass()),
        centre=np.array(properties.CentreOfMass().Coord()),
        direction=tangents[0] if curve.GetType() == GeomAbs_Line else None,
        faces=faces,
        ends=(first, last),
        points=points,
        tangents=tangents,
        normals=normals,
    )


def type_name(kind: Any) -> str:
    """Name of a type of curve or surface, in lower case: "line", "bspline", "plane", "extrusion" and so on."""
    name = str(kind).rsplit(".", 1)[-1].removeprefix("GeomAbs_").lower()
    return name.removeprefix("surfaceof").removesuffix("curve").removesuffix("surface")


def _parameters(curve: Any, tolerance: float) -> FloatArray:
    """Parameters along an edge, so that straight pieces between them stay within the tolerance."""
    low, high = curve.FirstParameter(), curve.LastParameter()
    points = GCPnts_TangentialDeflection(curve, low, high, _ANGLE, tolerance, _POINTS)
    parameters = np.array([points.Parameter(i) for i in range(1, points.NbPoints() + 1)])
    if len(parameters) >= _POINTS:
        return parameters
    return np.linspace(low, high, _POINTS)


def _along(curve: Any, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points and unit tangents, in the curve's direction."""
    points, tangents = np.zeros((2, len(parameters), 3))
    point, tangent = gp_Pnt(), gp_Vec()
    for i, parameter in enumerate(parameters.tolist()):
        curve.D1(parameter, point, tangent)
        points[i], tangents[i] = point.Coord(), (tangent.X(), tangent.Y(), tangent.Z())
    tangents = unit(tangents)
    still = ~tangents.any(axis=1)
    if still.any():  # a cusp, or a spline's end with two control points in one place
        tangents[still] = unit(np.gradient(points, axis=0))[still]
    return points, tangents


def _normals(use: _Use, parameters: FloatArray) -> FloatArray:
    """Outward unit normals of a face along one of its edges."""
    surface = BRepAdaptor_Surface(use.face, False)
    sign = -1.0 if (use.face.Orientation() == TopAbs_REVERSED) else 1.0
    if use.face.Location().Transformation().IsNegative():
        sign = -sign
    if surface.GetType() == GeomAbs_Plane:
        plane = surface.Plane()
        normal = np.array(plane.Axis().Direction().Coord())
        return np.tile(sign * normal * (1.0 if plane.Direct() else -1.0), (len(parameters), 1))
    on_surface = BRepAdaptor_Curve2d(use.edge, use.face)
    point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    middle = float(parameters[0] + parameters[-1]) / 2

    def normal_at(parameter: float) -> FloatArray:
        place = on_surface.Value(parameter)
        surface.D1(place.X(), place.Y(), point, du, dv)
        a, b = np.array([[v.X(), v.Y(), v.Z()] for v in (du, dv)])
        normal = np.cross(a, b)
        size = float(np.linalg.norm(normal))
        flat = size <= 1e-9 * max(float(a @ a), float(b @ b))
        return np.zeros(3) if flat else np.asarray(normal / size)

    normals = np.array([normal_at(parameter) for parameter in parameters.tolist()])
    for i in np.flatnonzero(~normals.any(axis=1)):
        normals[i] = normal_at(float(parameters[i] + _STEP * (middle - parameters[i])))
    return np.asarray(sign * normals)
