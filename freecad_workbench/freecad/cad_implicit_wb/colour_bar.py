"""The scale beside a result in the colours of its error: a widget over the 3-D view."""

from __future__ import annotations

import numpy as np

from .drawing import SCALE
from .qt import QtCore, QtGui, QtWidgets, translate

#: Pixels: the bar itself, and the room around it for figures and the title.
_BAR_WIDTH, _BAR_HEIGHT = 18, 150
_WIDTH, _HEIGHT, _MARGIN = 138, 236, 10

#: Figures beside the bar.
_TICKS = 5


def figure(value: float) -> str:
    """Return an error in mm with three digits, in µm where that is readable."""
    if value == 0:
        return "0"
    return f"{value * 1000:.3g} µm" if value < 0.1 else f"{value:.3g} mm"


class ColourBar(QtWidgets.QWidget):
    """Colours, their errors, and a title that says whose; in the lower left corner of the view."""

    def __init__(self, view: QtWidgets.QWidget, name: str) -> None:
        super().__init__(view)
        self.setObjectName("cad_implicit_colour_bar")
        self.setAttribute(QtCore.Qt.WA_TransparentForMouseEvents)
        self.resize(_WIDTH, _HEIGHT)
        self.name, self.largest, self.title = name, 0.0, ""
        self.bound: float | None = None
        view.installEventFilter(self)
        self._place()

    def show_scale(self, title: str, largest: float, bound: float | None) -> None:
        """Show a scale from 0 to ``largest`` mm, and the error bound below it, in mm, if it is known."""
        self.title, self.largest, self.bound = title, largest, bound
        self.show()
        self.raise_()
        self.update()

    def eventFilter(self, watched: QtCore.QObject, event: QtCore.QEvent) -> bool:  # noqa: N802 - named by Qt
        if event.type() == QtCore.QEvent.Resize:
            self._place()
        return False

    def paintEvent(self, event: QtGui.QPaintEvent) -> None:  # noqa: N802 - named by Qt
        painter = QtGui.QPainter(self)
        painter.setRenderHint(QtGui.QPainter.Antialiasing)
        painter.setPen(QtCore.Qt.NoPen)
        painter.setBrush(QtGui.QColor(255, 255, 255, 225))
        painter.drawRoundedRect(self.rect(), 6, 6)
        painter.setPen(QtGui.QColor(20, 20, 20))
        head = QtCore.QRect(_MARGIN, 6, _WIDTH - 2 * _MARGIN, 34)
        wrapped = int(QtCore.Qt.AlignLeft) | int(QtCore.Qt.TextWordWrap)
        painter.drawText(head, wrapped, f"{self.name}\n{self.title}")
        top = head.bottom() + 8
        self._bar(painter, top)
        for i in range(_TICKS):
            y = top + _BAR_HEIGHT - round(i * _BAR_HEIGHT / (_TICKS - 1))
            painter.drawLine(_MARGIN + _BAR_WIDTH, y, _MARGIN + _BAR_WIDTH + 4, y)
            text = figure(self.largest * i / (_TICKS - 1))
            painter.drawText(_MARGIN + _BAR_WIDTH + 8, y + 4, text)
        if self.bound is not None:
            painter.drawText(_MARGIN, _HEIGHT - 10, translate("bound {}").format(figure(self.bound)))
        painter.end()

    def _bar(self, painter: QtGui.QPainter, top: int) -> None:
        gradient = QtGui.QLinearGradient(0, top + _BAR_HEIGHT, 0, top)
        for place, (r, g, b) in zip(np.linspace(0, 1, len(SCALE)), SCALE, strict=True):
            gradient.setColorAt(float(place), QtGui.QColor.fromRgbF(float(r), float(g), float(b)))
        painter.fillRect(_MARGIN, top, _BAR_WIDTH, _BAR_HEIGHT, QtGui.QBrush(gradient))

    def _place(self) -> None:
        view = self.parentWidget()
        self.move(_MARGIN, view.height() - _HEIGHT - _MARGIN)
