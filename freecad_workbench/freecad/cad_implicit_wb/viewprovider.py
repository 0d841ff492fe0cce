"""How a feature is shown: icon, place in the tree, double-click, menu, and its error in colours."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import FreeCAD as App
import FreeCADGui as Gui

from . import feature, making, running
from .error_colours import ErrorColours
from .messages import tell_error
from .operations import OPERATIONS
from .qt import ICONS, QtWidgets, icon, translate

if TYPE_CHECKING:
    from .panel import OperationPanel

# Here, as this module is imported with the first feature that is made or opened: recomputes leave the window alive.
feature.waiting = running.wait_in_window

#: Files of icons with the sign for results that are out of date, by operation; written when they are first needed.
_stale_icons: dict[str, str] = {}


class ViewProvider:
    """View provider of all features. Saved files name this class: it must stay here and keep its name."""

    colours: ErrorColours | None = None
    panel: OperationPanel | None = None

    def __init__(self, view: Any) -> None:
        view.Proxy = self

    def attach(self, view: Any) -> None:
        """Take hold of the object; FreeCAD calls it for new objects and for those of an opened file."""
        self.view, self.obj = view, view.Object
        self.colours = ErrorColours(view)

    def getIcon(self) -> str:  # noqa: N802
        """Icon in the tree, with a sign if the result is out of date."""
        name = OPERATIONS[self.obj.Proxy.operation].icon
        return _stale_icon(name) if self.obj.Stale else icon(name)

    def claimChildren(self) -> list[Any]:  # noqa: N802
        """Give what the feature is made of: it is hidden under it in the tree, as in Part."""
        return _sources(self.obj)

    def updateData(self, obj: Any, name: str) -> None:  # noqa: N802
        """Follow changes of the feature: errors in colour belong to one shape."""
        if name in ("Shape", "Mesh") and self.colours is not None:
            self.colours.forget()
        if name == "Stale":
            obj.ViewObject.signalChangeIcon()

    def onDelete(self, view: Any, _elements: Any) -> bool:  # noqa: N802
        """Show the sources again when the feature is deleted."""
        if self.colours is not None:
            self.colours.forget()
        for source in _sources(view.Object):
            source.ViewObject.Visibility = True
        return True

    # editing

    def doubleClicked(self, view: Any) -> bool:  # noqa: N802
        """Open the task panel, in a transaction that Cancel takes back."""
        edit(view.Object)
        return True

    def setEdit(self, view: Any, mode: int = 0) -> bool | None:  # noqa: N802
        """Open the task panel."""
        if mode != 0:
            return None
        from .panel import OperationPanel

        if self.colours is not None:
            self.colours.forget()
        self.panel = OperationPanel(view.Object)
        Gui.Control.showDialog(self.panel)
        return True

    def unsetEdit(self, _view: Any, mode: int = 0) -> bool | None:  # noqa: N802
        """Close the task panel."""
        if mode != 0:
            return None
        self.panel = None
        Gui.Control.closeDialog()
        return True

    def setupContextMenu(self, view: Any, menu: QtWidgets.QMenu) -> bool:  # noqa: N802
        """Add what can be done with the feature."""
        menu.addAction(translate("Edit {}").format(view.Object.Label), lambda: edit(view.Object))
        other, label = (
            ("Solid", translate("Result as a solid"))
            if feature.is_mesh_feature(view.Object)
            else ("Mesh", translate("Result as a mesh"))
        )
        menu.addAction(label, lambda: retype(view.Object, other))
        if self.colours is not None:
            shown = menu.addAction(translate("Error in colours"))
            shown.setCheckable(True)
            shown.setChecked(self.colours.shown)
            shown.triggered.connect(self.colours.toggle)
        return True

    # storing

    def dumps(self) -> None:
        """Nothing is stored but the class."""

    def loads(self, _state: Any) -> None:
        """Nothing is stored but the class."""

    __getstate__, __setstate__ = dumps, loads  # FreeCAD 0.20


def retype(obj: Any, result: str) -> None:
    """Let a feature give a solid, or a mesh, from now on; it is computed anew."""
    document = obj.Document
    document.openTransaction(translate("Result of {}").format(obj.Label))
    obj.Result = result
    new = making.retyped(obj)
    ViewProvider(new.ViewObject)
    document.recompute()
    if new.isValid():
        document.commitTransaction()
    else:
        error = new.getStatusString()
        document.abortTransaction()
        tell_error(translate("{} failed").format(translate("Convert to Solid")), error)


def _sources(obj: Any) -> list[Any]:
    """Return what a feature is made of."""
    found = [obj.Proxy.source(obj), getattr(obj, "Tool", None)]
    return [source for source in found if source is not None]


def edit(obj: Any) -> None:
    """Open a feature's task panel in a transaction of its own."""
    if Gui.Control.activeDialog():
        return
    obj.Document.openTransaction(translate("Edit {}").format(obj.Label))
    Gui.getDocument(obj.Document.Name).setEdit(obj.Name)


def _stale_icon(name: str) -> str:
    """File of an icon with the sign for results that are out of date in its corner."""
    if name not in _stale_icons:
        sign = (ICONS / "implicit_stale.svg").read_text(encoding="utf-8")
        inner = sign[sign.index("<g ") : sign.index("</svg>")]
        text = Path(icon(name)).read_text(encoding="utf-8")
        badge = f'<g transform="translate(32 32) scale(0.5)">{inner}</g></svg>'
        path = Path(_icon_folder()) / f"{name}_stale.svg"
        path.write_text(text.replace("</svg>", badge), encoding="utf-8")
        _stale_icons[name] = str(path)
    return _stale_icons[name]


def _icon_folder() -> str:
    folder = Path(App.getTempPath(), "cad_implicit_icons")
    folder.mkdir(parents=True, exist_ok=True)
    return str(folder)
