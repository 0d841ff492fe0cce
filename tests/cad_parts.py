"""Parts for the tests of cad; B-reps are built with raw OCP, so that they run with either host."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh

from cad_implicit import Field, Grid, Mesh


def ball(radius: float = 7.3, at: tuple[float, float, float] = (31.7, -12.9, 105.3)) -> Mesh:
    raw = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return Mesh(raw.vertices + at, raw.faces, source={"name": "ball"})


def sampled(dim: int = 3, dtype: type = np.float32) -> Field:
    shape = (5, 4, 3)[:dim]
    grid = Grid((-1.5, 2.25, 10.125)[:dim], (0.1, 0.25, 0.7)[:dim], shape)
    return Field(grid, np.arange(np.prod(shape)).reshape(shape).astype(dtype))


def primitives() -> dict[str, tuple[Any, float]]:
    """Convex solids by name with their analytic volume in mm³; faces, seams, poles and apexes of all kinds."""
    from OCP.BRepPrimAPI import (
        BRepPrimAPI_MakeBox,
        BRepPrimAPI_MakeCone,
        BRepPrimAPI_MakeCylinder,
        BRepPrimAPI_MakeSphere,
    )

    return {
        "box": (BRepPrimAPI_MakeBox(7.3, 11.9, 3.1).Shape(), 7.3 * 11.9 * 3.1),
        "sphere": (BRepPrimAPI_MakeSphere(6.7).Shape(), 4 / 3 * np.pi * 6.7**3),
        "sphere wedge": (BRepPrimAPI_MakeSphere(6.7, np.pi / 3).Shape(), 4 / 3 * np.pi * 6.7**3 / 6),
        "cylinder": (BRepPrimAPI_MakeCylinder(4.3, 9.1).Shape(), np.pi * 4.3**2 * 9.1),
        "cone": (BRepPrimAPI_MakeCone(5.3, 0.0, 7.9).Shape(), np.pi * 5.3**2 * 7.9 / 3),
        "frustum": (BRepPrimAPI_MakeCone(5.3, 2.1, 7.9).Shape(), np.pi * 7.9 / 3 * (5.3**2 + 5.3 * 2.1 + 2.1**2)),
    }


def torus(major: float = 9.7, minor: float = 2.9) -> Any:
    """Torus; of volume ``2 pi² major minor²``."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus

    return BRepPrimAPI_MakeTorus(major, minor).Shape()


def loft() -> Any:
    """Ruled loft from a circle to a square."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakePolygon, BRepBuilderAPI_MakeWire
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt

    sections = BRepOffsetAPI_ThruSections(True, False)
    circle = gp_Circ(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 8.3)
    sections.AddWire(BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(circle).Edge()).Wire())
    square = BRepBuilderAPI_MakePolygon()
    for x, y in ((4, 4), (-4, 4), (-4, -4), (4, -4)):
        square.Add(gp_Pnt(x, y, 13.7))
    square.Close()
    sections.AddWire(square.Wire())
    sections.Build()
    return sections.Shape()


def box(size: tuple[float, float, float], at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Any:
    """Box with its lowest corner at a point."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    return BRepPrimAPI_MakeBox(gp_Pnt(*at), *size).Shape()


def moved(shape: Any, angle: float = 0.7, mirror: bool = False) -> Any:
    """Shape turned about a slanted axis and shifted, by location (or by new geometry if mirrored)."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    axis = gp_Ax1(gp_Pnt(1, 2, 3), gp_Dir(1, -2, 0.5))
    turn, shift = gp_Trsf(), gp_Trsf()
    if mirror:
        turn.SetMirror(gp_Ax2(gp_Pnt(1, 2, 3), gp_Dir(1, -2, 0.5)))
        return BRepBuilderAPI_Transform(shape, turn, True).Shape()
    turn.SetRotation(axis, angle)
    shift.SetTranslation(gp_Vec(31.7, -12.9, 5.3))
    return shape.Moved(TopLoc_Location(shift)).Moved(TopLoc_Location(turn))


def distance_to_face(points: np.ndarray, face: Any) -> np.ndarray:
    """Distances of points ``(N, 3)`` to a B-rep face, by the kernel's own projection."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt

    def one(point: np.ndarray) -> float:
        return float(BRepExtrema_DistShapeShape(BRepBuilderAPI_MakeVertex(gp_Pnt(*point)).Vertex(), face).Value())

    return np.array([one(point) for point in points.tolist()])
