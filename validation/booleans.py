"""Booleans and balls beside manifold3d's: ``python -m validation.booleans``.

Unions, differences and intersections of pairs of solids, off the axes: manifold3d's of their meshes beside the
Implicits' of the same meshes, contoured at h. Closing and opening with a ball of radius r: manifold3d's
``minkowski_sum`` and ``minkowski_difference`` with balls of 16, 32 and 64 segments beside ours. Errors are largest and
RMS distances, both ways, to the exact kernel's solid by its surfaces. All run in a child process with a time limit.
With ``--readme`` the table in the README is written anew.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import cadquery as cq
import numpy as np
from manifold3d import Manifold, Mesh64

import cad_implicit as ci
from cad_implicit.cad.occ_mesh import tessellate
from cad_implicit.comparison import surface_samples
from cad_implicit.distance import MeshDistance
from cad_implicit.mesh import Mesh
from cad_implicit.report.exact_surfaces import Surfaces

from .local_checks import Worker
from .readme import into_readme

#: Spacing, radius and the meshes' tolerance in mm.
SPACING, RADIUS = 0.25, 2.0
TOLERANCE = 0.005 * SPACING

#: Segments of the balls for Minkowski sums.
SEGMENTS = (16, 32, 64)

#: Volumes of the exact kernel's booleans must fit together within this share.
_VOLUME = 1e-4

#: Random samples each way; seconds for one row.
_SAMPLES = 20_000
_TIMEOUT = 120.0


@dataclass(frozen=True)
class Row:
    """One result: largest and RMS error in mm, seconds, triangles."""

    case: str
    method: str
    largest: float
    rms: float
    seconds: float
    triangles: int


def _off_axis(part: cq.Workplane) -> cq.Workplane:
    return part.rotate((0, 0, 0), (1, 2, 3), 33)


def _pairs() -> dict[str, tuple[cq.Workplane, cq.Workplane]]:
    """Pairs of solids whose surfaces cross at clear angles.

    Of a ring and a cone, or a slanted rod, the exact kernel makes nothing that could be a measure: the union of 864 and
    980 mm³ has 80 mm³.
    """
    slab = cq.Workplane().box(20, 14, 9)
    ring = cq.Workplane(obj=cq.Solid.makeTorus(7, 2.5))
    rod = cq.Workplane("YZ").center(1, 0.4).circle(1.3).extrude(14)
    return {
        "box, cylinder": (slab, cq.Workplane("XZ").center(1, 3).circle(4).extrude(20, both=True)),
        "box, ball": (slab, cq.Workplane(obj=cq.Solid.makeSphere(6, cq.Vector(8, 5, 3), angleDegrees1=-90))),
        "box, ring": (slab, ring.translate((2, 1, 3.5))),
        "ring, rod": (ring, rod),
    }


#: Booleans by name: of the exact kernel, of manifold3d and of Implicits.
BOOLEANS: dict[str, tuple[str, Callable[[Any, Any], Any]]] = {
    "union": ("union", lambda a, b: a | b),
    "difference": ("cut", lambda a, b: a - b),
    "intersection": ("intersect", lambda a, b: a & b),
}


def _balls() -> dict[str, tuple[cq.Workplane, cq.Workplane]]:
    """Parts whose closing or opening the exact kernel knows, too, and that."""
    block = cq.Workplane().box(20, 14, 9)
    boss = cq.Workplane().box(24, 24, 6).union(cq.Workplane().circle(6).extrude(13))
    return {
        "opening of a box": (block, block.edges().fillet(RADIUS)),
        "closing of a boss on a plate": (boss, boss.faces(">Z[-2]").edges("%CIRCLE").fillet(RADIUS)),
    }


def errors(mesh: Mesh, surfaces: Surfaces) -> tuple[float, float]:
    """Largest and RMS distance in mm between a mesh and a solid, both ways."""
    forth = np.concatenate([mesh.vertices, surface_samples(mesh, _SAMPLES)[0]])
    back, _ = surfaces.samples(np.ones(len(surfaces.shapes), np.bool_), _SAMPLES)
    away = np.concatenate([surfaces.nearest(forth)[0], MeshDistance(mesh, sign="pseudonormal").unsigned(back)])
    return float(away.max()), float(np.sqrt(np.mean(away**2)))


def manifold(mesh: Mesh) -> Manifold:
    """Give a mesh to manifold3d."""
    return Manifold(Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))


def from_manifold(solid: Manifold) -> Mesh:
    """Take a mesh back from manifold3d."""
    own = solid.to_mesh64()
    return Mesh(np.asarray(own.vert_properties)[:, :3], np.asarray(own.tri_verts, np.int32))


def _mesh(part: cq.Workplane) -> Mesh:
    return tessellate([part.val().wrapped], TOLERANCE, 0.5)[0]


def _boolean(pair: str, name: str, ours: bool) -> tuple[Mesh, float, cq.Workplane]:
    first, second = (_off_axis(part) for part in _pairs()[pair])
    _, operator = BOOLEANS[name]
    truth = _exact(name, first, second)
    a, b = _mesh(first), _mesh(second)
    start = time.perf_counter()
    if ours:
        mesh = ci.contour(operator(MeshDistance(a), MeshDistance(b)), SPACING)
    else:
        own = {"union": Manifold.__add__, "difference": Manifold.__sub__, "intersection": Manifold.__xor__}[name]
        mesh = from_manifold(own(manifold(a), manifold(b)))
    return mesh, time.perf_counter() - start, truth


def _exact(name: str, first: cq.Workplane, second: cq.Workplane) -> cq.Workplane:
    """Give the exact kernel's boolean.

    Raises
    ------
    ValueError
        If its volume is not what those of the two and of their intersection make.
    """
    truth = getattr(first, BOOLEANS[name][0])(second)
    a, b, both = (float(part.val().Volume()) for part in (first, second, first.intersect(second)))
    right = {"union": a + b - both, "difference": a - both, "intersection": both}[name]
    volume = float(truth.val().Volume())
    if abs(volume - right) > _VOLUME * right:
        raise ValueError(f"the exact kernel's volumes do not fit together: {volume:.5g} and {right:.5g} mm³")
    return truth


def _ball(case: str, segments: int) -> tuple[Mesh, float, cq.Workplane]:
    part, truth = (_off_axis(solid) for solid in _balls()[case])
    mesh = _mesh(part)
    start = time.perf_counter()
    if segments:
        solid, ball = manifold(mesh), Manifold.sphere(RADIUS, segments)
        if case.startswith("opening"):
            solid = solid.minkowski_difference(ball).minkowski_sum(ball)
        else:
            solid = solid.minkowski_sum(ball).minkowski_difference(ball)
        return from_manifold(solid), time.perf_counter() - start, truth
    operation = ci.round if case.startswith("opening") else ci.fillet
    return ci.contour(operation(MeshDistance(mesh), RADIUS, spacing=SPACING)), time.perf_counter() - start, truth


def tasks() -> list[tuple[str, str, Callable[[], tuple[Mesh, float, cq.Workplane]]]]:
    """Case, method, and what makes the mesh, gives the seconds that took, and the exact solid."""
    found: list[tuple[str, str, Callable[[], tuple[Mesh, float, cq.Workplane]]]] = []
    for pair in _pairs():
        for name in BOOLEANS:
            for ours, method in ((False, "manifold3d"), (True, f"ours, h = {SPACING:g}")):
                found.append((f"{name}: {pair}", method, lambda p=pair, n=name, o=ours: _boolean(p, n, o)))  # type: ignore[misc]
    for case in _balls():
        for segments in (*SEGMENTS, 0):
            method = f"manifold3d, {segments} segments" if segments else f"ours, h = {SPACING:g}"
            found.append((f"{case}, r = {RADIUS:g}", method, lambda c=case, s=segments: _ball(c, s)))  # type: ignore[misc]
    return found


def perform(number: int) -> Row:
    """Do one of the tasks and measure it; those of ours once before, for numba compiles at the first call."""
    case, method, make = tasks()[number]
    if method.startswith("ours"):
        make()
    mesh, seconds, truth = make()
    largest, rms = errors(mesh, Surfaces(truth.val().wrapped, TOLERANCE))
    return Row(case, method, largest, rms, seconds, len(mesh.faces))


def table(rows: list[Row | tuple[str, str, str]]) -> str:
    """Give the rows in Markdown."""
    day = datetime.now(UTC).strftime("%Y-%m-%d")
    lines = [
        f"`python -m validation.booleans --readme`, {day}, meshes to {TOLERANCE:g} mm, errors in mm:", "",
        "| case | by | largest error | RMS | s | triangles |", "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for row in rows:
        if isinstance(row, Row):
            cells = (row.case, row.method, f"{row.largest:.2g}", f"{row.rms:.2g}", f"{row.seconds:.2f}", row.triangles)
        else:
            cells = (row[0], row[1], row[2], "–", "–", "–")  # type: ignore[assignment]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Do all, print the table; return 1 if one of ours fails while the exact kernel does not."""
    parser = argparse.ArgumentParser(description="Booleans and balls beside manifold3d's.")
    parser.add_argument("--case", default="", help="only cases whose name contains this")
    parser.add_argument("--readme", action="store_true", help="write the table into README.md")
    options = parser.parse_args()
    worker = Worker(perform, _TIMEOUT)
    rows: list[Row | tuple[str, str, str]] = []
    for number, (case, method, _) in enumerate(tasks()):
        if options.case in case:
            row = worker(number)
            rows.append((case, method, row) if isinstance(row, str) else row)
            print(rows[-1], flush=True)
    worker.close()
    print(table(rows))
    if options.readme:
        into_readme("booleans", table(rows))
    failed = [row for row in rows if isinstance(row, tuple) and "exact kernel" not in row[2]]
    return int(any(row[1].startswith("ours") for row in failed))


if __name__ == "__main__":
    sys.exit(main())
