"""Edges of a B-rep of FreeCAD: sampled along their curves, with the normals of the faces beside them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cad_implicit.mesh import FloatArray

from .edges import Edge, convexity, unit
from .freecad import Shape, bounds
from .freecad_original import Numbers, Use

#: Largest distance between an edge and its polyline, over the diagonal, and largest angle in radians between its
#: pieces: those of the triangles.
_DEFLECTION = 1 / 2000
_ANGLE = 0.2
#: Fewest points along an edge: enough to see its convexity change; and rounds of halving where there are too few.
_POINTS = 5
_HALVINGS = 10
#: Where a surface has no normal (a pole, an apex) it is taken this share of the edge farther in.
_STEP = 1e-4


def shape_edges(shape: Shape, tolerance: float | None = None) -> list[Edge]:
    """Edges of a shape, numbered as FreeCAD does, chains not told.

    Parameters
    ----------
    shape : Part.Shape
    tolerance : float, optional
        Largest distance in mm between an edge and its polyline; the diagonal / 2000 by default.
    """
    if tolerance is None:
        low, high = bounds(shape)
        tolerance = float(np.linalg.norm(high - low)) * _DEFLECTION
    numbers, faces = Numbers(shape), shape.Faces
    uses: dict[int, list[Use]] = {}
    for use in numbers.uses:
        if use.face_orientation in "+-" and use.orientation in "+-":
            uses.setdefault(use.edge, []).append(use)
    return [
        _edge(edge, number, uses.get(number, []), faces, numbers, tolerance)
        for number, edge in enumerate(shape.Edges)
        if not edge.Degenerated
    ]


def number_of(shape: Shape, edge: Shape) -> int:
    """Give the number of an edge of a shape, 0 if the shape does not hold it."""
    return next((number for number, own in enumerate(shape.Edges, 1) if own.isSame(edge)), 0)


def points_along(edge: Shape) -> FloatArray:
    """Points ``(5, 3)`` in mm along an edge."""
    return _along(edge.Curve, _spread(edge))[0]


def curve_name(curve: object) -> str:
    """Name of a curve, as :class:`cad_implicit.cad.edges.Edge` has it."""
    return type(curve).__name__.removesuffix("Curve").lower()


def _edge(
    edge: Shape, number: int, uses: list[Use], faces: Sequence[Shape], numbers: Numbers, tolerance: float
) -> Edge:
    curve = edge.Curve
    parameters = _parameters(edge, tolerance)
    points, tangents = _along(curve, parameters)
    uses = sorted(uses, key=lambda use: use.orientation != "+")
    if len(uses) == 2 and uses[0].orientation == uses[1].orientation:
        uses = [*uses, uses[0]]  # inside out beside each other: counted as nonmanifold
    normals = np.full((len(points), 2, 3), np.nan)
    for side, use in enumerate(uses[:2]):
        normals[:, side] = _normals(edge, faces[use.face], use, parameters)
    beside = tuple(use.face + 1 for use in uses)
    first, last = (end + 1 for end in numbers.ends(number))
    name = curve_name(curve)
    return Edge(
        number=number + 1,
        convexity=convexity(tangents, normals, beside),
        curve=name,
        closed=first == last,
        length=float(edge.Length),
        centre=np.array(tuple(edge.CenterOfMass)),
        direction=tangents[0] if name == "line" else None,
        faces=beside,
        ends=(first, last),
        points=points,
        tangents=tangents,
        normals=normals,
    )


def _parameters(edge: Shape, tolerance: float) -> FloatArray:
    """Parameters along an edge, so that straight pieces between them stay within the tolerance."""
    parameters = _spread(edge)
    for _ in range(_HALVINGS):
        middles = (parameters[1:] + parameters[:-1]) / 2
        points, tangents = _along(edge.Curve, parameters)
        between, slopes = _along(edge.Curve, middles)
        off = np.linalg.norm(between - (points[1:] + points[:-1]) / 2, axis=1)
        cosine = np.minimum((tangents[1:] * slopes).sum(axis=1), (tangents[:-1] * slopes).sum(axis=1))
        rough = (off > tolerance) | (cosine < np.cos(_ANGLE / 2))
        if not rough.any():
            break
        parameters = np.sort(np.concatenate([parameters, middles[rough]]))
    return parameters


def _spread(edge: Shape) -> FloatArray:
    """Parameters (5,) from one end of an edge to the other."""
    low, high = edge.ParameterRange
    return np.linspace(low, high, _POINTS)


def _along(curve: object, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points and unit tangents, in the curve's direction."""
    both = [curve.getD1(parameter) for parameter in parameters.tolist()]  # type: ignore[attr-defined]
    points = np.array([tuple(point) for point, _ in both])
    tangents = unit(np.array([tuple(tangent) for _, tangent in both]))
    still = ~tangents.any(axis=1)
    if still.any():  # a cusp, or a spline's end with two control points in one place
        tangents[still] = unit(np.gradient(points, axis=0))[still]
    return points, tangents


def _normals(edge: Shape, face: Shape, use: Use, parameters: FloatArray) -> FloatArray:
    """Outward unit normals of a face along one of its edges."""
    surface = face.Surface
    sign = 1.0 if use.face_orientation == "+" else -1.0
    if type(surface).__name__ == "Plane":
        du, dv = (np.array(tuple(surface.getDN(0.0, 0.0, *order))) for order in ((1, 0), (0, 1)))
        return np.tile(sign * np.cross(du, dv), (len(parameters), 1))
    oriented = edge if (edge.Orientation == "Forward") == (use.orientation == "+") else edge.reversed()
    on_surface = face.curveOnSurface(oriented)[0]
    middle = float(parameters[0] + parameters[-1]) / 2

    def normal_at(parameter: float) -> FloatArray:
        place = on_surface.value(parameter)
        a, b = (np.array(tuple(surface.getDN(place.x, place.y, *order))) for order in ((1, 0), (0, 1)))
        normal = np.cross(a, b)
        size = float(np.linalg.norm(normal))
        flat = size <= 1e-9 * max(float(a @ a), float(b @ b))
        return np.zeros(3) if flat else np.asarray(normal / size)

    normals = np.array([normal_at(parameter) for parameter in parameters.tolist()])
    for i in np.flatnonzero(~normals.any(axis=1)):
        normals[i] = normal_at(float(parameters[i] + _STEP * (middle - parameters[i])))
    return np.asarray(sign * normals)
