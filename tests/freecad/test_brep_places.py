"""Records of a shape whose parts are placed within each other, several times over: products of places."""

from __future__ import annotations

from typing import Any

import pytest

pytestmark = pytest.mark.freecad


@pytest.mark.parametrize("kind", ["Part::Fuse", "Part::MultiFuse"])
def test_vertices_are_the_same_by_whatever_way_they_are_placed(document: Any, kind: str) -> None:
    import FreeCAD as App
    import Part

    from cad_implicit.cad.brep_text import parsed
    from cad_implicit.cad.freecad_original import Numbers

    box = document.addObject("Part::Box")
    box.Length, box.Width, box.Height = 41.3, 33.7, 12.9
    cylinder = document.addObject("Part::Cylinder")
    cylinder.Radius, cylinder.Height = 8.1, 27.3
    cylinder.Placement.Base = App.Vector(19.7, 16.3, 0)
    part = document.addObject(kind)
    if kind == "Part::Fuse":
        part.Base, part.Tool = box, cylinder
    else:
        part.Shapes = [box, cylinder]
    part.Placement = App.Placement(App.Vector(3, -2, 5), App.Rotation(App.Vector(1, 2, 3), 33))
    part.Refine = False
    document.recompute()
    numbers = Numbers(part.Shape)
    assert (len(numbers.faces), len(numbers.edges), len(numbers.vertices)) == (9, 16, 11)
    brep = parsed(part.Shape.exportBrepToString())
    again = Part.Shape()
    again.importBrepFromString(brep.text())
    assert again.isValid()
    assert again.Volume == pytest.approx(part.Shape.Volume, rel=1e-12)
    assert again.CenterOfGravity.isEqual(part.Shape.CenterOfGravity, 1e-9)
