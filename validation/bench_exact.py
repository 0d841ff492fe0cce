"""Speed and memory of the exact engine, and its peers beside it: ``python -m validation.bench_exact``.

The bracket that comes with the package, tessellated to 12k triangles and turned off the axes, is closed, opened and
smoothed at 128, 256 and 512 cells along its longest side and the margin. Each figure comes from a child process of its
own with all kernels compiled: the best time of some runs, and the growth of the resident memory at its peak.

MeshLib (the extra ``peers``) closes the same mesh by its double offset and by its sharp offset twice, at the same
voxel size. Errors are those of the fillet against the analytic one (a notch and a boss on a plate) and, on the
bracket, against our own at a quarter of the spacing.
"""

from __future__ import annotations

import argparse
import cProfile
import importlib.util
import os
import pstats
import sys
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
from shapes import SHIFT, TURN, boss, boss_fillet, notch, notch_fillet

from cad_implicit import Mesh, run
from cad_implicit.comparison import compare
from cad_implicit.distance import MeshDistance

from .bench_distance import turned_bracket

#: Radius in mm of all operations on the bracket; its holes have 3.17, its bore 5.95.
RADIUS = 2.0

THREADS = 2

#: The analytic parts: radius of the fillet and of the boss in mm, angle of the notch in degrees.
FILLET_RADIUS = 10.0
BOSS_RADIUS = 15.0
NOTCH_ANGLE = 75.0

#: Goals in seconds.
GOALS = {("fillet", 128): 0.6, ("fillet", 256): 2.5, ("smooth", 128): 1.0, ("smooth", 256): 4.0}

#: Goals of the growth: time and memory no worse than spacing to this power; and bytes at 512 cells.
GOAL_POWER = -2.3
GOAL_BYTES = 1.5e9

_WARM_UP_CELLS = 110
_RUN_STAGES = ("read", "mesh", "fillet", "round", "smooth", "offset", "contour", "check")


@dataclass(frozen=True)
class Figures:
    """Seconds by stage of the fastest run, seconds of all runs, triangles, and growth of the memory in bytes."""

    seconds: dict[str, float]
    totals: tuple[float, ...]
    triangles: int
    memory: int

    @property
    def best(self) -> float:
        """Shortest time in seconds."""
        return min(self.totals)


class StageClock:
    """Progress callback that adds up the time of each stage of each part of the job."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._outer, self._inner = "", ""
        self._last = time.perf_counter()

    def __call__(self, stage: str, fraction: float) -> None:
        now = time.perf_counter()
        name = f"{self._outer}: {self._inner}" if self._inner else self._outer
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._last = now
        if stage in _RUN_STAGES:
            self._outer, self._inner = stage, ""
        else:
            self._inner = "rest" if fraction >= 1 else stage


def spacing_of(mesh: Mesh, cells: int) -> float:
    """Spacing in mm that gives so many cells along the longest side and the margin of the radius on both ends."""
    return float((mesh.bounds[1] - mesh.bounds[0]).max() + 2 * RADIUS) / cells


def job(mesh: Mesh, operation: str, cells: int, clock: Callable[[str, float], None] | None = None) -> Mesh:
    """Run one operation on the bracket."""
    options: dict[str, Any] = {"progress": clock} if clock else {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        h = spacing_of(mesh, cells)
        return run(mesh, operation, RADIUS, spacing=h, engine="exact", force=True, threads=THREADS, **options).mesh


def in_child(function: Callable[..., Any], *arguments: Any) -> Any:
    """Run a function in a process of its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def peak_memory(function: Callable[[], Any]) -> tuple[Any, int]:
    """Run a function; tell by how many bytes the resident memory grew at the most, too."""
    import resource

    import psutil

    before = psutil.Process().memory_info().rss
    result = function()
    return result, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - before


def measure(operation: str, cells: int, repeats: int) -> Figures:
    """Measure one operation; to be called in a fresh process."""
    bracket = turned_bracket()
    job(bracket, operation, _WARM_UP_CELLS)
    totals, stages = [], []
    memory, triangles = 0, 0
    for number in range(repeats):
        clock = StageClock()
        start = time.perf_counter()
        if number == 0:
            mesh, memory = peak_memory(lambda c=clock: job(bracket, operation, cells, c))
            triangles = len(mesh.faces)
            del mesh
        else:
            job(bracket, operation, cells, clock)
        totals.append(time.perf_counter() - start)
        stages.append({name: seconds for name, seconds in clock.seconds.items() if name})
    return Figures(stages[int(np.argmin(totals))], tuple(totals), triangles, memory)


