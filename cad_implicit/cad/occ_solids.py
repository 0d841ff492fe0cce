"""Solids of plans: what is left of the part is the part's own faces and edges, all else is made new."""

from __future__ import annotations

from typing import Any

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepCheck import BRepCheck_Wire
from OCP.BRepTools import BRepTools_ReShape
from OCP.gp import gp_Pnt
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_WIRE
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire

from .occ import Shape, as_edge, as_face, as_vertex, as_wire, compound, explore
from .occ_geometry import curve_of, flat_curve_of, surface_of
from .occ_original import ShapeTopology
from .planner import LEAST
from .plans import Plan, PlannedEdge, PlannedFace, PlannedVertex


def made(plan: Plan, own: ShapeTopology) -> Made:
    """Solid of a plan; the part itself stays as it is."""
    return Made(plan, own)


class Made:
    """What the kernel made of a plan; see :class:`cad_implicit.cad.plans.Product`."""

    def __init__(self, plan: Plan, own: ShapeTopology) -> None:
        self._plan, self._own = plan, own
        self._builder = BRep_Builder()
        self._vertices = {number: self._vertex(vertex) for number, vertex in plan.vertices.items()}
        self._edges = {number: self._edge(edge) for number, edge in plan.edges.items()}
        faces = [self._face(position, face) for position, face in enumerate(plan.faces)]
        self._copied = self._copies()
        whole = compound([self._solid([faces[n] for n in numbers]) for numbers in plan.solids])
        self.shape = self._copied.Apply(whole)
        self.faces = [self._copied.Apply(face) for face in faces]

    def crossing(self, position: int) -> list[int]:
        """Numbers of edges of a face that touch each other elsewhere than at their ends, as the kernel tells them."""
        face, found = as_face(self.faces[position]), []
        for wire in explore(face, TopAbs_WIRE):
            first, second = TopoDS_Edge(), TopoDS_Edge()
            BRepCheck_Wire(as_wire(wire)).SelfIntersect(face, first, second)
            found += [edge for edge in (first, second) if not edge.IsNull()]
        numbers = {number for loop in self._plan.faces[position].wires for number, _ in loop}
        own = {number: self._copied.Apply(self._edges[number]) for number in numbers}
        return [number for number, edge in own.items() if any(edge.IsSame(other) for other in found)]

    def _vertex(self, planned: PlannedVertex) -> Shape:
        if planned.own >= 0:
            return as_vertex(self._own.vertex_shapes[planned.own].Oriented(TopAbs_FORWARD))
        vertex = TopoDS_Vertex()
        self._builder.MakeVertex(vertex, gp_Pnt(*planned.point.tolist()), planned.tolerance)
        return vertex

    def _copies(self) -> BRepTools_ReShape:
        """Find the vertices of the part that need wider tolerances, and give copies those: the part stays as it is."""
        copies = BRepTools_ReShape()
        for number, planned in self._plan.vertices.items():
            if planned.own >= 0 and planned.tolerance > self._own.tolerances[planned.own]:
                own, copy = as_vertex(self._vertices[number]), TopoDS_Vertex()
                self._builder.MakeVertex(copy, BRep_Tool.Pnt_s(own), planned.tolerance)
                copies.Replace(own, copy)
        return copies

    def _edge(self, planned: PlannedEdge) -> Shape:
        if planned.whole:
            return self._own.edges[planned.own].shape
        if planned.own >= 0:
            edge = as_edge(self._own.edges[planned.own].shape.EmptyCopied())
            self._builder.UpdateEdge(edge, planned.tolerance)
        else:
            edge = TopoDS_Edge()
            self._builder.MakeEdge(edge, curve_of(planned.span.curve), planned.tolerance)  # type: ignore[arg-type]
        for vertex, orientation in zip(planned.ends, (TopAbs_FORWARD, TopAbs_REVERSED), strict=True):
            self._builder.Add(edge, self._vertices[vertex].Oriented(orientation))
        self._builder.Range(edge, planned.span.low, planned.span.high)
        return edge

    def _face(self, position: int, planned: PlannedFace) -> Shape:
        if planned.whole:
            return self._own.face_shapes[planned.own]
        if planned.own >= 0:
            original = self._own.face_shapes[planned.own]
            face: Any = as_face(as_face(original.Oriented(TopAbs_FORWARD)).EmptyCopied())
        else:
            assert planned.surface is not None
            face = TopoDS_Face()
            self._builder.MakeFace(face, surface_of(planned.surface), TopLoc_Location(), LEAST)
        for loop in planned.wires:
            wire = TopoDS_Wire()
            self._builder.MakeWire(wire)
            for number, ahead in loop:
                flat = self._plan.edges[number].on.get(position)
                if flat is not None:
                    self._builder.UpdateEdge(self._edges[number], flat_curve_of(flat), face, LEAST)
                orientation = TopAbs_FORWARD if ahead == planned.forward else TopAbs_REVERSED
                self._builder.Add(wire, self._edges[number].Oriented(orientation))
            wire.Closed(True)
            self._builder.Add(face, wire)
        return face if planned.forward else face.Oriented(TopAbs_REVERSED)

    def _solid(self, faces: list[Shape]) -> Shape:
        shell, solid = TopoDS_Shell(), TopoDS_Solid()
        self._builder.MakeShell(shell)
        for face in faces:
            self._builder.Add(shell, face)
        shell.Closed(True)
        self._builder.MakeSolid(solid)
        self._builder.Add(solid, shell)
        return solid
