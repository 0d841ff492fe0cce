"""Features of meshes in a document: recompute, nesting, moving, copies, files, errors."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import FreeCAD as App
import Mesh
import numpy as np
import Part
import pytest
from freecad.cad_implicit_wb import feature, making, sources
from freecad_parts import mesh_volume, rounded, same_place

pytestmark = pytest.mark.freecad

SIDES = (10.3, 20.1, 15.7)
TILTED = App.Placement(App.Vector(3, -2, 7), App.Rotation(App.Vector(1, 2, 3), 33))


def block(document: Any) -> Any:
    """A block of triangles, moved and turned."""
    obj = document.addObject("Mesh::Feature", "Block")
    obj.Mesh = Mesh.Mesh(Part.makeBox(*SIDES).tessellate(0.1))
    obj.Placement = TILTED
    return obj


def test_arrays_and_meshes_go_both_ways() -> None:
    points, facets = Part.makeTorus(10, 3).tessellate(0.05)
    vertices = np.array([tuple(p) for p in points])
    mesh = sources.mesh_of(vertices, np.array(facets))
    assert mesh.CountFacets == len(facets)
    assert mesh.Volume == pytest.approx(2 * math.pi**2 * 10 * 9, rel=0.02)
    assert not mesh.hasNonManifolds()


def test_a_round_of_a_mesh_is_computed_once_and_lies_on_its_source(document: Any, computed: list[Any]) -> None:
    source = block(document)
    obj = making.make(document, "round", source, result="Mesh", Radius=2.0)
    assert obj.Stale
    assert not computed
    document.recompute()
    assert obj.isValid()
    assert 0.999 * rounded(SIDES, 2.0) < mesh_volume(obj.Mesh) < rounded(SIDES, 2.0)
    assert same_place(obj, TILTED)
    assert obj.Mesh.BoundBox.Center.distanceToPoint(source.Mesh.BoundBox.Center) < 1e-3
    assert not obj.Stale
    assert 0 < obj.ErrorBound.Value < 0.1
    assert obj.EngineUsed == "exact distance"
    assert len(computed) == 1

    source.Placement = App.Placement()
    document.recompute()
    assert obj.Placement.isIdentity()
    assert obj.Mesh.BoundBox.Center.distanceToPoint(App.Vector(*SIDES) / 2) < 1e-3
    assert len(computed) == 1  # moving is not computing

    obj.Radius = 3.0
    assert obj.Stale
    document.recompute()
    assert 0.998 * rounded(SIDES, 3.0) < mesh_volume(obj.Mesh) < rounded(SIDES, 3.0)
    assert len(computed) == 2


def test_features_nest(document: Any) -> None:
    grown = making.make(document, "offset", block(document), result="Mesh", Distance=1.5)
    hollow = making.make(document, "shell", grown, result="Mesh", Thickness=1.5)
    document.recompute()
    assert hollow.isValid()
    a, b, c = SIDES
    outer = rounded((a + 3, b + 3, c + 3), 1.5)
    assert mesh_volume(grown.Mesh) == pytest.approx(outer, rel=1e-3)
    assert mesh_volume(hollow.Mesh) == pytest.approx(outer - a * b * c, rel=3e-3)


def test_a_boolean_of_meshes_respects_both_places(document: Any) -> None:
    first = block(document)
    second = document.addObject("Mesh::Feature", "Tool")
    second.Mesh = Mesh.Mesh(Part.makeBox(5, 5, 50).tessellate(0.1))
    second.Placement = TILTED.multiply(App.Placement(App.Vector(2, 3, -10), App.Rotation()))
    made = {
        kind: making.make(document, "boolean", first, tool=second, result="Mesh", Kind=kind)
        for kind in ("union", "difference", "intersection")
    }
    document.recompute()
    whole, common = math.prod(SIDES), 25 * SIDES[2]
    assert mesh_volume(made["union"].Mesh) == pytest.approx(whole + 25 * 50 - common, rel=1e-4)
    assert mesh_volume(made["difference"].Mesh) == pytest.approx(whole - common, rel=1e-4)
    assert mesh_volume(made["intersection"].Mesh) == pytest.approx(common, rel=1e-4)
    assert same_place(made["difference"], TILTED)


def test_loading_computes_nothing_and_copies_live(document: Any, computed: list[Any], tmp_path: Path) -> None:
    obj = making.make(document, "round", block(document), result="Mesh", Radius=2.0)
    document.recompute()
    volume = mesh_volume(obj.Mesh)
    path = str(tmp_path / "round.FCStd")
    document.saveAs(path)
    App.closeDocument(document.Name)
    computed.clear()

    opened = App.openDocument(path)
    obj = opened.Round
    assert mesh_volume(obj.Mesh) == pytest.approx(volume, rel=1e-6)
    assert not obj.Stale
    opened.recompute(None, True)  # every object, changed or not
    assert obj.isValid()
    assert not computed

    copy = opened.copyObject(obj, False)
    copy.Radius = 3.0
    opened.recompute()
    assert 0.998 * rounded(SIDES, 3.0) < mesh_volume(copy.Mesh) < rounded(SIDES, 3.0)
    assert mesh_volume(obj.Mesh) == pytest.approx(volume, rel=1e-6)
    assert len(computed) == 1


def test_staleness_is_stored(document: Any, tmp_path: Path) -> None:
    obj = making.make(document, "round", block(document), result="Mesh", Radius=2.0)
    document.recompute()
    obj.Radius = 2.5
    path = str(tmp_path / "stale.FCStd")
    document.saveAs(path)
    App.closeDocument(document.Name)
    assert App.openDocument(path).Round.Stale


def test_errors_mark_the_feature_and_leave_the_rest(document: Any) -> None:
    source = block(document)
    obj = making.make(document, "round", source, result="Mesh", Radius=2.0)
    after = making.make(document, "offset", obj, result="Mesh", Distance=0.5)
    document.recompute()
    volume = mesh_volume(obj.Mesh)
    obj.Radius = 8.0
    document.recompute()
    assert not obj.isValid()
    assert "at most 5.15 mm" in obj.getStatusString()
    assert mesh_volume(obj.Mesh) == volume
    assert obj.Stale
    obj.Radius = 1.0
    document.recompute()
    assert obj.isValid()
    assert after.isValid()
    assert 0.999 * rounded(SIDES, 1.0) < mesh_volume(obj.Mesh) < rounded(SIDES, 1.0)
    document.removeObject(source.Name)
    document.recompute()
    assert not obj.isValid()
    assert "no source" in obj.getStatusString()


def test_edges_of_meshes_are_refused(document: Any) -> None:
    source = block(document)
    obj = making.make(document, "fillet", source, result="Mesh")
    obj.Base = (source, ["Edge1"])
    document.recompute()
    assert not obj.isValid()
    assert "is a mesh" in obj.getStatusString()


def test_an_answer_that_is_there_is_taken(document: Any, computed: list[Any]) -> None:
    from freecad.cad_implicit_wb import client

    obj = making.make(document, "round", block(document), result="Mesh", Radius=2.0)
    request = obj.Proxy.request(obj)
    task = client.start(request)
    task.wait()
    feature.remember(request, task.result())
    document.recompute()
    assert obj.isValid()
    assert len(computed) == 1
    draft = obj.Proxy.request(obj, draft=True)
    assert draft.options["draft"]
    assert client.key(draft) != client.key(request)


def test_a_later_version_is_refused_and_left_untouched(document: Any, tmp_path: Path) -> None:
    obj = making.make(document, "round", block(document), result="Mesh", Radius=2.0)
    document.recompute()
    volume = mesh_volume(obj.Mesh)
    obj.SchemaVersion = feature.SCHEMA_VERSION + 1
    path = str(tmp_path / "later.FCStd")
    document.saveAs(path)
    App.closeDocument(document.Name)
    opened = App.openDocument(path)
    obj = opened.Round
    obj.Radius = 3.0
    opened.recompute()
    assert not obj.isValid()
    assert "later version" in obj.getStatusString()
    assert mesh_volume(obj.Mesh) == pytest.approx(volume, rel=1e-6)
    assert obj.SchemaVersion == feature.SCHEMA_VERSION + 1
    assert not obj.Stale


def test_a_link_to_a_mesh(document: Any) -> None:
    source = block(document)
    link = document.addObject("App::Link", "Link")
    link.LinkedObject, link.Placement = source, App.Placement(App.Vector(100, 0, 0), App.Rotation())
    obj = making.make(document, "offset", link, result="Mesh", Distance=1.0)
    document.recompute()
    assert obj.isValid(), obj.getStatusString()
    a, b, c = SIDES
    assert mesh_volume(obj.Mesh) == pytest.approx(rounded((a + 2, b + 2, c + 2), 1.0), rel=1e-3)
    assert obj.Mesh.BoundBox.Center.distanceToPoint(App.Vector(100, 0, 0) + App.Vector(a, b, c) / 2) < 0.01
    link.LinkTransform = True
    document.recompute()
    middle = App.Vector(100, 0, 0) + TILTED.multVec(App.Vector(a, b, c) / 2)
    assert obj.Mesh.BoundBox.Center.distanceToPoint(middle) < 0.01
