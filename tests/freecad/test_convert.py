"""Files of results, and solids that depend on nothing."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from typing import Any

import FreeCAD as App
import Mesh
import Part
import pytest
from freecad.cad_implicit_wb import convert, making
from freecad.cad_implicit_wb.errors import WorkbenchError
from freecad_parts import rounded

pytestmark = pytest.mark.freecad

TILTED = App.Placement(App.Vector(3, -2, 7), App.Rotation(App.Vector(1, 2, 3), 33))
SIDES = (10.3, 20.1, 15.7)


def ball(document: Any) -> Any:
    obj = document.addObject("Part::Sphere", "Ball")
    obj.Radius = 10
    obj.Placement = TILTED
    document.recompute()
    return obj


def rounded_block(document: Any) -> Any:
    """A round of a block of triangles."""
    source = document.addObject("Mesh::Feature", "Block")
    source.Mesh = Mesh.Mesh(Part.makeBox(*SIDES).tessellate(0.1))
    source.Placement = TILTED
    obj = making.make(document, "round", source, result="Mesh", Radius=2.0, Spacing=0.6)
    document.recompute()
    assert obj.isValid()
    return obj


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply"])
def test_triangles_of_solids_are_within_the_tolerance(document: Any, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"ball{suffix}"
    for tolerance in (0.1, 0.01):
        convert.export(ball(document), path, tolerance)
        mesh = Mesh.Mesh(str(path))
        exact = 4 / 3 * math.pi * 1000
        assert exact - 4 * math.pi * 100 * tolerance < mesh.Volume < exact
        assert mesh.BoundBox.Center.distanceToPoint(TILTED.Base) < 2 * tolerance
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_meshes_are_written_in_their_place(document: Any, tmp_path: Path) -> None:
    obj = rounded_block(document)
    for suffix in (".stl", ".obj", ".ply"):
        convert.export(obj, tmp_path / f"block{suffix}")
        mesh = Mesh.Mesh(str(tmp_path / f"block{suffix}"))
        assert mesh.Volume == pytest.approx(obj.Mesh.Volume, rel=5e-5)
        assert mesh.BoundBox.Center.distanceToPoint(TILTED.multVec(App.Vector(*SIDES) / 2)) < 0.01
    convert.export(obj, tmp_path / "block.3mf")
    with zipfile.ZipFile(tmp_path / "block.3mf") as archive:
        model = archive.read("3D/3dmodel.model").decode()
    assert 'unit="millimeter"' in model
    assert model.count("<triangle ") == obj.Mesh.CountFacets


@pytest.mark.parametrize("suffix", [".step", ".brep"])
def test_solids_are_written_exactly(document: Any, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"ball{suffix}"
    convert.export(ball(document), path)
    shape = Part.read(str(path))
    assert shape.Volume == pytest.approx(4 / 3 * math.pi * 1000, rel=1e-9)
    assert shape.Solids[0].CenterOfMass.isEqual(TILTED.Base, 1e-6)


def test_a_solid_of_a_mesh_depends_on_nothing(document: Any, tmp_path: Path) -> None:
    obj = rounded_block(document)
    cost = convert.cost(obj)
    assert cost.faces == obj.Mesh.CountFacets
    assert cost.seconds > 0
    assert cost.bytes > 1000 * cost.faces
    solid = convert.to_solid(obj)
    assert solid.Shape.ShapeType == "Solid"
    assert solid.Shape.isValid()
    assert solid.OutList == []
    assert solid.Shape.Volume == pytest.approx(obj.Mesh.Volume, rel=1e-5)
    assert 0.99 * rounded(SIDES, 2.0) < solid.Shape.Volume < rounded(SIDES, 2.0)
    assert len(solid.Shape.Faces) < cost.faces
    assert solid.Shape.CenterOfMass.isEqual(TILTED.multVec(App.Vector(*SIDES) / 2), 1e-2)
    convert.export(obj, tmp_path / "block.step")
    assert Part.read(str(tmp_path / "block.step")).Volume == pytest.approx(solid.Shape.Volume, rel=1e-6)


def test_what_cannot_be_written_is_told(document: Any, tmp_path: Path) -> None:
    obj = ball(document)
    with pytest.raises(WorkbenchError, match=r"files .txt are not known; use .stl"):
        convert.export(obj, tmp_path / "ball.txt")
    with pytest.raises(WorkbenchError, match="there is no folder"):
        convert.export(obj, tmp_path / "nowhere" / "ball.stl")
    empty = document.addObject("Part::Feature", "Empty")
    with pytest.raises(WorkbenchError, match="Empty has no shape"):
        convert.export(empty, tmp_path / "empty.step")
    assert not list(tmp_path.iterdir())
