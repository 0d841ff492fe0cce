"""The child process that computes: run as a script by :mod:`child`, beside FreeCAD and without its window.

Messages are pickles behind their length, over stdin and stdout. It ends itself when its parent is gone. Nothing but the
standard library is imported before the first message, so that the parent, too, can use :func:`send` and
:func:`receive`.

From the parent: ``("job", number, job)`` and ``("cancel", number)``. To the parent, after :data:`MARK`:
``("ready", version of Python)``, ``("stage", number, stage, fraction)``, ``("answer", number, dict)`` or
``("error", number, kind, message)``.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import pickle
import queue
import struct
import sys
import threading
import time
from pathlib import Path
from typing import Any, BinaryIO

#: Variable of the environment with the setup of the child, as JSON: ``path``, what goes into ``sys.path``.
SETUP = "CAD_IMPLICIT_WORKER"

#: First bytes of the child; what a program prints before (``freecadcmd`` its banner) is skipped.
MARK = b"\x00cad_implicit worker\x00"

#: Seconds between two messages on progress: a bar is smooth at ten a second.
_PAUSE = 0.1

#: The window comes first where both want a processor.
_NICE = 5

_HEAD = struct.Struct("<Q")


class Stopped(Exception):  # noqa: N818 (not an error)
    """The parent cancelled the job."""


def send(stream: BinaryIO, message: Any) -> None:
    """Write one message."""
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    stream.write(_HEAD.pack(len(data)))
    stream.write(data)
    stream.flush()


def receive(stream: BinaryIO) -> Any:
    """Read one message; EOFError if the other side is gone."""
    size = _HEAD.unpack(_read(stream, _HEAD.size))[0]
    return pickle.loads(_read(stream, size))


def skip_to_mark(stream: BinaryIO) -> None:
    """Read up to the end of :data:`MARK`; EOFError if it never comes."""
    seen = b""
    while not seen.endswith(MARK):
        seen = (seen + _read(stream, 1))[-len(MARK) :]


def _read(stream: BinaryIO, size: int) -> bytes:
    data = stream.read(size)
    if data is None or len(data) < size:
        raise EOFError
    return data


class Worker:
    """Jobs one after another; messages are read in a thread of their own, so that a job can be cancelled."""

    def __init__(self, source: BinaryIO, target: BinaryIO) -> None:
        self._source, self._target = source, target
        self._jobs: queue.Queue[tuple[int, Any]] = queue.Queue()
        self._cancelled: set[int] = set()
        self._lock = threading.Lock()
        self._number, self._told, self._now = 0, 0.0, ("starting", 0.0)

    def tell(self, *message: Any) -> None:
        """Send a message."""
        with self._lock:
            send(self._target, message)

    def listen(self) -> None:
        """Read messages until the parent is gone; then end the process, whatever it is doing."""
        try:
            while True:
                kind, number, *rest = receive(self._source)
                if kind == "job":
                    self._jobs.put((number, *rest))
                else:
                    self._cancelled.add(number)
        except (EOFError, OSError):
            os._exit(0)

    def progress(self, stage: str, fraction: float) -> None:
        """Tell how far a job is; ends it if it was cancelled."""
        if self._number in self._cancelled:
            raise Stopped
        now = time.monotonic()
        if stage != self._now[0] or now - self._told > _PAUSE:
            self._now, self._told = (stage, fraction), now
            self.tell("stage", self._number, stage, float(fraction))

    def compiling(self, begins: bool) -> None:
        """Tell that a kernel is being compiled, or that work goes on."""
        stage, fraction = ("compiling", 0.0) if begins else self._now
        self.tell("stage", self._number, stage, fraction)

    def serve(self, jobs: Any) -> None:
        """Do jobs for ever."""
        while True:
            self._number, job = self._jobs.get()
            try:
                self.progress("starting", 0.0)
                self.tell("answer", self._number, jobs.run(job, self))
            except Stopped:
                self.tell("error", self._number, "cancelled", "cancelled")
            except MemoryError:
                self.tell("error", self._number, "error", "there is not enough memory for this; use a coarser spacing")
            except Exception as error:
                self.tell("error", self._number, "error", jobs.message(error))


def load(name: str) -> Any:
    """Import a module from beside this file, without the package and what that may import of FreeCAD's window."""
    package = "cad_implicit_worker"
    if package not in sys.modules:
        spec = importlib.machinery.ModuleSpec(package, None, is_package=True)
        spec.submodule_search_locations = [str(Path(__file__).parent)]
        sys.modules[package] = importlib.util.module_from_spec(spec)
    return importlib.import_module(f"{package}.{name}")


def main() -> None:
    """Serve the parent."""
    target = os.fdopen(os.dup(1), "wb")
    if hasattr(os, "nice"):
        os.nice(_NICE)
    os.dup2(2, 1)  # whatever a kernel prints must not come between the messages
    sys.path[:] = json.loads(os.environ.pop(SETUP))["path"]
    target.write(MARK)
    worker = Worker(sys.stdin.buffer, target)
    worker.tell("ready", sys.version_info[:2])
    threading.Thread(target=worker.listen, daemon=True).start()
    worker.serve(load("jobs"))


if __name__ == "__main__" or os.environ.get(SETUP):
    main()
