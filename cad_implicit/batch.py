"""Many parts: the same operation on files and folders, each in a process that may crash without harm to the others."""

from __future__ import annotations

import json
import os
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from .cad import INPUT_EXTENSIONS, save
from .cad.files import sweep
from .errors import CadImplicitError, ClusterError, FileFormatError
from .job import run
from .parallel import Progress, no_progress
from .sizing import available_memory, limit_memory

#: Where the results of a folder are written down.
LEDGER = "batch.jsonl"

#: Tries for a part whose process was killed.
_TRIES = 2

#: Seconds between two looks at progress, and until a scheduler must have answered.
_LOOK, _CONNECT = 0.2, 10.0


@dataclass(frozen=True)
class Item:
    """A part of a batch, and where its result goes."""

    part: Path
    output: Path


#: A part, and what became of it.
_Found = tuple[Item, dict[str, Any]]


def items(parts: Sequence[Path], folder: Path, suffix: str) -> list[Item]:
    """Files, and files of folders, with their outputs; folders keep their structure.

    Raises
    ------
    FileFormatError
        If there is nothing to read.
    """
    found: list[tuple[Path, Path]] = []
    for part in parts:
        if part.is_dir():
            inside = sorted(p for p in part.rglob("*") if p.is_file() and p.suffix.lower() in INPUT_EXTENSIONS)
            found += [(p, p.relative_to(part)) for p in inside if folder.resolve() not in p.resolve().parents]
        else:
            found.append((part, Path(part.name)))
    if not found:
        raise FileFormatError(f"there is no part in {', '.join(map(str, parts))}; parts end in {INPUT_EXTENSIONS}")
    result, taken = [], set()
    for part, relative in found:
        target = folder / relative.with_suffix(suffix)
        if target in taken:  # a.step and a.stl, or the same name from two places
            target = folder / relative.with_name(f"{relative.stem}_{part.suffix[1:]}{suffix}")
        number = 2
        while target in taken:
            target = folder / relative.with_name(f"{relative.stem}_{number}{suffix}")
            number += 1
        taken.add(target)
        result.append(Item(part, target))
    return result


def run_batch(
    chosen: Sequence[Item],
    folder: Path,
    operation: str,
    amount: float | None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Progress = no_progress,
    **options: Any,
) -> Iterator[dict[str, Any]]:
    """Work on all parts; yields what happened to each as soon as it is known.

    Parts that a ledger in the folder tells to be done with the same operation and options, and unchanged since, are not
    done again. A part whose process is killed is tried once more. The processes share the memory that may be used.

    Parameters
    ----------
    chosen : sequence of Item
    folder : Path
        Gets the ledger, one JSON object a line.
    operation, amount, options
        As for :func:`cad_implicit.run`.
    workers : int, optional
        Processes; by default as many as cores.
    scheduler : str, optional
        Address (``tcp://…``) of a scheduler of dask.distributed whose workers do the work instead, and see the same
        files. How often a part is tried whose worker is killed, the scheduler is set to.
    progress : callable
        Called as ``progress("parts", fraction)``; may raise to cancel: parts that are being worked on leave nothing.

    Raises
    ------
    ClusterError
        If the scheduler does not answer.
    """
    folder.mkdir(parents=True, exist_ok=True)
    ledger = folder / LEDGER
    known = _known(ledger)
    task = {"operation": operation, "amount": amount, **options}
    count = max(1, min(workers or os.cpu_count() or 1, len(chosen)))
    todo = []
    for item in chosen:
        before = known.get(str(item.output))
        if before is not None and before["stamp"] == _stamp(item, task) and item.output.exists():
            yield {**before, "resumed": True}
        else:
            sweep(item.output)
            todo.append(item)
    done = len(chosen) - len(todo)
    rows = _on_cluster(todo, task, scheduler) if scheduler else _in_processes(todo, task, count)
    with ledger.open("a", encoding="utf-8") as out, closing(rows):
        for found in rows:
            progress("parts", done / len(chosen))
            if found is None:
                continue
            item, row = found
            row = {"input": str(item.part), "output": str(item.output), "stamp": _stamp(item, task), **row}
            done += 1
            out.write(json.dumps(row) + "\n")
            out.flush()
            yield row
    progress("parts", 1.0)


