"""Finding a Python that can do the work, starting it, talking with it, ending it.

The child is a plain Python of FreeCAD's own version that imports FreeCAD as a module; ``freecadcmd`` where there is
none. It gets FreeCAD's search path, with FreeCAD's own folders last: they hold stand-ins for packages (``lazy_loader``)
that scikit-image does not start with.
"""

from __future__ import annotations

import collections
import contextlib
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import FreeCAD as App
import Part

from .errors import WorkbenchError
from .worker import SETUP, receive, send, skip_to_mark

_WORKER = Path(__file__).with_name("worker.py")

#: Folders within FreeCAD that go to the end of the child's search path.
_OWN_FOLDERS = ("Ext", "Mod")

#: Lines of a child's last words that are shown.
_LAST_WORDS = 6


class Child:
    """A process that computes, ready for jobs.

    Raises
    ------
    WorkbenchError
        If no Python on this machine can do it; with what each said.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        said = []
        for command in commands():
            self._start(command)
            try:
                skip_to_mark(self._process.stdout)
                version = tuple(self.receive()[1])
            except EOFError:
                said.append(f"{command[0]}: {self.last_words()}")
                continue
            if version == sys.version_info[:2]:
                return
            self.kill()
            said.append(f"{command[0]} is Python {version[0]}.{version[1]}")
        raise WorkbenchError("no process for computing could be started:\n" + "\n".join(said))

    def _start(self, command: list[str]) -> None:
        self._killed = False
        self._words: collections.deque[str] = collections.deque(maxlen=_LAST_WORDS)
        flags: Any = {"creationflags": getattr(subprocess, "CREATE_NO_WINDOW", 0)} if sys.platform == "win32" else {}
        self._process: Any = subprocess.Popen(  # its streams are pipes, never None
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=_environment(), **flags
        )
        self._listener = threading.Thread(target=self._listen, args=(self._process.stderr,), daemon=True)
        self._listener.start()

    def _listen(self, stream: Any) -> None:
        self._words.extend(line.decode(errors="replace").rstrip() for line in stream)

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it still runs, and goes on to."""
        return not self._killed and self._process.poll() is None

    def send(self, *message: Any) -> None:
        """Send a message; BrokenPipeError if the child is gone."""
        with self._lock:
            send(self._process.stdin, message)

    def receive(self) -> Any:
        """Wait for a message; EOFError if the child is gone."""
        return receive(self._process.stdout)

    def kill(self) -> None:
        """End it now."""
        self._killed = True
        self._process.kill()

    def last_words(self) -> str:
        """Tell how it ended, and what it wrote before."""
        code = self._process.wait()
        self._listener.join()
        return "\n".join([f"ended with code {code}", *self._words])

    def close(self) -> None:
        """End it and free what it holds."""
        self._process.kill()
        self._process.wait()
        self._listener.join()
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            with contextlib.suppress(BrokenPipeError):  # something was left in the pipe
                stream.close()


def commands() -> Iterator[list[str]]:
    """Commands that may start the child, the likeliest first."""
    major, minor = sys.version_info[:2]
    names = [f"python{major}.{minor}", "python3", "python"]
    suffix = ".exe" if sys.platform == "win32" else ""
    found = [sys.executable] if Path(sys.executable or "").name.startswith("python") else []
    for folder in (App.ConfigGet("BinPath"), Path(App.getHomePath(), "bin"), Path(sys.prefix, "bin"), sys.prefix):
        found += [str(path) for name in names if (path := Path(folder, name + suffix)).is_file()]
    found += [which for name in names if (which := shutil.which(name))]
    for python in dict.fromkeys(str(path) for path in found):
        yield [python, str(_WORKER)]
    for name in ("freecadcmd", "FreeCADCmd"):
        beside = Path(App.ConfigGet("BinPath"), name + suffix)
        command = str(beside) if beside.is_file() else shutil.which(name)
        if command:
            yield [command, str(_WORKER)]


def search_path() -> list[str]:
    """Where the child looks for modules: as FreeCAD does, with FreeCAD's own folders last."""
    paths = [path for path in dict.fromkeys(sys.path) if path and Path(path).exists()]
    own = [path for path in paths if set(_OWN_FOLDERS) & set(Path(path).parts)]
    rest = [path for path in paths if path not in own]
    library = [str(Path(module.__file__).parent) for module in (App, Part) if getattr(module, "__file__", None)]
    return list(dict.fromkeys([*rest, *library, *own]))


def _environment() -> dict[str, str]:
    """Environment of the child; threads of OpenMP that wait sleep, and do not take the window's time."""
    setup = json.dumps({"path": search_path()})
    return {**os.environ, SETUP: setup, "OMP_WAIT_POLICY": "passive", "PYTHONIOENCODING": "utf-8"}
