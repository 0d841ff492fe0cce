"""Solid jobs: from a solid of a host to a solid that goes on in CAD, with what is known of it.

What the front ends of CadQuery and build123d share. A job is run as by :func:`cad_implicit.run`, so that it is checked
and has an error bound; its result becomes a solid by :func:`cad_implicit.to_part`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypedDict

import numpy as np

from .cad import OpenPart
from .cad.edges import Edge, part_edges
from .cad.kernel import kernel
from .cad.solids import SolidPart
from .choices import Edges
from .errors import CadImplicitError, OpenMeshError, SelectorError, tell
from .job import run
from .parallel import Progress, no_progress
from .parting import to_part
from .rails import Radius
from .sizing import spacing_for_facets

#: Results of more triangles than this are simplified within their error bound before they become facets: a solid of so
#: many takes about 5 s and 30 MB in a STEP file.
_MANY = 20_000

#: Operations on whole parts that get a coarser spacing where the part is large beside the amount; lattices would tear.
_COARSER = ("fillet", "round", "smooth", "offset", "shell")

#: Of parts that leak, which have no error bound, within this share of the spacing: as much as the bound of others.
_UNBOUNDED = 0.1


class Options(TypedDict, total=False):
    """What all operations take.

    Attributes
    ----------
    spacing, tolerance : float
        Grid spacing, or largest accepted error, in mm; at most one of them. By default that of
        :func:`cad_implicit.offset`, but coarser on parts that are large beside the radius and worked on as a whole:
        down to three cells to a radius.
    simplify : float
        Where the solid is made of facets, merge triangles within so many mm; by default, if there are more than 20,000,
        within the error bound.
    force : bool
        Go past refusals (most of the part is lost, too many triangles), never past memory.
    threads : int
        Default: all cores.
    progress : callable
        Called as ``progress(stage, fraction)``; may raise to cancel.
    """

    spacing: float | None
    tolerance: float | None
    simplify: float | None
    force: bool
    threads: int | None
    progress: Progress


class BlendOptions(Options, total=False):
    """What fillets, rounds and chamfers take, besides.

    Attributes
    ----------
    tangent : bool
        Whether edges that go on smoothly from the chosen ones are worked on, too; they are by default.
    """

    tangent: bool


@dataclass(frozen=True)
class Provenance:
    """How a solid came about.

    Attributes
    ----------
    engine : "exact kernel" or "implicit"
    reason : str
        Why the exact kernel's result was not taken, if it was asked.
    error_bound : float or None
        Largest expected distance in mm to the true result; of the exact kernel the largest gap that it knows of. None
        if the part was not closed, so that nothing can be said.
    exact_share : float
        Share of the surface's area, from 0 to 1, that lies on surfaces of the part or of blends; the rest is facets.
    facets : str
        Why there are facets where there might be none.
    spacing : float or None
        Grid spacing in mm; None for the exact kernel.
    """

    engine: Literal["exact kernel", "implicit"]
    reason: str
    error_bound: float | None
    exact_share: float
    facets: str = ""
    spacing: float | None = None


def worked(part: OpenPart, operation: str, amount: Any, **what: Any) -> tuple[SolidPart, Provenance]:
    """Do one operation on a part; what it takes is what :func:`cad_implicit.run` takes.

    A part that is not closed is worked on all the same, by winding numbers, with a warning.

    Raises
    ------
    CadImplicitError
        As :func:`cad_implicit.run` and :func:`cad_implicit.to_part` do.

    Warns
    -----
    GeometryWarning
        Of all that differs from what a user may expect.
    """
    simplify = what.pop("simplify", None)
    default = what.get("spacing") is None and what.get("tolerance") is None
    if default and what.get("edges") is None and operation in _COARSER and isinstance(amount, float | int) and amount:
        what["spacing"] = spacing_for_facets(part.bounds, abs(amount))
    try:
        outcome = run(part, operation, amount, **what)
    except OpenMeshError:
        outcome = run(part, operation, amount, **{**what, "force": True})
    for note in outcome.warnings:
        tell(note)
    bound, tolerance = outcome.error_bound, simplify
    if tolerance is None and len(outcome.mesh.faces) > _MANY:
        tolerance = _UNBOUNDED * outcome.spacing if bound is None else bound
    own = {key: what[key] for key in ("threads", "progress") if key in what}
    try:
        solid = to_part(outcome.shape, mesh=outcome.mesh, name=part.name, tolerance=tolerance, **own)
    except CadImplicitError:
        if simplify is not None or tolerance is None:
            raise
        tolerance = None  # nobody asked for it: some meshes cannot be simplified
        solid = to_part(outcome.shape, mesh=outcome.mesh, name=part.name, **own)
    if bound is not None and tolerance is not None and solid.facets:
        bound += tolerance
    return solid, Provenance("implicit", "", bound, solid.exact_share, solid.why, outcome.spacing)


def shelled(
    part: OpenPart, thickness: float, openings: Sequence[Any] | None, **what: Any
) -> tuple[SolidPart, Provenance]:
    """Carve a part out to a wall: within it if the thickness in mm is negative, around it if it is positive.

    Parameters
    ----------
    part : OpenPart
    thickness : float
    openings : sequence of TopoDS_Face or Part.Face, or None
        Faces that get no wall.
    **what
        What :func:`cad_implicit.run` takes.

    Raises
    ------
    SelectorError
        If there are openings of a wall around the part, or one is no face of the part.
    CadImplicitError
        As :func:`worked`.
    """
    side = "inward" if thickness < 0 else "outward"
    if openings is None:
        return worked(part, "shell", abs(thickness), side=side, **what)
    if thickness > 0:
        raise SelectorError(
            f"walls around a part have no openings; for one within it use a negative thickness, {-thickness:g} mm"
        )
    numbers = ",".join(map(str, kernel(part.shape, "chosen").face_numbers(part, openings)))
    return worked(part, "shell", abs(thickness), side=side, open=numbers, **what)


def safely_filleted(
    part: OpenPart, radius: Radius | None, edges: Edges, *, time_limit: float | None = None, **what: Any
) -> tuple[SolidPart, Provenance]:
    """Fillet chosen edges by the exact kernel; where it fails, by this package.

    Parameters
    ----------
    part : OpenPart
    radius, edges
        As for :func:`cad_implicit.fillet`.
    time_limit : float, optional
        Seconds that the exact kernel may take.

    Raises
    ------
    CadImplicitError
        If neither can; with a note on what the kernel said.
    """
    from .cad.exact_blends import TIME_LIMIT, exact_blend
    from .choices import choose

    limit = TIME_LIMIT if time_limit is None else time_limit
    what.get("progress", no_progress)("exact kernel", 0.0)
    found = part_edges(part)
    chosen = choose(part, found, edges, radius, tangent=False)
    sizes = {choice.edge.number: choice.radius for choice in chosen}
    reason = _unfit(found, sizes)
    if not reason:
        exact = exact_blend(part.shape, {n: float(r) for n, r in sizes.items()}, time_limit=limit)  # type: ignore[arg-type]
        if exact.ok:
            own = kernel(exact.shape)
            shape = own.compound(own.solids(exact.shape))
            area = own.area(shape)
            solid = SolidPart(shape, part.name, area, area, own.count_faces(shape), 0)
            return solid, Provenance("exact kernel", "", exact.tolerance, 1.0)
        reason = f"{exact.status}: {exact.message}" if exact.message else exact.status
    what.get("progress", no_progress)("exact kernel", 1.0)
    try:
        solid, provenance = worked(part, "fillet", radius, edges=edges, **what)
    except CadImplicitError as error:
        error.add_note(f"The exact kernel was asked first: {reason}")
        raise
    return solid, replace(provenance, reason=reason)


def _unfit(found: Sequence[Edge], sizes: Mapping[int, Radius]) -> str:
    """Tell why the exact kernel is not asked, if it is not: it lays one radius along all edges that go on smoothly."""
    if not all(isinstance(radius, float | int | np.number) for radius in sizes.values()):
        return "not tried: the radius varies along an edge"
    chain = {edge.number: edge.chain for edge in found}
    radii: dict[int, Radius] = {}
    for number, radius in sizes.items():
        if radii.setdefault(chain[number], radius) != radius:
            return "not tried: edges that go on smoothly have radii of their own"
    return ""


def blendable(found: Sequence[Edge]) -> list[int]:
    """Numbers of all edges that can be blended."""
    return [edge.number for edge in found if edge.convexity in ("convex", "concave", "mixed")]
