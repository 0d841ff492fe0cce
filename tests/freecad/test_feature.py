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
from freecad.cad_implicit_wb import child, client, feature, making, references
from freecad_parts import rounded, same_place

pytestmark = pytest.mark.freecad

ROOT = Path(__file__).parents[2]
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


def test_a_body_of_part_design(document: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path, str(Path(App.getResourceDir(), "Mod"))])  # where PartDesign is
    body = document.addObject("PartDesign::Body", "Body")
    pad = document.addObject("PartDesign::AdditiveBox", "Pad")
    body.addObject(pad)
    pad.Length, pad.Width, pad.Height = 20, 15, 10
    body.Placement = TILTED
    document.recompute()
    names = upright(pad.Shape)
    obj = made(document, "fillet", body, names, Radius=2.0)
    assert obj.getParentGeoFeatureGroup() is None
    assert obj.Shape.Volume == pytest.approx(3000 - 4 * (1 - math.pi / 4) * 4 * 10, rel=1e-6)
    assert same_place(obj, TILTED)
    pad.Length = 25
    document.recompute()
    assert obj.Shape.Volume == pytest.approx(3750 - 4 * (1 - math.pi / 4) * 4 * 10, rel=1e-6)


def test_links_and_boolean_operations_with_the_result(document: Any) -> None:
    plate = box(document, 20, 15, 10)
    link = document.addObject("App::Link", "Link")
    link.LinkedObject = plate
    link.Placement = TILTED
    document.recompute()
    obj = made(document, "fillet", link, upright(plate.Shape), Radius=2.0)
    volume = 3000 - 4 * (1 - math.pi / 4) * 4 * 10
    assert obj.Shape.Volume == pytest.approx(volume, rel=1e-6)
    assert obj.Shape.BoundBox.Center.distanceToPoint(TILTED.multVec(App.Vector(10, 7.5, 5))) < 1e-6
    drill = document.addObject("Part::Cylinder", "Drill")
    drill.Radius, drill.Height = 3, 40
    drill.Placement = TILTED.multiply(App.Placement(App.Vector(10, 7, -10), App.Rotation()))
    cut = document.addObject("Part::Cut", "Cut")
    cut.Base, cut.Tool = obj, drill
    document.recompute()
    assert cut.isValid()
    assert cut.Shape.isValid()
    assert cut.Shape.Volume == pytest.approx(volume - math.pi * 9 * 10, rel=1e-6)


def test_a_compound_of_two_solids(document: Any) -> None:
    both = document.addObject("Part::Feature", "Both")
    both.Shape = Part.makeCompound([Part.makeBox(10, 10, 10), Part.makeBox(5, 5, 5, App.Vector(20, 0, 0))])
    names = [
        f"Edge{n + 1}" for n, e in enumerate(both.Shape.Edges) if e.BoundBox.XMax < 1e-6 and e.BoundBox.YMax < 1e-6
    ]
    names += [
        f"Edge{n + 1}" for n, e in enumerate(both.Shape.Edges) if e.BoundBox.XMin > 24.9 and e.BoundBox.YMax < 1e-6
    ]
    assert len(names) == 2
    obj = making.make(document, "fillet", both, names, Radius=1.0)
    document.recompute()
    assert obj.isValid(), obj.getStatusString()
    assert len(obj.Shape.Solids) == 2
    assert obj.Shape.Volume == pytest.approx(1125 - (1 - math.pi / 4) * 15, rel=1e-6)


def test_offset_infill_and_smooth_of_a_box(document: Any) -> None:
    plate = box(document, 20, 15, 10)
    grown = made(document, "offset", plate, Distance=1.5, result="Mesh")
    assert 0.999 * rounded((23, 18, 13), 1.5) < grown.Mesh.Volume < rounded((23, 18, 13), 1.5)
    light = made(document, "infill", plate, Cell=5.0, Wall=0.6, Skin=1.0, Kind="gyroid", result="Mesh")
    skin = 3000 - 18 * 13 * 8
    # the mean area of a gyroid is 3.09 per cell, so walls take about that share
    assert light.Mesh.Volume == pytest.approx(skin + 18 * 13 * 8 * 3.09 * 0.6 / 5.0, rel=0.08)
    smooth = made(document, "smooth", plate, ["Face6"], Radius=1.0)
    exact = plate.Shape.makeFillet(1.0, plate.Shape.Faces[5].Edges)
    assert smooth.Shape.Volume == pytest.approx(exact.Volume, rel=1e-5)


def test_both_kinds_of_results_and_from_one_to_the_other(document: Any) -> None:
    part, _ = bossed(document)
    solid = made(document, "fillet", part, [ring(part.Shape)], Radius=2.0)
    after = made(document, "offset", solid, Distance=0.5, result="Mesh")
    truth = exact_fillet(part.Shape, [ring(part.Shape)], 2.0).Volume
    solid.Result = "Mesh"
    mesh = making.retyped(solid)
    document.recompute()
    assert mesh.isDerivedFrom("Mesh::Feature")
    assert mesh.isValid(), mesh.getStatusString()
    assert mesh.Mesh.isSolid()
    assert mesh.Mesh.Volume == pytest.approx(truth, rel=1e-3)
    assert after.Base[0] is mesh
    assert after.isValid(), after.getStatusString()
    mesh.Result = "Solid"
    again = making.retyped(mesh)
    document.recompute()
    assert again.Shape.Volume == pytest.approx(truth, rel=2e-6)
    assert making.retyped(again) is again


