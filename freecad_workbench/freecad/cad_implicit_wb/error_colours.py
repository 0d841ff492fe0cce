"""A result in the colours of its error, with a scale; measured in the child process when it is asked for."""

from __future__ import annotations

from typing import Any

import FreeCADGui as Gui
import numpy as np

from . import client
from .colour_bar import ColourBar
from .drawing import Overlay, colours_of
from .errors import WorkbenchError
from .lifetime import Lifetime
from .messages import tell_error
from .qt import translate
from .running import Runner

#: The scale ends at this share of the vertices: one bad vertex in a thousand must not make all others look perfect.
_LARGEST_SHARE = 0.999

#: … and at no less than this, in mm: below is the noise of the arithmetic, ten times the resolution of CAD kernels.
_SMALLEST = 1e-6


class ErrorColours:
    """Shows and hides the error of one feature."""

    def __init__(self, view: Any) -> None:
        self._view = view
        self._overlay: Overlay | None = None
        self._bar: ColourBar | None = None
        self._runner: Runner | None = None
        self._lifetime: Lifetime | None = None

    @property
    def shown(self) -> bool:
        """Whether the error is shown, or being measured."""
        return self._overlay is not None or self._runner is not None

    def toggle(self) -> None:
        """Show the error, or the feature as it was."""
        if self.shown:
            self.forget()
        else:
            self._measure()

    def _measure(self) -> None:
        obj = self._view.Object
        self._runner = Runner()
        self._runner.finished.connect(self._show)
        self._runner.failed.connect(self._failed)
        self._lifetime = Lifetime([obj], lambda: self.forget(deleted=True))
        try:
            self._runner.follow(client.start(obj.Proxy.request(obj, error=True)))
        except WorkbenchError as error:
            self._failed(error)

    def _show(self, answer: Any) -> None:
        obj = self._view.Object
        self._runner = None
        error = np.abs(np.asarray(answer.error))
        known = error[np.isfinite(error)]
        if not len(known):
            self._failed(WorkbenchError(translate("the error of this result is not known")))
            return
        largest = max(float(np.quantile(known, _LARGEST_SHARE)), _SMALLEST)
        view = Gui.getDocument(obj.Document.Name).ActiveView
        self._overlay = Overlay(view, obj.Placement)
        self._overlay.preview(answer.vertices, answer.faces, colours_of(error, largest))
        self._bar = ColourBar(view.graphicsView(), obj.Label)
        self._bar.show_scale(translate("self-checked error"), largest, answer.error_bound)
        self._view.Visibility = False

    def _failed(self, error: BaseException) -> None:
        label = self._view.Object.Label
        self.forget()
        tell_error(translate("The error of {} could not be measured").format(label), error)

    def forget(self, *, deleted: bool = False) -> None:
        """Take the colours away and show the feature again, unless it is deleted."""
        if self._lifetime is not None:
            self._lifetime.stop()
            self._lifetime = None
        if self._runner is not None:
            self._runner.stop()
            self._runner = None
        if self._bar is not None:
            self._bar.hide()
            self._bar.deleteLater()
            self._bar = None
        if self._overlay is not None:
            self._overlay.clear()
            self._overlay = None
            if not deleted:
                self._view.Visibility = True
