"""The task panel: Cancel, wrong values, deleted objects and documents, expressions, undo, files, recompute."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui
import Mesh
import pytest
from freecad.cad_implicit_wb import client, preferences
from freecad.cad_implicit_wb.qt import QtCore, QtWidgets, translate
from freecad.cad_implicit_wb.wording import label_of
from gui_window import Gaps, closed, panel, tell

SIDES = (20.3, 14.7, 9.1)


def block(document: Any, name: str = "Block", move: float = 0.0) -> Any:
    mesh = document.addObject("Mesh::Feature", name)
    mesh.Mesh = Mesh.createBox(*SIDES)
    mesh.Placement.Base = App.Vector(move, move / 2, move / 3)
    Gui.activeDocument().activeView().viewIsometric()
    Gui.SendMsgToActiveView("ViewFit")
    return mesh


def made(window: Any, document: Any, command: str, **values: float) -> Any:
    """Make a feature of what is selected, as a user does."""
    Gui.runCommand(f"Implicit_{command}")
    form = window.until(panel)
    form.preview.setChecked(False)
    for name, value in values.items():
        form.fields[name].widget.setProperty("rawValue", value)
    window.ok()
    window.until(closed)
    return document.getObject(command)


def offset_volume(d: float) -> float:
    """Volume of the block grown by a distance with sharp edges kept round: Steiner's formula."""
    a, b, c = SIDES
    pi = 3.141592653589793
    return a * b * c + 2 * d * (a * b + b * c + c * a) + pi * d**2 * (a + b + c) + 4 / 3 * pi * d**3


def test_cancel_takes_everything_back(window: Any, document: Any) -> None:
    mesh = block(document)
    window.select(mesh)
    undo = document.UndoCount
    Gui.runCommand("Implicit_Offset")
    window.until(panel)
    window.cancel()
    assert closed()
    assert [obj.Name for obj in document.Objects] == ["Block"]
    assert document.UndoCount == undo
    assert mesh.ViewObject.Visibility


def test_wrong_values_are_told_and_the_panel_stays(window: Any, document: Any) -> None:
    window.select(block(document))
    Gui.runCommand("Implicit_Round")
    form = window.until(panel)
    form.fields["Radius"].widget.setProperty("rawValue", 400.0)
    window.ok()
    box = window.until(lambda: window.find("cad_implicit_error"))
    window.shot("wrong_value", keep=False)
    assert "radius 400 mm is too large" in box.text().lower()
    assert "radius 400 mm is too large" in form.note.text().lower()
    box.close()
    form.fields["Radius"].widget.setProperty("rawValue", 1.0)
    assert form.note.text() == ""
    form.preview.setChecked(False)
    window.ok()
    window.until(closed)
    assert document.Round.isValid()


def test_expressions_and_units(window: Any, document: Any) -> None:
    mesh = block(document)
    mesh.addProperty("App::PropertyLength", "Wall")
    mesh.Wall = 2.5
    window.select(mesh)
    Gui.runCommand("Implicit_Offset")
    form = window.until(panel)
    form.preview.setChecked(False)
    box = form.fields["Distance"].widget
    box.lineEdit().setText("0.1 in")
    box.editingFinished.emit()
    window.until(lambda: document.Offset.Distance.Value == pytest.approx(2.54))
    document.Offset.setExpression("Distance", "Block.Wall / 2")
    window.ok()
    window.until(closed)
    assert document.Offset.Distance.Value == 1.25
    assert document.Offset.Mesh.Volume == pytest.approx(offset_volume(1.25), rel=2e-3)
    mesh.Wall = 3
    document.recompute()
    assert document.Offset.Mesh.Volume == pytest.approx(offset_volume(1.5), rel=2e-3)


def test_double_click_edits_and_undo_goes_back(window: Any, document: Any) -> None:
    window.select(block(document))
    obj = made(window, document, "Offset", Distance=1.1)
    assert Gui.activeDocument().getInEdit() is None
    assert obj.ViewObject.Proxy.doubleClicked(obj.ViewObject)
    form = window.until(panel)
    assert form.fields["Distance"].value == 1.1
    form.fields["Distance"].widget.setProperty("rawValue", 0.7)
    window.ok()
    window.until(closed)
    assert obj.Mesh.Volume == pytest.approx(offset_volume(0.7), rel=2e-3)
    document.undo()
    assert obj.Distance.Value == 1.1
    assert obj.Mesh.Volume == pytest.approx(offset_volume(1.1), rel=2e-3)
    obj.ViewObject.Proxy.doubleClicked(obj.ViewObject)
    window.until(panel).fields["Distance"].widget.setProperty("rawValue", 3.0)
    window.cancel()
    assert obj.Distance.Value == 1.1


