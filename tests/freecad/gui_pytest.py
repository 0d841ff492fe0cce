"""Run inside FreeCAD's window: pytest as soon as the window is there; FreeCAD ends with pytest's exit code."""

import os
import shlex
import sys
import traceback

from PySide import QtCore


def go() -> None:
    code = 70  # whatever goes wrong before pytest answers
    sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__
    try:
        sys.modules_at_start = frozenset(sys.modules)  # a test looks at what the workbench imports when FreeCAD starts
        import pytest

        root = os.environ["CAD_IMPLICIT_ROOT"]
        os.chdir(root)
        chosen = [word for word in shlex.split(os.environ["CAD_IMPLICIT_PYTEST"]) if word] or ["tests/freecad/gui"]
        theirs = "ignore::ImportWarning"  # FreeCAD's own finders of modules
        code = int(pytest.main(["-p", "no:cacheprovider", "--rootdir", root, "-W", theirs, *chosen]))
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


QtCore.QTimer.singleShot(0, go)
