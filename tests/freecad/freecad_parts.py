"""What tests of features share: parts, features, volumes that are known exactly, places."""

from __future__ import annotations

import math
from typing import Any

import FreeCAD as App
import numpy as np
from freecad.cad_implicit_wb import making, references


def rounded(sides: tuple[float, float, float], r: float) -> float:
    """Volume of a box whose edges and corners are rounded: the inner box, grown (Steiner's formula)."""
    a, b, c = (side - 2 * r for side in sides)
    return a * b * c + 2 * r * (a * b + b * c + c * a) + math.pi * r**2 * (a + b + c) + 4 / 3 * math.pi * r**3


def mesh_volume(mesh: Any) -> float:
    """Volume of a closed mesh in mm³; FreeCAD adds up its own in single precision, here off by up to 4e-4 of it."""
    points, facets = mesh.Topology
    vertices = np.array([tuple(point) for point in points])
    return float(np.linalg.det(vertices[np.array(facets)]).sum() / 6)


def same_place(obj: Any, placement: Any) -> bool:
    """Whether an object is at a placement."""
    own = obj.Placement
    return bool(own.Base.isEqual(placement.Base, 1e-9) and own.Rotation.isSame(placement.Rotation, 1e-9))


def bossed(document: Any, placement: Any = None) -> tuple[Any, Any]:
    """A parametric box with a boss, and the box."""
    box = document.addObject("Part::Box", "Box")
    box.Length, box.Width, box.Height = 30, 20, 10
    boss = document.addObject("Part::Cylinder", "Boss")
    boss.Radius, boss.Height = 4, 25
    boss.Placement.Base = App.Vector(12, 10, 0)
    part = document.addObject("Part::MultiFuse", "Part")
    part.Shapes = [box, boss]
    part.Refine = True
    part.Placement = placement or App.Placement()
    document.recompute()
    return part, box


def ring(shape: Any) -> str:
    """The concave edge where the boss stands on the box, in any place of the part."""
    own = shape.copy()
    own.Placement = App.Placement()
    foot = App.Vector(12, 10, 10)
    (number,) = (n for n, e in enumerate(own.Edges) if e.isClosed() and e.CenterOfMass.isEqual(foot, 1e-6))
    return f"Edge{number + 1}"


def exact_fillet(shape: Any, names: list[str], radius: float) -> Any:
    return shape.makeFillet(radius, [shape.Edges[references.split(name)[1] - 1] for name in names])


def box(document: Any, *sides: float) -> Any:
    obj = document.addObject("Part::Box", "Plate")
    obj.Length, obj.Width, obj.Height = sides
    document.recompute()
    return obj


def upright(shape: Any) -> list[str]:
    """Edges along z."""
    edges = enumerate(shape.Edges)
    return [
        f"Edge{n + 1}"
        for n, e in edges
        if len(e.Vertexes) == 2 and e.tangentAt(e.FirstParameter).cross(App.Vector(0, 0, 1)).Length < 1e-9
    ]


def made(document: Any, *arguments: Any, **values: Any) -> Any:
    """A feature that was computed, and is valid."""
    obj = making.make(document, *arguments, **values)
    document.recompute()
    assert obj.isValid(), obj.getStatusString()
    if not obj.isDerivedFrom("Mesh::Feature"):
        assert obj.Shape.isValid()
        assert obj.Shape.ShapeType == "Solid"
    return obj
