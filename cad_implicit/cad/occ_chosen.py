"""What a user of a host selected, as numbers of edges and faces of the part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_VERTEX
from OCP.TopoDS import TopoDS

from cad_implicit.errors import SelectorError, tell
from cad_implicit.implicit import FloatArray

from .edges import Edge, edge_number
from .occ import Shape, as_edge, distinct, shape_map
from .parts import OpenPart

as_vertex = getattr(TopoDS, "Vertex_s", None) or TopoDS.Vertex

#: Places nearer to each other than this share of the diagonal are one: uniting solids moves nothing farther.
_SAME_PLACE = 1e-5

#: Convexities of edges that can be blended, and of those at which there is nothing to blend: the hosts' own fillets
#: pass over these without a word, too.
_FIT, _NOTHING = ("convex", "concave", "mixed"), ("smooth", "seam")


def edge_numbers(part: OpenPart, found: Sequence[Edge], shapes: Sequence[Shape]) -> list[int]:
    """Numbers of the edges that can be blended among what was selected.

    Parameters
    ----------
    part : OpenPart
    found : sequence of Edge
        All of its edges.
    shapes : sequence of TopoDS_Shape
        Edges; wires and faces for their edges; vertices for the edges that end there.

    Raises
    ------
    SelectorError
        If there is none, or the part does not have one of them.

    Warns
    -----
    GeometryWarning
        If some have one face only, or more than two: the part is invalid then.
    """
    known = {edge.number: edge for edge in found}
    numbers: dict[int, None] = {}
    for shape in shapes:
        if shape.ShapeType() == TopAbs_VERTEX:
            numbers |= dict.fromkeys(_at(part, found, shape))
        else:
            own = [edge for edge in distinct(shape, TopAbs_EDGE) if not BRep_Tool.Degenerated_s(as_edge(edge))]
            numbers |= dict.fromkeys(edge_number(part, found, edge) for edge in own)
    fit = [number for number in numbers if known[number].convexity in _FIT]
    unfit = sum(known[number].convexity not in (*_FIT, *_NOTHING) for number in numbers)
    if unfit:
        tell(
            f"the part is invalid: {unfit} of the {len(numbers)} edges selected have one face only, or more than two, "
            "and are left out; where a union in CadQuery made it so, try clean=False there"
        )
    if not fit:
        why = "faces meet smoothly at all edges selected" if numbers else "no edges were selected"
        raise SelectorError(f"{why}, so that there is nothing to blend; select others")
    return fit


def _at(part: OpenPart, found: Sequence[Edge], vertex: Shape) -> list[int]:
    """Numbers of the edges that end at a vertex."""
    place = np.array(BRep_Tool.Pnt_s(as_vertex(vertex)).Coord())
    limit = _SAME_PLACE * float(np.linalg.norm(part.bounds[1] - part.bounds[0]))
    met = [e.number for e in found if np.linalg.norm(e.points[[0, -1]] - place, axis=1).min() <= limit]
    if not met:
        x, y, z = place
        raise SelectorError(f"no edge of the part ends at ({x:.4g}, {y:.4g}, {z:.4g}) mm")
    return met


def face_numbers(part: OpenPart, faces: Sequence[Shape]) -> list[int]:
    """Numbers of faces of a part, as ``TopExp::MapShapes`` counts them: the very faces, or those in the same place.

    Raises
    ------
    SelectorError
        If the part does not have one of them.
    """
    numbers = shape_map(part.shape, TopAbs_FACE)
    limit = _SAME_PLACE * float(np.linalg.norm(part.bounds[1] - part.bounds[0]))
    result = []
    for face in faces:
        number = int(numbers.FindIndex(face))
        if not number:
            centre = _centre(face)
            away = [float(np.linalg.norm(_centre(own) - centre)) for own in distinct(part.shape, TopAbs_FACE)]
            number = int(np.argmin(away)) + 1
            if away[number - 1] > limit:
                x, y, z = centre
                raise SelectorError(f"the part has no face around ({x:.4g}, {y:.4g}, {z:.4g}) mm")
        result.append(number)
    return result


def _centre(face: Shape) -> FloatArray:
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, properties)
    return np.array(properties.CentreOfMass().Coord())
