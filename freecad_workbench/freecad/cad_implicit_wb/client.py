"""Computing in a child process, so that FreeCAD's window never waits: :func:`start` gives a :class:`Task` to look at.

The child stays warm between jobs. One job runs at a time; others wait for it. A job that is cancelled has 0.2 s to stop
by itself, then the child is killed, and the next job starts a new one. A crash of the kernel, or lack of memory, ends
the child and makes the task an error; FreeCAD goes on.

Nothing here imports numba or scipy.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import itertools
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from .child import Child
from .errors import CancelledError, WorkbenchError
from .estimates import estimate, learn

__all__ = ["Answer", "Request", "Task", "WorkbenchError", "estimate", "key", "shutdown", "start"]

#: Seconds that a cancelled job has to stop by itself.
GRACE = 0.2

#: Seconds between two looks at a task that is waited for: a thirtieth, so that pictures move.
_TICK = 0.03

#: Options on which an answer does not depend.
_SAME_ANYWAY = ("threads", "memory_limit")

#: What is said of a child that ended in the middle of a job.
_DIED = (
    "the computation ended unexpectedly: the kernel crashed, or there was not enough memory. FreeCAD and your document "
    "are not harmed; try a coarser spacing or another radius.\nLast words: {}"
)


@dataclass(frozen=True, eq=False)
class Request:
    """What is to be done.

    Attributes
    ----------
    shape_brep : str or None
        The source as ``Part.Shape.exportBrepToString`` writes it, in its own frame.
    mesh : pair of arrays or None
        Of a source of triangles: vertices ``(V, 3)`` in mm, faces ``(F, 3)``.
    operation : str
        "fillet", "round", "smooth", "chamfer", "offset", "shell", "infill", "boolean", or "solid": a solid of a mesh.
    amount : float or None
        Radius, length, distance or thickness in mm; None if every edge has its own radius.
    edges : dict or None
        Numbers of edges (N of FreeCAD's EdgeN) to radii in mm; None for the whole part.
    options : dict
        ``result`` "solid" or "mesh"; ``spacing``, ``tolerance`` in mm; ``engine`` "exact" or "reinit"; ``force``;
        ``threads``; ``memory_limit`` in bytes; ``tangent``; ``exact_first``: FreeCAD's own kernel first, for fillets,
        chamfers and booleans; ``draft``: a coarse mesh for a preview; ``error``: tell the error at each vertex (for
        "mesh"). Of a chamfer ``second``; of a shell ``side`` ("inward", "outward", "both") and ``open`` (numbers of
        faces); of an infill ``cell``, ``kind`` and ``skin``; of a boolean ``kind`` ("union", "difference",
        "intersection"), and ``tool_brep`` or ``tool_mesh`` in the frame of the source. What is None is left out.
    """

    shape_brep: str | None
    mesh: tuple[Any, Any] | None
    operation: str
    amount: float | None
    edges: dict[int, float] | None
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Answer:
    """What came of it.

    Attributes
    ----------
    brep : str or None
        A solid, for ``Part.Shape.importBrepFromString``.
    vertices, faces : arrays or None
        ``(V, 3)`` in mm and ``(F, 3)``: the result as triangles, if that or a draft was asked for.
    error : (V,) array or None
        Error in mm at the vertices, positive where there is too much material; NaN where it is not known.
    error_bound : float or None
        Largest expected distance in mm from the true result; None if it is not known (parts that leak).
    exact_share : float
        Share of the area, from 0 to 1, on exact surfaces; 0 for meshes.
    engine : str
        Who made it, for the user.
    warnings : list of str
    spacing : float or None
        In mm.
    seconds : float
    volume_before, volume_after : float
        In mm³.
    """

    brep: str | None
    vertices: Any
    faces: Any
    error: Any
    error_bound: float | None
    exact_share: float
    engine: str
    warnings: list[str]
    spacing: float | None
    seconds: float
    volume_before: float
    volume_after: float


def key(request: Request) -> str:
    """Fingerprint of a request: two that are alike give the same answer."""
    total = hashlib.sha256()
    values = {f.name: getattr(request, f.name) for f in fields(Request)}
    values["options"] = {name: value for name, value in request.options.items() if name not in _SAME_ANYWAY}
    _digest(total, values)
    return total.hexdigest()


def _digest(total: Any, value: Any) -> None:
    """Add a value to a hash, whatever order a dict has and whether numbers are NumPy's."""
    if isinstance(value, dict):
        for name in sorted(value, key=str):
            if value[name] is not None:
                total.update(f"{name}=".encode())
                _digest(total, value[name])
    elif isinstance(value, np.ndarray):
        total.update(f"{value.dtype}{value.shape}".encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, tuple | list):
        total.update(f"({len(value)}".encode())
        for item in value:
            _digest(total, item)
    else:
        plain = float(value) if isinstance(value, int | float | np.number) else value
        total.update(f"{plain!r};".encode())


class Task:
    """Work that goes on elsewhere; made by :func:`start`. Only :meth:`poll` changes what its attributes tell.

    Attributes
    ----------
    request : Request
    done : bool
        Whether :meth:`result` has something to give, or to raise.
    stage : str
        What is being done: "waiting" (for another job), "starting", "compiling", and those of the library ("read",
        "mesh", "fillet", "contour", "check", "solid" …).
    fraction : float
        How much of the stage is done, from 0 to 1.
    """

    def __init__(self, request: Request) -> None:
        self.request = request
        self.done, self.stage, self.fraction = False, "waiting", 0.0
        self._number = next(_NUMBERS)
        self._news: queue.Queue[tuple[Any, ...]] = queue.Queue()
        self._cancelled, self._compiled = threading.Event(), False
        self._child: Child | None = None
        self._handing = threading.Lock()
        self._outcome: Answer | WorkbenchError | None = None
        threading.Thread(target=self._work, daemon=True).start()

    def poll(self) -> None:
        """Read what the child told; call it from a timer."""
        while not self.done:
            try:
                self._note(self._news.get_nowait())
            except queue.Empty:
                return

    def wait(self, timeout: float | None = None, on_tick: Callable[[Task], None] | None = None) -> bool:
        """Wait until it is done, at most so many seconds.

        ``on_tick(task)`` is called at each piece of news, and at least 30 times a second.

        Returns
        -------
        bool
            Whether it is done.
        """
        end = None if timeout is None else time.monotonic() + timeout
        self.poll()
        while not self.done and (end is None or time.monotonic() < end):
            with contextlib.suppress(queue.Empty):
                self._note(self._news.get(timeout=_TICK))
            if on_tick is not None and not self.done:
                on_tick(self)
        return self.done

    def cancel(self) -> None:
        """Stop it: within half a second it is done, and :meth:`result` raises CancelledError."""
        if self.done or self._cancelled.is_set():
            return
        self._cancelled.set()
        threading.Thread(target=self._stop, daemon=True).start()

    def result(self) -> Answer:
        """Give what came of it.

        Raises
        ------
        WorkbenchError
            With what was wrong, for the user; CancelledError if it was cancelled.
        """
        if isinstance(self._outcome, Answer):
            return self._outcome
        raise self._outcome or WorkbenchError("the computation is not finished yet")

    def _note(self, news: tuple[Any, ...]) -> None:
        kind, *rest = news
        if kind == "stage":
            self.stage, self.fraction = rest
            self._compiled |= self.stage == "compiling"
            return
        self._outcome = CancelledError("cancelled") if self._cancelled.is_set() else rest[0]
        if isinstance(self._outcome, Answer) and not self._compiled:
            learn(self.request, self._outcome)
        self.done, self.fraction = True, 1.0

    def _work(self) -> None:
        """Do the job in the child, from a thread of its own."""
        try:
            while not _BUSY.acquire(timeout=_TICK):
                self._check()
            try:
                answer = self._answer()
            finally:
                _BUSY.release()
            self._news.put(("done", Answer(**{f.name: answer[f.name] for f in fields(Answer)})))
        except WorkbenchError as error:
            self._news.put(("done", error))
        except Exception as error:
            self._news.put(("done", WorkbenchError(f"{type(error).__name__}: {error}")))

    def _check(self) -> None:
        if self._cancelled.is_set():
            raise CancelledError("cancelled")

    def _answer(self) -> dict[str, Any]:
        """Ask FreeCAD's own kernel, if it comes first, then the library."""
        job = {f.name: getattr(self.request, f.name) for f in fields(Request)}
        options = self.request.options
        if not options.get("exact_first") or options.get("draft") or options.get("result") == "mesh":
            return self._ask(job)
        try:
            exact = self._ask({**job, "kernel": True}, limit=KERNEL_LIMIT)
        except CancelledError:
            raise
        except WorkbenchError as error:
            exact = {"reason": str(error)}
        if "brep" in exact:
            return exact
        return self._ask({**job, "reason": exact["reason"]})

    def _ask(self, job: dict[str, Any], limit: float | None = None) -> dict[str, Any]:
        """Send a job and wait for its end; the child is killed after so many seconds.

        Raises
        ------
        WorkbenchError
            As the child tells it, or if it dies.
        """
        self._check()
        self._news.put(("stage", "starting", 0.0))
        child = self._child = _warm_child()
        timer = threading.Timer(limit, child.kill) if limit else None
        start = time.monotonic()
        try:
            self._check()  # again: whoever cancels before there is a child finds none to tell
            if timer:
                timer.start()
            child.send("job", self._number, job)
            while True:
                kind, number, *rest = child.receive()
                if number != self._number:
                    continue
                if kind == "stage":
                    self._news.put(("stage", *rest))
                elif kind == "answer":
                    return {**rest[0], "seconds": time.monotonic() - start}
                else:
                    raise (CancelledError if rest[0] == "cancelled" else WorkbenchError)(rest[1])
        except (EOFError, OSError, ValueError):  # the last if its streams are closed already
            words = child.last_words()
            _forget(child)
            if limit and time.monotonic() - start >= limit:
                raise WorkbenchError(f"no answer within {limit:g} s") from None
            raise WorkbenchError(_DIED.format(words)) from None
        finally:
            with self._handing:
                self._child = None
            if timer:
                timer.cancel()

    def _stop(self) -> None:
        """Ask the child to stop, and kill it if it does not."""
        child = self._child
        if child is None:
            return
        try:
            child.send("cancel", self._number)
        except (OSError, ValueError):
            return
        end = time.monotonic() + GRACE
        while self._child is child and time.monotonic() < end:
            time.sleep(0.01)
        with self._handing:
            if self._child is child:  # not given to another task in the meantime
                child.kill()


#: Seconds that FreeCAD's own kernel may take when it is asked first; it can loop for ever.
KERNEL_LIMIT = 60.0

#: Numbers of tasks: messages of an earlier one may still be on their way.
_NUMBERS = itertools.count(1)

#: Held by the task whose job runs.
_BUSY = threading.Lock()

#: The warm child, if there is one.
_child: Child | None = None


def start(request: Request) -> Task:
    """Begin the work; returns at once, also where the child must be started first."""
    return Task(request)


def shutdown() -> None:
    """End the child; the next :func:`start` starts another."""
    if _child is not None:
        _forget(_child)


def _warm_child() -> Child:
    global _child
    if _child is None or not _child.alive:
        shutdown()
        _child = Child()
    return _child


def _forget(child: Child) -> None:
    global _child
    if _child is child:
        _child = None
    child.close()


atexit.register(shutdown)