def test_freecads_own_kernel_first(document: Any) -> None:
    part, _ = bossed(document)
    obj = made(document, "fillet", part, [ring(part.Shape)], Radius=2.0, ExactFirst=True)
    assert obj.EngineUsed == "FreeCAD's own kernel"
    assert obj.Shape.Volume == pytest.approx(exact_fillet(part.Shape, [ring(part.Shape)], 2.0).Volume, rel=1e-9)
    cube = box(document, 10, 10, 10)
    obj = made(document, "fillet", cube, [f"Edge{n + 1}" for n in range(12)], Radius=5.0, ExactFirst=True)
    assert obj.EngineUsed == "exact distance"
    assert "FreeCAD's own kernel was asked first" in obj.Warnings[0]
    assert obj.Shape.Volume == pytest.approx(4 / 3 * math.pi * 125, rel=2e-4)


def test_a_boolean_of_solids_and_with_a_fillet(document: Any) -> None:
    plate = box(document, 20, 15, 5)
    pin = document.addObject("Part::Cylinder", "Pin")
    pin.Radius, pin.Height, pin.Placement.Base = 3, 12, App.Vector(10, 7, 0)
    plate.Placement = pin.Placement = TILTED
    pin.Placement = TILTED.multiply(App.Placement(App.Vector(10, 7, 0), App.Rotation()))
    document.recompute()
    volume = 20 * 15 * 5 + math.pi * 9 * 7
    exact = made(document, "boolean", plate, tool=pin, Kind="union", ExactFirst=True)
    assert exact.Shape.Volume == pytest.approx(volume, rel=1e-6)
    facets = made(document, "boolean", plate, tool=pin, Kind="union", Spacing=0.4)
    assert facets.Shape.Volume == pytest.approx(volume, rel=2e-3)
    blended = made(document, "boolean", plate, tool=pin, Kind="union", Radius=1.5, result="Mesh")
    # what is left of a square beside a quarter of a circle, turned around the pin
    area = (1 - math.pi / 4) * 1.5**2
    centroid = 3 + 1.5 * (5 / 6 - math.pi / 4) / (1 - math.pi / 4)
    assert blended.Mesh.Volume == pytest.approx(volume + 2 * math.pi * centroid * area, rel=3e-4)


