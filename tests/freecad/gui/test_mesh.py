"""Meshes in the window: rounded, with a preview; the error in colours; made a solid; cancelled."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui
import Mesh
import numpy as np
import Part
import pytest
from freecad.cad_implicit_wb import exporting
from freecad.cad_implicit_wb.qt import QtWidgets
from gui_window import Gaps, closed, panel, tell

SIDES = (30.7, 20.3, 11.9)
TURN = App.Placement(App.Vector(4, -3, 2), App.Rotation(App.Vector(1, 2, 3), 41))


def block(document: Any) -> Any:
    mesh = document.addObject("Mesh::Feature", "Block")
    mesh.Mesh = Mesh.createBox(*SIDES)
    mesh.Placement = TURN
    Gui.activeDocument().activeView().viewIsometric()
    Gui.SendMsgToActiveView("ViewFit")
    return mesh


def rounded_volume(r: float) -> float:
    """Volume of a block opened by a ball: that of the smaller block, its offset faces, edges and corners."""
    a, b, c = (side - 2 * r for side in SIDES)
    return a * b * c + 2 * r * (a * b + b * c + c * a) + math.pi * r**2 * (a + b + c) + 4 / 3 * math.pi * r**3


def distance_to_rounded(points: np.ndarray, r: float) -> np.ndarray:
    """Distance of points from a rounded block about the origin."""
    q = np.abs(points) - (np.array(SIDES) / 2 - r)
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - r


def test_round_of_a_mesh(window: Any, document: Any) -> None:
    mesh = block(document)
    window.select(mesh)
    with Gaps("mesh: panel, preview, result"):
        Gui.runCommand("Implicit_Round")
        form = window.until(panel)
        form.fields["Radius"].widget.setProperty("rawValue", 1.7)
        window.until(lambda: form.progress.isVisible())
        window.until(lambda: not form.progress.isVisible())
        assert form.elements is None
        assert "cells" in form.estimate.text()
    window.shot("preview", keep=False)
    window.ok()
    window.until(closed)
    result = document.Round
    assert result.isValid()
    assert not mesh.ViewObject.Visibility
    vertices, faces = result.Mesh.Topology
    points = np.array([tuple(TURN.inverse().multVec(App.Vector(*p))) for p in vertices])
    centre = (points.max(axis=0) + points.min(axis=0)) / 2
    assert np.abs(distance_to_rounded(points - centre, 1.7)).max() <= result.ErrorBound.Value
    # Not FreeCAD's own figure: that is added up in single precision.
    volume = np.linalg.det(points[np.array(faces)]).sum() / 6
    assert 0.998 * rounded_volume(1.7) < volume < rounded_volume(1.7)
    document.undo()
    assert [obj.Name for obj in document.Objects] == ["Block"]
    document.redo()
    assert document.Round.Mesh.Volume == pytest.approx(result.Mesh.Volume)


def test_error_in_colours(window: Any, document: Any) -> None:
    mesh = block(document)
    window.select(mesh)
    Gui.runCommand("Implicit_Offset")
    window.until(panel)
    window.ok()
    window.until(closed)
    obj = document.Offset
    provider = obj.ViewObject.Proxy
    provider.colours.toggle()
    bar = window.until(lambda: window.main.findChild(QtWidgets.QWidget, "cad_implicit_colour_bar"))
    window.shot("offset_error", keep=False)
    assert 0 < bar.largest <= obj.ErrorBound.Value
    assert not obj.ViewObject.Visibility
    provider.colours.toggle()
    assert obj.ViewObject.Visibility
    assert not bar.isVisible()


def test_cancel_of_a_long_computation(window: Any, document: Any) -> None:
    mesh = block(document)
    window.select(mesh)
    Gui.runCommand("Implicit_Round")
    form = window.until(panel)
    form.preview.setChecked(False)
    form.fields["Radius"].widget.setProperty("rawValue", 2.3)
    form.fields["Spacing"].widget.setProperty("rawValue", 0.04)
    window.ok()
    task = window.until(lambda: form.progress.isVisible() and window.task())
    with Gaps("mesh: a long computation"):
        window.pump(4)
    window.shot("computing", keep=False)
    assert not task.done
    start = time.perf_counter()
    window.cancel()
    assert closed()
    window.until(lambda: task.poll() or task.done, 30)
    tell(f"cancel: stopped after {(time.perf_counter() - start) * 1000:.0f} ms")
    assert [obj.Name for obj in document.Objects] == ["Block"]
    assert mesh.ViewObject.Visibility


def test_convert_to_solid(window: Any, document: Any, tmp_path: Path) -> None:
    """A feature whose result is a mesh gives a solid from now on; a plain mesh, a solid beside it; both are written."""
    mesh = block(document)
    window.select(mesh)
    Gui.runCommand("Implicit_Offset")
    window.until(panel).preview.setChecked(False)
    window.ok()
    window.until(closed)
    window.select(document.Offset)
    Gui.runCommand("Implicit_ToSolid")
    solid = next(obj for obj in document.Objects if obj.isDerivedFrom("Part::FeaturePython"))
    assert solid.Label == "Offset"
    assert solid.Shape.isValid()
    assert solid.Shape.Volume == pytest.approx(grown(1.0), rel=3e-3)
    exporting.export(solid, tmp_path / "a.step")
    assert Part.read(str(tmp_path / "a.step")).Volume == pytest.approx(solid.Shape.Volume, rel=1e-6)
    window.select(mesh)
    Gui.runCommand("Implicit_ToSolid")
    plain = document.getObject("Block_solid")
    assert plain.Shape.Volume == pytest.approx(math.prod(SIDES), rel=1e-6)
    assert len(plain.Shape.Faces) == 6
    assert not mesh.ViewObject.Visibility
    exporting.export(plain, tmp_path / "b.stl")
    assert Mesh.Mesh(str(tmp_path / "b.stl")).Volume == pytest.approx(math.prod(SIDES), rel=1e-5)


def grown(d: float) -> float:
    """Volume of the block grown by a distance, edges round: Steiner's formula."""
    a, b, c = SIDES
    return a * b * c + 2 * d * (a * b + b * c + c * a) + math.pi * d**2 * (a + b + c) + 4 / 3 * math.pi * d**3
