"""The workbench in FreeCAD's window: it is there, its commands are, and they are grey where they cannot work."""

from __future__ import annotations

import shlex
import subprocess
import sys
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui
import pytest
from freecad.cad_implicit_wb import commands, messages, preferences, requirements, selection
from freecad.cad_implicit_wb.qt import ICONS, RESOURCES, QtCore, QtGui, QtWidgets

NAMES = [
    f"Implicit_{name}"
    for name in (
        *("Fillet", "Round", "Smooth", "Chamfer", "Offset", "Shell", "Infill", "Boolean"),
        *("Validate", "ToSolid", "Export"),
    )
]


def test_workbench_is_listed_with_toolbar_and_menu(window: Any) -> None:
    assert "ImplicitWorkbench" in Gui.listWorkbenches()
    toolbar = window.main.findChild(QtWidgets.QToolBar, "Implicit")
    assert [a.text() for a in toolbar.actions() if not a.isSeparator()] == [
        *("Fillet", "Round", "Smooth", "Chamfer", "Offset", "Shell", "Infill", "Boolean"),
        *("Validate", "Convert to Solid", "Export"),
    ]
    assert all(not a.icon().isNull() and a.toolTip() for a in toolbar.actions() if not a.isSeparator())
    assert "Implicit" in [a.text().replace("&", "") for a in window.main.menuBar().actions()]
    window.shot("workbench", keep=False)


def test_start_imports_nothing_heavy() -> None:
    assert "freecad.cad_implicit_wb.init_gui" in sys.modules_at_start
    heavy = {"numba", "scipy", "skimage", "trimesh", "cad_implicit", "freecad.cad_implicit_wb.commands"}
    assert not heavy & sys.modules_at_start


def test_commands_are_grey_where_they_cannot_work(window: Any, document: Any) -> None:
    assert not any(window.active(name) for name in NAMES)
    box = document.addObject("Part::Box", "Box")
    other = document.addObject("Part::Sphere", "Sphere")
    mesh = document.addObject("Mesh::Feature", "Mesh")
    sketch = document.addObject("Sketcher::SketchObject", "Sketch")
    document.recompute()
    blends = {"Implicit_Fillet", "Implicit_Round", "Implicit_Smooth", "Implicit_Chamfer"}
    whole = {"Implicit_Offset", "Implicit_Infill", "Implicit_Export"}

    def active() -> set[str]:
        return {name for name in NAMES if window.active(name)}

    window.select(box, "Edge1", "Edge3")
    assert active() == blends | whole
    window.select(box, "Face1")
    assert active() == blends | whole | {"Implicit_Shell"}
    window.select(box, "Vertex1")
    assert active() == whole
    window.select(box)
    assert active() == blends | whole | {"Implicit_Shell"}
    window.select(mesh)
    assert active() == blends | whole | {"Implicit_Shell", "Implicit_ToSolid"}
    window.select(sketch)
    assert active() == set()
    window.select(box)
    Gui.Selection.addSelection(other)
    assert active() == {"Implicit_Boolean"}
    Gui.Selection.clearSelection()
    assert active() == set()


def test_body_stands_for_its_tip(window: Any, document: Any) -> None:
    body = document.addObject("PartDesign::Body", "Body")
    block = body.newObject("PartDesign::AdditiveBox", "Block")
    document.recompute()
    window.select(body, "Block.Edge2")
    assert selection.chosen() == [selection.Chosen(body, ("Edge2",))]
    assert block.Name == "Block"


