"""How often all edges of one kind can be blended, beside the exact kernel: ``python -m validation.local_rates DIR``.

Thirty solids, turned off the axes, all their convex edges or all their concave ones, radii of 0.5, 1, 2 and 4 % of the
diagonal. A run is right if its mesh is closed, manifold, free of self-intersections and touched by its balls. Where the
exact kernel fails, too, an error is right if it says that no ball fits and names an edge and the largest radius, which
then must fit. DIR keeps the results; what is there is not run again. Exits with 1 if a run is wrong.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
import traceback
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cad_implicit.blend_regions import SPACINGS
from cad_implicit.cad import OpenPart
from cad_implicit.cad.edges import part_edges
from cad_implicit.cad.exact_blends import exact_blend
from cad_implicit.cad.parts import open_part
from cad_implicit.choices import choose
from cad_implicit.errors import RadiusError
from cad_implicit.face_groups import PartFaces
from cad_implicit.local_blend import REACH, blend_edges, lay_out

from .local_checks import Worker, checked
from .local_parts import turned_by
from .local_solids import SOLIDS

_KINDS = ("convex", "concave")
_SHARES = (0.005, 0.01, 0.02, 0.04)
#: Spacings in a radius.
_CELLS = 4.0
#: Seconds for one run of either kind.
_OURS, _EXACT = 240, 60
_REFUSAL = re.compile(r"edges? \d+.*largest radius.* ([\d.e+-]+) mm")


@dataclass(frozen=True)
class Job:
    """One run."""

    solid: str
    kind: str
    share: float

    @property
    def key(self) -> str:
        """Name of the run."""
        return f"{self.solid} {self.kind} {self.share:g}"


JOBS = tuple(Job(solid, kind, share) for solid in SOLIDS for kind in _KINDS for share in _SHARES)


@dataclass(frozen=True)
class Found:
    """What came of a run: ``fate`` is "right", "refused", "none" (no such edges) or "wrong"."""

    fate: str
    seconds: float
    radius: float = 0.0
    message: str = ""
    faces: int = 0
    contact: float = 0.0
    centres: float = 0.0


def ours(index: int) -> Found:
    """Blend with this package and check."""
    job = JOBS[index]
    part, numbers, radius = _prepared(job)
    if not numbers:
        return Found("none", 0.0, radius)
    start = time.perf_counter()
    spacing, radii = radius / _CELLS, dict.fromkeys(numbers, radius)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            blend = blend_edges(part, radius, numbers, spacing=spacing)
            mesh = blend.mesh()
    except RadiusError as error:
        fault = _unfit(part, numbers, str(error))
        fate = "wrong" if fault else "refused"
        return Found(fate, time.perf_counter() - start, radius, f"{fault}{error}")
    except Exception as error:  # a fault of the engine: the table tells it
        where = traceback.extract_tb(error.__traceback__)[-1]
        message = f"{type(error).__name__}: {error} ({where.name}, {Path(where.filename).name}:{where.lineno})"
        return Found("wrong", time.perf_counter() - start, radius, message)
    seconds = time.perf_counter() - start
    result = checked(mesh, blend, part, radii, spacing)
    fate = "wrong" if result.faults else "right"
    return Found(fate, seconds, radius, "; ".join(result.faults), result.faces, result.contact, result.centres)


def exact(index: int) -> Found:
    """Blend with the exact kernel."""
    part, numbers, radius = _prepared(JOBS[index])
    if not numbers:
        return Found("none", 0.0, radius)
    answer = exact_blend(part.shape, dict.fromkeys(numbers, radius), time_limit=_EXACT)
    return Found("right" if answer.ok else answer.status, answer.seconds, radius, answer.message)


def _prepared(job: Job) -> tuple[OpenPart, list[int], float]:
    turn = list(SOLIDS).index(job.solid)
    part = open_part(turned_by(SOLIDS[job.solid](), 40 + turn))
    plain = open_part(SOLIDS[job.solid]().val())
    diagonal = float(np.linalg.norm(plain.bounds[1] - plain.bounds[0]))
    return part, [edge.number for edge in part_edges(part) if edge.convexity == job.kind], job.share * diagonal


def _unfit(part: OpenPart, numbers: Sequence[int], message: str) -> str:
    """Tell what is wrong with an error that says that no ball fits, if anything."""
    match = _REFUSAL.search(message)
    if match is None:
        return "names no edge or no largest radius: "
    radius, found = 0.999 * float(match[1]), part_edges(part)
    faces = PartFaces(part, REACH * radius, found)
    try:  # where balls roll is all that matters: contouring a tiny radius would take long
        lay_out(choose(part, found, numbers, radius), faces, found, SPACINGS * radius / _CELLS)
    except RadiusError as error:
        return f"the largest radius does not fit either ({error}): "
    return ""


def main() -> int:
    """Print the table; return 1 if a run is wrong."""
    parser = argparse.ArgumentParser(description="Rates of success over solids and radii.")
    parser.add_argument("folder", type=Path, help="where results are kept")
    parser.add_argument("--run", help="only runs whose name contains this")
    parser.add_argument("--skip", type=int, default=1, help="only every so many-th run")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    chosen = [i for i, job in enumerate(JOBS) if not options.run or options.run in job.key][:: options.skip]
    kernel = _all("exact", options.folder, chosen, partial(exact), 2 * _EXACT)
    own = _all("ours", options.folder, chosen, partial(ours), _OURS)
    return _tell(chosen, own, kernel)


def _all(name: str, folder: Path, chosen: Sequence[int], task: Any, timeout: float) -> dict[str, Found]:
    """Results by key, those in the file and new ones."""
    file = folder / f"{name}.jsonl"
    done: dict[str, Found] = {}
    if file.exists():
        for line in file.read_text().splitlines():
            entry = json.loads(line)
            key = entry.pop("key")
            done[key] = Found(**entry)
    worker = Worker(task, timeout)
    for index in chosen:
        key = JOBS[index].key
        if key in done:
            continue
        result = worker(index)
        found = Found("wrong", timeout, message=result) if isinstance(result, str) else result
        done[key] = found
        with file.open("a") as out:
            out.write(json.dumps({"key": key, **asdict(found)}) + "\n")
        print(f"{name:6s} {key:36s}{found.fate:>10s}{found.seconds:7.1f} s  {found.message[:250]}", flush=True)
    worker.close()
    return done


def _tell(chosen: Sequence[int], own: dict[str, Found], kernel: dict[str, Found]) -> int:
    print(
        f"\n{'run':36s}{'radius':>8s}{'ours':>9s}{'exact':>10s}{'faces':>9s}{'contact/h':>10s}{'centres/h':>10s}{'s':>7s}"
    )
    wrong = 0
    counts: dict[str, list[int]] = {kind: [0, 0, 0, 0] for kind in _KINDS}
    for index in chosen:
        job = JOBS[index]
        a, b = own[job.key], kernel[job.key]
        if a.fate == "none":
            continue
        if a.fate == "refused" and b.fate == "right":
            a = replace(a, fate="wrong", message=f"the exact kernel does it: {a.message}")
        wrong += a.fate == "wrong"
        count = counts[job.kind]
        for place, hit in enumerate((True, a.fate == "right", a.fate == "refused", b.fate == "right")):
            count[place] += hit
        print(
            f"{job.key:36s}{a.radius:8.3f}{a.fate:>9s}{b.fate:>10s}{a.faces:9d}{a.contact:10.4f}{a.centres:10.1e}"
            f"{a.seconds:7.1f}  {a.message[:200]}"
        )
    for kind, (runs, right, refused, theirs) in counts.items():
        print(
            f"{kind}: {runs} runs; {right} blended and right, {refused} refused with the largest radius, "
            f"{runs - right - refused} wrong; the exact kernel {theirs}"
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
