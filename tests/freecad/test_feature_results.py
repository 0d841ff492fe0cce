"""Kinds of features and results, other programs, cancelling and undoing: solids in a document."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import FreeCAD as App
import Part
import pytest
from freecad.cad_implicit_wb import child, client, feature, making
from freecad_parts import bossed, box, exact_fillet, made, mesh_volume, ring, rounded, same_place, upright

pytestmark = pytest.mark.freecad

ROOT = Path(__file__).parents[2]
TILTED = App.Placement(App.Vector(3, -2, 7), App.Rotation(App.Vector(1, 2, 3), 33))


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
    assert 0.999 * rounded((23, 18, 13), 1.5) < mesh_volume(grown.Mesh) < rounded((23, 18, 13), 1.5)
    light = made(document, "infill", plate, Cell=5.0, Wall=0.6, Skin=1.0, Kind="gyroid", result="Mesh")
    skin = 3000 - 18 * 13 * 8
    # the mean area of a gyroid is 3.09 per cell, so walls take about that share
    assert mesh_volume(light.Mesh) == pytest.approx(skin + 18 * 13 * 8 * 3.09 * 0.6 / 5.0, rel=0.08)
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
    assert mesh_volume(mesh.Mesh) == pytest.approx(truth, rel=1e-3)
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
    assert mesh_volume(blended.Mesh) == pytest.approx(volume + 2 * math.pi * centroid * area, rel=3e-4)


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
        assert mesh_volume(mesh.Mesh) == pytest.approx(3000 - 18 * 13 * 8, rel=1e-3)
        grid = made(document, "offset", plate, Distance=1.0, Spacing=0.5, Engine="reinit", result="Mesh")
        off = abs(mesh_volume(grid.Mesh) - rounded((22, 17, 12), 1.0))
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
