"""All fillets of the corpus beside the exact kernel's: ``python -m validation [DIR]``.

Parts of :mod:`validation.fillets.corpus`, turned off the axes. A run succeeds if its mesh is closed, manifold, free of
self-intersections, and its error, measured against the exact kernel's solid or by the rolling ball, is within the
bound; where no ball of the radius fits, if it says so with the largest that does, and the exact kernel fails, too.
DIR (``fillets`` by default) gets a table, ``report.md``, and ``results.jsonl``; what is there is not run again. With
``--readme`` the summary in the README is written anew. Exits with 1 if a run fails.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from .fillets.corpus import Job, jobs
from .fillets.performing import perform
from .local_checks import Worker
from .readme import into_readme

#: Seconds after which a run counts as hung.
_TIMEOUT = 600.0


def main() -> int:
    """Run, print and write the table; return 1 if a run fails."""
    parser = argparse.ArgumentParser(description="Fillets of the corpus beside the exact kernel's.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path("fillets"))
    parser.add_argument("--run", help="only runs whose name contains this")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--readme", action="store_true", help="write the summary into README.md")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    file = options.folder / "results.jsonl"
    rows = {}
    if file.exists():
        rows = {row["key"]: row for row in map(json.loads, file.read_text().splitlines())}
    os.environ["NUMBA_NUM_THREADS"] = "1"  # of the processes that do the runs
    chosen = [job for job in jobs() if not options.run or options.run in job.key]
    start = time.perf_counter()
    numbers = {job.key: number for number, job in enumerate(jobs())}
    waiting: SimpleQueue[Job] = SimpleQueue()
    for job in chosen:
        if job.key not in rows:
            waiting.put(job)
    with file.open("a") as out, ThreadPoolExecutor(options.workers) as pool:

        def work() -> None:
            worker = Worker(perform, _TIMEOUT)
            for job in iter(lambda: _next(waiting), None):
                row = worker(numbers[job.key])
                if isinstance(row, str):
                    row = {"key": job.key, **asdict(job), "fate": "failed", "kernel": "?", "faults": [row]}
                rows[job.key] = row
                out.write(json.dumps(row) + "\n")
                out.flush()
                print(_line(row), flush=True)
            worker.close()

        for done in [pool.submit(work) for _ in range(options.workers)]:
            done.result()
    shown = [rows[job.key] for job in chosen if rows[job.key]["fate"] != "none"]
    summary = _summary(shown)
    (options.folder / "report.md").write_text(_table(shown) + "\n" + summary, encoding="utf-8")
    used = sum(row.get("processor_seconds", 0.0) for row in rows.values())
    print(f"\n{summary}\n{time.perf_counter() - start:.0f} s, of the processors {used:.0f} s in all runs")
    if options.readme:
        into_readme("corpus", summary)
    return 1 if any(row["fate"] == "failed" for row in shown) else 0


def _next(waiting: SimpleQueue[Job]) -> Job | None:
    try:
        return waiting.get_nowait()
    except Empty:
        return None


def _line(row: dict[str, Any]) -> str:
    errors = "  ".join(f"{name} {value:.2g}" for name, value in row.get("regions", {}).items() if name != "all")
    faults = "; ".join(row.get("faults", []))
    return f"{row['key']:44s}{row['fate']:>9s}  kernel {row.get('kernel', '')!s:9s}{row.get('seconds', 0):6.1f} s  {errors}  {faults[:160]}"  # noqa: E501


def _table(rows: list[dict[str, Any]]) -> str:
    names = ["blend", "unchanged", "sharp edges", "differs by nature"]
    head = ["part", "operation", "r", "h", "exact kernel", "ours", "against", *names, "s"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        regions = row.get("regions", {})
        cells = [row.get("part", row["key"]), f"{row.get('operation')} {row.get('edges') or 'whole part'}"]
        cells += [f"{row.get('radius', 0):.3g}", f"{row.get('spacing', 0):.3g}", str(row["kernel"]), row["fate"]]
        cells += [str(row.get("against", "–")), *(f"{regions[n]:.2g}" if n in regions else "–" for n in names)]
        cells.append(f"{row.get('own_seconds', 0):.1f}")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _summary(rows: list[dict[str, Any]]) -> str:
    """Count by kind of run."""
    day = datetime.now(UTC).strftime("%Y-%m-%d")
    lines = [
        f"`python -m validation --readme`, {day}: {len({row.get('part') for row in rows})} parts, "
        f"{sum(row.get('processor_seconds', 0) for row in rows) / 60:.0f} minutes of processor time.", "",
        "| | runs | within the bound | no ball fits, and said so | failed | exact kernel |",
        "|---|---|---|---|---|---|",
    ]  # fmt: skip
    kinds = {
        "concave edges filleted": ("fillet", "concave"),
        "convex edges rounded": ("round", "convex"),
        "whole part closed": ("fillet", None),
    }
    for name, (operation, edges) in kinds.items():
        own = [row for row in rows if row.get("operation") == operation and row.get("edges") == edges]
        counts = [sum(row["fate"] == fate for row in own) for fate in ("passed", "refused", "failed")]
        kernel = sum(row["kernel"] == "ok" for row in own)
        lines.append(f"| {name} | {len(own)} | {' | '.join(map(str, counts))} | {kernel} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())
