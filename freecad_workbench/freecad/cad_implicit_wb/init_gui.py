"""Registers the workbench. Runs at every start of FreeCAD's window, so it imports nothing that takes time.

FreeCAD skips a workbench in silence if this module cannot be imported: missing packages are told by the commands.
"""

from __future__ import annotations

import FreeCADGui as Gui

from .qt import ICONS, RESOURCES, icon, translate

Gui.addLanguagePath(str(RESOURCES / "translations"))
Gui.updateLocale()  # before the first text is translated


class ImplicitWorkbench(Gui.Workbench):
    """Fillets that never fail: parametric features whose surfaces are found through distance fields."""

    MenuText = translate("Implicit")
    ToolTip = translate("Fillets, rounds, offsets, shells and infill that never fail, with a known error")
    Icon = icon("workbench")

    def Initialize(self) -> None:  # noqa: N802 - named by FreeCAD
        """Create the commands, when the workbench is first opened."""
        from . import commands

        names = commands.register()
        self.appendToolbar(translate("Implicit"), names)
        self.appendMenu(translate("Implicit"), names)

    def ContextMenu(self, recipient: str) -> None:  # noqa: N802
        """Offer what fits the selection on a right click."""
        from . import commands

        fitting = commands.fitting()
        if recipient in ("View", "Tree") and fitting:
            self.appendContextMenu(translate("Implicit"), fitting)

    def GetClassName(self) -> str:  # noqa: N802
        """Name the C++ class, which FreeCAD asks of workbenches written in Python."""
        return "Gui::PythonWorkbench"


Gui.addIconPath(str(ICONS))
Gui.addPreferencePage(str(RESOURCES / "preferences.ui"), "cad_implicit")
Gui.addWorkbench(ImplicitWorkbench())
