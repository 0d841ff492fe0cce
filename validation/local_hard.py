"""Local blends at which the exact kernel gives up, and others that are hard: ``python -m validation.local_hard DIR``.

Each run is a child process; pictures go to DIR. A run is sound if its mesh is closed, manifold, free of
self-intersections, touched by its balls, and of the expected volume; where no ball fits, if the error says so with the
edge and the largest radius. Exits with 1 if a run is not sound.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cadquery as cq

from cad_implicit.cad.edges import Edge, part_edges
from cad_implicit.cad.exact_blends import exact_blend
from cad_implicit.cad.parts import open_part
from cad_implicit.contouring import contour
from cad_implicit.errors import CadImplicitError, RadiusError
from cad_implicit.local_blend import blend_edges
from cad_implicit.pictures import render

from . import cases
from . import local_parts as parts
from .local_checks import Checked, Worker, checked, numbers_in
from .local_parts import Chosen, chosen_edges
from .parts import solid

B = cq.Workplane
_TIMEOUT = 300
_VIEW = (1.0, -1.6, 1.1)


@dataclass(frozen=True)
class Hard:
    """A part, some of its edges, their radii, and what must come of it.

    Attributes
    ----------
    choices : tuple of (selector or points, radius)
    spacing : float
        In mm.
    volume, tolerance : float
        Expected in mm³, and how far off it may be beyond what chords take; volume 0 if it is not known.
    fits : bool
        Whether a ball fits; else the right answer is a RadiusError.
    chamfer : bool
        Whether the radius is the length of a chamfer.
    view : (3,) tuple
        Direction from the part to the eye.
    """

    name: str
    build: Callable[[], cq.Workplane]
    choices: tuple[tuple[Chosen, float], ...]
    spacing: float
    volume: float = 0.0
    tolerance: float = 0.0
    fits: bool = True
    chamfer: bool = False
    view: tuple[float, float, float] = _VIEW


@dataclass(frozen=True)
class Outcome:
    """What came of a run."""

    name: str
    exact: str
    seconds: float
    error: str = ""
    refused: bool = False
    before: float = 0.0
    checked: Checked | None = None
    faults: tuple[str, ...] = ()

    def line(self) -> str:
        """Row of the table."""
        head = f"{self.name:34s}{self.exact:>10s}{self.seconds:7.1f} s"
        if self.error:
            return f"{head}  {'refused' if self.refused else 'ERROR'}: {self.error}"
        c = self.checked
        assert c is not None
        return f"{head}{c.faces:8d}{c.volume:13.4f}{c.volume - self.before:12.4f}{c.contact:9.4f}{c.centres:9.1e}" + (
            "  FAULT: " + "; ".join(self.faults) if self.faults else ""
        )


_HEADER = (
    f"{'':3s}{'run':34s}{'exact':>10s}{'':9s}{'faces':>8s}{'volume':>13s}{'change':>12s}{'contact':>9s}{'centres':>9s}"
)


def wall_beside(height: float) -> cq.Workplane:
    """Step of a height on a block, 30 long: the concave edge at its foot is along Y."""
    points = [(0, 0), (40, 0), (40, 10), (20, 10), (20, 10 + height), (0, 10 + height)]
    return B("XZ").polyline(points).close().extrude(-30)


def hole_near_side(distance: float) -> cq.Workplane:
    """Block with a hole of radius 10 so far from its side."""
    return B().box(60, 60, 20).cut(B().circle(10).extrude(60, both=True).translate((20 - distance, 0, 0)))


def boss_near_border(distance: float) -> cq.Workplane:
    """Plate with a boss of radius 10 so far from its side."""
    return B().box(60, 60, 10).union(B().circle(10).extrude(20).translate((20 - distance, 0, 0)))


def thick_plate() -> cq.Workplane:
    """Plate 50 wide and 10 thick."""
    return B().box(80, 50, 10)


def cliff(height: float, r: float) -> float:
    """Area that a ball at the foot of a wall lower than its radius leaves to be filled, as it rolls on its border."""
    reach = math.sqrt(r * r - (r - height) ** 2)
    under = (reach * math.sqrt(r * r - reach * reach) + r * r * math.asin(reach / r)) / 2
    return r * reach - under


_SPHERE = 4 / 3 * math.pi
_L_BOTH = (("convex", 2.0), ("concave", 4.0))
_BESIDE = 30 * (40 * 10 + 20 * 1.2)
_STADIUM = 10 * (50 * 30 + math.pi * 625)

#: The runs; those of :mod:`validation.cases` first.
RUNS: tuple[Hard, ...] = (
    Hard("case 1, all 1", cases.hollow_box, (("all", 1.0),), 0.25),
    Hard("case 1, all 0.4", cases.hollow_box, (("all", 0.4),), 0.1),
    Hard("case 2, |Z 3", cases.loft_with_holes, (("|Z", 3.0),), 0.75),
    Hard("case 3, |Y 4", cases.split_cylinder, (("|Y", 4.0),), 1.0),
    Hard("case 3, ellipse 4", cases.split_cylinder, (("convex exc %circle", 4.0),), 1.0),
    Hard("case 4, >Z 0.2", cases.raised_text, ((">Z", 0.2),), 0.05),
    Hard("case 5, all 0.3", cases.leaking_union, (("all", 0.3),), 0.075),
    Hard("case 6, all 5", cases.cube_to_sphere, (("all", 5.0),), 0.25, _SPHERE * 125, 0.01),
    Hard("case 6, all 4.999", cases.cube_to_sphere, (("all", 4.999),), 0.25, 1000 - 476.24415, 0.01),
    Hard("case 6, all 5.1", cases.cube_to_sphere, (("all", 5.1),), 0.25, fits=False),
    Hard("case 7, |Z 25", cases.stadium, (("|Z", 25.0),), 1.0, _STADIUM, 0.1),
    Hard("case 7, |Z 25 finer", cases.stadium, (("|Z", 25.0),), 0.5, _STADIUM, 0.1),
    Hard("case 7, |Z 24.99", cases.stadium, (("|Z", 24.99),), 1.0, 40000 - 5360.75474, 0.1),
    Hard("case 8, <Z 1", cases.chamfered_bottom, (("<Z", 1.0),), 0.2),
    Hard("case 8, chamfer of <Z 1", cases.chamfered_bottom, (("<Z", 1.0),), 0.2, chamfer=True),
    Hard("case 9, >Z 1", cases.torus_groove, ((">Z", 1.0),), 0.4),
    Hard("case 10, all 1", cases.tangent_boss, (("all", 1.0),), 0.2),
    Hard("case 10, concave 1", cases.tangent_boss, (("concave", 1.0),), 0.2),
    Hard("case 11, not <Z or >Z, 1", cases.bosses_with_rib, (("not(<Z or >Z)", 1.0),), 0.2),
    Hard("case 12, all 1", cases.steinmetz, (("all", 1.0),), 0.2),
    Hard("L, convex 2 concave 4", parts.l_part, _L_BOTH, 0.4, view=(1, -1.6, 0.5)),
    Hard("3 mm plate, |Z 10", parts.thin_plate, (("|Z", 10.0),), 0.5, 3600 - 1200 * (1 - math.pi / 4), 0.1),
    Hard("hole 1 from a side, rim 2", partial(hole_near_side, 1.0), (("%circle and >Z", 2.0),), 0.4),
    Hard("hole 0.3 from a side, rim 2", partial(hole_near_side, 0.3), (("%circle and >Z", 2.0),), 0.4),
    Hard("hole 2 from a side, rim 2", partial(hole_near_side, 2.0), (("%circle and >Z", 2.0),), 0.4),
    Hard("boss 1 from a side, base 2", partial(boss_near_border, 1.0), (("concave", 2.0),), 0.4),
    Hard("slot, one end arc", parts.slot, ((((12.8197, 0, 2),), 2.0),), 0.4),
    Hard("slot, floor 6 is half its width", parts.slot, (("concave exc |Z", 6.0),), 1.0),
    Hard("wall 1.2, r 2", partial(wall_beside, 1.2), (("concave", 2.0),), 0.4, _BESIDE + 30 * cliff(1.2, 2), 0.01),
    Hard("wall 2, r 2", partial(wall_beside, 2.0), (("concave", 2.0),), 0.4, 30 * 440 + 120 * (1 - math.pi / 4), 0.01),
    Hard(
        "slab, both edges of a side 5", thick_plate, ((">X and |Y", 5.0),), 1.0, 40000 - 50 * 100 * (0.5 - math.pi / 8)
    ),
    Hard("blind hole 5, floor 5.1", parts.hole, (("concave", 5.1),), 0.5, fits=False),
    Hard("blind hole 5, floor 5", parts.hole, (("concave", 5.0),), 0.5),
    Hard("vase, all 1", cases.revolved_vase, (("all", 1.0),), 0.25),
    Hard("twisted prism, all 1", cases.twisted_prism, (("all", 1.0),), 0.25),
    Hard("sphere in a corner, concave 1.5", cases.sphere_in_corner, (("concave", 1.5),), 0.3),
    Hard("skew bores, concave 2", cases.slanted_bores, (("all", 1.0),), 0.25),
)


def perform(index: int, folder: Path) -> Outcome:
    """Do one run, check and picture it."""
    task = RUNS[index]
    part = open_part(solid(task.build()))
    found = part_edges(part)
    radii = {edge.number: r for chosen, r in task.choices for edge in chosen_edges(chosen, found)}
    found_kinds = {edge.number: edge.convexity for edge in found}
    radii = {n: r for n, r in radii.items() if found_kinds[n] in ("convex", "concave", "mixed")}
    exact = exact_blend(part.shape, radii, "chamfer" if task.chamfer else "fillet", time_limit=60)
    status = f"{exact.change:.4f}" if exact.ok else exact.status
    start = time.perf_counter()
    try:
        length = task.choices[0][1] if task.chamfer else None
        blend = blend_edges(part, None, radii, spacing=task.spacing, chamfer=task.chamfer, second=length)
        mesh = contour(blend)
    except CadImplicitError as error:
        refused = isinstance(error, RadiusError)
        text = f"{type(error).__name__}: {error}"
        faults = () if refused and not task.fits else ("error",)
        return Outcome(task.name, status, time.perf_counter() - start, text, refused, faults=faults)
    except Exception as error:  # a fault of the engine: the table tells it
        where = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} ({where.name}, line {where.lineno} of {Path(where.filename).name})"
        return Outcome(task.name, status, time.perf_counter() - start, text, faults=("error",))
    seconds = time.perf_counter() - start
    before = blend.parent.mesh.volume
    render([mesh], [task.name], folder / f"{index:02d}.png", view=task.view)
    result = checked(mesh, blend, part, {} if task.chamfer else radii, task.spacing)
    faults = result.faults if task.fits else [*result.faults, "no error, though no ball fits"]
    if task.volume:
        chords = 0.2 * task.spacing**2 / min(radii.values()) * _blend_area(radii, found)
        off = result.volume - task.volume
        if abs(off) > task.tolerance + 1e-4 * task.volume + chords:
            faults = [*faults, f"volume off by {off:.4f}"]
    return Outcome(task.name, status, seconds, before=before, checked=result, faults=tuple(faults))


def _blend_area(radii: dict[int, float], found: Sequence[Edge]) -> float:
    """Rough area of blends: a quarter of a tube along each edge."""
    return sum(math.pi / 2 * radii[e.number] * e.length for e in found if e.number in radii)


def main() -> int:
    """Print the table; return 1 if a run is not sound."""
    parser = argparse.ArgumentParser(description="Local blends at hard places.")
    parser.add_argument("folder", type=Path, help="where pictures go")
    parser.add_argument("--run", help="only runs whose name contains this")
    parser.add_argument("--numbers", help="only these, such as 3,7 or 10-20")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    chosen = [i for i, task in enumerate(RUNS) if not options.run or options.run in task.name]
    if options.numbers:
        chosen = [i for i in chosen if i in numbers_in(options.numbers)]
    worker = Worker(partial(perform, folder=options.folder), _TIMEOUT)
    unsound = 0
    print(_HEADER)
    for index in chosen:
        result = worker(index)
        if isinstance(result, str):
            result = Outcome(RUNS[index].name, "", _TIMEOUT, result, faults=("error",))
        unsound += bool(result.faults)
        print(f"{index:2d} {result.line()}", flush=True)
    worker.close()
    print(f"{len(chosen)} runs, {len(chosen) - unsound} sound, {unsound} not")
    return 1 if unsound else 0


if __name__ == "__main__":
    sys.exit(main())
