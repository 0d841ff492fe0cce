"""Threads, progress and cancellation: one lock around parallel kernels, one callback type.

Numba's portable threading layer aborts the process when two threads enter parallel kernels at once, so every
parallel kernel runs inside :func:`threads`.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from threading import RLock
from typing import Any

from .errors import ForkedError

#: Called as ``progress(stage, fraction)`` with fraction in [0, 1]; it may raise to cancel the work.
Progress = Callable[[str, float], None]

_LOCK = RLock()

#: Number of threads of whoever holds the lock, None if nobody does.
_running: int | None = None

#: Whether this process is the copy of one whose kernels run on OpenMP, which ends copies that use it.
_forked = False

#: Fewer items than this are not worth a second thread: starting one on a busy machine takes 2 ms on average (8 ms at
#: the 95th percentile), the work on them under 1 ms.
_SERIAL_ITEMS = 20_000

#: A question to a tree of triangles is as much work as so many items.
QUERY = 10


def no_progress(stage: str, fraction: float) -> None:
    """Ignore progress: the default callback."""


@contextmanager
def threads(count: int | None = None, items: int = _SERIAL_ITEMS) -> Iterator[None]:
    """Hold the lock of the parallel kernels, running them on ``count`` threads (default: all cores).

    One thread is enough for few ``items``.

    Raises
    ------
    ValueError
        If ``count`` is less than one.
    ForkedError
        In a process that was forked from one in which kernels ran on OpenMP.
    """
    global _running
    if _forked:
        raise ForkedError(
            "this process was forked from one in which kernels ran on OpenMP, which would end it: start processes by "
            'multiprocessing.get_context("spawn"), or use another threading layer (pip install tbb)'
        )
    if count is not None and count < 1:
        raise ValueError(f"threads must be at least 1, not {count}")
    with _LOCK:
        numba = compiler()
        outer = _running
        before = outer or numba.get_num_threads()
        available = int(numba.config.NUMBA_NUM_THREADS)
        wanted = min(count or os.cpu_count() or 1, available) if items >= _SERIAL_ITEMS else 1
        if wanted != before:  # setting it takes 20 microseconds
            numba.set_num_threads(wanted)
        _running = wanted
        try:
            yield
        finally:
            _running = outer
            if wanted != before:
                numba.set_num_threads(before)


def _after_fork() -> None:
    """Note in a forked process on what the kernels of its parent run."""
    global _forked
    if compiler.cache_info().currsize:
        try:
            _forked = _forked or compiler().threading_layer() == "omp"
        except ValueError:  # none has run
            return


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


@cache
def compiler() -> Any:
    """Give Numba, set up: before parallel kernels run, and so that it is told when kernels are compiled."""
    # Threads of OpenMP that wait should sleep, not spin: on two cores shared with three other jobs a fillet took 37 s
    # with spinning threads and 9 s with sleeping ones. Read by OpenMP when the first parallel kernel runs.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    import numba
    from numba.core import event

    from .compiling import Notice

    event.register("numba:compile", Notice())
    with suppress(ImportError):  # its threads are not waited for at exit, which was seen to take for ever
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(import_module("numba.np.ufunc.tbbpool")))
    return numba
