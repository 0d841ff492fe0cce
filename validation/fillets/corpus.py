"""Parts by script, mechanical and varied, and those on which the exact kernel fails; lengths in mm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cadquery as cq
import numpy as np

from cad_implicit.cad.edges import part_edges
from cad_implicit.cad.parts import OpenPart, open_part
from validation import cases
from validation.local_parts import turned_by
from validation.local_solids import SOLIDS

#: Radii as shares of the diagonal.
SHARES = (0.01, 0.03)

#: Parts of the corpus by name; the last ones break the exact kernel.
PARTS: dict[str, Callable[[], cq.Workplane]] = {
    **SOLIDS,
    "ribbed_plate": cases.ribbed_plate,
    "gear": cases.gear,
    "revolved_vase": cases.revolved_vase,
    "twisted_prism": cases.twisted_prism,
    "hollow_box": cases.hollow_box,
    "loft_with_holes": cases.loft_with_holes,
    "split_cylinder": cases.split_cylinder,
    "raised_text": cases.raised_text,
    "torus_groove": cases.torus_groove,
    "tangent_boss": cases.tangent_boss,
    "bosses_with_rib": cases.bosses_with_rib,
    "steinmetz": cases.steinmetz,
}


@dataclass(frozen=True)
class Job:
    """One validation: ``edges`` is None for the ball that rolls on the whole part."""

    part: str
    operation: str
    edges: str | None
    share: float

    @property
    def key(self) -> str:
        """Name of the run."""
        return f"{self.part} {self.operation} {self.edges or 'whole'} {self.share:g}"


def jobs() -> list[Job]:
    """All runs: chosen edges of either kind at each radius, and the closing of the whole part at the largest."""
    found = []
    for part in PARTS:
        for share in SHARES:
            found += [Job(part, "fillet", "concave", share), Job(part, "round", "convex", share)]
        found.append(Job(part, "fillet", None, SHARES[-1]))
    return found


def prepared(job: Job) -> tuple[OpenPart, float, bool]:
    """Part, turned off the axes, the radius in mm, and whether it has edges of the kind."""
    name = list(PARTS).index(job.part)
    part = open_part(turned_by(PARTS[job.part](), 70 + name))
    plain = open_part(PARTS[job.part]().val())
    diagonal = float(np.linalg.norm(plain.bounds[1] - plain.bounds[0]))
    kind = job.edges or "concave"
    return part, job.share * diagonal, any(edge.convexity == kind for edge in part_edges(part))
