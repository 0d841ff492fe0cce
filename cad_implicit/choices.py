"""Which edges are blended, and how: from what a user says to single edges with their radii."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .cad import OpenPart
from .cad.edge_pieces import pieces
from .cad.edges import Edge, edge_number, selected
from .errors import RadiusError, SelectorError
from .rails import Choice, Radius

#: What :func:`choose` takes for edges: a selector, a number, an Edge, an edge of the host, points along an edge,
#: several of them, or a mapping from any of them to a radius.
Edges = Any

#: Convexities of the edges that an operation takes.
KINDS: dict[str, tuple[str, ...]] = {
    "fillet": ("convex", "concave"),
    "round": ("convex",),
    "smooth": ("convex", "concave"),
    "chamfer": ("convex", "concave"),
}

#: Why edges cannot be blended, by their convexity.
_UNFIT = {
    "smooth": "its faces turn by less than a degree: there is nothing to blend",
    "seam": "a face meets itself smoothly there: there is nothing to blend",
    "boundary": "it has one face only: the part is open there",
    "nonmanifold": "more than two faces meet there",
}


def choose(
    part: OpenPart,
    found: Sequence[Edge],
    edges: Edges,
    radius: Radius | None,
    *,
    second: float | None = None,
    chamfer: bool = False,
    tangent: bool = True,
    kinds: Sequence[str] = ("convex", "concave"),
) -> list[Choice]:
    """Edges to blend, with their radii.

    Parameters
    ----------
    part : OpenPart
    found : sequence of Edge
        All of the part's edges.
    edges : Edges
        With a mapping, what is named last counts.
    radius : Radius or None
        For edges without one of their own.
    second : float, optional
        Second length of chamfers whose radius is one number; the same as the first by default.
    chamfer : bool
        Whether radii are lengths of chamfers: one, or those on the left and on the right.
    tangent : bool
        Whether edges that go on smoothly from the chosen ones are chosen, too.
    kinds : sequence of str
        Convexities that are allowed.

    Raises
    ------
    SelectorError
        If nothing is chosen, or an edge that cannot be blended is.
    RadiusError
        If a radius is missing, or not positive.
    """
    named: dict[int, tuple[Edge, Radius]] = {}
    wanted = edges if isinstance(edges, Mapping) else {_Everything(edges): radius}
    for key, own in wanted.items():
        if own is None:
            raise RadiusError("give a radius in mm")
        what = key.edges if isinstance(key, _Everything) else key
        for edge in _named(part, found, what, kinds):
            named[edge.number] = (edge, checked(own))
    if tangent:
        for edge in found:
            if edge.number in named or edge.convexity not in ("convex", "concave", "mixed"):
                continue
            alike = [own for other, own in named.values() if other.chain == edge.chain]
            if alike:
                named[edge.number] = (edge, alike[0])
    result = [_choice(piece, own, second, chamfer) for edge, own in named.values() for piece in pieces(edge)]
    result = [choice for choice in result if choice.edge.convexity in kinds]
    if not result:
        raise SelectorError(f"{edges!r} chooses no edge that is {' or '.join(kinds)}; `cad-implicit edges` lists them")
    return result


def _choice(edge: Edge, radius: Radius, second: float | None, chamfer: bool) -> Choice:
    if not chamfer:
        return Choice(edge, radius)
    if isinstance(radius, tuple):
        return Choice(edge, radius[0], radius[1])
    if not isinstance(radius, int | float):
        raise RadiusError("the length of a chamfer is one number of mm, or two for the faces on both sides")
    return Choice(edge, radius, float(checked(radius if second is None else second)))  # type: ignore[arg-type]


class _Everything:
    """Key for edges that are given without radii; they need not be hashable."""

    def __init__(self, edges: Edges) -> None:
        self.edges = edges


def checked(radius: Radius) -> Radius:
    """Return a radius if it is one.

    Raises
    ------
    RadiusError
        If it is not positive and finite: a number, two numbers, or a function at nine places.
    """
    if callable(radius):
        values = [float(radius(f)) for f in np.linspace(0, 1, 9).tolist()]
    else:
        values = [float(r) for r in np.atleast_1d(np.asarray(radius, np.float64))]
        radius = values[0] if len(values) == 1 else tuple(values)  # type: ignore[assignment]
        if len(values) > 2:
            raise RadiusError(f"a radius is one number of mm, two, or a function, not {len(values)} numbers")
    if not all(np.isfinite(r) and r > 0 for r in values):
        raise RadiusError(f"radius must be a positive number of mm, not {min(values):g}")
    return radius


def _named(part: OpenPart, found: Sequence[Edge], what: Edges, kinds: Sequence[str]) -> list[Edge]:
    """Edges that are named; a selector leaves out what cannot be blended, a single edge must be fit."""
    if isinstance(what, str):
        chosen = list(selected(found, what))
        by_number = what.replace(",", "").replace(" ", "").isdigit()
        fit = [edge for edge in chosen if edge.convexity not in _UNFIT]
        if by_number or not fit:
            for edge in chosen:
                _check_fit(edge, kinds)
        for edge in fit:
            _check_fit(edge, kinds)
        return fit
    numbers = [edge_number(part, found, one) for one in _each(what)]
    if not numbers:
        raise SelectorError("no edges were given")
    known = {edge.number: edge for edge in found}
    chosen = []
    for number in numbers:
        if number not in known:
            raise SelectorError(f"there is no edge {number}; `cad-implicit edges` lists them")
        _check_fit(known[number], kinds)
        chosen.append(known[number])
    return chosen


def _check_fit(edge: Edge, kinds: Sequence[str]) -> None:
    if edge.convexity in _UNFIT:
        raise SelectorError(f"edge {edge.number} cannot be blended: {_UNFIT[edge.convexity]}")
    if edge.convexity != "mixed" and edge.convexity not in kinds:
        raise SelectorError(
            f"edge {edge.number} is {edge.convexity}, and this takes {' or '.join(kinds)} edges only; choose others, "
            f'as with "{kinds[0]}", or use fillet, which takes both'
        )


def _each(what: Edges) -> Iterable[Any]:
    """Single edges of what was given."""
    if hasattr(what, "vals"):  # a CadQuery Workplane
        return list(what.vals())
    if isinstance(what, np.ndarray) and what.ndim == 2:
        return [what]
    if isinstance(what, Iterable) and not isinstance(what, Edge) and not hasattr(what, "wrapped"):
        return list(what)
    return [what]