def profile(operation: str, cells: int, count: int = 10) -> str:
    """Functions that take the most time of their own; to be called in a fresh process."""
    import io

    bracket = turned_bracket()
    job(bracket, operation, _WARM_UP_CELLS)
    profiler = cProfile.Profile()
    profiler.enable()
    job(bracket, operation, cells)
    profiler.disable()
    text = io.StringIO()
    pstats.Stats(profiler, stream=text).strip_dirs().sort_stats("tottime").print_stats(count)
    return "\n".join(line for line in text.getvalue().splitlines()[4:] if line.strip())


def meshlib_closing(mesh: Mesh, radius: float, spacing: float, sharp: bool) -> tuple[Mesh, float]:
    """Close a mesh with MeshLib; tell the seconds too."""
    from meshlib import mrmeshnumpy, mrmeshpy

    part = mrmeshnumpy.meshFromFacesVerts(mesh.faces, mesh.vertices.astype(np.float32))
    start = time.perf_counter()
    if sharp:
        options = mrmeshpy.SharpOffsetParameters()
        options.voxelSize = spacing
        grown = mrmeshpy.sharpOffsetMesh(mrmeshpy.MeshPart(part), radius, options)
        result = mrmeshpy.sharpOffsetMesh(mrmeshpy.MeshPart(grown), -radius, options)
    else:
        plain = mrmeshpy.OffsetParameters()
        plain.voxelSize = spacing
        result = mrmeshpy.doubleOffsetMesh(mrmeshpy.MeshPart(part), radius, -radius, plain)
    seconds = time.perf_counter() - start
    faces = mrmeshnumpy.getNumpyFaces(result.topology)
    return Mesh(mrmeshnumpy.getNumpyVerts(result), faces), seconds


def our_closing(mesh: Mesh, radius: float, spacing: float) -> tuple[Mesh, float]:
    """Close a mesh with the exact engine; tell the seconds too."""
    start = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = run(mesh, "fillet", radius, spacing=spacing, engine="exact", force=True, threads=THREADS).mesh
    return result, time.perf_counter() - start


def methods() -> dict[str, Callable[[Mesh, float, float], tuple[Mesh, float]]]:
    """Find the closings to compare, by name."""
    found: dict[str, Callable[[Mesh, float, float], tuple[Mesh, float]]] = {"cad_implicit": our_closing}
    if importlib.util.find_spec("meshlib"):
        found["MeshLib double offset"] = lambda m, r, h: meshlib_closing(m, r, h, False)
        found["MeshLib sharp offset twice"] = lambda m, r, h: meshlib_closing(m, r, h, True)
    return found


def arc_errors(vertices: NDArray[np.float64], part: str, spacing: float) -> NDArray[np.float64]:
    """Distances in spacings of the vertices on the fillet to the analytic one; those farther than one are not on it."""
    x, y, z = ((vertices - SHIFT) @ TURN).T
    if part == "notch":
        half = np.radians(NOTCH_ANGLE / 2)
        u, v = FILLET_RADIUS / np.sin(half) - x, y
        inside = (np.abs(np.arctan2(v, u)) < np.pi / 2 - half - 0.02) & (np.abs(z) < 20)
    else:
        u, v = BOSS_RADIUS + FILLET_RADIUS - np.hypot(x, y), FILLET_RADIUS - z
        inside = (np.arctan2(v, u) > 0.02) & (np.arctan2(v, u) < np.pi / 2 - 0.02)
    error = np.abs(np.hypot(u, v) - FILLET_RADIUS) / spacing
    return error[inside & (error < 1)]


def analytic(cells: int) -> list[tuple[str, str, float, tuple[float, float], tuple[float, float]]]:
    """Compare the methods with analytic fillets; to be called in a fresh process.

    Gives part, method, seconds, and median and largest error in spacings, first of the triangles (distance from points
    of the true fillet to the mesh), then of the vertices on the fillet.
    """
    parts: dict[str, tuple[Mesh, NDArray[np.float64]]] = {
        "notch": (notch(NOTCH_ANGLE, 40.0), notch_fillet(NOTCH_ANGLE, FILLET_RADIUS, 40.0)),
        "boss": (boss(BOSS_RADIUS, 40.0, 40.0), boss_fillet(BOSS_RADIUS, FILLET_RADIUS)),
    }
    rows = []
    for name, (mesh, truth) in parts.items():
        h = (float((mesh.bounds[1] - mesh.bounds[0]).max()) + 2 * FILLET_RADIUS) / cells
        for method, closing in methods().items():
            closing(mesh, FILLET_RADIUS, 4 * h)
            result, seconds = closing(mesh, FILLET_RADIUS, h)
            facets = MeshDistance(result, sign="pseudonormal").unsigned(truth) / h
            vertices = arc_errors(result.vertices, name, h)
            middle_largest = [(float(np.median(error)), float(error.max())) for error in (facets, vertices)]
            rows.append((name, method, seconds, *middle_largest))
    return rows


