"""FreeCAD as a module of this Python; where it is not installed, its tests are not collected.

FreeCAD brings an OpenCASCADE of its own, which must not meet that of CadQuery and build123d in one process.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]

#: Where Debian keeps FreeCAD's modules.
LIBRARY = os.environ.get("FREECAD_LIBRARY", "/usr/lib/freecad-python3/lib")


def _has_freecad() -> bool:
    if importlib.util.find_spec("OCP") is not None:
        return False
    for folder in (str(ROOT / "freecad_workbench"), str(ROOT)):
        if folder not in sys.path:
            sys.path.insert(0, folder)
    if "FreeCAD" not in sys.modules and importlib.util.find_spec("FreeCAD") is None:
        sys.path.append(LIBRARY)
    return importlib.util.find_spec("FreeCAD") is not None


HAS_FREECAD = _has_freecad()
collect_ignore_glob = ["gui_pytest.py"] if HAS_FREECAD else ["*.py"]


@pytest.fixture
def document() -> Iterator[Any]:
    """An empty document; all are closed after the test."""
    import FreeCAD as App

    yield App.newDocument("Test")
    for name in list(App.listDocuments()):
        App.closeDocument(name)


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Requests that were computed since the test began."""
    from freecad.cad_implicit_wb import client

    seen: list[Any] = []
    start: Callable[[Any], Any] = client.start

    def counted(request: Any) -> Any:
        seen.append(request)
        return start(request)

    monkeypatch.setattr(client, "start", counted)
    return seen


@pytest.fixture(scope="session", autouse=True)
def _child_ended() -> Iterator[None]:
    yield
    if HAS_FREECAD:
        from freecad.cad_implicit_wb import client

        client.shutdown()
