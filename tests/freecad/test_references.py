"""Chosen edges and faces, found again after a recompute or told to be lost; never another one."""

from __future__ import annotations

from typing import Any

import FreeCAD as App
import Part
import pytest
from freecad.cad_implicit_wb import references
from freecad.cad_implicit_wb.errors import BrokenReferenceError
from freecad.cad_implicit_wb.references import Element

pytestmark = pytest.mark.freecad

V = App.Vector


def boss(length: float = 30, x: float = 15, radius: float = 4) -> Any:
    """A box with a boss."""
    base = Part.makeBox(length, 20, 10)
    return base.fuse(Part.makeCylinder(radius, 25, V(x, 10, 0))).removeSplitter()


def drilled(shape: Any, x: float, y: float, radius: float = 2) -> Any:
    return shape.cut(Part.makeCylinder(radius, 100, V(x, y, -1)))


def names(shape: Any, kind: str = "Edge") -> list[str]:
    return [f"{kind}{n + 1}" for n in range(len(shape.Edges if kind == "Edge" else shape.Faces))]


def found(before: Any, after: Any, name: str) -> str | None:
    """Name that an element has in another shape; None if it is told to be lost. Goes through the stored text."""
    stored = Element.from_text(references.describe(before, [name])[0].to_text())
    try:
        return references.found([stored], after)[0]
    except BrokenReferenceError:
        return None


def element(shape: Any, name: str) -> Any:
    kind, number = references.split(name)
    return (shape.Edges if kind == "Edge" else shape.Faces)[number - 1]


def concave(shape: Any) -> str:
    """The circle where the boss stands on the box."""
    rings = [n for n, e in enumerate(shape.Edges) if e.isClosed() and abs(e.CenterOfMass.z - 10) < 1e-9]
    (ring,) = [n for n in rings if type(shape.Edges[n].Curve).__name__ == "Circle"]
    return f"Edge{ring + 1}"


def shuffled(shape: Any) -> Any:
    """The same solid with its faces, and so its edges, in another order."""
    faces = shape.Faces
    return Part.Solid(Part.Shell([*faces[3:], *faces[:3]][::-1]))


def test_numbers_stay_in_the_same_shape() -> None:
    for kind in ("Edge", "Face"):
        for name in names(boss(), kind):
            assert found(boss(), boss(), name) == name


def test_renumbered_edges_and_faces_are_found() -> None:
    before, after = boss(), shuffled(boss())
    assert after.isValid()
    moved = 0
    for kind in ("Edge", "Face"):
        for name in names(before, kind):
            now = found(before, after, name)
            assert now is not None, name
            moved += now != name
            assert element(after, now).CenterOfMass.isEqual(element(before, name).CenterOfMass, 1e-9)
    assert moved > 10


def test_a_hole_elsewhere_renumbers_and_all_edges_are_found() -> None:
    before, after = boss(), drilled(boss(), 4, 5)
    changed = 0
    for name in names(before):
        now = found(before, after, name)
        assert now is not None
        changed += now != name
        assert element(after, now).CenterOfMass.isEqual(element(before, name).CenterOfMass, 1e-9)
    assert changed
    for name in names(before, "Face"):  # the top's centre moved, for it has a hole now
        now = found(before, after, name)
        assert now is not None
        old, new = element(before, name), element(after, now)
        assert type(old.Surface) is type(new.Surface)
        assert old.CenterOfMass.distanceToPoint(new.CenterOfMass) < 2


def test_a_longer_box_moves_its_edges() -> None:
    before, after = boss(30), shuffled(boss(50))
    for name in names(before):
        now = found(before, after, name)
        assert now is not None, name
        old, new = element(before, name).CenterOfMass, element(after, now).CenterOfMass
        assert abs(new.y - old.y) < 1e-9
        assert abs(new.z - old.z) < 1e-9
        assert new.x == pytest.approx({0: 0, 15: new.x, 30: 50}.get(round(old.x), old.x))
    assert element(after, found(before, after, concave(before)) or "").CenterOfMass.isEqual(V(15, 10, 10), 1e-9)


def test_a_boss_that_moves_and_grows_takes_its_edge_along() -> None:
    after = boss(30, 12, 5)
    now = found(boss(), after, concave(boss()))
    assert now is not None
    assert element(after, now).CenterOfMass.isEqual(V(12, 10, 10), 1e-9)


