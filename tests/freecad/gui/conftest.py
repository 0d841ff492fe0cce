"""The tests of this folder run within FreeCAD's window (``run_gui.sh``); elsewhere they are not collected."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

#: Seconds after which a dialog that nobody answers is closed; progress may take as long as it does.
_ANSWER = 60

_WINDOW = bool(getattr(sys.modules.get("FreeCAD"), "GuiUp", 0))
collect_ignore_glob = [] if _WINDOW else ["*.py"]

if _WINDOW:
    from freecad.cad_implicit_wb.qt import QtCore, QtWidgets
    from gui_window import document, window

    __all__ = ["document", "no_dialog_stays", "window"]

    @pytest.fixture(autouse=True)
    def no_dialog_stays() -> Iterator[None]:
        """Fail a test that opens a dialog which it does not answer, where it would stand still."""
        seen: list[object] = []
        stayed: list[str] = []

        def look() -> None:
            dialog = QtWidgets.QApplication.activeModalWidget()
            if dialog is None or isinstance(dialog, QtWidgets.QProgressDialog) or dialog not in seen:
                seen.clear()
            if dialog is not None:
                seen.append(dialog)
            if len(seen) > _ANSWER:
                labels = [label.text() for label in dialog.findChildren(QtWidgets.QLabel)]
                stayed.append(f"{dialog.windowTitle()}: {' '.join(labels)}")
                dialog.close()

        timer = QtCore.QTimer()
        timer.timeout.connect(look)
        timer.start(1000)
        yield
        timer.stop()
        assert not stayed