def test_recompute_leaves_the_window_alive(window: Any, document: Any) -> None:
    mesh = block(document)
    window.select(mesh)
    obj = made(window, document, "Offset", Distance=1.0, Spacing=0.08)
    mesh.Mesh = Mesh.createBox(SIDES[0] + 3, *SIDES[1:])
    mesh.touch()  # FreeCAD itself takes a new mesh for no change
    seen = []

    def look() -> None:
        dialog = window.find("cad_implicit_waiting")
        if dialog is not None and not seen:
            seen.append(dialog.progress.stage.text())
            window.shot("recompute", keep=False)
            gaps.forgive()

    timer = QtCore.QTimer()
    timer.timeout.connect(look)
    timer.start(50)
    with Gaps("mesh: recompute of a changed source") as gaps:
        document.recompute()
    timer.stop()
    assert obj.isValid()
    assert not obj.Stale
    assert obj.Mesh.BoundBox.XLength == pytest.approx(SIDES[0] + 5, abs=0.01)
    if obj.Seconds > 1:
        assert seen


def test_recompute_that_is_cancelled_marks_the_feature(window: Any, document: Any) -> None:
    mesh = block(document)
    window.select(mesh)
    obj = made(window, document, "Offset", Distance=1.0)
    volume = obj.Mesh.Volume
    obj.Spacing = 0.02
    timer = QtCore.QTimer()

    def look() -> None:
        dialog = window.find("cad_implicit_waiting")
        if dialog is not None:
            dialog.reject()

    timer.timeout.connect(look)
    timer.start(50)
    document.recompute()
    timer.stop()
    assert not obj.isValid()
    assert obj.Stale
    assert obj.ViewObject.Proxy.getIcon().endswith("_stale.svg")
    assert obj.Mesh.Volume == volume
    obj.Spacing = 0
    document.recompute()
    assert obj.isValid()
    assert obj.ViewObject.Proxy.getIcon().endswith("implicit_offset.svg")


@pytest.mark.parametrize("what", ["object", "source", "document"])
def test_deleted_while_computing(window: Any, document: Any, what: str) -> None:
    window.select(block(document))
    Gui.runCommand("Implicit_Round")
    form = window.until(panel)
    form.preview.setChecked(False)
    form.fields["Spacing"].widget.setProperty("rawValue", 0.04)
    window.ok()
    task = window.until(window.task)
    window.pump(0.5)
    if what == "document":
        App.closeDocument(document.Name)
    else:
        document.removeObject("Round" if what == "object" else "Block")
    window.until(lambda: task.poll() or task.done, 30)
    with pytest.raises(client.WorkbenchError):
        task.result()
    window.until(closed, 5)


def test_save_and_reopen(window: Any, document: Any, tmp_path: Path) -> None:
    window.select(block(document))
    made(window, document, "Offset", Distance=1.3)
    path = str(tmp_path / "offset.FCStd")
    document.saveAs(path)
    App.closeDocument(document.Name)
    opened = App.openDocument(path)
    obj = opened.Offset
    assert obj.Mesh.Volume == pytest.approx(offset_volume(1.3), rel=2e-3)
    assert "Touched" not in obj.State
    assert not obj.Stale
    assert obj.ViewObject.Proxy.claimChildren() == [opened.Block]
    Gui.ActiveDocument = Gui.getDocument(opened.Name)
    obj.ViewObject.Proxy.doubleClicked(obj.ViewObject)
    form = window.until(panel)
    assert form.fields["Distance"].value == 1.3
    window.cancel()


def test_boolean_of_two_meshes(window: Any, document: Any) -> None:
    first, second = block(document), block(document, "Other", 4.0)
    window.select(first)
    Gui.Selection.addSelection(second)
    obj = made(window, document, "Boolean")
    assert obj.isValid()
    common = (SIDES[0] - 4) * (SIDES[1] - 2) * (SIDES[2] - 4 / 3)
    exact = 2 * SIDES[0] * SIDES[1] * SIDES[2] - common
    assert obj.Mesh.Volume == pytest.approx(exact, rel=2e-3)
    assert obj.ViewObject.Proxy.claimChildren() == [first, second]
    assert not first.ViewObject.Visibility
    assert not second.ViewObject.Visibility


