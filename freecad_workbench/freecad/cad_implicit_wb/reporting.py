"""The accuracy report of a feature, made by the command line tool in a process of its own and opened in the browser."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui

from . import child, preferences
from .errors import WorkbenchError
from .messages import tell_error
from .qt import QtCore, QtGui, QtWidgets, translate

#: What the process runs: the command line tool, with FreeCAD's search path as its first argument.
_PROGRAM = """
import json, sys
sys.path[:] = json.loads(sys.argv.pop(1))
import FreeCAD, Part
from cad_implicit.cli import main
main()
"""

#: Reports under way: Qt keeps no objects of Python alive.
_running: list[Report] = []


def start(obj: Any) -> Report:
    """Begin a report on a feature; it goes on beside the work.

    Raises
    ------
    WorkbenchError
        If edges of the feature have radii of their own, or its source is a mesh.
    """
    report = Report(obj)
    _running.append(report)
    return report


def arguments(obj: Any, folder: Path) -> list[str]:
    """Command line of the report on a feature; its source is written into the folder.

    Raises
    ------
    WorkbenchError
        As :func:`start`.
    """
    request = obj.Proxy.request(obj)
    if request.shape_brep is None:
        raise WorkbenchError(translate("reports compare with the exact kernel, which does not take meshes"))
    if len(set((request.edges or {}).values())) > 1:
        raise WorkbenchError(translate("reports are for one radius; this feature has edges with their own"))
    part = folder / "part.brep"
    part.write_text(request.shape_brep, encoding="utf-8")
    words = ["validate", str(part), "-o", str(folder), "--quiet", "--operation", request.operation]
    words += ["-r", repr(float(next(iter((request.edges or {}).values()), request.amount)))]
    if request.edges is not None:
        words += ["--edges", ",".join(str(n) for n in sorted(request.edges))]
    if preferences.threads():
        words += ["--threads", str(preferences.threads())]
    return words


class Report(QtCore.QObject):
    """One report under way, with a small window that has Cancel.

    Attributes
    ----------
    page : Path
        ``report.html``, once it is done.
    """

    done = QtCore.Signal()

    def __init__(self, obj: Any) -> None:
        super().__init__(Gui.getMainWindow())
        self._folder = Path(tempfile.mkdtemp(prefix="cad_implicit_report_"))
        words = arguments(obj, self._folder)
        self.page = self._folder / "report.html"
        self._cancelled = False
        self._process = QtCore.QProcess(self)
        self._process.finished.connect(self._finished)
        self._box = QtWidgets.QProgressDialog(
            translate("Measuring the error of {} …").format(obj.Label), translate("Cancel"), 0, 0, Gui.getMainWindow()
        )
        self._box.setWindowTitle(translate("Validate"))
        self._box.setWindowModality(QtCore.Qt.NonModal)
        self._box.setMinimumDuration(0)
        self._box.canceled.connect(self.cancel)
        python = next(iter(child.commands()))[0]
        self._process.start(python, ["-c", _PROGRAM, json.dumps(child.search_path()), *words])
        self._box.show()

    def cancel(self) -> None:
        """End the process."""
        self._cancelled = True
        self._process.kill()

    def _finished(self, *_: Any) -> None:
        """Open the page, or tell why there is none; a report that says "failed" is a report, too."""
        self._box.canceled.disconnect(self.cancel)
        self._box.close()
        self._box.deleteLater()
        _running.remove(self)
        if self._cancelled:
            return
        if self.page.is_file():
            App.Console.PrintMessage(translate("Report: {}").format(self.page) + "\n")
            QtGui.QDesktopServices.openUrl(QtCore.QUrl.fromLocalFile(str(self.page)))
        else:
            said = bytes(self._process.readAllStandardError()).decode(errors="replace").strip()
            tell_error(translate("There is no report"), said or translate("the process ended without a word"))
        self.done.emit()
