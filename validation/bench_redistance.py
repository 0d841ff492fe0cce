"""Time of one iteration of the distance computation beside the paper's Table 2.

``python -m validation.bench_redistance`` prints milliseconds per iteration, the median over many.
"""

from __future__ import annotations

import argparse
import time
from statistics import median

import numpy as np

from cad_implicit.field import Field
from cad_implicit.grid import Grid
from cad_implicit.redistancing import redistance

#: Table 2 of the paper, the sphere: milliseconds for one iteration on one thread.
PAPER = {32: 1.7, 64: 14.0, 128: 110.0}

#: Iterations between two calls of the progress callback.
BATCH = 8


def sphere(nodes: int) -> Field:
    """Sample the defining function of the unit sphere, float32, on [-2, 2]³."""
    grid = Grid.cover([[-2] * 3, [2] * 3], shape=nodes)
    x, y, z = np.meshgrid(*grid.axes(), indexing="ij", sparse=True)
    return Field(grid, (1 - x**2 - y**2 - z**2).astype(np.float32))


def milliseconds(field: Field, batches: int, threads: int, **options: str) -> tuple[float, float]:
    """Median time of one iteration, and of everything before the first one."""
    stamps: list[float] = []
    redistance(field, iterations=1, threads=threads, **options)  # compile
    start = time.perf_counter()
    redistance(
        field,
        iterations=BATCH * batches,
        threads=threads,
        progress=lambda *_: stamps.append(time.perf_counter()),
        **options,
    )
    return 1e3 * median(np.diff(stamps)) / BATCH, 1e3 * (stamps[0] - start)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--batches", type=int, default=25, help="medians are over so many times 8 iterations")
    batches = parser.parse_args().batches
    print("ms per iteration, upwind and Euler, float32, sub-cell fix included")
    print(f"{'nodes':>6} {'1 thread':>9} {'2 threads':>10} {'paper':>8} {'paper / ours':>13} {'set-up, 1 thread':>17}")
    for nodes in (32, 64, 128, 256):
        field = sphere(nodes)
        repeats = max(5, batches // 5) if nodes == 256 else batches
        one, setup = milliseconds(field, repeats, 1)
        two, _ = milliseconds(field, repeats, 2)
        paper = f"{PAPER[nodes]:8.1f} {PAPER[nodes] / one:13.0f}" if nodes in PAPER else f"{'-':>8} {'-':>13}"
        print(f"{nodes:>5}³ {one:9.3f} {two:10.3f} {paper} {setup:17.1f}")
    print()
    print("ms per iteration of the other schemes at 128³")
    field = sphere(128)
    for scheme, how in (
        ("upwind", "rk2"),
        ("upwind", "gauss-seidel"),
        ("eno2", "euler"),
        ("eno2", "rk2"),
        ("eno2", "gauss-seidel"),
        ("weno5", "rk2"),
        ("weno5", "gauss-seidel"),
    ):
        one, _ = milliseconds(field, 3, 1, scheme=scheme, time=how)
        two, _ = milliseconds(field, 3, 2, scheme=scheme, time=how)
        print(f"{scheme:>6} {how:<13} 1 thread {one:8.2f}   2 threads {two:8.2f}")
    start = time.perf_counter()
    redistance(field, scheme="fmm", distance=0.4)
    print(f"   fmm in all, to 0.4 from the surface: {1e3 * (time.perf_counter() - start):.0f} ms")


if __name__ == "__main__":
    main()
