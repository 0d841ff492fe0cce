"""The tests of this folder run within FreeCAD's window (``run_gui.sh``); elsewhere they are not collected."""

from __future__ import annotations

import sys

_WINDOW = bool(getattr(sys.modules.get("FreeCAD"), "GuiUp", 0))
collect_ignore_glob = [] if _WINDOW else ["*.py"]

if _WINDOW:
    from gui_window import document, window

    __all__ = ["document", "window"]
