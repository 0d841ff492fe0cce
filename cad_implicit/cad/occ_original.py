"""Vertices, edges and seams of a B-rep, as outlines of results need them."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepTools import BRepTools
from OCP.GeomAPI import GeomAPI_ProjectPointOnCurve
from OCP.gp import gp_Pnt
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_FORWARD, TopAbs_VERTEX
from OCP.TopExp import TopExp

from cad_implicit.implicit import FloatArray

from .geometry import Surface, past_seam
from .occ import Shape, as_edge, as_face, as_vertex, explore, shape_map
from .occ_geometry import SurfaceLook, surface_of


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
        self.tolerance = float(BRep_Tool.Tolerance_s(edge))

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
    face_shapes, vertex_shapes : list of TopoDS_Shape
    edges : list of ShapeEdge
    vertices : (V, 3) float64
    tolerances : (V,) float64
        Of the vertices in mm.
    """

    def __init__(self, shape: Shape) -> None:
        face_map, edge_map, vertex_map = (shape_map(shape, kind) for kind in (TopAbs_FACE, TopAbs_EDGE, TopAbs_VERTEX))
        self.face_shapes = [as_face(face_map.FindKey(i)) for i in range(1, face_map.Extent() + 1)]
        self.vertex_shapes = [vertex_map.FindKey(i) for i in range(1, vertex_map.Extent() + 1)]
        self.vertices = np.array([BRep_Tool.Pnt_s(as_vertex(v)).Coord() for v in self.vertex_shapes])
        self.tolerances = np.array([BRep_Tool.Tolerance_s(as_vertex(v)) for v in self.vertex_shapes])
        beside: dict[int, list[int]] = {}
        self._seams: dict[int, list[int]] = {}
        for number, face in enumerate(self.face_shapes):
            for edge in explore(face, TopAbs_EDGE):
                key = edge_map.FindIndex(edge)
                beside.setdefault(key, []).append(number)
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
        self._surfaces: dict[int, SurfaceLook] = {}

    def seams(self, face: int) -> list[int]:
        """Edges at which a face meets itself."""
        return self._seams.get(face, [])

    def surface(self, face: int) -> SurfaceLook:
        """Surface of a face, to look places up on it."""
        if face not in self._surfaces:
            self._surfaces[face] = SurfaceLook(BRep_Tool.Surface_s(self.face_shapes[face]))
        return self._surfaces[face]

    def look(self, surface: Surface) -> SurfaceLook:
        """Look places up on a new surface."""
        return SurfaceLook(surface_of(surface))

    def forward(self, face: int) -> bool:
        """Whether the normal of a face's surface points outwards."""
        return bool(self.face_shapes[face].Orientation() == TopAbs_FORWARD)

    def middle(self, face: int) -> FloatArray:
        """Parameters (2,) in the middle of a face."""
        low_u, high_u, low_v, high_v = BRepTools.UVBounds_s(self.face_shapes[face])
        return np.array([(low_u + high_u) / 2, (low_v + high_v) / 2])

    def past_seam(self, face: int, seam: int, points: FloatArray) -> FloatArray:
        """How far (N,) points of a face are past a seam, in turns from -0.5 to 0.5."""
        return past_seam(self.surface(face), self.edges[seam], points)
