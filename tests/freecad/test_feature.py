"""Features of solids in a document: against FreeCAD's own fillets and exact volumes, through all that documents do."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import FreeCAD as App
import Part
import pytest
from freecad.cad_implicit_wb import making
from freecad_parts import bossed, box, exact_fillet, made, ring, same_place, upright

pytestmark = pytest.mark.freecad

TILTED = App.Placement(App.Vector(3, -2, 7), App.Rotation(App.Vector(1, 2, 3), 33))


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


def test_a_hole_renumbers_and_the_fillet_stays_on_its_edge(document: Any) -> None:
    part, _ = bossed(document)
    drill = document.addObject("Part::Cylinder", "Drill")
    drill.Radius, drill.Height, drill.Placement.Base = 1.5, 60, App.Vector(100, 4, -1)
    cut = document.addObject("Part::Cut", "Cut")
    cut.Base, cut.Tool = part, drill
    document.recompute()
    names = [
        ring(cut.Shape),
        next(n for n in upright(cut.Shape) if cut.Shape.Edges[int(n[4:]) - 1].CenterOfMass.x > 29),
    ]
    obj = made(document, "fillet", cut, names, Radius=2.0, own_radii={names[1]: 1.0})
    before = obj.Shape.Volume
    drill.Placement.Base = App.Vector(25, 10, -1)
    document.recompute()
    assert obj.isValid(), obj.getStatusString()
    assert obj.Shape.Volume == pytest.approx(before - math.pi * 1.5**2 * 10, rel=1e-5)
    assert obj.Proxy.own_radii(obj) == {obj.Base[1][1]: 1.0}
    assert obj.Base[1][0] == ring(cut.Shape)


def test_an_edge_that_is_gone_is_an_error_that_names_it(document: Any) -> None:
    plate = box(document, 10, 11, 12)
    chamfer = document.addObject("Part::Chamfer", "Chamfer")
    chamfer.Base, chamfer.Edges = plate, [(12, 1.0, 1.0)]
    document.recompute()
    middle = plate.Shape.Edges[0].CenterOfMass
    (name,) = (f"Edge{n + 1}" for n, e in enumerate(chamfer.Shape.Edges) if e.CenterOfMass.isEqual(middle, 1e-6))
    obj = made(document, "fillet", chamfer, [name], Radius=0.5)
    length = plate.Shape.Edges[0].Length
    volume = 1320 - 0.5 * plate.Shape.Edges[11].Length - (1 - math.pi / 4) * 0.25 * length
    assert obj.Shape.Volume == pytest.approx(volume, rel=1e-6)
    chamfer.Edges = [(1, 1.0, 1.0)]
    document.recompute()
    assert chamfer.isValid()
    assert not obj.isValid()
    assert f"{name} of Chamfer cannot be told" in obj.getStatusString()
    assert obj.Shape.Volume == pytest.approx(volume, rel=1e-6)
    middle = plate.Shape.Edges[11].CenterOfMass
    (name,) = (f"Edge{n + 1}" for n, e in enumerate(chamfer.Shape.Edges) if e.CenterOfMass.isEqual(middle, 1e-6))
    obj.Proxy.set_elements(obj, [name])
    document.recompute()
    assert obj.isValid(), obj.getStatusString()
    volume = 1320 - 0.5 * length - (1 - math.pi / 4) * 0.25 * plate.Shape.Edges[11].Length
    assert obj.Shape.Volume == pytest.approx(volume, rel=1e-6)


def test_files_keep_the_shape_and_loading_computes_nothing(document: Any, computed: list[Any], tmp_path: Path) -> None:
    part, _ = bossed(document)
    obj = made(document, "fillet", part, [ring(part.Shape)], Radius=2.0)
    volume, name = obj.Shape.Volume, obj.Name
    path = tmp_path / "boss.FCStd"
    document.saveAs(str(path))
    App.closeDocument(document.Name)
    computed.clear()
    opened = App.openDocument(str(path))
    obj = opened.getObject(name)
    assert obj.Shape.Volume == pytest.approx(volume, rel=1e-9)
    assert not obj.Stale
    assert not computed
    opened.recompute(None, True)
    assert obj.isValid()
    assert not computed
    opened.Box.Length = 40
    opened.recompute()
    truth = exact_fillet(opened.Part.Shape, [ring(opened.Part.Shape)], 2.0)
    assert obj.Shape.Volume == pytest.approx(truth.Volume, rel=2e-6)

    # and where the add-on is not installed
    code = (
        "import sys; sys.path.append(sys.argv[2]); import FreeCAD as App\n"
        "d = App.openDocument(sys.argv[1]); o = d.getObject(sys.argv[3]); print('volume', repr(o.Shape.Volume))"
    )
    library = str(Path(Part.__file__).parent)
    command = [sys.executable, "-I", "-c", code, str(path), library, name]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ})
    assert float(done.stdout.split("volume ")[1]) == pytest.approx(volume, rel=1e-9)


def test_copies_live_on_their_own(document: Any) -> None:
    part, _ = bossed(document)
    obj = made(document, "fillet", part, [ring(part.Shape)], Radius=2.0)
    copy = document.copyObject(obj, False)
    copy.Radius = 1.0
    document.recompute()
    for one, radius in ((obj, 2.0), (copy, 1.0)):
        assert one.isValid()
        truth = exact_fillet(part.Shape, [ring(part.Shape)], radius)
        assert one.Shape.Volume == pytest.approx(truth.Volume, rel=2e-6)
    whole = document.copyObject(obj, True)  # with all that it depends on
    document.recompute()
    assert whole.Base[0] is not part
    assert whole.Shape.Volume == pytest.approx(obj.Shape.Volume, rel=1e-9)


def test_a_round_of_a_fillet_of_a_shell(document: Any, computed: list[Any]) -> None:
    plate = box(document, 30, 20, 12)
    top = next(f"Face{n + 1}" for n, f in enumerate(plate.Shape.Faces) if abs(f.CenterOfMass.z - 12) < 1e-9)
    shell = made(document, "shell", plate, [top], Thickness=2.0)
    assert shell.Shape.Volume == pytest.approx(30 * 20 * 12 - 26 * 16 * 10, rel=1e-5)

    def along(shape: Any, *, z: float | None = None, corner: tuple[float, float] | None = None) -> list[str]:
        names = upright(shape) if corner else [f"Edge{n + 1}" for n in range(len(shape.Edges))]
        edges = [(name, shape.Edges[int(name[4:]) - 1].BoundBox) for name in names]
        if corner:
            return [n for n, b in edges if abs(b.XMin - corner[0]) < 1e-6 and abs(b.YMin - corner[1]) < 1e-6]
        return [n for n, b in edges if abs(b.ZMin - z) < 1e-6 and abs(b.ZMax - z) < 1e-6]

    floor = along(shell.Shape, z=2.0)
    assert len(floor) == 4
    fillet = made(document, "fillet", shell, floor, Radius=1.5)
    hollow = Part.makeBox(30, 20, 12).cut(Part.makeBox(26, 16, 10, App.Vector(2, 2, 2)))
    exact = exact_fillet(hollow, along(hollow, z=2.0), 1.5)
    assert fillet.Shape.Volume == pytest.approx(exact.Volume, rel=1e-5)

    rounded_ = made(document, "round", fillet, along(fillet.Shape, corner=(0, 0)), Radius=3.0)
    assert rounded_.Shape.Volume == pytest.approx(exact.Volume - (1 - math.pi / 4) * 9 * 12, rel=1e-5)
    plate.Length = 35
    document.recompute()
    assert rounded_.isValid(), rounded_.getStatusString()
    assert len(computed) == 6
    assert rounded_.Shape.BoundBox.XMax == pytest.approx(35)


def test_a_radius_that_does_not_fit_is_told_with_the_largest(document: Any) -> None:
    plate = box(document, 30, 20, 10)
    hole = document.addObject("Part::Cut", "Blind")
    drill = document.addObject("Part::Cylinder", "Drill")
    drill.Radius, drill.Height, drill.Placement.Base = 3, 20, App.Vector(15, 10, 4)
    hole.Base, hole.Tool = plate, drill
    document.recompute()
    (floor,) = (
        f"Edge{n + 1}" for n, e in enumerate(hole.Shape.Edges) if e.isClosed() and abs(e.CenterOfMass.z - 4) < 1e-9
    )
    obj = making.make(document, "fillet", hole, [floor], Radius=4.0)
    document.recompute()
    assert not obj.isValid()
    assert floor[4:] in obj.getStatusString()
    assert "3 mm" in obj.getStatusString() or "2.9" in obj.getStatusString()
    obj.Radius = 2.5
    document.recompute()
    assert obj.isValid(), obj.getStatusString()
    assert obj.Shape.Volume == pytest.approx(exact_fillet(hole.Shape, [floor], 2.5).Volume, rel=1e-5)


@pytest.mark.parametrize(
    ("sides", "along_z", "radius", "volume"),
    [
        ((10, 10, 10), False, 5.0, 4 / 3 * math.pi * 125),
        ((50, 80, 10), True, 25.0, (50 * 30 + math.pi * 25**2) * 10),
    ],
    ids=["cube to sphere", "plate to stadium"],
)
def test_parts_that_freecads_fillet_refuses(
    document: Any, sides: tuple[float, ...], along_z: bool, radius: float, volume: float
) -> None:
    plate = box(document, *sides)
    names = upright(plate.Shape) if along_z else [f"Edge{n + 1}" for n in range(12)]
    assert refused(plate.Shape, names, radius)
    obj = made(document, "fillet", plate, names, Radius=radius)
    assert obj.Shape.Volume == pytest.approx(volume, rel=2e-4)


def refused(shape: Any, names: list[str], radius: float) -> bool:
    """Whether FreeCAD's own fillet fails."""
    try:
        result = exact_fillet(shape, names, radius)
    except Exception:
        return True
    return result.isNull() or not result.isValid() or not result.Solids or result.Volume <= 0


