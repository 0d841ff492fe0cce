"""Jobs of the child process: from a source to an answer, with the library and FreeCAD's Part, without FreeCAD's window.

Loaded by :mod:`worker`. What takes long to import is imported here, while the child waits for its first job.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol

import FreeCAD  # noqa: F401  (Part finds its libraries by it)
import numba.core.event
import Part

from cad_implicit.cad import open_part
from cad_implicit.errors import CadImplicitError, GeometryWarning

from . import kernel, work

#: What the library says to users of the command line, and what it is here.
_WORDS = (
    (re.compile(r",? or (use )?--force( to [^.;]*)?"), ", or tick Force"),
    (re.compile(r"; `cad-implicit edges` lists them"), ""),
    (re.compile(r"--force"), "Force"),
)


class Teller(Protocol):
    """What a job tells the parent with."""

    def progress(self, stage: str, fraction: float) -> None:
        """Tell how far it is; raises if it is cancelled."""

    def compiling(self, begins: bool) -> None:
        """Tell that a kernel is being compiled."""


class _Compiling(numba.core.event.Listener):
    """Passes on that kernels are being compiled; kernels that are called by others within those."""

    def __init__(self) -> None:
        self.teller: Teller | None = None
        self._depth = 0

    def on_start(self, event: Any) -> None:
        self._depth += 1
        if self.teller is not None and self._depth == 1:
            self.teller.compiling(True)

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        if self.teller is not None and self._depth == 0:
            self.teller.compiling(False)


_compiling = _Compiling()
numba.core.event.register("numba:compile", _compiling)


def run(job: dict[str, Any], teller: Teller) -> dict[str, Any]:
    """Do one job: a Request as a dict; gives an Answer as one, without ``seconds``."""
    options = {name: value for name, value in job["options"].items() if value is not None}
    shape = _shape(job["shape_brep"])
    if job.get("kernel"):
        return kernel.exact(shape, job["operation"], job["edges"], options)
    with _told(teller) as notes:
        part = open_part(tuple(job["mesh"]) if shape is None else shape)
        answer = work.done(part, shape, job["operation"], job["amount"], job["edges"], options, teller.progress)
    answer["warnings"] = list(dict.fromkeys(_plain(note) for note in [*answer["warnings"], *notes]))
    if job.get("reason"):
        answer["warnings"].insert(0, f"FreeCAD's own kernel was asked first: {job['reason']}")
    return answer


def message(error: Exception) -> str:
    """Put an error into words for the user."""
    text = _plain("\n".join([str(error), *getattr(error, "__notes__", ())]))
    return text if isinstance(error, CadImplicitError) else f"{type(error).__name__}: {text}"


@contextmanager
def _told(teller: Teller) -> Iterator[list[str]]:
    """Collect what the library tells."""
    _compiling.teller = teller
    notes: list[str] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", GeometryWarning)
            yield notes
        notes += [str(w.message) for w in caught if issubclass(w.category, GeometryWarning)]
    finally:
        _compiling.teller = None


def _plain(text: str) -> str:
    for pattern, words in _WORDS:
        text = pattern.sub(words, text)
    return text


def _shape(brep: str | None) -> Any:
    if brep is None:
        return None
    shape = Part.Shape()
    shape.importBrepFromString(brep)
    return shape