def test_first_use_says_that_it_compiles(window: Any, document: Any, tmp_path: Path, monkeypatch: Any) -> None:
    client.shutdown()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    window.select(block(document))
    try:
        with Gaps("first use: starting, compiling"):
            Gui.runCommand("Implicit_Round")
            form = window.until(panel)
            window.until(lambda: "compiling" in form.progress.stage.text())
            window.pump(5)
        assert form.progress.bar.maximum() == 0  # moves, as nobody knows how long it takes
        window.shot("compiling", keep=False)
        task = window.task()
        start = time.perf_counter()
        window.cancel()
        window.until(lambda: task.poll() or task.done, 30)
        tell(f"cancel while compiling: stopped after {(time.perf_counter() - start) * 1000:.0f} ms")
    finally:
        client.shutdown()


def test_limits_of_the_preferences_reach_the_computation(window: Any, document: Any) -> None:
    group = App.ParamGet(preferences.GROUP)
    window.select(block(document))
    try:
        group.SetInt("Threads", 1)
        group.SetFloat("MemoryLimit", 0.001)
        Gui.runCommand("Implicit_Round")
        form = window.until(panel)
        request = document.Round.Proxy.request(document.Round)
        assert request.options["threads"] == 1
        form.fields["Spacing"].widget.setProperty("rawValue", 0.1)
        window.ok()
        box = window.until(lambda: window.find("cad_implicit_error"))
        assert "GiB" in box.text()
        window.cancel()
    finally:
        group.RemInt("Threads")
        group.RemFloat("MemoryLimit")


@pytest.mark.parametrize("language", ["German", "French"])
def test_panel_in_other_languages_fits_the_dock(window: Any, document: Any, language: str) -> None:
    try:
        Gui.setLocale(language)
        assert translate("Fillet") == {"German": "Hohlkehle", "French": "Congé"}[language]
        window.select(block(document))
        Gui.runCommand("Implicit_Shell")
        form = window.until(panel)
        form.arrow.setChecked(True)
        window.pump(0.5)
        window.shot(f"panel_{language}", keep=False)
        assert label_of("Thickness") == {"German": "Wandstärke", "French": "Épaisseur"}[language]
        assert form.minimumSizeHint().width() <= 266
        window.cancel()
    finally:
        Gui.setLocale("English")


def test_loads_from_mod_and_stays_when_disabled(tmp_path: Path) -> None:
    """The repository linked into ``Mod``, in a FreeCAD of its own."""
    root = Path(os.environ["CAD_IMPLICIT_ROOT"])
    (tmp_path / "Mod").mkdir()
    (tmp_path / "Mod" / "cad_implicit").symlink_to(root)
    script = tmp_path / "say.py"
    script.write_text(
        "import os, sys\nfrom PySide import QtCore\nimport FreeCADGui as Gui\n"
        "def go():\n"
        "    try:\n"
        "        import cad_implicit\n"
        "        said = 'ImplicitWorkbench' in Gui.listWorkbenches()\n"
        "        print('SAID', said, cad_implicit.__file__, file=sys.__stdout__)\n"
        "    finally:\n"
        "        sys.__stdout__.flush()\n        os._exit(0)\n"
        "QtCore.QTimer.singleShot(0, go)\n"
    )
    environment = {**os.environ, "FREECAD_USER_HOME": str(tmp_path)}
    said = subprocess.run(
        ["freecad", str(script)], env=environment, capture_output=True, text=True, timeout=120, check=False
    ).stdout
    assert "SAID True" in said
    assert str(tmp_path / "Mod") in said or str(root) in said


def test_no_widget_is_left_behind(window: Any, document: Any) -> None:
    window.select(block(document))
    nodes = Gui.activeDocument().activeView().getSceneGraph().getNumChildren()
    for _ in range(3):
        Gui.runCommand("Implicit_Offset")
        window.until(panel)
        window.cancel()
        window.select(document.Block)
    assert Gui.activeDocument().activeView().getSceneGraph().getNumChildren() == nodes
    assert QtWidgets.QApplication.activeModalWidget() is None
