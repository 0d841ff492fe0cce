"""The exact engine over all runs of :mod:`validation.cases`, each in a child process: ``python -m validation.runs``.

A run is sound if its mesh is closed, oriented outward, accepted by manifold3d, and free of self-intersections, and if
its volume is the expected one where that is known. Where nothing of the part is left the right answer is the error
that says so. Exits with 1 if a run is not sound.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np
from numpy.typing import NDArray

from cad_implicit import run
from cad_implicit.distance import MeshDistance
from cad_implicit.errors import CadImplicitError, EmptyResultError, RadiusError
from cad_implicit.exact import polished
from cad_implicit.mesh import Mesh

from .cases import ALL_PARTS, RUNS, Run, turned
from .intersections import find_intersections

#: Largest difference between the ratio of volumes and the expected one.
_VOLUME_TOLERANCE = 0.015

#: Seconds after which a run counts as hung.
_TIMEOUT = 900

_HEADER = (
    f"{'case':>4s} {'part':18s}{'operation':10s}{'amount':>7s}{'cells':>6s}{'faces':>8s}{'closed':>7s}{'manifold':>9s}"
    f"{'crossing':>9s}{'angle':>7s}{'<1':>5s}{'parts':>6s}{'before':>11s}{'after':>11s}{'ratio':>7s}{'expect':>7s}"
    f"{'off/h':>8s}{'past/h':>8s}{'s':>7s}"
)


@dataclass(frozen=True)
class Result:
    """What came of a run.

    Attributes
    ----------
    error : str
        Message of the error, or empty.
    refused : bool
        Whether the error is the one that says that the part is too thin for the ball.
    off, past : float
        In spacings: farthest vertex from the surface of the shape, and farthest that an opening reaches outside, or a
        closing inside, of the part.
    """

    run: Run
    seconds: float
    error: str = ""
    refused: bool = False
    faces: int = 0
    closed: bool = False
    manifold: str = ""
    crossings: int = 0
    smallest_angle: float = 0.0
    slim: int = 0
    components: int = 0
    before: float = 0.0
    after: float = 0.0
    off: float = 0.0
    past: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def ratio(self) -> float:
        """Volume after over volume before."""
        return self.after / self.before if self.before else 0.0

    @property
    def faults(self) -> list[str]:
        """What is wrong, nothing for a sound result."""
        expected = self.run.expected
        if self.error:
            return [] if self.refused and expected == 0.0 else ["error"]
        found = []
        if expected == 0.0:
            found.append("no error, though nothing should be left")
        elif expected is not None and abs(self.ratio - expected) > _VOLUME_TOLERANCE:
            found.append("volume")
        if not self.closed:
            found.append("open")
        if self.after <= 0:
            found.append("inside out")
        if self.manifold != "NoError":
            found.append(self.manifold)
        if self.crossings:
            found.append(f"{self.crossings} self-intersections")
        return found

    def line(self) -> str:
        """Row of the table."""
        r = self.run
        head = f"{r.case or '':>4} {r.part:18s}{r.operation:10s}{r.amount:7g}{r.cells:6d}"
        verdict = "; ".join(self.faults)
        if self.error:
            return f"{head}  {'ERROR' if verdict else 'refused'} {self.seconds:.1f} s: {self.error}"
        expected = "" if r.expected is None else f"{r.expected:.3f}"
        return (
            f"{head}{self.faces:8d}{'yes' if self.closed else 'NO':>7s}{self.manifold:>9s}{self.crossings:9d}"
            f"{self.smallest_angle:7.2f}{self.slim:5d}{self.components:6d}{self.before:11.5g}{self.after:11.5g}"
            f"{self.ratio:7.3f}{expected:>7s}{self.off:8.1e}{self.past:8.1e}{self.seconds:7.1f}"
            + (f"  FAULT: {verdict}" if verdict else "")
        )


def smallest_angles(mesh: Mesh) -> NDArray[np.float64]:
    """Smallest angle (F,) of each triangle in degrees."""
    corners = mesh.vertices[mesh.faces]
    sides = np.sort(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2), axis=1)
    sine = 2 * np.linalg.norm(mesh.face_vectors, axis=1) / np.maximum(sides[:, 1] * sides[:, 2], 1e-300)
    return np.degrees(np.arcsin(np.minimum(sine, 1)))


def manifold_status(mesh: Mesh) -> str:
    """Ask manifold3d about a mesh; "NoError" if it is manifold."""
    import manifold3d

    raw = manifold3d.Mesh64(np.array(mesh.vertices), mesh.faces.astype(np.uint64))
    return str(manifold3d.Manifold(raw).status()).rsplit(".", maxsplit=1)[-1]


def perform(task: Run) -> Result:
    """Do one run and check the result."""
    part = turned(ALL_PARTS[task.part]())
    box = part.BoundingBox()
    spacing = max(box.xlen, box.ylen, box.zlen) / task.cells
    start = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            outcome = run(part, task.operation, task.amount, spacing=spacing, engine="exact", force=True)
    except CadImplicitError as error:
        refused = isinstance(error, EmptyResultError | RadiusError)
        return Result(task, time.perf_counter() - start, f"{type(error).__name__}: {error}", refused)
    except Exception as error:  # a fault of the engine: the table tells it
        return Result(task, time.perf_counter() - start, f"{type(error).__name__}: {error}")
    seconds = time.perf_counter() - start
    mesh, before = outcome.mesh, outcome.before
    angles = smallest_angles(mesh)
    depth = MeshDistance(before, sign="pseudonormal")(mesh.vertices) / spacing
    past = {"round": float(-depth.min()), "fillet": float(depth.max())}.get(task.operation, 0.0)
    return Result(
        task,
        seconds,
        faces=len(mesh.faces),
        closed=mesh.is_watertight,
        manifold=manifold_status(mesh),
        crossings=find_intersections(mesh).count,
        smallest_angle=float(angles.min()),
        slim=int((angles < 1).sum()),
        components=mesh.components,
        before=before.volume,
        after=mesh.volume,
        off=float(np.abs(polished(outcome.shape, mesh.vertices)[0]).max()) / spacing,
        past=max(past, 0.0),
        notes=tuple(outcome.warnings),
    )


class Worker:
    """A child process for the runs, started again after one that crashed or hung."""

    def __init__(self) -> None:
        self._pool: ProcessPoolExecutor | None = None

    def __call__(self, task: Run) -> Result:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
        start = time.perf_counter()
        try:
            return self._pool.submit(perform, task).result(timeout=_TIMEOUT)
        except BrokenProcessPool:
            self._pool = None
            return Result(task, time.perf_counter() - start, "the process crashed")
        except TimeoutError:
            for process in list(self._pool._processes.values()):
                process.kill()
            self._pool = None
            return Result(task, time.perf_counter() - start, f"not done after {_TIMEOUT} s")

    def close(self) -> None:
        """End the child process."""
        if self._pool is not None:
            self._pool.shutdown()


def main() -> int:
    """Print the table; return 1 if a run is not sound."""
    parser = argparse.ArgumentParser(description="Run the exact engine over parts that the exact kernel fails on.")
    parser.add_argument("--part", help="only runs of parts whose name contains this")
    parser.add_argument("--notes", action="store_true", help="print the warnings of each run too")
    options = parser.parse_args()
    chosen = [task for task in RUNS if not options.part or options.part in task.part]
    worker = Worker()
    results = []
    print(_HEADER)
    for task in chosen:
        results.append(worker(task))
        print(results[-1].line(), flush=True)
        if options.notes:
            for note in results[-1].notes:
                print(f"       {note}")
    worker.close()
    unsound = sum(bool(result.faults) for result in results)
    print(f"{len(results)} runs, {len(results) - unsound} sound, {unsound} not")
    return 1 if unsound else 0


if __name__ == "__main__":
    sys.exit(main())
