"""The parts at which the exact kernel fails, through the CadQuery plugin."""

from __future__ import annotations

from collections.abc import Callable

import cadquery as cq

import cad_implicit.cadquery  # noqa: F401  (it patches Workplane)

from . import cases

#: Edges, or faces for their edges, of each case, its radius in mm, and what is done there.
_CHOSEN: tuple[tuple[int, Callable[[cq.Workplane], cq.Workplane], str], ...] = (
    (1, lambda part: part.edges(), "safeFillet"),
    (2, lambda part: part.faces("|Z").edges(), "safeFillet"),
    (3, lambda part: part.edges("|Y"), "safeFillet"),
    (4, lambda part: part.faces(">Z").edges(), "safeFillet"),
    (5, lambda part: part.edges(), "safeFillet"),
    (6, lambda part: part.edges(), "safeFillet"),
    (7, lambda part: part.edges("|Z"), "safeFillet"),
    (8, lambda part: part.edges("<Z"), "implicitChamfer"),
    (9, lambda part: part.edges(">Z"), "safeFillet"),
    (10, lambda part: part.edges(), "safeFillet"),
    (11, lambda part: part.edges("not(<Z or >Z)"), "safeFillet"),
    (12, lambda part: part.edges(), "safeFillet"),
)


def runs() -> dict[str, Callable[[], cq.Shape]]:
    """Tell what is to be done, by name; each gives a shape with its attribute ``implicit``."""
    found: dict[str, Callable[[], cq.Shape]] = {}
    for case, (number, select, method) in zip(cases.CASES, _CHOSEN, strict=True):
        assert case.number == number
        found[f"{number} {method} {case.radius:g}"] = lambda c=case, s=select, m=method: getattr(s(c.build()), m)(
            c.radius
        ).val()
        found[f"{number} implicitRound {case.radius:g}"] = lambda c=case: c.build().implicitRound(c.radius).val()
    return found