def on_bracket(cells: int, repeats: int) -> list[tuple[str, float, float, float, float]]:
    """Compare the methods on the bracket; to be called in a fresh process.

    Gives method, seconds, and mean, 99th percentile and largest error in spacings: the two-sided distance to our
    closing at a quarter of the spacing.
    """
    mesh = turned_bracket()
    h = spacing_of(mesh, cells)
    truth = our_closing(mesh, RADIUS, h / 4)[0]
    rows = []
    for method, closing in methods().items():
        runs = [closing(mesh, RADIUS, h) for _ in range(repeats)]
        difference = compare(truth, runs[0][0])
        rows.append((method, min(s for _, s in runs), difference.mean / h, difference.p99 / h, difference.maximum / h))
    return rows


def power(cells: list[int], figures: list[float]) -> float:
    """Exponent of the growth of figures with the spacing, from the coarsest to the finest."""
    return -float(np.log(figures[-1] / figures[0]) / np.log(cells[-1] / cells[0]))


def print_speed(finest: int, repeats: int) -> None:
    """Print time by stage, memory and growth."""
    print(f"{len(turned_bracket().faces)} triangles, radius {RADIUS:g} mm, {THREADS} threads; load {os.getloadavg()}")
    for operation in ("fillet", "round", "smooth"):
        sizes = [n for n in (128, 256, 512) if n <= (finest if operation == "fillet" else 256)]
        found = []
        for cells in sizes:
            f: Figures = in_child(measure, operation, cells, repeats if cells < 512 else 1)
            found.append(f)
            goal = GOALS.get((operation, cells))
            print(
                f"{operation} {cells}³: best {f.best:.2f} s, median {np.median(f.totals):.2f} s"
                f"{f' (goal {goal:g} s)' if goal else ''}, {f.triangles} triangles, {f.memory / 1e6:.0f} MB"
                f"{f' (goal {GOAL_BYTES / 1e6:.0f} MB)' if cells == 512 else ''}; load {os.getloadavg()[0]:.1f}",
                flush=True,
            )
            for name, seconds in f.seconds.items():
                if seconds > 0.005 * f.best:
                    print(f"    {name:24s}{1e3 * seconds:9.0f} ms")
        if len(found) > 1:
            time_power = power(sizes, [f.best for f in found])
            memory_power = power(sizes, [float(f.memory) for f in found])
            print(f"{operation}: time ~ h^{time_power:.2f}, memory ~ h^{memory_power:.2f} (goal h^{GOAL_POWER:g})")


def print_peers(repeats: int) -> None:
    """Print time and error beside the peers."""
    if "MeshLib double offset" not in methods():
        print("MeshLib is not installed: peers skipped (pip install cad_implicit[peers])")
    for cells in (128, 256):
        print(f"closing at {cells}³ against analytic fillets, errors in spacings")
        rows = in_child(analytic, cells)
        for part, method, seconds, facets, vertices in rows:
            ours = next(row for row in rows if row[:2] == (part, "cad_implicit"))
            print(
                f"    {part:8s}{method:28s}{seconds:8.2f} s ({seconds / ours[2]:5.1f}x)"
                f"  triangles: median {facets[0]:.1e} max {facets[1]:.1e} ({facets[1] / ours[3][1]:6.1f}x)"
                f"  vertices: median {vertices[0]:.1e} max {vertices[1]:.1e} ({vertices[1] / ours[4][1]:8.1f}x)"
            )
    print("closing of the bracket at 128³, error against ours at 512³, in spacings")
    rows = in_child(on_bracket, 128, repeats)
    for method, seconds, mean, p99, largest in rows:
        print(
            f"    {method:36s}{seconds:8.2f} s ({seconds / rows[0][1]:5.1f}x)"
            f"  mean {mean:.1e} ({mean / rows[0][2]:.0f}x)  p99 {p99:.1e}  max {largest:.1e}"
        )


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser(description="Speed and memory of the exact engine, and its peers beside it.")
    parser.add_argument("--finest", type=int, default=512, help="most cells for the closing: 128, 256 or 512")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--only", choices=("speed", "peers", "profile"))
    options = parser.parse_args()
    if options.only in (None, "speed"):
        print_speed(options.finest, options.repeats)
    if options.only in (None, "profile"):
        for operation in ("fillet", "smooth"):
            print(f"{operation} 256³, functions by their own time")
            print(in_child(profile, operation, 256), flush=True)
    if options.only in (None, "peers"):
        print_peers(options.repeats)


if __name__ == "__main__":
    main()
