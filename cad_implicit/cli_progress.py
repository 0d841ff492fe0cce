"""Progress of the command line: a bar on a terminal, a word when kernels are compiled, and Ctrl-C."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from .parallel import Progress


@contextmanager
def progress_bar(silent: bool) -> Iterator[Progress]:
    """Progress bar on a terminal; nothing in a pipe. Says once when kernels are being compiled. Ctrl-C cancels."""
    with _interruptible() as check:
        if silent:
            yield check
            return
        with _compile_notice():
            if not sys.stderr.isatty():
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


@contextmanager
def _compile_notice() -> Iterator[None]:
    """Say so, once, when a kernel is compiled for the first time on this machine."""
    from numba.core import event

    class Notice(event.Listener):  # type: ignore[misc]
        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                typer.echo("compiling kernels, once per machine (about a minute) …", err=True)
            self.said = True

        def on_end(self, event: object) -> None:
            pass

    with event.install_listener("numba:compile", Notice()):
        yield
