"""Solids of plane faces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.Geom import Geom_Line, Geom_Plane
from OCP.gp import gp_Dir, gp_Pnt
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire

from .facets import RESOLUTION, Polyhedron
from .occ import Shape, silence


def polyhedron(plan: Polyhedron) -> tuple[Shape, Callable[[int], bool]]:
    """Solid of plane faces, and a way to ask the kernel whether the face of a number is valid."""
    made = _faces(plan, _edges(plan))

    def is_good(number: int) -> bool:
        with silence():
            return bool(BRepCheck_Analyzer(made[number]).IsValid())

    return _solid(made, plan.shells()), is_good


def _edges(plan: Polyhedron) -> list[tuple[Shape, Shape]]:
    """Straight edges forward and reversed, between shared vertices."""
    builder = BRep_Builder()
    low, high = plan.low, plan.high
    place, vertex_off = plan.points.tolist(), plan.vertex_off.tolist()
    corners: dict[int, tuple[gp_Pnt, Shape, Shape]] = {}
    for number in np.unique(np.concatenate([low, high])).tolist():
        point, vertex = gp_Pnt(*place[number]), TopoDS_Vertex()
        builder.MakeVertex(vertex, point, vertex_off[number])
        corners[number] = point, vertex, vertex.Reversed()
    way = plan.points[high] - plan.points[low]
    length = np.linalg.norm(way, axis=1).tolist()
    edges = []
    for a, b, direction, far, off in zip(
        low.tolist(), high.tolist(), way.tolist(), length, plan.edge_off.tolist(), strict=True
    ):
        edge = TopoDS_Edge()
        builder.MakeEdge(edge, Geom_Line(corners[a][0], gp_Dir(*direction)), off)
        builder.Add(edge, corners[a][1])
        builder.Add(edge, corners[b][2])
        builder.Range(edge, 0.0, far)
        edges.append((edge, edge.Reversed()))
    return edges


def _faces(plan: Polyhedron, edges: list[tuple[Shape, Shape]]) -> list[TopoDS_Face]:
    faces, edge, forward = plan.faces, plan.edge, plan.forward
    builder = BRep_Builder()
    made, corner = [], 0
    for loops, centre, normal in zip(faces.loops, faces.centres.tolist(), faces.normals.tolist(), strict=True):
        face = TopoDS_Face()
        builder.MakeFace(face, Geom_Plane(gp_Pnt(*centre), gp_Dir(*normal)), RESOLUTION)
        for loop in loops:
            wire = TopoDS_Wire()
            builder.MakeWire(wire)
            for _ in loop:
                builder.Add(wire, edges[edge[corner]][0 if forward[corner] else 1])
                corner += 1
            wire.Closed(True)
            builder.Add(face, wire)
        made.append(face)
    return made


def _solid(faces: list[TopoDS_Face], shell_of: list[int]) -> Shape:
    """Solid of faces, each in the shell of its number."""
    builder, solid = BRep_Builder(), TopoDS_Solid()
    builder.MakeSolid(solid)
    shells = []
    for _ in range(max(shell_of) + 1):
        shell = TopoDS_Shell()
        builder.MakeShell(shell)
        shells.append(shell)
    for face, number in zip(faces, shell_of, strict=True):
        builder.Add(shells[number], face)
    for shell in shells:
        shell.Closed(True)
        builder.Add(solid, shell)
    return solid
