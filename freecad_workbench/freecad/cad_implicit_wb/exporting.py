"""Asks for the name of a file, and for patience where a solid is made of many triangles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui

from . import convert, selection
from .form import in_bytes, in_seconds
from .qt import QtWidgets, translate

_FILTERS = {".stl": "STL (*.stl)", ".3mf": "3MF (*.3mf)", ".step": "STEP (*.step *.stp)"}

#: Solids with more faces than this are made only if the user says so: ten seconds, and 36 MB as STEP.
_MANY_FACES = 33_000


def ask_and_export(obj: Any) -> None:
    """Ask for a file and write an object to it."""
    start = str(Path(App.ActiveDocument.FileName or ".").parent / f"{obj.Label}.stl")
    filters = ";;".join(_FILTERS.values())
    name, chosen = QtWidgets.QFileDialog.getSaveFileName(Gui.getMainWindow(), translate("Export"), start, filters)
    if name:
        suffix = next(suffix for suffix, text in _FILTERS.items() if text == chosen)
        export(obj, Path(name) if Path(name).suffix else Path(name + suffix))


def export(obj: Any, path: Path) -> None:
    """Write an object to a file, if the user agrees with what a solid of it costs; say so in the report view."""
    if path.suffix.lower() in convert.SOLID_FILES and not agreed(obj):
        return
    convert.export(obj, path)
    App.Console.PrintMessage(translate("{} written").format(path) + "\n")


def agreed(obj: Any) -> bool:
    """Whether a solid of an object is small, or the user wants it all the same."""
    cost = convert.cost(obj)
    if not selection.is_mesh(obj) or cost.faces <= _MANY_FACES:
        return True
    text = translate("The solid will have up to {} faces: {}, and {} as a STEP file. Go on?")
    said = text.format(cost.faces, in_seconds(cost.seconds), in_bytes(cost.bytes))
    answer = QtWidgets.QMessageBox.question(Gui.getMainWindow(), translate("Convert to Solid"), said)
    return answer == QtWidgets.QMessageBox.Yes
