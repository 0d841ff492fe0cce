"""Local blends beside the exact kernel's, each run in a child process: ``python -m validation.local_blends``.

Vertices are compared with the surfaces of the exact solid, samples of its blends with the triangles, and the volumes.
Where the exact blend is a B-spline, which misses the true surface itself, the figures are printed but not judged. Exits
with 1 if a run is not sound.
"""

from __future__ import annotations

import argparse
import sys
import time
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cad_implicit.cad import OpenPart
from cad_implicit.cad.edges import part_edges
from cad_implicit.cad.exact_blends import Blend, Size, exact_blend
from cad_implicit.cad.parts import open_part
from cad_implicit.mesh import Mesh

from .local_checks import Worker, numbers_in
from .local_parts import Triple, sizes_of, turned_by
from .local_triples import NAMED, TRIPLES
from .runs import manifold_status
from .surfaces import Errors, Surfaces, errors

#: Seconds after which a run counts as hung.
_TIMEOUT = 600

#: Most cells along the diagonal: a spacing that asks for more is taken larger.
_CELLS = 260.0

#: Share of the spacing by which the triangles of the exact solid may be off.
_FACETS = 1 / 1000

_HEADER = (
    f"{'':3s} {'run':40s}{'kind':>8s}{'r/h':>6s}{'faces':>8s}{'vertex/h':>9s}{'plane/h':>9s}{'back/h':>8s}{'chord':>7s}"
    f"{'volume':>9s}{'limit':>8s}{'change':>11s}{'exact':>11s}{'s':>6s}"
)


@dataclass(frozen=True)
class Outcome:
    """What came of a run; see :class:`validation.surfaces.Errors`."""

    name: str
    seconds: float = 0.0
    error: str = ""
    kind: str = ""
    cells: float = 0.0
    faces: int = 0
    closed: bool = True
    manifold: str = "NoError"
    errors: Errors | None = None
    change: float = 0.0
    exact: float = 0.0
    formula: float | None = None
    spacing: float = 0.0
    faults: tuple[str, ...] = field(default=())

    def line(self) -> str:
        """Row of the table."""
        if self.error:
            return f"{self.name:40s}  ERROR {self.seconds:.1f} s: {self.error}"
        e = self.errors
        assert e is not None
        verdict = "; ".join(self.faults)
        place = ", ".join(f"{x:.3f}" for x in e.place)
        return (
            f"{self.name:40s}{self.kind:>8s}{self.cells:6.1f}{self.faces:8d}{e.vertices:9.4f}{e.planes:9.5f}{e.back:8.4f}"
            f"{e.chord:7.3f}{e.volume:9.1e}{e.volume_limit:8.1e}{self.change:11.4f}{self.exact:11.4f}{self.seconds:6.1f}"
            + (f"  FAULT: {verdict}; worst at ({place}) on a {e.face}" if verdict else "")
        )


def blended_mesh(part: OpenPart, sizes: Mapping[int, Size], blend: Blend, spacing: float) -> Mesh:
    """Triangles of a local blend by this package."""
    from cad_implicit.local_blend import blend_edges

    if blend == "fillet":
        return blend_edges(part, None, dict(sizes), spacing=spacing).mesh()
    seconds = {size[1] for size in sizes.values() if isinstance(size, tuple)}
    firsts = {number: size[0] if isinstance(size, tuple) else size for number, size in sizes.items()}
    second = seconds.pop() if seconds else None
    if second is None and len(set(firsts.values())) == 1:
        second = next(iter(firsts.values()))
    return blend_edges(part, None, firsts, spacing=spacing, chamfer=True, second=second).mesh()


def perform(index: int, triple: Triple) -> Outcome:
    """Do one run and compare."""
    start = time.perf_counter()
    plain = part_edges(open_part(triple.build().val()))
    sizes = sizes_of(triple, plain)
    part = open_part(turned_by(triple.build(), index))
    radius = float(min(np.min(size) for size in sizes.values()))
    diagonal = float(np.linalg.norm(part.bounds[1] - part.bounds[0]))
    spacing = max(radius / triple.cells, diagonal / _CELLS)
    exact = exact_blend(part.shape, sizes, triple.blend)
    if not exact.ok:
        return Outcome(triple.name, error=f"the exact kernel: {exact.status} {exact.message}")
    start = time.perf_counter()
    try:
        mesh = blended_mesh(part, sizes, triple.blend, spacing)
    except Exception as error:  # a fault of the engine: the table tells it
        where = traceback.extract_tb(error.__traceback__)[-1]
        message = f"{type(error).__name__}: {error} ({where.name}, line {where.lineno})"
        return Outcome(triple.name, time.perf_counter() - start, message)
    seconds = time.perf_counter() - start
    surfaces = Surfaces(exact.shape, _FACETS * spacing)
    is_blend = np.zeros(len(surfaces.shapes), np.bool_)
    is_blend[np.array(exact.blend) - 1] = True
    found = errors(mesh, surfaces, is_blend, spacing, radius, exact.after)
    kind = "spline" if "bspline" in surfaces.names[is_blend] else "exact"
    faults = [] if mesh.is_watertight else ["open"]
    manifold = manifold_status(mesh)
    faults += [manifold] if manifold != "NoError" else []
    if kind == "exact":
        faults += found.faults
    return Outcome(
        triple.name,
        seconds,
        kind=kind,
        cells=radius / spacing,
        faces=len(mesh.faces),
        closed=mesh.is_watertight,
        manifold=manifold,
        errors=found,
        change=mesh.volume - exact.before,
        exact=exact.change,
        formula=triple.change,
        spacing=spacing,
        faults=tuple(faults),
    )


def perform_numbered(index: int) -> Outcome:
    """Do the run of a number; triples hold functions, which do not go to another process."""
    return perform(index, (*NAMED, *TRIPLES)[index])


def main() -> int:
    """Print the table; return 1 if a run is not sound."""
    parser = argparse.ArgumentParser(description="Compare local blends with those of the exact kernel.")
    parser.add_argument("--run", help="only runs whose name contains this")
    parser.add_argument("--numbers", help="only these, such as 3,7 or 10-20")
    options = parser.parse_args()
    triples = (*NAMED, *TRIPLES)
    chosen = [i for i, triple in enumerate(triples) if not options.run or options.run in triple.name]
    if options.numbers:
        chosen = [i for i in chosen if i in numbers_in(options.numbers)]
    worker = Worker(perform_numbered, _TIMEOUT)
    unsound = 0
    print(_HEADER)
    for index in chosen:
        result = worker(index)
        outcome = Outcome(triples[index].name, error=result) if isinstance(result, str) else result
        unsound += bool(outcome.error or outcome.faults)
        print(f"{index:3d} {outcome.line()}", flush=True)
    worker.close()
    print(f"{len(chosen)} runs, {len(chosen) - unsound} sound, {unsound} not")
    return 1 if unsound else 0


if __name__ == "__main__":
    sys.exit(main())
