"""B-rep parts with edges and faces of all kinds, built with raw OCP, so that they run with either host."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import cad_parts
import numpy as np

from cad_implicit.cad import occ


def cut(shape: Any, *tools: Any) -> Any:
    """Shape without the tools."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    for tool in tools:
        shape = BRepAlgoAPI_Cut(shape, tool).Shape()
    return occ.compound(occ.solids(shape))


def fused(shape: Any, *others: Any) -> Any:
    """All shapes as one, faces in one surface merged."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain

    for other in others:
        shape = BRepAlgoAPI_Fuse(shape, other).Shape()
    unify = ShapeUpgrade_UnifySameDomain(shape, True, True, False)
    unify.Build()
    return occ.compound(occ.solids(unify.Shape()))


def cylinder(radius: float, height: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Any:
    """Cylinder along z, its lowest face around a point."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*at), gp_Dir(0, 0, 1)), radius, height).Shape()


def angle_bar() -> Any:
    """L profile of 9 x 7, 2 and 3 thick, 11 long: one concave edge among 18."""
    return cut(cad_parts.box((9, 11, 7)), cad_parts.box((7, 13, 5), (2, -1, 3)))


def slotted_plate() -> Any:
    """Plate of 30 x 16 x 6 with a slot 4 deep, 14 long between the centres of its round ends of radius 3.

    On top, 4 convex edges around the slot continue each other, and 4 concave ones around its floor.
    """
    slot = fused(cad_parts.box((14, 6, 9), (-7, -3, 2)), cylinder(3, 9, (-7, 0, 2)), cylinder(3, 9, (7, 0, 2)))
    return cut(cad_parts.box((30, 16, 6), (-15, -8, 0)), slot)


def hip() -> Any:
    """Bar 10 long whose top has an edge that is convex at its start and concave at its end."""
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections

    maker = BRepOffsetAPI_ThruSections(True, True)
    for x, z in ((0.0, -1.0), (10.0, 1.0)):
        maker.AddWire(closed_wire([(x, *yz) for yz in ((-5, -5), (5, -5), (5, z), (0, 0), (-5, 0))]))
    maker.Build()
    return maker.Shape()


def teardrop() -> Any:
    """Prism of height 5 over a closed curve with one right angle: its side is one face that meets itself there."""
    angle = np.linspace(0, np.pi, 25)
    return prism(spline_edge(np.column_stack([6 * np.sin(angle), 3 * np.sin(2 * angle), 0 * angle])), 5)


def closed_wire(points: Sequence[tuple[float, float, float]]) -> Any:
    """Polygon as a wire."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakePolygon
    from OCP.gp import gp_Pnt

    maker = BRepBuilderAPI_MakePolygon()
    for point in points:
        maker.Add(gp_Pnt(*point))
    maker.Close()
    return maker.Wire()


def spline_edge(points: np.ndarray) -> Any:
    """Edge along a spline through points."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.GeomAPI import GeomAPI_PointsToBSpline
    from OCP.gp import gp_Pnt

    try:
        from OCP.TColgp import TColgp_Array1OfPnt as Points
    except ImportError:
        from OCP.collections import Array1_gp_Pnt as Points
    array = Points(1, len(points))
    for number, point in enumerate(points.tolist(), 1):
        array.SetValue(number, gp_Pnt(*point))
    return BRepBuilderAPI_MakeEdge(GeomAPI_PointsToBSpline(array).Curve()).Edge()


def prism(*edges: Any) -> Any:
    """Prism over a plane wire of edges; the last argument is its height along z."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Vec

    wire = BRepBuilderAPI_MakeWire()
    for edge in edges[:-1]:
        wire.Add(edge)
    return BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Vec(0, 0, edges[-1])).Shape()


def drilled_block() -> Any:
    """Block with a bore of radius 2."""
    return cut(cad_parts.box((9, 8, 7)), cylinder(2, 9, (4, 4, -1)))


def torus_segment() -> Any:
    """A third of a torus with radii 6 and 2."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus

    return BRepPrimAPI_MakeTorus(6.0, 2.0, 2 * np.pi / 3).Shape()


def spindle() -> Any:
    """Lens: a circular arc of radius 5, turned about its chord; its side is the inner sheet of a torus."""
    return turned_section([(0, -4), (0, 4)], arc_edge((0, -4), (2, 0), (0, 4)))


def vase() -> Any:
    """Turned part 9 high whose side is a spline turned about z."""
    side = [(5, 0), (4, 3), (6, 7), (5, 9)]
    spline = spline_edge(np.array([(x, 0, z) for x, z in side], float))
    return turned_section([(5, 9), (0, 9), (0, 0), (5, 0)], spline)


def thickened() -> Any:
    """Wavy sheet, 1.5 thick: one of its faces is the offset of the other."""
    from OCP.BRepOffset import BRepOffset_MakeOffset, BRepOffset_Skin
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.GeomAbs import GeomAbs_Intersection
    from OCP.gp import gp_Vec
    from OCP.TopAbs import TopAbs_FACE

    x = np.linspace(0, 9, 7)
    edge = spline_edge(np.column_stack([x, 0 * x, np.sin(x / 2)]))
    sheet = next(occ.explore(BRepPrimAPI_MakePrism(edge, gp_Vec(0, 6, 0)).Shape(), TopAbs_FACE))
    maker = BRepOffset_MakeOffset()
    maker.Initialize(sheet, 1.5, 1e-6, BRepOffset_Skin, False, False, GeomAbs_Intersection, True)
    maker.MakeOffsetShape()
    return maker.Shape()


def arc_edge(*points: tuple[float, float]) -> Any:
    """Circular arc through three points (x, z)."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.GC import GC_MakeArcOfCircle
    from OCP.gp import gp_Pnt

    return BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(*(gp_Pnt(x, 0, z) for x, z in points)).Value()).Edge()


def turned_section(corners: Sequence[tuple[float, float]], side: Any) -> Any:
    """Solid of revolution about z: straight lines between corners (x, z), closed by one more edge."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt

    ends = [gp_Pnt(x, 0, z) for x, z in corners]
    wire = BRepBuilderAPI_MakeWire(side)
    for one, other in pairwise(ends):
        wire.Add(BRepBuilderAPI_MakeEdge(one, other).Edge())
    face = BRepBuilderAPI_MakeFace(wire.Wire()).Face()
    return BRepPrimAPI_MakeRevol(face, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))).Shape()


def all_rounded() -> Any:
    """Block with a boss of radius 4, all of its edges rounded with radius 0.9."""
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.TopAbs import TopAbs_EDGE

    shape = fused(cad_parts.box((20, 16, 6)), cylinder(4, 12, (9, 8, 0)))
    maker = BRepFilletAPI_MakeFillet(shape)
    for edge in occ.distinct(shape, TopAbs_EDGE):
        maker.Add(0.9, occ.as_edge(edge))
    return maker.Shape()