def _in_processes(todo: Sequence[Item], task: dict[str, Any], count: int) -> Generator[_Found | None]:
    """Work on parts in processes of this machine; None is a moment to look up."""
    waiting: SimpleQueue[Item] = SimpleQueue()
    news: SimpleQueue[_Found] = SimpleQueue()
    for item in todo:
        waiting.put(item)
    stop: list[bool] = []
    share = available_memory() // count
    with ThreadPoolExecutor(count) as pool:
        threads = [pool.submit(_serve, waiting, news, task, share, stop) for _ in range(count)]
        try:
            left = len(todo)
            while left:
                try:
                    yield news.get(timeout=_LOOK)
                    left -= 1
                except Empty:
                    yield None
        finally:
            stop.append(True)
            for thread in threads:
                thread.cancel()


def _on_cluster(todo: Sequence[Item], task: dict[str, Any], address: str) -> Generator[_Found | None]:
    """Work on parts on a cluster whose machines see the same files; None is a moment to look up.

    Raises
    ------
    ClusterError
        If there is no scheduler at the address, or it is lost.
    """
    try:
        from distributed import Client, KilledWorker, wait
    except ImportError:
        raise ClusterError('a cluster needs dask.distributed: pip install "cad_implicit[cluster]"') from None
    try:
        client = Client(address, timeout=_CONNECT)
    except (OSError, ValueError) as error:
        raise ClusterError(f"no scheduler answers at {address} ({error}); start one with: dask scheduler") from None
    with client:
        futures = {client.submit(_perform, item, task, pure=False): item for item in todo}
        try:
            while futures:
                try:
                    ready = wait(list(futures), timeout=_LOOK, return_when="FIRST_COMPLETED").done
                except TimeoutError:
                    yield None
                    continue
                for future in ready:
                    item = futures.pop(future)
                    try:
                        row = future.result()
                    except KilledWorker as error:
                        row = {"fate": "killed", "message": f"its workers ended without an answer: {error}"[:300]}
                    yield item, row
        finally:
            client.cancel(list(futures))


def _known(ledger: Path) -> dict[str, dict[str, Any]]:
    """Finished parts by their outputs; a line that was cut short does not count."""
    found = {}
    for line in ledger.read_text(encoding="utf-8").splitlines() if ledger.exists() else []:
        try:
            row = json.loads(line)
        except ValueError:
            continue
        if row.get("fate") == "done":
            found[row["output"]] = row
        else:
            found.pop(row.get("output", ""), None)
    return found


def _stamp(item: Item, task: dict[str, Any]) -> list[Any]:
    """Tell a part in its present state, and what is done with it."""
    try:
        state = item.part.stat()
    except OSError:
        return [str(item.part)]
    return [str(item.part.resolve()), state.st_size, state.st_mtime_ns, json.dumps(task, sort_keys=True, default=str)]


def _serve(
    waiting: SimpleQueue[Item], news: SimpleQueue[_Found], task: dict[str, Any], memory: int, stop: list[bool]
) -> None:
    """Work on parts until none is left, in a process that is started anew when it dies."""
    pool: ProcessPoolExecutor | None = None
    while not stop:
        try:
            item = waiting.get_nowait()
        except Empty:
            break
        row: dict[str, Any] = {}
        for number in range(1, _TRIES + 1):
            pool = pool or ProcessPoolExecutor(1, get_context("spawn"), limit_memory, (memory,))
            try:
                row = pool.submit(_perform, item, task).result()
                break
            except BrokenProcessPool:
                pool = None
                row = {"fate": "killed", "message": f"its process ended {number} times without an answer"}
                if stop:
                    return
        news.put((item, row))
    if pool is not None:
        pool.shutdown()


def _perform(item: Item, task: dict[str, Any]) -> dict[str, Any]:
    """Work on one part, in a process of its own."""
    options = dict(task)
    try:
        outcome = run(item.part, options.pop("operation"), options.pop("amount"), threads=1, **options)
        item.output.parent.mkdir(parents=True, exist_ok=True)
        save(outcome.result_for(item.output.suffix, no_progress), item.output)
    except (CadImplicitError, ValueError, OSError, MemoryError) as error:
        return {"fate": "failed", "message": f"{type(error).__name__}: {error}"}
    return {"fate": "done", "message": "", **{k: v for k, v in outcome.as_dict().items() if k != "input"}}
