"""The list of chosen edges or faces in the task panel; clicks in the 3-D view add and remove."""

from __future__ import annotations

from typing import Any

import FreeCAD as App
import FreeCADGui as Gui

from .fields import quantity_box
from .qt import QtCore, QtWidgets, translate
from .selection import whole

#: Rows of the list that are seen at once; more are scrolled.
_ROWS = 5

#: Pixels of a row with an input in it, and of the head with the frame.
_ROW, _HEAD = 28, 28


class ElementList(QtWidgets.QWidget):
    """Edges (or faces) of one object, each edge with its radius where it has one of its own.

    Parameters
    ----------
    kinds : tuple of str
        "Edge" and "Face" (for its edges), or "Face" alone.
    radii : bool
        Whether every element can have its own radius.
    """

    changed = QtCore.Signal()

    def __init__(self, kinds: tuple[str, ...], *, radii: bool) -> None:
        super().__init__()
        self._kinds, self._radii = kinds, radii
        self._own: dict[str, float] = {}
        self._names: list[str] = []
        self.tree = QtWidgets.QTreeWidget()
        self.tree.setRootIsDecorated(False)
        heads = [translate("Edge") if "Edge" in kinds else translate("Face")]
        self.tree.setHeaderLabels([*heads, translate("Own radius")] if radii else heads)
        self.tree.setColumnWidth(0, 80)
        self.tree.setSelectionMode(QtWidgets.QAbstractItemView.ExtendedSelection)
        self.hint = QtWidgets.QLabel()
        self.hint.setWordWrap(True)
        self.remove = QtWidgets.QPushButton(translate("Remove"))
        self.remove.clicked.connect(self._remove_marked)
        layout = QtWidgets.QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for widget in (self.hint, self.tree, self.remove):
            layout.addWidget(widget)
        self._fill()

    @property
    def names(self) -> list[str]:
        """Chosen elements, in the order in which they were."""
        return list(self._names)

    @property
    def own_radii(self) -> dict[str, float]:
        """Radii in mm of the edges that have their own."""
        return {name: self._own[name] for name in self._names if self._own.get(name, 0) > 0}

    def set(self, names: list[str], own: dict[str, float]) -> None:
        """Take a choice as it is stored; nothing is told to have changed."""
        self._names, self._own = list(names), dict(own)
        self._fill()

    def toggle(self, name: str) -> None:
        """Add an element, or remove it if it is there."""
        if not name.startswith(self._kinds):
            return
        if name in self._names:
            self._names.remove(name)
            self._own.pop(name, None)
        else:
            self._names.append(name)
        self._fill()
        self.changed.emit()

    def _remove_marked(self) -> None:
        marked = {item.text(0) for item in self.tree.selectedItems()} or set(self._names)
        self._names = [name for name in self._names if name not in marked]
        self._fill()
        self.changed.emit()

    def _fill(self) -> None:
        self.tree.clear()
        for name in self._names:
            item = QtWidgets.QTreeWidgetItem([name])
            self.tree.addTopLevelItem(item)
            if self._radii:
                self.tree.setItemWidget(item, 1, self._radius_box(name))
        self.hint.setText(self._hint())
        self.remove.setVisible(bool(self._names))
        self.tree.setVisible(bool(self._names))
        self.tree.setFixedHeight(_HEAD + _ROW * min(len(self._names), _ROWS))

    def _hint(self) -> str:
        if "Edge" not in self._kinds:
            return translate("Click faces in the 3-D view that are left open, and again to close them.")
        if self._names:
            return translate("Click edges in the 3-D view to add them, and again to remove them.")
        return translate("All edges. Click edges in the 3-D view to work on those only.")

    def _radius_box(self, name: str) -> Any:
        box = quantity_box(self._own.get(name, 0.0), lambda value: self._take(name, value))
        box.setToolTip(translate("Radius of this edge; 0: the one for all."))
        return box

    def _take(self, name: str, radius: float) -> None:
        self._own[name] = radius
        self.changed.emit()


class Clicks:
    """Follows clicks in the 3-D view while it lives: FreeCAD calls ``addSelection`` of every observer.

    The element is taken out of FreeCAD's selection again, so that a second click is a click, too.
    """

    def __init__(self, source: Any, elements: ElementList) -> None:
        self._source, self._elements = source, elements
        Gui.Selection.addObserver(self)

    def addSelection(self, document: str, name: str, element: str, _point: Any) -> None:  # noqa: N802 - by FreeCAD
        """Toggle an element that was clicked on the source."""
        clicked = App.getDocument(document).getObject(name)
        element = element.split(".")[-1]
        if not element or clicked is None or self._source not in (clicked, whole(clicked)):
            return
        QtCore.QTimer.singleShot(0, lambda: self._taken(document, name, element))

    def _taken(self, document: str, name: str, element: str) -> None:
        Gui.Selection.clearSelection(document)
        self._elements.toggle(element)

    def stop(self) -> None:
        """Follow no longer."""
        Gui.Selection.removeObserver(self)
