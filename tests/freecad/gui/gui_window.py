"""What the tests in FreeCAD's window share: a document, time that passes, screenshots, gaps."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui
import pytest
from freecad.cad_implicit_wb import preferences
from freecad.cad_implicit_wb.qt import QtCore, QtGui, QtWidgets

#: Screenshots for the README; others go into a temporary folder, or where CAD_IMPLICIT_SHOTS says.
SCREENSHOTS = Path(__file__).parents[3] / "freecad_workbench" / "screenshots"

#: Seconds that anything may take before a test fails; kernels are compiled on the way.
PATIENCE = 240.0


class Window:
    """FreeCAD's window, with time that passes in it."""

    def __init__(self, shots: Path) -> None:
        self._shots = shots
        self.main = Gui.getMainWindow()

    def pump(self, seconds: float = 0.0) -> None:
        """Let events happen for a while."""
        end = time.monotonic() + seconds
        while True:
            QtWidgets.QApplication.processEvents(QtCore.QEventLoop.AllEvents, 20)
            if time.monotonic() >= end:
                return
            time.sleep(0.002)

    def until(self, met: Callable[[], Any], seconds: float = PATIENCE) -> Any:
        """Let events happen until something is true; fails after so many seconds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.pump()
            if found := met():
                return found
            time.sleep(0.002)
        self.shot("timeout", keep=False)
        raise AssertionError(f"not within {seconds:g} s: {met.__code__.co_names}")

    def find(self, name: str) -> Any:
        """Return a shown dialog by its object name, or None."""
        shown = QtWidgets.QApplication.topLevelWidgets()
        return next((w for w in shown if w.objectName() == name and w.isVisible()), None)

    def shot(self, name: str, *, keep: bool = True) -> Path:
        """Take a picture of the screen."""
        self.pump(0.3)
        picture = QtGui.QGuiApplication.primaryScreen().grabWindow(0)
        folder = SCREENSHOTS if keep and os.environ.get("CAD_IMPLICIT_SHOTS") == "keep" else self._shots
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{name}.png"
        assert picture.save(str(path), "PNG", 0)
        return path

    def select(self, obj: Any, *names: str) -> None:
        """Select an object, or elements of it, as a click does."""
        Gui.Selection.clearSelection()
        for name in names or ("",):
            Gui.Selection.addSelection(obj.Document.Name, obj.Name, name)
        self.pump()

    def click(self, view: Any, point: Any) -> None:
        """Click on a point of the 3-D view with the mouse of the screen."""
        self.pump(1)  # the camera may still be moving
        area = view.graphicsView().viewport()
        scale = view.getSize()[0] / area.width()  # of screens whose pixels are not Qt's
        across, up = (n / scale for n in view.getPointOnScreen(point))
        place = area.mapToGlobal(QtCore.QPoint(round(across), round(area.height() - 1 - up)))
        own = (round(place.x() * scale), round(place.y() * scale))
        for x, y in ((own[0] + 40, own[1] + 40), own):
            subprocess.run(["xdotool", "mousemove", str(x), str(y)], check=True)
            self.pump(0.3)
        subprocess.run(["xdotool", "click", "1"], check=True)
        self.pump(0.3)

    def active(self, command: str) -> bool:
        """Whether a command is not greyed out."""
        return bool(Gui.Command.get(command).isActive())

    def press(self, role: Any) -> None:
        """Press OK or Cancel of the task panel."""
        docks = self.main.findChildren(QtWidgets.QDialogButtonBox)
        button = next(b for box in docks if box.isVisible() and (b := box.button(role)) is not None)
        button.click()

    def task(self) -> Any:
        """Return the task of the open panel, or None."""
        objects = App.ActiveDocument.Objects
        panels = (getattr(getattr(obj.ViewObject, "Proxy", None), "panel", None) for obj in objects)
        return next((p.runner.task for p in panels if p is not None), None)

    def ok(self) -> None:
        self.press(QtWidgets.QDialogButtonBox.Ok)

    def cancel(self) -> None:
        self.press(QtWidgets.QDialogButtonBox.Cancel)


@pytest.fixture
def window(tmp_path: Path, document: Any) -> Iterator[Window]:
    """FreeCAD's window with the workbench open and an empty document."""
    Gui.activateWorkbench("ImplicitWorkbench")
    App.ParamGet(preferences.GROUP).SetBool("Preview", True)
    App.ParamGet("User parameter:BaseApp/Preferences/View").SetBool("Gradient", False)
    App.ParamGet("User parameter:BaseApp/Preferences/View").SetBool("Simple", True)
    App.ParamGet("User parameter:BaseApp/Preferences/View").SetUnsigned("BackgroundColor", 0xF4F6F8FF)
    found = Window(Path(os.environ.get("CAD_IMPLICIT_SHOTS_FOLDER", tmp_path)))
    found.pump(0.1)
    yield found
    if Gui.Control.activeDialog():
        Gui.Control.closeDialog()
    for box in QtWidgets.QApplication.topLevelWidgets():
        if box.objectName().startswith("cad_implicit_") and box.isVisible():
            box.close()
    found.pump(0.05)


@pytest.fixture
def document() -> Iterator[Any]:
    """An empty document, closed after the test."""
    made = App.newDocument("Test")
    yield made
    for name in list(App.listDocuments()):
        App.closeDocument(name)


class Gaps:
    """The longest pause of the window's event loop, seen by a timer that should fire every 10 ms."""

    def __init__(self, what: str) -> None:
        self.largest, self.busy, self._what = 0.0, 0.0, what
        self._last, self._used = time.perf_counter(), time.thread_time()
        self._timer = QtCore.QTimer()
        self._timer.setInterval(10)
        self._timer.setTimerType(QtCore.Qt.PreciseTimer)
        self._timer.timeout.connect(self._fired)

    def __enter__(self) -> Gaps:
        self.forgive()
        self._timer.start()
        return self

    def __exit__(self, *_: Any) -> None:
        self._timer.stop()
        busy = f"at most {self.busy * 1000:.0f} ms of its own work between two events"
        tell(f"{self._what}: largest gap of the window {self.largest * 1000:.0f} ms; {busy}")

    def forgive(self) -> None:
        """Leave out what happened since the timer fired last, as screenshots do."""
        self._last, self._used = time.perf_counter(), time.thread_time()

    def _fired(self) -> None:
        now, used = time.perf_counter(), time.thread_time()
        self.largest, self.busy = max(self.largest, now - self._last), max(self.busy, used - self._used)
        self._last, self._used = now, used


def tell(text: str) -> None:
    """Print a measured figure, whatever pytest does with prints."""
    sys.__stdout__.write(f"\n{text} (load of the machine {os.getloadavg()[0]:.1f})\n")
    sys.__stdout__.flush()


def panel() -> Any:
    """Return the inputs of the open task panel, or None."""
    return Gui.getMainWindow().findChild(QtWidgets.QWidget, "cad_implicit_panel")


def closed() -> bool:
    """Whether no task panel is open."""
    return not Gui.Control.activeDialog()
