"""Qt as this FreeCAD has it: Qt 5 (PySide2) or Qt 6 (PySide6) behind FreeCAD's own ``PySide``; and translated text."""

from __future__ import annotations

from pathlib import Path

import FreeCAD as App
from PySide import QtCore, QtGui

try:
    from PySide import QtWidgets
except ImportError:  # FreeCAD 0.20 has the widgets in QtGui
    QtWidgets = QtGui

__all__ = [
    "ICONS",
    "RESOURCES",
    "QtCore",
    "QtGui",
    "QtWidgets",
    "icon",
    "marked",
    "run_dialog",
    "translate",
    "translate_collected",
]

RESOURCES = Path(__file__).parent / "resources"
ICONS = RESOURCES / "icons"

#: Every text of the workbench is translated in this context.
CONTEXT = "cad_implicit"


def translate(text: str) -> str:
    """Return the text in the user's language. Call it with a literal: ``translations.py`` collects those."""
    return str(App.Qt.translate(CONTEXT, text))


def marked(text: str) -> str:
    """Mark a literal for ``translations.py``; it is translated where it is shown, by :func:`translate_collected`."""
    return text


def translate_collected(text: str) -> str:
    """Return a text that is no literal here; ``translations.py`` collects it where it is written."""
    return str(App.Qt.translate(CONTEXT, text))


def icon(name: str) -> str:
    """Path of an icon, ``implicit_<name>.svg``."""
    return str(ICONS / f"implicit_{name}.svg")


def run_dialog(dialog: QtWidgets.QDialog) -> int:
    """Run a modal dialog and return its answer (``exec_`` in Qt 5, ``exec`` in Qt 6)."""
    return int(dialog.exec() if hasattr(dialog, "exec") else dialog.exec_())
