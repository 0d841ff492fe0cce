"""The package beside others: ``python -m validation.peers [--parts N] [--only METHOD]``.

Closings of six parts and openings of their complements by a ball at three spacings, off the axes. The truth is
analytic: the error is the distance from points of the true blend, and of the sharp edges that stay, to the result. Each
run is a process of its own with a limit in time, in which the method has run before on a coarse grid. Writes
``results.json``, ``table.md`` and ``pareto.png`` beside this file; what is in the former is not run again.
"""

from __future__ import annotations

import argparse
import json
import os
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from datetime import UTC, datetime
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from .methods import methods
from .running import CELLS, PARTS, RADIUS, perform

HERE = Path(__file__).parent
#: Seconds that one run may take.
_LIMIT = 240.0


def in_child(*arguments: Any) -> dict[str, Any]:
    """Perform a run in a process of its own; tell if it takes too long or dies."""
    pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
    try:
        return pool.submit(perform, *arguments).result(timeout=_LIMIT)
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


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown table of all runs, and of the ratios to ours at the same spacing."""
    lines = [
        "# Beside other packages\n",
        f"`python -m validation.peers`, {datetime.now(UTC):%Y-%m-%d}, {os.cpu_count()} cores. Radius {RADIUS:g} mm; "
        "errors in µm: distance of the true blend, and of the sharp edges that stay, to the result. Ratios are to ours "
        "at the same spacing.\n",
        "| part | operation | spacing | method | time s | | memory MB | RMS | | largest | | sharp edges | triangles |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    ours = {_place(row): row for row in rows if row["method"] == "cad_implicit" and "rms" in row}
    for row in rows:
        head = f"| {row['part']} | {row['operation']} | r/{row['cells']} | {row['method']} |"
        if "failed" in row:
            lines.append(f"{head} {row['failed']} | | | | | | | | |")
            continue
        own = ours.get(_place(row), row)
        ratios = [row[key] / own[key] for key in ("seconds", "rms", "maximum")]
        sharp = "" if row["sharp"] is None else f"{1e3 * row['sharp']:.3g}"
        lines.append(
            f"{head} {row['seconds']:.2f} | {ratios[0]:.2g}x | {row['memory'] / 1e6:.0f} | {1e3 * row['rms']:.3g} | "
            f"{ratios[1]:.3g}x | {1e3 * row['maximum']:.3g} | {ratios[2]:.3g}x | {sharp} | {row['triangles']} |"
        )
    return "\n".join(lines) + "\n"


def _place(row: dict[str, Any]) -> tuple[Any, ...]:
    return row["part"], row["operation"], row["cells"]


def plot(rows: list[dict[str, Any]], path: Path) -> None:
    """Error against time, both logarithmic, a panel a part; closings filled, openings hollow."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(13, 7.5), sharex=True, sharey=True, layout="constrained")
    names = list(dict.fromkeys(row["method"] for row in rows))
    for axis, part in zip(axes.flat, PARTS, strict=True):
        for number, name in enumerate(names):
            for operation, fill in (("fillet", "full"), ("round", "none")):
                own = [
                    r
                    for r in rows
                    if (r["part"], r["operation"], r["method"]) == (part, operation, name) and "rms" in r
                ]
                label = name if fill == "full" else None
                axis.loglog(
                    [r["seconds"] for r in own], [1e3 * r["rms"] for r in own], "o-", color=f"C{number}",
                    fillstyle=fill, label=label, markersize=6, linewidth=1,
                )  # fmt: skip
        axis.set_title(part)
        axis.grid(alpha=0.3)
    for axis in axes[-1]:
        axis.set_xlabel("time, s")
    for axis in axes[:, 0]:
        axis.set_ylabel("RMS error of the blend, µm")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, title="filled: closing; hollow: opening")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main() -> None:
    """Run what is missing, write table and plot."""
    parser = argparse.ArgumentParser(description="The package beside others: error against time.")
    parser.add_argument("--parts", type=int, default=len(PARTS), help="only the first N parts")
    parser.add_argument("--only", help="only methods whose name contains this")
    parser.add_argument("--cells", type=int, nargs="*", default=CELLS, help="spacings to a radius")
    options = parser.parse_args()
    file = HERE / "results.json"
    rows: list[dict[str, Any]] = json.loads(file.read_text()) if file.exists() else []
    known = {(*_place(row), row["method"]) for row in rows}
    for part in list(PARTS)[: options.parts]:
        for operation in ("fillet", "round"):
            for method in methods():
                for cells in options.cells:
                    place = (part, operation, cells, method)
                    alike = method.startswith("manifold3d") and cells != CELLS[0]  # knows no spacing
                    if place in known or alike or (options.only and options.only not in method):
                        continue
                    row = {"part": part, "operation": operation, "cells": cells, "method": method}
                    row |= in_child(part, operation, method, cells)
                    rows.append(row)
                    file.write_text(json.dumps(rows, indent=1) + "\n")
                    print(row, flush=True)
    (HERE / "table.md").write_text(table(rows), encoding="utf-8")
    plot(rows, HERE / "pareto.png")


if __name__ == "__main__":
    main()
