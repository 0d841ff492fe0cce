"""Dual contouring of analytic parts: time without the field, evaluations for each vertex, quality of the triangles.

Run as ``python -m validation.bench_dual [cells along the longest side …]``, 128 and 256 by default.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
from dual_oracles import PARTS, Distance, Placed, broken_edges, self_intersections, smallest_angles

from cad_implicit.dual import dual_contour
from cad_implicit.mesh import Mesh

FloatArray = NDArray[np.float64]
STAGES = ("sample", "hermite", "vertices", "triangles")


class Clocked(Placed):
    """A part that adds up the time spent on its evaluation."""

    def __init__(self, distance: Distance, half_size: ArrayLike) -> None:
        super().__init__(distance, half_size)
        self.seconds = 0.0

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        start = time.perf_counter()
        result = super().value_and_gradient(points)
        self.seconds += time.perf_counter() - start
        return result


def timed(part: Clocked, spacing: float) -> tuple[Mesh, dict[str, float]]:
    """Mesh and the seconds of each stage without the evaluations."""
    part.seconds, part.evaluations = 0.0, 0
    last = {}

    def clock() -> float:
        return time.perf_counter() - part.seconds

    def progress(stage: str, fraction: float) -> None:
        last[stage] = clock()

    begin = clock()
    mesh = dual_contour(part, spacing, progress=progress)
    ends = [begin, *(last[stage] for stage in STAGES)]
    seconds = dict(zip(STAGES, np.diff(ends), strict=True))
    return mesh, {**seconds, "own": clock() - begin}


def main(counts: list[int]) -> None:
    """Print one line for each part and number of cells."""
    print(
        f"{'part':11s}{'cells':>6s}{'triangles':>11s}{'own ms':>8s}"
        + "".join(f"{stage:>10s}" for stage in STAGES)
        + f"{'field ms':>9s}{'evals/V':>8s}{'angle':>7s}{'<1':>4s}{'<2':>4s}"
        + f"{'max |f|/h':>10s}{'crossing':>9s}{'broken':>7s}"
    )
    for name, (distance, half_size, _, _) in PARTS.items():
        for count in counts:
            part = Clocked(distance, half_size)
            spacing = float((part.bounds[1] - part.bounds[0]).max()) / count
            runs = [timed(part, spacing) for _ in range(3)]
            mesh, seconds = min(runs, key=lambda run: run[1]["own"])
            field, evaluations = part.seconds, part.evaluations
            angles = smallest_angles(mesh)
            print(
                f"{name:11s}{count:6d}{len(mesh.faces):11d}{1e3 * seconds['own']:8.0f}"
                + "".join(f"{1e3 * seconds[stage]:10.0f}" for stage in STAGES)
                + f"{1e3 * field:9.0f}{evaluations / len(mesh.vertices):8.2f}{angles.min():7.2f}"
                + f"{(angles < 1).sum():4d}{(angles < 2).sum():4d}{np.abs(part(mesh.vertices)).max() / spacing:10.1e}"
                + f"{self_intersections(mesh):9d}{broken_edges(mesh):7d}",
                flush=True,
            )


if __name__ == "__main__":
    main([int(count) for count in sys.argv[1:]] or [128, 256])