def test_the_solid_of_two_crossing_cylinders_that_freecads_fillet_refuses(document: Any) -> None:
    first = Part.makeCylinder(5, 40, App.Vector(0, 0, -20))
    second = Part.makeCylinder(5, 40, App.Vector(0, -20, 0), App.Vector(0, 1, 0))
    solid = document.addObject("Part::Feature", "Steinmetz")
    solid.Shape = first.common(second)
    assert solid.Shape.Volume == pytest.approx(16 / 3 * 125, rel=1e-6)
    names = [f"Edge{n + 1}" for n, e in enumerate(solid.Shape.Edges) if type(e.Curve).__name__ != "Line"]
    assert refused(solid.Shape, names, 1.0)
    obj = made(document, "round", solid, Radius=1.0)
    assert obj.Shape.Volume == pytest.approx(0.990 * 16 / 3 * 125, rel=3e-3)


def test_a_chamfer_of_a_rounded_cube_that_freecad_refuses(document: Any) -> None:
    cube = Part.makeBox(10, 10, 10)
    solid = document.addObject("Part::Feature", "Cube")
    solid.Shape = exact_fillet(cube, upright(cube), 1.0)
    names = [f"Edge{n + 1}" for n, e in enumerate(solid.Shape.Edges) if abs(e.BoundBox.ZMax) < 1e-6]
    assert len(names) == 8
    try:
        result = solid.Shape.makeChamfer(1.0, [solid.Shape.Edges[int(name[4:]) - 1] for name in names])
        assert not result.isValid()
    except Part.OCCError:
        pass
    obj = made(document, "chamfer", solid, names, Length=1.0)
    # what is cut off: a triangle of 1/2 mm² along the four sides of 8 mm, and four quarters of a ring around a cone
    removed = 0.5 * 4 * 8 + (math.pi - math.pi / 3)
    assert obj.Shape.Volume == pytest.approx(solid.Shape.Volume - removed, rel=2e-4)
