"""The task panel of a feature: values, chosen edges, what it will cost, a preview, and the computation itself.

Nothing is computed in FreeCAD's process. While the panel is open, the feature's properties follow its inputs; OK
computes, hands the answer to the feature, recomputes the document and commits; Cancel takes everything back.
"""

from __future__ import annotations

from typing import Any

import FreeCADGui as Gui

from . import client, feature, sources
from .drawing import Overlay
from .elements import Clicks
from .errors import WorkbenchError
from .form import PanelForm
from .lifetime import Lifetime
from .messages import in_words, tell_error
from .qt import QtCore, QtWidgets, translate
from .running import Runner

#: Milliseconds without a change after which the cost is estimated, and the preview computed.
_PAUSE_ESTIMATE = 150
_PAUSE_PREVIEW = 600

#: Transparency in percent of the source while a preview is shown in its place.
_SEE_THROUGH = 80


class OperationPanel:
    """Edits one feature; a transaction is open. FreeCAD calls ``accept``, ``reject`` and ``getStandardButtons``."""

    def __init__(self, obj: Any) -> None:
        self.obj, self.document, self.source = obj, obj.Document, obj.Proxy.source(obj)
        self.form = PanelForm(obj, self.changed)
        self._closed = False
        self._final = False  # what is computed is the result, not a preview
        self.runner = Runner()
        self.runner.progressed.connect(self.form.progress.show_stage)
        self.runner.finished.connect(self._finished)
        self.runner.failed.connect(self._failed)
        self._estimate_soon = self._timer(_PAUSE_ESTIMATE, self._estimate)
        self._preview_soon = self._timer(_PAUSE_PREVIEW, self._start_preview)
        self.form.preview.toggled.connect(self._preview_toggled)
        self.form.stop.clicked.connect(self._stop)
        self._seen = _Seen(obj, self.source, getattr(obj, "Tool", None))
        self._overlay = Overlay(Gui.getDocument(self.document.Name).ActiveView, self._frame())
        self._clicks = None
        if self.form.elements is not None:
            self.form.elements.changed.connect(self._elements_changed)
            self._clicks = Clicks(self.source, self.form.elements)
            self._mark()
        self._lifetime = Lifetime([obj, self.source], self._gone)
        self.changed()

    # what FreeCAD calls

    def getStandardButtons(self) -> int:  # noqa: N802
        """OK and Cancel."""
        return int(QtWidgets.QDialogButtonBox.Ok | QtWidgets.QDialogButtonBox.Cancel)

    def isAllowedAlterDocument(self) -> bool:  # noqa: N802
        """Let the user go on working on other things."""
        return True

    isAllowedAlterView = isAllowedAlterSelection = isAllowedAlterDocument  # noqa: N815

    def accept(self) -> bool:
        """Compute the result; the panel closes when it is there."""
        if self._final:
            return False
        self._pause()
        self._final = True
        try:
            self._request = self.obj.Proxy.request(self.obj)
        except WorkbenchError as error:
            self._failed(error)
            return False
        if client.key(self._request) == self.obj.Fingerprint:
            self._commit()
            return False
        self._busy(True)
        self.runner.follow(client.start(self._request))
        return False

    def reject(self) -> bool:
        """Stop whatever is computed and take every change back."""
        self._close()
        self.document.abortTransaction()
        Gui.getDocument(self.document.Name).resetEdit()
        Gui.Control.closeDialog()
        return True

    # values

    def changed(self) -> None:
        """Estimate again after a change, and preview after a pause."""
        self.form.tell("")
        if self.runner.busy:
            self._stop()
        self._overlay.hide_preview()
        self._estimate_soon.start()
        if self.form.preview.isChecked():
            self._preview_soon.start()

    def _elements_changed(self) -> None:
        chosen = self.form.elements
        assert chosen is not None  # only its list calls this
        self.obj.Proxy.set_elements(self.obj, chosen.names, chosen.own_radii)
        self._mark()
        self.changed()

    def _frame(self) -> Any:
        """Placement of the source, in whose frame everything is computed."""
        return (sources.located_mesh if sources.is_mesh(self.source) else sources.located)(self.source)[1]

    def _mark(self) -> None:
        if self.form.elements is not None:
            self._overlay.mark(sources.located(self.source)[0], self.form.elements.names)

    def _estimate(self) -> None:
        try:
            self.form.show_estimate(client.estimate(self.obj.Proxy.request(self.obj)))
        except WorkbenchError as error:  # OK tells it in a box
            self.form.tell(in_words(error))

    # computing

    def _preview_toggled(self, on: bool) -> None:
        if on:
            self._preview_soon.start()
        else:
            self._preview_soon.stop()
            self._overlay.hide_preview()
            self._seen.see_through(False)
            if self.runner.busy and not self._final:
                self._stop()

    def _start_preview(self) -> None:
        try:
            request = self.obj.Proxy.request(self.obj, draft=True)
        except WorkbenchError as error:  # the user is still choosing
            self.form.tell(in_words(error))
            return
        self._busy(True)
        self.runner.follow(client.start(request))

    def _stop(self) -> None:
        """Stop computing; the panel stays."""
        self.runner.stop()
        self._final = False
        self._busy(False)

    def _finished(self, answer: Any) -> None:
        self._busy(False)
        if not self._final:
            self._overlay.preview(answer.vertices, answer.faces)
            self._seen.see_through(True)
            return
        feature.remember(self._request, answer)
        self._commit()

    def _failed(self, error: BaseException) -> None:
        """Tell an error below the values; of the final result in a box, too."""
        final, self._final = self._final, False
        self._busy(False)
        self.form.tell(in_words(error))
        if final:
            tell_error(translate("{} failed").format(self.obj.Label), error)

    def _commit(self) -> None:
        self.obj.touch()
        self.document.recompute()
        if not self.obj.isValid():
            self._failed(WorkbenchError(self.obj.getStatusString()))
            return
        self._final = False
        self._close()
        self._seen.show_result()
        self.document.commitTransaction()
        Gui.getDocument(self.document.Name).resetEdit()
        Gui.Control.closeDialog()

    # the end

    def _gone(self) -> None:
        """Stop and close, where the feature, its source or the document is deleted, without touching them."""
        self._close(deleted=True)
        QtCore.QTimer.singleShot(0, Gui.Control.closeDialog)

    def _close(self, *, deleted: bool = False) -> None:
        self._closed = True
        self._pause()
        self._lifetime.stop()
        if self._clicks is not None:
            self._clicks.stop()
        self._overlay.clear()
        if not deleted:
            self._seen.restore()

    def _pause(self) -> None:
        self._estimate_soon.stop()
        self._preview_soon.stop()
        self._stop()

    def _busy(self, on: bool) -> None:
        if not self._closed:
            self.form.show_busy(on, final=self._final)

    def _timer(self, pause: int, slot: Any) -> QtCore.QTimer:
        timer = QtCore.QTimer()  # without a parent: FreeCAD may delete the form first
        timer.setSingleShot(True)
        timer.setInterval(pause)
        timer.timeout.connect(slot)
        return timer


class _Seen:
    """What is seen while the panel is open: the source, to be clicked at, and not the old result."""

    def __init__(self, obj: Any, source: Any, tool: Any) -> None:
        self._result, self._source = obj.ViewObject, source.ViewObject
        self._tool = None if tool is None else tool.ViewObject
        self._before = (self._result.Visibility, self._source.Visibility)
        self._transparency = getattr(self._source, "Transparency", None)
        self._result.Visibility, self._source.Visibility = False, True

    def see_through(self, on: bool) -> None:
        """Let a preview be seen through the source, or not."""
        if self._transparency is not None:
            self._source.Transparency = max(_SEE_THROUGH, self._transparency) if on else self._transparency

    def restore(self) -> None:
        """Show what was shown before."""
        self.see_through(False)
        self._result.Visibility, self._source.Visibility = self._before

    def show_result(self) -> None:
        """Show the result in place of what it is made of."""
        self._result.Visibility, self._source.Visibility = True, False
        if self._tool is not None:
            self._tool.Visibility = False
