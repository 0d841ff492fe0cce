"""Vertices, edges and seams of a B-rep, as outlines of results need them."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.GeomAPI import GeomAPI_ProjectPointOnCurve
from OCP.gp import gp_Pnt
from OCP.ShapeAnalysis import ShapeAnalysis_Surface
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_FORWARD, TopAbs_VERTEX
from OCP.TopExp import TopExp

from cad_implicit.implicit import FloatArray

from .occ import Shape, as_edge, as_face, as_vertex, explore, shape_map


class ShapeEdge:
    """An edge of a shape, by the parameter of its curve."""

    def __init__(self, edge: Shape, faces: tuple[int, ...], ends: tuple[int, int]) -> None:
        self.shape, self.faces, self.ends = edge, faces, ends
        curve = BRep_Tool.Curve_s(edge, 0.0, 0.0)
        adaptor = BRepAdaptor_Curve(edge)
        self.geometry = curve[0] if isinstance(curve, tuple) else curve
        self.low, self.high = float(adaptor.FirstParameter()), float(adaptor.LastParameter())
        self.period = self.high - self.low if ends[0] == ends[1] else None
        self.bends = np.zeros(0)

    def at(self, ways: FloatArray) -> FloatArray:
        return np.array([self.geometry.Value(float(t)).Coord() for t in np.atleast_1d(ways)])

    def way(self, points: FloatArray) -> FloatArray:
        found = np.zeros(len(points))
        for number, point in enumerate(points.tolist()):
            found[number] = self._way(gp_Pnt(*point))
        return found

    def _way(self, point: Any) -> float:
        project = GeomAPI_ProjectPointOnCurve(point, self.geometry, self.low, self.high)
        ends = [(float(self.geometry.Value(t).Distance(point)), t) for t in (self.low, self.high)]
        if project.NbPoints() > 0:
            ends.append((float(project.LowerDistance()), float(project.LowerDistanceParameter())))
        return min(ends)[1]


class ShapeTopology:
    """What outlines need to know of a shape.

    Attributes
    ----------
    faces, edges, vertices : the kernel's own, and
    points : (V, 3) float64
    """

    def __init__(self, shape: Shape) -> None:
        face_map, edge_map, vertex_map = (shape_map(shape, kind) for kind in (TopAbs_FACE, TopAbs_EDGE, TopAbs_VERTEX))
        self.face_shapes = [as_face(face_map.FindKey(i)) for i in range(1, face_map.Extent() + 1)]
        self.vertex_shapes = [vertex_map.FindKey(i) for i in range(1, vertex_map.Extent() + 1)]
        self.vertices = np.array([BRep_Tool.Pnt_s(as_vertex(v)).Coord() for v in self.vertex_shapes])
        beside: dict[int, list[int]] = {}
        self._seams: dict[int, list[int]] = {}
        self.degenerate: dict[int, list[Shape]] = {}
        for number, face in enumerate(self.face_shapes):
            for edge in explore(face, TopAbs_EDGE):
                key = edge_map.FindIndex(edge)
                beside.setdefault(key, []).append(number)
                if BRep_Tool.Degenerated_s(as_edge(edge)):
                    self.degenerate.setdefault(number, []).append(as_edge(edge))
        self.edges: list[ShapeEdge] = []
        for key in range(1, edge_map.Extent() + 1):
            edge = as_edge(edge_map.FindKey(key))
            if BRep_Tool.Degenerated_s(edge):
                continue
            ends = [vertex_map.FindIndex(end(edge)) - 1 for end in (TopExp.FirstVertex_s, TopExp.LastVertex_s)]
            own = beside.get(key, [])
            if len(own) == 2 and own[0] == own[1]:
                self._seams.setdefault(own[0], []).append(len(self.edges))
            self.edges.append(ShapeEdge(as_edge(edge.Oriented(TopAbs_FORWARD)), tuple(own), (ends[0], ends[1])))
        self._surfaces: dict[int, Any] = {}

    def seams(self, face: int) -> list[int]:
        """Edges at which a face meets itself."""
        return self._seams.get(face, [])

    def surface(self, face: int) -> Any:
        """Surface of a face, to look places up on it."""
        if face not in self._surfaces:
            self._surfaces[face] = ShapeAnalysis_Surface(BRep_Tool.Surface_s(self.face_shapes[face]))
        return self._surfaces[face]

    def past_seam(self, face: int, seam: int, points: FloatArray) -> FloatArray:
        """How far (N,) points of a face are past a seam, in turns from -0.5 to 0.5."""
        surface = self.surface(face)
        geometry = surface.Surface()
        edge = self.edges[seam]
        on_seam = places(surface, edge.at(np.linspace(edge.low, edge.high, 5)[1:-1]))
        flat = np.ptp(on_seam, axis=0)
        low_u, high_u, low_v, high_v = geometry.Bounds()
        if flat[0] < flat[1] or not geometry.IsVClosed():
            axis, period = 0, high_u - low_u
        else:
            axis, period = 1, high_v - low_v
        turns = (places(surface, points)[:, axis] - on_seam[0, axis]) / period
        return np.asarray(turns - np.round(turns))


def places(surface: Any, points: FloatArray) -> FloatArray:
    """Parameters (N, 2) of the nearest places of a surface to points (N, 3) of a curve."""
    found = np.zeros((len(points), 2))
    place = None
    for number, point in enumerate(points.tolist()):
        where = gp_Pnt(*point)
        place = surface.ValueOfUV(where, 1e-7) if place is None else surface.NextValueOfUV(place, where, 1e-7)
        found[number] = place.X(), place.Y()
    return found
