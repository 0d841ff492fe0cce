"""One run of a method on a part, in a process of its own, and its errors."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent / "tests"))
import exact_cases as cases
import shapes

from .methods import Operation, distances, methods

RADIUS = 2.0

#: Spacings to a radius.
CELLS = (4, 8, 16)

PARTS = {
    "wedge of 60°": lambda: cases.wedge(60, RADIUS),
    "corner": lambda: cases.corner(RADIUS),
    "pocket": lambda: cases.pocket(RADIUS),
    "boss": lambda: cases.cone_boss(2, 2, RADIUS, 240),
    "cone": lambda: cases.cone_boss(2.5, 1.5, RADIUS, 240),
    "cylinders 2:1.5": lambda: cases.cross(2, 1.5, RADIUS, 240),
}


#: A run is repeated, and its shortest time taken, this often and while all take less than these seconds.
_REPEATS, _ENOUGH = 3, 4.0


def perform(part: str, operation: Operation, method: str, cells: int) -> dict[str, Any]:
    """One run: seconds of the clock and of the processors, memory, and errors in mm; for a fresh process."""
    import resource

    import psutil

    case = PARTS[part]()
    mesh = shapes.cavity(case.mesh, 2.5 * RADIUS) if operation == "round" else case.mesh
    work, h = methods()[method], RADIUS / cells
    work(mesh, RADIUS, RADIUS / 2.5, operation)  # so that all is loaded
    before = psutil.Process().memory_info().rss
    times: list[float] = []
    used: list[float] = []
    while len(times) < _REPEATS and sum(times) < _ENOUGH:
        start = time.process_time()
        result, seconds = work(mesh, RADIUS, h, operation)
        times.append(seconds)
        used.append(time.process_time() - start)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - before
    blend = distances(result, shapes.placed(case.blend_samples()))
    edges = cases._sharp_samples(case, RADIUS / CELLS[-1]) if operation != "smooth" else np.zeros((0, 3))
    sharp = distances(result, edges)
    return {
        "seconds": min(times),
        "processor": min(used),
        "memory": memory,
        "triangles": len(result.faces),
        "watertight": result.is_watertight,
        "rms": float(np.sqrt((blend**2).mean())),
        "maximum": float(blend.max()),
        "sharp": float(sharp.max()) if len(sharp) else None,
    }