def test_within_freecads_own_program(document: Any, tmp_path: Path) -> None:
    part, _ = bossed(document)
    truth = exact_fillet(part.Shape, [ring(part.Shape)], 2.0).Volume
    path, script = tmp_path / "boss.FCStd", tmp_path / "inside.py"
    document.saveAs(str(path))
    lines = (
        "import FreeCAD as App",
        "from freecad.cad_implicit_wb import making, client",
        f"document = App.openDocument({str(path)!r})",
        f"obj = making.make(document, 'fillet', document.Part, [{ring(part.Shape)!r}], Radius=2.0)",
        "document.recompute()",
        "print('volume', obj.isValid() and repr(obj.Shape.Volume), obj.getStatusString())",
        "client.shutdown()",
    )
    script.write_text("\n".join(lines))
    folders = [p for p in sys.path if p.endswith(("freecad_workbench", "site-packages", str(ROOT)))]
    command = ["freecadcmd", *(word for folder in folders for word in ("-P", folder)), str(script)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert float(done.stdout.split("volume ")[1].split()[0]) == pytest.approx(truth, rel=2e-6), done.stdout


def test_without_the_packages_that_the_addon_manager_does_not_know(
    document: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("manifold3d", "skimage"):
        (tmp_path / f"{name}.py").write_text("raise ImportError('not installed')")
    client.shutdown()
    folders = child.search_path()
    monkeypatch.setattr(child, "search_path", lambda: [str(tmp_path), *folders])
    try:
        plate = box(document, 20, 15, 10)
        local = made(document, "fillet", plate, upright(plate.Shape), Radius=2.0)
        assert local.Shape.Volume == pytest.approx(3000 - 4 * (1 - math.pi / 4) * 4 * 10, rel=1e-3)
        assert any("manifold3d is not installed" in note for note in local.Warnings)
        whole = made(document, "offset", plate, Distance=1.0, Spacing=0.5)
        assert 0.998 * rounded((22, 17, 12), 1.0) < whole.Shape.Volume < rounded((22, 17, 12), 1.0)
        mesh = made(document, "shell", plate, Thickness=1.0, result="Mesh")
        assert mesh.Mesh.Volume == pytest.approx(3000 - 18 * 13 * 8, rel=1e-3)
        grid = made(document, "offset", plate, Distance=1.0, Spacing=0.5, Engine="reinit", result="Mesh")
        off = abs(grid.Mesh.Volume - rounded((22, 17, 12), 1.0))
        assert off < grid.ErrorBound.Value * grid.Mesh.Area
    finally:
        client.shutdown()


def test_cancel_keeps_the_last_good_shape(document: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    plate = box(document, 20, 15, 10)
    obj = made(document, "fillet", plate, upright(plate.Shape), Radius=2.0)
    volume = obj.Shape.Volume
    labels = []

    def cancelled(task: client.Task, label: str) -> None:
        labels.append(label)
        task.cancel()

    monkeypatch.setattr(feature, "waiting", cancelled)
    obj.Radius = 3.0
    document.recompute()
    assert labels == [obj.Label]
    assert not obj.isValid()
    assert "cancelled" in obj.getStatusString()
    assert obj.Shape.Volume == volume
    assert obj.Stale
    monkeypatch.setattr(feature, "waiting", None)
    document.recompute()
    assert obj.Shape.Volume == pytest.approx(3000 - 4 * (1 - math.pi / 4) * 9 * 10, rel=1e-6)


def test_a_part_group_places_source_and_result_together(document: Any) -> None:
    group = document.addObject("App::Part", "Group")
    plate = box(document, 20, 15, 10)
    group.addObject(plate)
    group.Placement = TILTED
    obj = made(document, "fillet", plate, upright(plate.Shape), Radius=2.0)
    assert obj.getParentGeoFeatureGroup() is group
    assert obj.Placement.isIdentity()
    assert obj.Shape.BoundBox.Center.isEqual(App.Vector(10, 7.5, 5), 1e-6)


def test_undo_and_redo_bring_shapes_back(document: Any, computed: list[Any]) -> None:
    document.UndoMode = 1
    plate = box(document, 20, 15, 10)
    document.openTransaction("Fillet")
    obj = made(document, "fillet", plate, upright(plate.Shape), Radius=2.0)
    document.commitTransaction()
    document.openTransaction("Edit")
    obj.Radius = 3.0
    obj.Proxy.set_elements(obj, upright(plate.Shape)[1:], {upright(plate.Shape)[1]: 3.0})
    obj.Proxy.set_elements(obj, upright(plate.Shape))
    document.recompute()
    document.commitTransaction()
    stored = obj.References
    volumes = [3000 - 4 * (1 - math.pi / 4) * r**2 * 10 for r in (2.0, 3.0)]
    assert obj.Shape.Volume == pytest.approx(volumes[1], rel=1e-6)
    document.undo()
    document.recompute()
    assert obj.Radius.Value == 2.0
    assert obj.References == stored
    assert obj.Shape.Volume == pytest.approx(volumes[0], rel=1e-6)
    document.redo()
    document.recompute()
    assert obj.Shape.Volume == pytest.approx(volumes[1], rel=1e-6)
    assert len(computed) == 2  # shapes came back with their properties
    document.undo()
    document.undo()
    assert [o.Name for o in document.Objects] == [plate.Name]


def test_base_can_be_set_by_hand(document: Any) -> None:
    plate = box(document, 20, 15, 10)
    first, second, third, _ = upright(plate.Shape)
    obj = made(document, "fillet", plate, [first, second], Radius=2.0, own_radii={second: 1.0})
    one = (1 - math.pi / 4) * 10
    assert obj.Shape.Volume == pytest.approx(3000 - 5 * one, rel=1e-6)
    obj.Base = (plate, [second, third])
    document.recompute()
    assert obj.isValid(), obj.getStatusString()
    assert obj.Proxy.own_radii(obj) == {second: 1.0}
    assert obj.Shape.Volume == pytest.approx(3000 - 5 * one, rel=1e-6)
    x = [plate.Shape.Edges[int(name[4:]) - 1].CenterOfMass.x for name in (first, third)]
    y = [plate.Shape.Edges[int(name[4:]) - 1].CenterOfMass.y for name in (first, third)]
    for n, gone in ((0, False), (1, True)):  # the sharp corner is there again, and the other one is rounded
        corner = Part.Vertex(x[n], y[n], 5)
        assert (obj.Shape.distToShape(corner)[0] > 0.5) == gone
    obj.Base = (plate, [])
    document.recompute()
    assert not obj.Proxy.elements(obj)


def test_a_preview_that_would_take_long_is_refused(document: Any) -> None:
    hall = box(document, 3000, 2000, 500)
    obj = making.make(document, "smooth", hall, Radius=1.0)
    with pytest.raises(client.WorkbenchError, match=r"no preview: .* it would take about \d+ s"):
        obj.Proxy.request(obj, draft=True)
    obj.Radius = 100.0
    task = client.start(obj.Proxy.request(obj, draft=True))
    task.wait()
    # what a ball of the radius does not reach: an eighth at each edge, more at the corners
    exact = rounded((3000, 2000, 500), 100.0)
    assert task.result().volume_after == pytest.approx(exact, rel=2e-3)