def test_missing_packages_are_told_with_the_command(window: Any, document: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(
        commands.Command, "needed", {"cad_implicit": "cad_implicit", "no_such_module": "no-such-package"}
    )
    window.select(_box(document))
    seen = []

    def look() -> None:
        dialog = window.find("cad_implicit_missing")
        seen.append(dialog.command)
        window.shot("missing_packages", keep=False)
        dialog.findChild(QtWidgets.QPushButton, "copy").click()
        dialog.reject()

    QtCore.QTimer.singleShot(200, look)
    Gui.runCommand("Implicit_Fillet")
    assert len(document.Objects) == 1
    words = shlex.split(seen[0])
    assert words[1:4] == ["-m", "pip", "install"]
    assert "no-such-package" in words
    assert "cad_implicit" not in words[words.index("no-such-package") :]
    assert QtWidgets.QApplication.clipboard().text() == seen[0]
    version = subprocess.run([words[0], "--version"], capture_output=True, text=True, check=True).stdout
    assert version.startswith("Python {}.{}.".format(*sys.version_info[:2]))
    assert words[words.index("--target") + 1].startswith(App.getUserAppDataDir())


def test_packages_that_are_there_are_not_missing() -> None:
    assert requirements.missing(requirements.NEEDED) == []
    assert requirements.missing({"no_such": "y", "numpy": "z"}) == ["y"]


def test_folder_of_packages_is_the_one_that_freecad_reads() -> None:
    own = (int(App.Version()[0]), int(App.Version()[1]))
    folder = requirements.package_folder(App.getUserAppDataDir(), own)
    assert folder.name == ("AdditionalPythonPackages" if own < (0, 21) else "py{}{}".format(*sys.version_info[:2]))


@pytest.mark.parametrize("path", sorted(ICONS.glob("*.svg")), ids=lambda p: p.stem)
def test_icons_are_drawn_and_differ_from_each_other(path: Any) -> None:
    pictures = {p: QtGui.QIcon(str(p)).pixmap(24, 24).toImage() for p in ICONS.glob("implicit_*.svg")}
    own = QtGui.QIcon(str(path)).pixmap(24, 24).toImage()
    opaque = sum(own.pixelColor(x, y).alpha() > 128 for x in range(24) for y in range(24))
    assert opaque > 24 * 24 / 4
    assert all(own != other for p, other in pictures.items() if p != path and not path.stem.startswith("preferences"))


def test_preferences_page_keeps_values(window: Any) -> None:
    page = Gui.PySideUic.loadUi(str(RESOURCES / "preferences.ui"))
    assert page.findChild(QtWidgets.QComboBox, "engine").count() == len(preferences.ENGINES)
    group = App.ParamGet(preferences.GROUP)
    try:
        group.SetFloat("Tolerance", 0.02)
        group.SetInt("Engine", 1)
        group.SetInt("Threads", 3)
        group.SetFloat("MemoryLimit", 1.5)
        group.SetBool("Preview", False)
        assert (preferences.tolerance(), preferences.engine(), preferences.threads()) == (0.02, "reinit", 3)
        assert (preferences.memory_limit(), preferences.preview()) == (1.5, False)
    finally:
        for name in ("Tolerance", "MemoryLimit"):
            group.RemFloat(name)
        for name in ("Engine", "Threads"):
            group.RemInt(name)
        group.RemBool("Preview")
    assert (preferences.tolerance(), preferences.engine(), preferences.preview()) == (0.0, "exact", True)
    assert window


def test_preferences_page_is_in_freecads_dialog(window: Any) -> None:
    seen = []

    def look() -> None:
        dialog = QtWidgets.QApplication.activeModalWidget()
        window.shot("preferences", keep=False)
        seen.append({box.objectName() for box in dialog.findChildren(QtWidgets.QWidget)})
        dialog.reject()

    QtCore.QTimer.singleShot(500, look)
    Gui.showPreferences("cad_implicit", 0)
    assert {"tolerance", "engine", "threads", "memory", "preview"} <= seen[0]


def test_errors_are_shown_in_a_box(window: Any) -> None:
    messages.tell_error("Fillet failed", ValueError("radius 9 mm is too large"))
    box = window.until(lambda: window.find("cad_implicit_error"), 5)
    assert box.text() == "Radius 9 mm is too large"


def _box(document: Any) -> Any:
    box = document.addObject("Part::Box", "Box")
    document.recompute()
    return box
