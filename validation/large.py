"""Large parts: ``python -m validation.large [CELLS …]``, 512 and 1024 along the longest side by default.

Fillets the bracket that comes with the package by 3 mm, each in a process of its own. Prints time, processor time, the
peak of memory beside the estimate, triangles, whether the mesh is closed, and its volume.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from importlib.resources import as_file, files
from typing import Any

import numpy as np
import psutil

import cad_implicit as ci
from cad_implicit import piecewise, sizing
from cad_implicit.cad import open_part

_RADIUS = 3.0


def work(cells: int) -> dict[str, Any]:
    """Fillet the bracket at so many cells along its longest side."""
    with as_file(files("cad_implicit") / "data" / "bracket.step") as path:
        part = open_part(path)
    spacing = float((part.bounds[1] - part.bounds[0]).max()) / cells
    ci.run(part, "fillet", _RADIUS, spacing=1.5)  # what is imported and compiled counts for nothing
    process = psutil.Process()
    before, start, busy = process.memory_info().rss, time.perf_counter(), time.process_time()
    outcome = ci.run(part, "fillet", _RADIUS, spacing=spacing, force=True)
    area = outcome.before.area
    tiled = piecewise.is_large(area, spacing)
    need = (
        sizing.estimate_tiles(area, spacing, sizing.bricks_in_a_tile(area, spacing))
        if tiled
        else sizing.estimate_surface(area, spacing)
    )
    return {
        "cells": cells,
        "spacing": spacing,
        "tiles": tiled,
        "seconds": time.perf_counter() - start,
        "processor": time.process_time() - busy,
        "peak": _peak(process),
        "grown": _peak(process) - before,
        "estimate": need,
        "triangles": len(outcome.mesh.faces),
        "closed": outcome.mesh.is_watertight,
        "volume": outcome.mesh.volume,
    }


def _peak(process: psutil.Process) -> int:
    """Most bytes that a process has held."""
    if sys.platform == "win32":
        return int(process.memory_info().peak_wset)
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else 1024 * peak)


def main() -> int:
    """Run all sizes; 1 if a mesh is not closed or the estimate is off by more than 1.5."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cells", type=int, nargs="*", default=[512, 1024])
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        print(json.dumps(work(options.cells[0])))
        return 0
    good = True
    for cells in options.cells:
        command = [sys.executable, "-m", "validation.large", "--worker", str(cells)]
        found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[-1])
        ratio = found["grown"] / found["estimate"]
        print(
            f"{cells}³: {found['seconds']:.1f} s ({found['processor']:.1f} s of processors), peak "
            f"{found['peak'] / 2**20:.0f} MiB, of these {found['grown'] / 2**20:.0f} for the work (estimate "
            f"{found['estimate'] / 2**20:.0f}, ratio {ratio:.2f}), {found['triangles']:,} triangles, "
            f"{'closed' if found['closed'] else 'NOT CLOSED'}, {'in tiles' if found['tiles'] else 'at once'}, "
            f"volume {found['volume']:.6f} mm³"
        )
        good &= found["closed"] and bool(np.isclose(np.log(ratio), 0, atol=np.log(1.5)))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
