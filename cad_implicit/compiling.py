"""Kernels are compiled when they are first used, once per machine; a second process begins at the other end.

Numba compiles on one core only. Where the kernels of distances are missing, which all work on meshes begins with, those
of contours will be missing, too: a helper compiles them meanwhile, and this process, when it gets there, takes them
from Numba's cache. Nothing waits for the helper, and nothing is missing without it.
"""

from __future__ import annotations

import atexit
import logging
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from numba.core import event

#: Modules whose kernels are compiled first.
_FIRST = ("cad_implicit.kernels.linked", "cad_implicit.kernels.bvh")

#: Set for helpers, which have none of their own; users may set it, too.
_ALONE = "CAD_IMPLICIT_COMPILE_ALONE"


class Notice(event.Listener):  # type: ignore[misc]
    """Says so, once, when a kernel is compiled, which takes most of a minute, in silence otherwise; starts a helper."""

    def __init__(self) -> None:
        self._said = self._helped = False

    def on_start(self, event: Any) -> None:
        """Be told that Numba begins to compile a function."""
        module = event.data["dispatcher"].py_func.__module__ or ""
        if not self._said and module.startswith("cad_implicit."):
            self._said = True
            logging.getLogger("cad_implicit").warning("compiling kernels, once per machine (less than a minute) …")
        if not self._helped and module in _FIRST:
            self._helped = True
            _start_helper()

    def on_end(self, event: Any) -> None:
        """Be told that a function is compiled."""


def _start_helper() -> None:
    """Start a process that compiles the kernels of contours; it ends with this one."""
    python = sys.executable or ""  # within FreeCAD another program
    alone = _ALONE in os.environ or multiprocessing.parent_process() is not None  # other workers compile, too
    if alone or os.cpu_count() == 1 or not Path(python).name.startswith("python"):
        return
    path = os.pathsep.join(folder for folder in sys.path if folder)
    try:
        helper = subprocess.Popen(
            [python, "-P", "-m", __name__],
            env={**os.environ, _ALONE: "1", "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except OSError:
        return
    atexit.register(_end, helper)


def _end(helper: subprocess.Popen[bytes]) -> None:
    helper.terminate()
    helper.wait()


def main() -> None:
    """Contour a small part: two boxes, so that there are smooth faces, edges and corners of both kinds."""
    from .contouring import contour
    from .shapes import box

    contour((box((5, 4, 3)) | box((1.5, 1.7, 6))).turned((1, 2, 3), 0.7), 0.6)


if __name__ == "__main__":
    main()
