"""Progress of the command line: a bar on a terminal, and Ctrl-C."""

from __future__ import annotations

import logging
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .parallel import Progress


@contextmanager
def progress_bar(silent: bool) -> Iterator[Progress]:
    """Progress bar on a terminal; nothing in a pipe. Ctrl-C cancels."""
    with _interruptible() as check:
        if silent:
            logging.getLogger("cad_implicit").setLevel(logging.ERROR)
        if silent or not sys.stderr.isatty():
            yield check
            return
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (TextColumn("{task.description:12}"), BarColumn(), TimeElapsedColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("start", total=1.0)

            def show(stage: str, fraction: float) -> None:
                check(stage, fraction)
                bar.update(task, description=stage, completed=fraction)

            yield show


@contextmanager
def _interruptible() -> Iterator[Progress]:
    """Give a progress callback that raises KeyboardInterrupt after Ctrl-C or SIGTERM.

    The signal itself raises too, but where it falls into a destructor Python only reports it and goes on, and where it
    falls into a compiled module another error may come of it.
    """
    told = False

    def stop(number: int, frame: object) -> None:
        nonlocal told
        told = True
        raise KeyboardInterrupt

    def check(stage: str, fraction: float) -> None:
        if told:
            raise KeyboardInterrupt

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield check
    except Exception:
        if told:
            raise KeyboardInterrupt from None
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
