"""The commands of the workbench, for its toolbar, menu and context menu."""

from __future__ import annotations

from typing import Any

import FreeCAD as App
import FreeCADGui as Gui

from . import preferences, requirements, selection
from .messages import all_there, tell_error
from .operations import OPERATIONS
from .qt import icon, translate


class Command:
    """A command as FreeCAD asks for it; works on the document and closes its transaction if it fails."""

    name, text, tip, pixmap = "", "", "", ""
    needed = requirements.NEEDED

    def GetResources(self) -> dict[str, str]:  # noqa: N802
        """Icon and texts."""
        return {"MenuText": self.text, "ToolTip": self.tip, "Pixmap": icon(self.pixmap)}

    def fits(self) -> bool:
        """Whether the selection is one that the command can work with."""
        raise NotImplementedError

    def run(self) -> None:
        """Do it."""
        raise NotImplementedError

    def IsActive(self) -> bool:  # noqa: N802
        """Grey the command out where it cannot work, and while a task panel is open."""
        return App.ActiveDocument is not None and not Gui.Control.activeDialog() and self.fits()

    def Activated(self, _index: int = 0) -> None:  # noqa: N802
        """Do it, unless packages are missing; whatever goes wrong is told in a box."""
        if not all_there(self.needed):
            return
        try:
            self.run()
        except Exception as error:  # the user is told
            App.ActiveDocument.abortTransaction()
            tell_error(translate("{} failed").format(self.text), error)


class OperationCommand(Command):
    """Make a feature of the selected part, and open its task panel."""

    def __init__(self, operation: str) -> None:
        self.operation = operation
        own = OPERATIONS[operation]
        self.name = f"Implicit_{operation.capitalize()}"
        self.text, self.tip, self.pixmap = own.name, own.tip, own.icon

    def fits(self) -> bool:
        """One part or mesh; for booleans two."""
        if self.operation == "boolean":
            return selection.two() is not None
        elements = OPERATIONS[self.operation].elements
        return selection.one(elements or ("Edge", "Face", "Vertex")) is not None

    def run(self) -> None:
        """Make the feature in a transaction that the panel commits or aborts."""
        from . import making, properties
        from .viewprovider import ViewProvider

        document = App.ActiveDocument
        found = selection.chosen()
        document.openTransaction(self.text)
        names = [n for n in found[0].names if n.startswith(OPERATIONS[self.operation].elements or " ")]
        tool = found[1].object if self.operation == "boolean" else None
        kind = "Mesh" if selection.is_mesh(found[0].object) else "Solid"
        values: dict[str, Any] = {"Tolerance": preferences.tolerance()}
        if "Engine" in properties.inputs_of(self.operation):
            values["Engine"] = preferences.engine()
        obj = making.make(document, self.operation, found[0].object, names, tool=tool, result=kind, **values)
        ViewProvider(obj.ViewObject)
        Gui.Selection.clearSelection()
        Gui.getDocument(document.Name).setEdit(obj.Name)


class Validate(Command):
    """The accuracy report of a fillet, round or smooth, in the browser."""

    name, pixmap = "Implicit_Validate", "validate"
    needed = requirements.NEEDED | requirements.FOR_REPORTS

    def __init__(self) -> None:
        self.text = translate("Validate")
        self.tip = translate("Measure the error of a fillet against the exact kernel, and open the report")

    def fits(self) -> bool:
        """One fillet, round or smooth of a part."""
        found = selection.chosen()
        return len(found) == 1 and _operation(found[0].object) in ("fillet", "round", "smooth")

    def run(self) -> None:
        """Start the report's process; it opens the browser when it is done."""
        from . import reporting

        reporting.start(selection.chosen()[0].object)


class ToSolid(Command):
    """A solid from a mesh; a feature whose result is a mesh gives a solid from now on."""

    name, pixmap = "Implicit_ToSolid", "to_solid"

    def __init__(self) -> None:
        self.text = translate("Convert to Solid")
        self.tip = translate("Make a solid of a closed mesh, with triangles in one plane merged")

    def fits(self) -> bool:
        """One mesh."""
        found = selection.chosen()
        return len(found) == 1 and selection.is_mesh(found[0].object)

    def run(self) -> None:
        """Convert in the child process, while a window shows the progress."""
        from . import convert, exporting, viewprovider

        obj = selection.chosen()[0].object
        if _operation(obj):
            viewprovider.retype(obj, "Solid")
        elif exporting.agreed(obj):
            App.ActiveDocument.openTransaction(self.text)
            convert.to_solid(obj)
            obj.ViewObject.Visibility = False
            App.ActiveDocument.commitTransaction()


class Export(Command):
    """Files for printing and for other CAD."""

    name, pixmap = "Implicit_Export", "export"

    def __init__(self) -> None:
        self.text = translate("Export")
        self.tip = translate("Write the selected part as STL, 3MF or STEP")

    def fits(self) -> bool:
        """One part or mesh."""
        return selection.one(("Edge", "Face", "Vertex")) is not None

    def run(self) -> None:
        """Ask for a file and write it."""
        from .exporting import ask_and_export

        ask_and_export(selection.chosen()[0].object)


def _operation(obj: Any) -> str:
    """Operation of one of our features; "" for other objects."""
    return str(getattr(getattr(obj, "Proxy", None), "operation", ""))


#: Names between which the toolbar draws a line.
_GROUPS = (("fillet", "round", "smooth", "chamfer"), ("offset", "shell", "infill", "boolean"))

_commands: dict[str, Command] = {}


def register() -> list[str]:
    """Make all commands known to FreeCAD, once; returns their names in the order of the toolbar, with separators."""
    if not _commands:
        made: list[Command] = [OperationCommand(name) for group in _GROUPS for name in group]
        made += [Validate(), ToSolid(), Export()]
        for command in made:
            _commands[command.name] = command
            Gui.addCommand(command.name, command)
    names = list(_commands)
    return [*names[:4], "Separator", *names[4:8], "Separator", *names[8:]]


def fitting() -> list[str]:
    """Names of the commands that fit the selection."""
    return [name for name, command in _commands.items() if command.IsActive()]
