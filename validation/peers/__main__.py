"""The package beside others: ``python -m validation.peers [--parts N] [--only METHOD] [--readme]``.

Closings of six parts, openings of their complements, and smoothings by a ball at three spacings, off the axes. The
truth is analytic: the error is the distance from points of the true blend, and of the sharp edges that stay, to the
result. Each run is a process of its own with a limit in time, in which the method has run before on a coarse grid.
Writes ``results.json``, ``table.md`` and ``pareto.png`` beside this file, and a summary into the README; what is in
the first is not run again: remove it to measure anew. On two cores that have nothing else to do it takes 50 minutes.
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from validation.readme import into_readme

from .methods import methods
from .report import OPERATIONS, OURS, details, place, plot, summary
from .running import CELLS, PARTS, perform

HERE = Path(__file__).parent
#: Seconds that one run may take.
_LIMIT = 60.0

#: Spacings to a radius of a run of ours besides, for errors like those of others at their widest.
_COARSE = 2


def in_child(*arguments: Any, limit: float | None = _LIMIT) -> dict[str, Any]:
    """Perform a run in a process of its own; tell if it takes too long or dies."""
    pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
    try:
        return pool.submit(perform, *arguments).result(timeout=limit)
    except TimeoutError:
        for process in list(pool._processes.values()):
            process.kill()
        return {"failed": f"more than {_LIMIT:.0f} s"}
    except BrokenProcessPool:
        return {"failed": "the process died"}
    except Exception as error:
        return {"failed": f"{type(error).__name__}: {error}"[:200]}
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def main() -> None:
    """Run what is missing, write table and plot."""
    parser = argparse.ArgumentParser(description="The package beside others: error against time.")
    parser.add_argument("--parts", type=int, default=len(PARTS), help="only the first N parts")
    parser.add_argument("--only", help="only methods whose name contains this")
    parser.add_argument("--cells", type=int, nargs="*", default=CELLS, help="spacings to a radius")
    parser.add_argument("--readme", action="store_true", help="write the summary into README.md")
    options = parser.parse_args()
    file = HERE / "results.json"
    rows: list[dict[str, Any]] = json.loads(file.read_text()) if file.exists() else []
    known = {(*place(row), row["method"]) for row in rows}
    for method in list(methods())[:2]:  # ours: no limit must end the compilation
        for operation in OPERATIONS:
            in_child(next(iter(PARTS)), operation, method, _COARSE, limit=None)
    for part in list(PARTS)[: options.parts]:
        for operation in OPERATIONS:
            for method in methods():
                for cells in (_COARSE, *options.cells) if method == OURS else options.cells:
                    one = (part, operation, cells, method)
                    alike = method.startswith("manifold3d") and cells != CELLS[0]  # knows no spacing
                    if one in known or alike or (options.only and options.only not in method):
                        continue
                    row = {"part": part, "operation": operation, "cells": cells, "method": method}
                    row |= in_child(part, operation, method, cells)
                    rows.append(row)
                    file.write_text(json.dumps(rows, indent=1) + "\n")
                    print(row, flush=True)
    names, parts = list(dict.fromkeys(row["method"] for row in rows)), list(PARTS)
    rows.sort(key=lambda row: (parts.index(row["part"]), row["operation"], names.index(row["method"]), row["cells"]))
    (HERE / "table.md").write_text(details(rows), encoding="utf-8")
    plot(rows, HERE / "pareto.png")
    print(summary(rows))
    if options.readme:
        into_readme("peers", summary(rows))


if __name__ == "__main__":
    main()
