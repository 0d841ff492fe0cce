"""Tasks of the child process, followed from the window: a timer polls them, nothing waits for them."""

from __future__ import annotations

from typing import Any

import FreeCADGui as Gui

from .qt import QtCore, QtWidgets
from .wording import stage_in_words

#: Milliseconds between two looks at a task: a bar is smooth, and a cancelled task is seen to end within a tenth of
#: the half second that Cancel may take.
POLL = 50

#: Milliseconds after which a recompute that is still computing shows its progress.
_PATIENCE = 400


class Runner(QtCore.QObject):
    """One task at a time; a new one takes the place of the one before."""

    progressed = QtCore.Signal(str, float)
    finished = QtCore.Signal(object)
    failed = QtCore.Signal(object)

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self.task: Any = None
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(POLL)
        self._timer.timeout.connect(self._look)

    @property
    def busy(self) -> bool:
        """Whether a task is under way."""
        return self.task is not None

    def follow(self, task: Any) -> None:
        """Follow a task to its end; one that was followed before is cancelled."""
        self.stop()
        self.task = task
        self._timer.start()

    def stop(self) -> None:
        """Cancel the task, if there is one. Nothing more is heard of it."""
        self._timer.stop()
        task, self.task = self.task, None
        if task is not None:
            task.cancel()

    def _look(self) -> None:
        task = self.task
        task.poll()
        if not task.done:
            self.progressed.emit(task.stage, task.fraction)
            return
        self._timer.stop()
        self.task = None
        try:
            answer = task.result()
        except Exception as error:  # whatever it is, the user is told
            self.failed.emit(error)
        else:
            self.finished.emit(answer)


class Progress(QtWidgets.QWidget):
    """A bar with the stage above it."""

    def __init__(self) -> None:
        super().__init__()
        self.stage = QtWidgets.QLabel()
        self.stage.setWordWrap(True)
        self.bar = QtWidgets.QProgressBar()
        self.bar.setRange(0, 1000)
        layout = QtWidgets.QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.stage)
        layout.addWidget(self.bar)

    def show_stage(self, stage: str, fraction: float) -> None:
        """Show how far a task is; a bar that only moves where nobody knows."""
        self.stage.setText(stage_in_words(stage))
        unknown = stage in ("starting", "compiling")
        self.bar.setRange(0, 0 if unknown else 1000)
        self.bar.setValue(0 if unknown else round(1000 * fraction))


class WaitingDialog(QtWidgets.QDialog):
    """Shows the progress of a recompute, with Cancel; everything else waits, as the document must not change now."""

    def __init__(self, task: Any, label: str) -> None:
        super().__init__(Gui.getMainWindow())
        self.setObjectName("cad_implicit_waiting")
        self.setWindowTitle(label)
        self.setMinimumWidth(320)
        self._task = task
        self.progress = Progress()
        buttons = QtWidgets.QDialogButtonBox(QtWidgets.QDialogButtonBox.Cancel)
        buttons.rejected.connect(self.reject)
        layout = QtWidgets.QVBoxLayout(self)
        layout.addWidget(self.progress)
        layout.addWidget(buttons)
        self.setModal(True)

    def reject(self) -> None:
        """Cancel the task; the dialog closes when it has ended."""
        self._task.cancel()


def wait_in_window(task: Any, label: str) -> None:
    """Keep the window alive until a task has ended: the hook that features call while they are recomputed.

    A nested event loop runs. Input goes to the dialog only, once it is shown, and to nothing before, so no one can
    delete what is being computed.
    """
    loop = QtCore.QEventLoop()
    dialog = WaitingDialog(task, label)
    timer = QtCore.QTimer()
    timer.setInterval(POLL)

    def look() -> None:
        task.poll()
        if task.done:
            loop.quit()
        else:
            dialog.progress.show_stage(task.stage, task.fraction)

    timer.timeout.connect(look)
    QtCore.QTimer.singleShot(_PATIENCE, lambda: None if task.done else dialog.show())
    timer.start()
    blocker = _InputBlocker(dialog)
    QtWidgets.QApplication.instance().installEventFilter(blocker)
    try:
        if not task.done:
            loop.exec() if hasattr(loop, "exec") else loop.exec_()
    finally:
        timer.stop()
        QtWidgets.QApplication.instance().removeEventFilter(blocker)
        dialog.hide()
        dialog.deleteLater()


class _InputBlocker(QtCore.QObject):
    """Swallows input to everything but one dialog."""

    _INPUT = frozenset(
        (
            QtCore.QEvent.MouseButtonPress,
            QtCore.QEvent.MouseButtonRelease,
            QtCore.QEvent.MouseButtonDblClick,
            QtCore.QEvent.KeyPress,
            QtCore.QEvent.KeyRelease,
            QtCore.QEvent.Shortcut,
            QtCore.QEvent.ShortcutOverride,
            QtCore.QEvent.ContextMenu,
            QtCore.QEvent.Close,
        )
    )

    def __init__(self, dialog: QtWidgets.QWidget) -> None:
        super().__init__()
        self._dialog = dialog

    def eventFilter(self, watched: QtCore.QObject, event: QtCore.QEvent) -> bool:  # noqa: N802 - named by Qt
        if event.type() not in self._INPUT:
            return False
        if isinstance(watched, QtWidgets.QWidget):
            return watched.window() is not self._dialog
        return event.type() == QtCore.QEvent.Shortcut  # to an action, of the main window
