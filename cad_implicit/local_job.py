"""Job on chosen edges: a local fillet, round, smooth or chamfer of one part, from reading to the checked mesh."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import sizing
from .cad import OpenPart, open_part
from .cad.edges import Edge, part_edges
from .choices import KINDS, Edges, choose
from .contouring import contour
from .errors import GeometryWarning, RadiusError, RefusedError
from .local_blend import is_sound, strip_area
from .local_ops import blend
from .mesh import Mesh
from .outcome import Clock, Outcome, crossings, leaks, plain, repairs
from .parallel import Progress, no_progress
from .rails import Radius
from .simplifying import has_manifold
from .simplifying import simplify as simplified

#: A result whose volume is that share of the part's away from it is refused unless forced.
CHANGED_VOLUME_LIMIT = 0.5

#: Places of an edge at which a radius that is given as a function is looked at.
_PLACES = 33


def run_local(
    part: object,
    operation: str,
    amount: Radius | None,
    *,
    edges: Edges | None,
    edge_radius: Mapping[Any, Radius] | None = None,
    second: float | None = None,
    tangent: bool = True,
    spacing: float | None = None,
    tolerance: float | None = None,
    simplify: float | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Outcome:
    """Blend chosen edges of one part and check the result; parameters and errors as for :func:`cad_implicit.run`."""
    clock = Clock(progress)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", GeometryWarning)
        with clock.stage("read"):
            opened = open_part(part)
            found = part_edges(opened)
        if operation == "chamfer":
            second = amount if second is None else second  # type: ignore[assignment]
        wanted = _wanted(opened, found, operation, amount, edges, edge_radius or {})
        radii = _radii(opened, found, operation, wanted, tangent=tangent)
        sizes = [*radii.values(), *([] if second is None else [second])]
        with clock.stage(operation):
            result = blend(
                operation,
                opened,
                amount if operation == "chamfer" else None,
                list(wanted) if operation == "chamfer" else wanted,
                second=second,
                tangent=tangent,
                spacing=spacing,
                tolerance=tolerance,
                threads=threads,
                progress=progress,
            )
            coarse = sizing.unresolved(result.spacing, max(max(_values(radius)) for radius in sizes))
            before = result.parent.mesh
            # chosen edges have their faces, whatever is missing elsewhere
            leak = leaks(before, force=True)
        if leak:
            leak.append("all of the part was contoured anew, not only its blends")
        area = strip_area(result.choices) if is_sound(result.parent) and has_manifold() else before.area
        sizing.check_triangles(area, result.spacing, force=force)
        with clock.stage("contour"):
            mesh = contour(result, threads=threads, progress=progress)
        if simplify is not None:
            with clock.stage("simplify"):
                mesh = simplified(mesh, simplify)
        with clock.stage("check"):
            told = [str(w.message) for w in caught if issubclass(w.category, GeometryWarning) and not leak]
            notes = (
                repairs(before)
                + coarse
                + (leak or crossings(before))
                + told
                + _changes(operation, before, mesh, force=force)
            )
    for w in caught:
        if not issubclass(w.category, GeometryWarning):
            warnings.warn_explicit(w.message, w.category, w.filename, w.lineno)
    smallest = min(min(_values(radius)) for radius in sizes)
    bound = None if leak else sizing.error_bound(result.spacing, smallest, "exact") + (simplify or 0.0)
    options: dict[str, Any] = {"edges": sorted(radii)}
    if operation == "chamfer":
        options["second"] = second
    else:
        options["radii"] = {str(number): plain(radii[number]) for number in sorted(radii)}
    options["tangent"] = tangent
    return Outcome(
        operation, amount, "exact", result, mesh, before, result.spacing, bound, clock.seconds, notes, options
    )


def _wanted(
    part: OpenPart,
    found: Sequence[Edge],
    operation: str,
    amount: Radius | None,
    edges: Edges | None,
    edge_radius: Mapping[Any, Radius],
) -> dict[int, Radius]:
    """Radii by the number of the edge, as they are given.

    Raises
    ------
    SelectorError
        If a selector chooses nothing, or an edge that cannot be blended.
    RadiusError
        If an edge has no radius.
    """
    wanted: dict[int, Radius | None] = {}
    kinds = KINDS[operation]
    if edges is not None:
        given = amount is not None or isinstance(edges, Mapping)
        for choice in choose(part, found, edges, amount if given else 1.0, tangent=False, kinds=kinds):
            wanted[choice.edge.number] = choice.radius if given else None
    for what, own in edge_radius.items():
        for choice in choose(part, found, what, own, tangent=False, kinds=kinds):
            wanted[choice.edge.number] = choice.radius
    missing = sorted(number for number, radius in wanted.items() if radius is None)
    if missing:
        names = ", ".join(map(str, missing[:8])) + (" …" if len(missing) > 8 else "")
        which = f"edges {names} have" if len(missing) > 1 else f"edge {names} has"
        raise RadiusError(f"{which} no radius: give one for all that have none of their own")
    return {number: radius for number, radius in wanted.items() if radius is not None}


def _radii(
    part: OpenPart, found: Sequence[Edge], operation: str, wanted: Mapping[int, Radius], *, tangent: bool
) -> dict[int, Radius]:
    """Radii by the number of the edge, with the edges that go on smoothly."""
    choices = choose(part, found, wanted, None, tangent=tangent, kinds=KINDS[operation])
    return {choice.edge.number: choice.radius for choice in choices}


def _values(radius: Radius) -> list[float]:
    if callable(radius):
        return [float(radius(fraction)) for fraction in np.linspace(0, 1, _PLACES).tolist()]
    return [float(r) for r in radius] if isinstance(radius, tuple) else [float(radius)]


def _changes(operation: str, before: Mesh, after: Mesh, *, force: bool) -> list[str]:
    """Tell what changed besides the edges; refuse what is no blend of some edges any more."""
    notes = []
    change = after.volume - before.volume
    refused = []
    if abs(change) > CHANGED_VOLUME_LIMIT * before.volume:
        refused.append(
            f"{operation} changes the volume of {before.volume:.6g} mm³ by {change:+.6g} mm³ "
            f"({change / before.volume:+.0%}), more than blends of edges do"
        )
    if not after.is_watertight:
        refused.append(f"the result is not closed: {after.open_edges} edges of its mesh are open")
    if refused and not force:
        raise RefusedError(f"{'; '.join(refused)}; use smaller radii or fewer edges, or --force")
    notes += refused
    if before.components != after.components:
        what = "fell into" if after.components > before.components else "became"
        notes.append(f"the part's {before.components} separate pieces {what} {after.components}")
    if before.is_watertight and after.is_watertight and before.genus != after.genus:
        notes.append(f"the number of through holes changed from {before.genus} to {after.genus}")
    return notes
