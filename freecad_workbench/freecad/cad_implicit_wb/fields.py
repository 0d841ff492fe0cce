"""Inputs of the task panel, one for each property of a feature: lengths with units and expressions, lists, boxes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui

from .qt import QtCore, QtWidgets
from .wording import choice_in_words, label_of, tip_of

Changed = Callable[[], None]

#: Times that a new input is made before giving up.
_TRIES = 5


def quantity_box(value: float, changed: Callable[[float], None], *, signed: bool = False) -> Any:
    """Return FreeCAD's own input for a length in mm; it understands units and formulas, ``=`` opens expressions."""
    for _ in range(_TRIES):
        box = Gui.UiLoader().createWidget("Gui::QuantitySpinBox")
        try:
            box.setProperty("unit", "mm")
            break
        except RuntimeError:  # PySide took it for one that was deleted, and lay at the same address
            continue
    if not signed:
        box.setProperty("minimum", 0.0)
    box.setProperty("singleStep", 0.1)
    box.setProperty("rawValue", float(value))
    QtCore.QObject.connect(box, QtCore.SIGNAL("valueChanged(double)"), changed)
    return box


class LengthField:
    """A length, bound to its property, so that an expression can stand for it."""

    def __init__(self, obj: Any, name: str, changed: Changed) -> None:
        self._obj, self._name, self._changed = obj, name, changed
        signed = obj.getTypeIdOfProperty(name) == "App::PropertyDistance"
        self.widget = quantity_box(getattr(obj, name).Value, self._take, signed=signed)
        Gui.ExpressionBinding(self.widget).bind(obj, name)

    @property
    def value(self) -> float:
        """What stands in the box, in mm."""
        return float(self.widget.property("rawValue"))

    def _take(self, value: float) -> None:
        setattr(self._obj, self._name, App.Units.Quantity(value, App.Units.Length))
        self._changed()


class ChoiceField:
    """One of a few, from an enumeration."""

    def __init__(self, obj: Any, name: str, changed: Changed) -> None:
        self._obj, self._name, self._changed = obj, name, changed
        self._keys = list(obj.getEnumerationsOfProperty(name))
        self.widget = QtWidgets.QComboBox()
        for key in self._keys:
            self.widget.addItem(choice_in_words(key))
        self.widget.setCurrentIndex(self._keys.index(getattr(obj, name)))
        self.widget.currentIndexChanged.connect(self._take)

    def _take(self, index: int) -> None:
        setattr(self._obj, self._name, self._keys[index])
        self._changed()


class BoolField:
    """Yes or no."""

    def __init__(self, obj: Any, name: str, changed: Changed) -> None:
        self._obj, self._name, self._changed = obj, name, changed
        self.widget = QtWidgets.QCheckBox(label_of(name))
        self.widget.setChecked(bool(getattr(obj, name)))
        self.widget.toggled.connect(self._take)

    def _take(self, on: bool) -> None:
        setattr(self._obj, self._name, on)
        self._changed()


_FIELDS: dict[str, Callable[[Any, str, Changed], Any]] = {
    "App::PropertyLength": LengthField,
    "App::PropertyDistance": LengthField,
    "App::PropertyEnumeration": ChoiceField,
    "App::PropertyBool": BoolField,
}


def field_of(obj: Any, name: str, changed: Changed) -> Any:
    """Return the input for a property, by its type."""
    field = _FIELDS[obj.getTypeIdOfProperty(name)](obj, name, changed)
    field.widget.setObjectName(name)
    field.widget.setToolTip(tip_of(obj.getDocumentationOfProperty(name)))
    return field