def test_bends_are_known_in_any_order_of_faces() -> None:
    cup = boss().cut(Part.makeCylinder(2, 30, V(15, 10, 20)))
    for shape in (cup, shuffled(cup)):
        for name in names(shape):
            edge, told = element(shape, name), references.describe(shape, [name])[0].bend
            if type(edge.Curve).__name__ == "Line" and edge.Length in (15.0, 10.0, 5.0, 12.0):
                continue  # seams of cylinders, and edges of the box
            inner = edge.isClosed() and edge.CenterOfMass.isEqual(V(15, 10, 20), 1e-9)
            at_foot = edge.isClosed() and edge.CenterOfMass.isEqual(V(15, 10, 10), 1e-9)
            assert told == (-1 if inner or at_foot else 1), name


def test_an_edge_that_a_chamfer_removed_is_lost() -> None:
    box = Part.makeBox(10, 11, 12)
    for number in range(12):
        after = box.makeChamfer(1, [box.Edges[number]])
        for other, name in enumerate(names(box)):
            now = found(box, after, name)
            if other == number:
                assert now is None
                continue
            assert now is not None, name  # whole or shortened, on the same line
            old, new = element(box, name), element(after, now)
            assert old.Length - 2.0001 < new.Length <= old.Length + 1e-9
            assert old.distToShape(new)[0] < 1e-9
            assert old.tangentAt(0).cross(new.tangentAt(0)).Length < 1e-9


def test_an_edge_of_a_step_is_not_taken_for_its_twin() -> None:
    def steps(*heights: float) -> Any:
        solid = Part.makeBox(20, 10, 10)
        for n, height in enumerate(heights):
            solid = solid.cut(Part.makeBox(20, 10, 10, V(18 - n, 0, height)))
        return solid

    before = steps(8.0, 9.0)
    (name,) = (n for n in names(before) if element(before, n).CenterOfMass.isEqual(V(18, 5, 8), 1e-9))
    after = steps(7.9)  # the step at 8 is gone, another one is 0.1 mm away
    assert found(before, after, name) is None


def test_mirrored_twins_are_not_swapped() -> None:
    def two(a: float, b: float) -> Any:
        return drilled(drilled(Part.makeBox(60, 20, 5), a, 10), b, 10)

    def rim(shape: Any, x: float) -> str:
        (name,) = (n for n in names(shape) if element(shape, n).CenterOfMass.isEqual(V(x, 10, 5), 1e-9))
        return name

    before = two(20, 40)
    for old, new, now in ((20, 22, (22, 40)), (40, 38, (20, 38))):  # one moves a little: the same hole
        assert found(before, two(*now), rim(before, old)) == rim(two(*now), new)
    # the first hole moves to where the second was: neither is told for sure, so both are lost
    after = two(40, 55)
    assert found(before, after, rim(before, 20)) in (None, rim(after, 40))
    assert found(before, after, rim(before, 40)) is None
    # one of the two is gone: that one is lost, the other one stays
    alone = drilled(Part.makeBox(60, 20, 5), 40, 10)
    assert found(before, alone, rim(before, 20)) is None
    assert found(before, alone, rim(before, 40)) == rim(alone, 40)
    # both are gone, and one is somewhere else
    other = drilled(Part.makeBox(60, 20, 5), 30, 10)
    assert found(before, other, rim(before, 20)) is None


def test_an_edge_that_was_split_is_lost_and_one_that_was_shortened_is_found() -> None:
    box = Part.makeBox(40, 20, 10)
    (top,) = (n for n in names(box) if element(box, n).CenterOfMass.isEqual(V(20, 0, 10), 1e-9))
    slot = box.cut(Part.makeBox(4, 4, 4, V(18, 0, 8)))
    assert found(box, slot, top) is None
    notch = box.cut(Part.makeBox(4, 4, 4, V(36, 0, 8)))
    now = found(box, notch, top)
    assert now is not None
    assert element(notch, now).Length == pytest.approx(36)
    assert element(notch, now).CenterOfMass.isEqual(V(18, 0, 10), 1e-9)


def test_two_references_to_one_edge_are_lost_and_all_lost_ones_are_named() -> None:
    box = Part.makeBox(10, 11, 12)
    stored = references.describe(box, ["Edge1", "Edge1"])
    with pytest.raises(BrokenReferenceError, match=r"Edge1, Edge1 of Plate .* choose them again"):
        references.found(stored, box, "Plate")
    sphere = Part.makeSphere(3)
    with pytest.raises(BrokenReferenceError, match=r"Edge1, Edge2 of Plate"):
        references.found(references.describe(box, ["Edge1", "Edge2"]), sphere, "Plate")


def test_names_that_are_no_elements_are_refused() -> None:
    assert references.split("Body.Pad.?Edge12") == ("Edge", 12)
    with pytest.raises(BrokenReferenceError, match="Vertex1 is neither"):
        references.split("Vertex1")
    with pytest.raises(BrokenReferenceError, match="there is no Edge13"):
        references.describe(Part.makeBox(1, 1, 1), ["Edge1", "Edge13"])
