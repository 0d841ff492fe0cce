"""Features of solids in a document: against FreeCAD's own fillets and exact volumes, through all that documents do."""

from __future__ import annotations

from typing import Any

import FreeCAD as App
import pytest
from freecad.cad_implicit_wb import making, references
from freecad_parts import same_place

pytestmark = pytest.mark.freecad

TILTED = App.Placement(App.Vector(3, -2, 7), App.Rotation(App.Vector(1, 2, 3), 33))


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


def test_a_fillet_of_a_boss_is_freecads_own_and_follows_the_box(document: Any, computed: list[Any]) -> None:
    part, plate = bossed(document, TILTED)
    obj = made(document, "fillet", part, [ring(part.Shape)], Radius=2.0)
    truth = exact_fillet(part.Shape, [ring(part.Shape)], 2.0)
    assert obj.Shape.Volume == pytest.approx(truth.Volume, rel=2e-6)
    assert obj.Shape.distToShape(truth.Vertexes[0])[0] < 1e-6
    assert obj.Shape.common(truth).Volume == pytest.approx(truth.Volume, rel=1e-5)
    assert same_place(obj, TILTED)
    assert "Toroid" in {type(face.Surface).__name__ for face in obj.Shape.Faces}
    assert obj.ExactShare == pytest.approx(1.0)

    plate.Length = 50
    document.recompute()
    assert obj.isValid(), obj.getStatusString()
    truth = exact_fillet(part.Shape, [ring(part.Shape)], 2.0)
    assert obj.Shape.Volume == pytest.approx(truth.Volume, rel=2e-6)
    assert obj.Proxy.elements(obj) == [ring(part.Shape)]
    assert len(computed) == 2
