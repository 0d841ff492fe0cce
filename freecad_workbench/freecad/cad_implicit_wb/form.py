"""What the task panel looks like: one column that fits the narrow dock."""

from __future__ import annotations

from typing import Any

from . import preferences, sources
from .elements import ElementList
from .fields import BoolField, Changed, field_of
from .operations import ACCURACY, OPERATIONS
from .qt import QtCore, QtGui, QtWidgets, icon, translate
from .running import Progress
from .wording import label_of

#: The colour of errors below the inputs; readable on light and dark themes.
_ERROR_COLOUR = "#d0342c"


class PanelForm(QtWidgets.QWidget):
    """The inputs of one feature, the estimate, the preview's switch, and the progress.

    Attributes
    ----------
    fields : dict
        Inputs by the name of their property.
    elements : ElementList or None
        Of operations that take edges or faces.
    preview, stop, progress, estimate, note
        The other widgets.
    """

    def __init__(self, obj: Any, changed: Changed) -> None:
        super().__init__()
        operation = OPERATIONS[obj.Proxy.operation]
        self.setObjectName("cad_implicit_panel")
        self.setWindowTitle(obj.Label)
        self.setWindowIcon(QtGui.QIcon(icon(operation.icon)))
        self.fields: dict[str, Any] = {}
        mesh = sources.is_mesh(obj.Proxy.source(obj))  # has no edges, and the kernel does not take it
        values = tuple(name for name in operation.values if not (mesh and name in ("Tangent", "ExactFirst")))
        choosing = operation.elements and not mesh
        self.elements = ElementList(operation.elements, radii=operation.radii) if choosing else None
        if self.elements is not None:
            self.elements.set(obj.Proxy.elements(obj), obj.Proxy.own_radii(obj))
        self._inputs = QtWidgets.QWidget()
        column = QtWidgets.QVBoxLayout(self._inputs)
        column.setContentsMargins(0, 0, 0, 0)
        if self.elements is not None:
            column.addWidget(self.elements)
        column.addLayout(self._rows(obj, values, changed))
        column.addWidget(self._accuracy(obj, changed))
        self.preview = QtWidgets.QCheckBox(translate("Preview"))
        self.preview.setToolTip(translate("A coarse result, computed after every change"))
        self.preview.setChecked(preferences.preview())
        self.preview.toggled.connect(preferences.set_preview)
        self.estimate, self.note = _text(), _text()
        self.note.setStyleSheet(f"color: {_ERROR_COLOUR}")
        self.progress = Progress()
        self.stop = QtWidgets.QPushButton(translate("Stop computing"))
        layout = QtWidgets.QVBoxLayout(self)
        for widget in (self._inputs, self.preview, self.estimate, self.progress, self.stop, self.note):
            layout.addWidget(widget)
        layout.addStretch()
        self.show_busy(False, final=False)
        self.tell("")

    def show_estimate(self, cost: dict[str, float]) -> None:
        """Show what the result will cost."""
        text = translate("Grid: {spacing:.3g} mm, {cells} cells\nMemory: {memory}\nTime: {seconds}")
        cells, memory, seconds = in_count(cost["cells"]), in_bytes(cost["memory_bytes"]), in_seconds(cost["seconds"])
        self.estimate.setText(text.format(spacing=cost["spacing"], cells=cells, memory=memory, seconds=seconds))

    def show_busy(self, busy: bool, *, final: bool) -> None:
        """Show progress while something is computed; inputs wait while it is the result."""
        self.progress.setVisible(busy)
        self.stop.setVisible(busy)
        self._inputs.setEnabled(not (busy and final))
        self.preview.setEnabled(not (busy and final))
        if busy:
            self.progress.show_stage("starting", 0.0)

    def tell(self, text: str) -> None:
        """Show an error below the inputs; nothing if it is empty."""
        self.note.setText(text)
        self.note.setVisible(bool(text))

    def _rows(self, obj: Any, names: tuple[str, ...], changed: Changed) -> QtWidgets.QFormLayout:
        rows = QtWidgets.QFormLayout()
        rows.setRowWrapPolicy(QtWidgets.QFormLayout.WrapLongRows)
        for name in names:
            field = self.fields[name] = field_of(obj, name, changed)
            if isinstance(field, BoolField):
                rows.addRow(field.widget)
            else:
                rows.addRow(label_of(name), field.widget)
        return rows

    def _accuracy(self, obj: Any, changed: Changed) -> QtWidgets.QWidget:
        """Build the inputs that are rarely needed, behind an arrow."""
        arrow = QtWidgets.QToolButton()
        arrow.setText(translate("Accuracy"))
        arrow.setToolButtonStyle(QtCore.Qt.ToolButtonTextBesideIcon)
        arrow.setArrowType(QtCore.Qt.RightArrow)
        arrow.setCheckable(True)
        arrow.setAutoRaise(True)
        inner = QtWidgets.QWidget()
        inner.setLayout(self._rows(obj, tuple(n for n in ACCURACY if n in obj.PropertiesList), changed))
        inner.hide()

        def opened(on: bool) -> None:
            inner.setVisible(on)
            arrow.setArrowType(QtCore.Qt.DownArrow if on else QtCore.Qt.RightArrow)

        arrow.toggled.connect(opened)
        self.arrow = arrow
        outer = QtWidgets.QWidget()
        layout = QtWidgets.QVBoxLayout(outer)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(arrow)
        layout.addWidget(inner)
        return outer


def _text() -> QtWidgets.QLabel:
    label = QtWidgets.QLabel()
    label.setWordWrap(True)
    return label


def in_count(number: float) -> str:
    """Return a count as the user reads it."""
    if number >= 1e6:
        return translate("{:.1f} million").format(number / 1e6)
    return f"{round(number, -2):,.0f}".replace(",", "\u202f") if number >= 1000 else f"{number:.0f}"


def in_bytes(number: float) -> str:
    """Return a number of bytes as the user reads it."""
    return f"{number / 2**30:.1f} GiB" if number >= 2**30 else f"{max(number / 2**20, 1):.0f} MiB"


def in_seconds(number: float) -> str:
    """Return a time as the user reads it."""
    if number >= 90:
        return translate("about {:.0f} min").format(number / 60)
    return translate("about {:.0f} s").format(max(number, 1))
