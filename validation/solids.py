"""Solids of local blends: ``python -m validation.solids [--kernel]``.

Every triple of :mod:`validation.local_triples` becomes a solid on the part's own surfaces and those of the blends.
Printed are whether the kernel finds it valid, the share of its area that is exact, how many faces it has, how far its
volume is from that of the exact kernel's own blend (with ``--kernel``) or of the mesh, the size of its STEP file, and
why it has facets if it has.
Exits with 1 if a solid is not valid or has facets.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from cad_implicit.cad import occ, occ_files
from cad_implicit.cad.edges import part_edges
from cad_implicit.cad.exact_blends import exact_blend
from cad_implicit.cad.parts import open_part
from cad_implicit.local_blend import LocalBlend, blend_edges
from cad_implicit.parting import to_part

from .local_checks import Worker, numbers_in
from .local_parts import Triple, sizes_of, turned_by
from .local_triples import NAMED, TRIPLES

_TIMEOUT = 600
#: Cells along the diagonal at most: the solid does not depend on the spacing.
_CELLS = 120.0


@dataclass(frozen=True)
class Found:
    """What came of a run; volumes in mm³, size in kB."""

    valid: bool
    share: float
    faces: int
    volume: float
    mesh: float
    kernel: float
    seconds: float
    blend_seconds: float
    size: float
    why: str

    def line(self) -> str:
        """Row of the table."""
        against = self.kernel if self.kernel else self.mesh
        fate = ("exact" if self.share == 1.0 else f"{self.share:.1%}") if self.valid else "INVALID"
        return (
            f"{fate:8s}{self.faces:6d} faces  volume {self.volume:12.4f} {self.volume / against - 1:+9.1e}"
            f"{self.blend_seconds:7.2f} s + {self.seconds:5.2f} s{self.size:9.1f} kB  {self.why[:160]}"
        )


def blend_of(triple: Triple, index: int) -> tuple[LocalBlend, object]:
    """Blend of a triple, turned off the axes, and what the kernel needs to do the same."""
    plain = part_edges(open_part(triple.build().val()))
    sizes = sizes_of(triple, plain)
    part = open_part(turned_by(triple.build(), index))
    radius = float(min(np.min(size) for size in sizes.values()))
    diagonal = float(np.linalg.norm(part.bounds[1] - part.bounds[0]))
    spacing = max(radius / triple.cells, diagonal / _CELLS)
    if triple.blend == "fillet":
        return blend_edges(part, None, dict(sizes), spacing=spacing), (part, sizes)
    return blend_edges(part, None, dict(sizes), spacing=spacing, chamfer=True), (part, sizes)


def perform(index: int, kernel: bool) -> Found | str:
    """Do one run."""
    triple = (*NAMED, *TRIPLES)[index]
    start = time.perf_counter()
    try:
        blend, (part, sizes) = blend_of(triple, index)  # type: ignore[misc]
        mesh = blend.mesh()
        middle = time.perf_counter()
        made = to_part(blend, mesh=mesh)
        end = time.perf_counter()
    except Exception as error:  # the table tells it
        where = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {error} ({where.name}, {Path(where.filename).name}:{where.lineno})"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.step"
        occ_files.write(made.wrapped, file, "part", "2000-01-01T00:00:00")
        size = file.stat().st_size / 1000
        again = occ.is_valid(occ_files.read_product(file).shape)
    truth = exact_blend(part.shape, sizes, triple.blend) if kernel else None
    return Found(
        occ.is_valid(made.wrapped) and again,
        made.exact_share,
        made.faces,
        occ.volume(made.wrapped),
        mesh.volume,
        truth.after if truth is not None and truth.ok else 0.0,
        end - middle,
        middle - start,
        size,
        made.why,
    )


def main() -> int:
    """Print the table; return 1 if a solid is not valid or not exact."""
    parser = argparse.ArgumentParser(description="Solids of local blends.")
    parser.add_argument("--numbers", help="only these, such as 3,7 or 10-20")
    parser.add_argument("--kernel", action="store_true", help="compare volumes with the exact kernel's")
    options = parser.parse_args()
    triples = (*NAMED, *TRIPLES)
    chosen = [i for i in range(len(triples)) if not options.numbers or i in numbers_in(options.numbers)]
    worker = Worker(partial(perform, kernel=options.kernel), _TIMEOUT)
    bad = 0
    for index in chosen:
        result = worker(index)
        bad += isinstance(result, str) or not (result.valid and result.share == 1.0)
        line = f"ERROR {result}" if isinstance(result, str) else result.line()
        print(f"{index:3d} {triples[index].name:36s}{line}", flush=True)
    worker.close()
    print(f"{len(chosen)} runs, {len(chosen) - bad} valid and exact")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
