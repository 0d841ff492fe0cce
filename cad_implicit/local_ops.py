"""Local operations: fillets, rounds and chamfers of chosen edges, with the radius up to the ends of the edges.

:func:`cad_implicit.fillet`, :func:`cad_implicit.round` and :func:`cad_implicit.smooth` come here if edges are given.
Edges belong to a part: a path, a host object or triangles. The result is an Implicit as any other, so global operations
may follow; local ones do, too: they look for the edges of its mesh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .cad import OpenPart, open_part
from .cad.edges import Edge, part_edges
from .choices import KINDS, Edges, choose
from .contouring import contour
from .distance import MeshDistance
from .errors import CadImplicitError, SelectorError
from .implicit import Implicit
from .local_blend import LocalBlend, blend_edges, largest_radius
from .local_blend import max_radius as _max_radius
from .parallel import Progress, no_progress
from .rails import Radius
from .sizing import Engine, positive


def blend(
    operation: str,
    part: Any,
    radius: Radius | None,
    edges: Edges,
    *,
    second: float | None = None,
    tangent: bool = True,
    spacing: float | None = None,
    tolerance: float | None = None,
    engine: Engine | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> LocalBlend:
    """Fillet, round, smooth or chamfer chosen edges; see :func:`cad_implicit.fillet` and :func:`chamfer`.

    Raises
    ------
    ValueError
        If the engine is another than "exact".
    """
    if engine not in (None, "exact"):
        raise ValueError(f'chosen edges are worked on by the engine "exact", not {engine!r}')
    if spacing is None and tolerance is None and isinstance(part, LocalBlend):
        spacing = part.spacing
    return blend_edges(
        as_part(part, threads=threads),
        radius,
        edges,
        kinds=KINDS[operation],
        second=second,
        chamfer=operation == "chamfer",
        tangent=tangent,
        spacing=spacing,
        tolerance=tolerance,
        threads=threads,
        progress=progress,
    )


def chamfer(
    part: Any,
    length: float,
    length2: float | None = None,
    *,
    edges: Edges,
    tangent: bool = True,
    spacing: float | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> LocalBlend:
    """Chamfer chosen edges: cut convex ones off, fill concave ones, with a flat strip.

    Parameters
    ----------
    part : path, host object, Mesh, MeshDistance or LocalBlend
    length : float
        In mm, from the edge to where the chamfer meets its faces.
    length2 : float, optional
        The same on the second face of the edge, that on its right; by default both are ``length``.
    edges, tangent, spacing, tolerance, threads, progress
        As for :func:`cad_implicit.fillet`, but that all edges get the same lengths.

    Raises
    ------
    SelectorError
        If no edge is chosen, or one that cannot be chamfered is.
    RadiusError
        If a length is not positive, or does not fit.
    SpacingError, MemoryLimitError
        With what was wrong, the figures, and what to do.

    Examples
    --------
    >>> import trimesh
    >>> from cad_implicit import contour
    >>> part = contour(chamfer(trimesh.creation.box((10, 10, 10)), 1.0, 2.0, edges="|Z and >X and >Y"))
    >>> part.is_watertight, round(part.volume, 3)
    (True, 990.0)
    """
    if isinstance(edges, Mapping):
        raise ValueError("chamfers of one call have the same lengths; chamfer the edges in several calls")
    positive("the chamfer's length", length)
    second = length if length2 is None else positive("the chamfer's second length", length2)
    return blend(
        "chamfer",
        part,
        float(length),
        edges,
        second=float(second),
        tangent=tangent,
        spacing=spacing,
        tolerance=tolerance,
        threads=threads,
        progress=progress,
    )


def max_radius(part: Any, edges: Edges = "all", *, tangent: bool = True) -> float:
    """Largest radius at which all chosen edges can be blended together without a face being consumed.

    Parameters
    ----------
    part : path, host object, Mesh, MeshDistance or LocalBlend
    edges, tangent
        As for :func:`cad_implicit.fillet`.

    Returns
    -------
    float
        In mm; 0 if no radius fits.

    Raises
    ------
    SelectorError
        If no edge is chosen, or one that cannot be blended is.

    Examples
    --------
    >>> import trimesh
    >>> round(max_radius(trimesh.creation.box((10, 12, 14)), "all"), 2)
    5.0
    """
    return _max_radius(as_part(part), edges, tangent=tangent)


def largest_radii(
    part: Any, edges: Sequence[Edge] | None = None, *, progress: Progress = no_progress
) -> dict[int, float | None]:
    """Largest radius for each edge, blended alone with those that go on smoothly from it.

    Parameters
    ----------
    part : path, host object, Mesh, MeshDistance or LocalBlend
    edges : sequence of Edge, optional
        Some of the part's edges; by default all.
    progress : callable
        Called as ``progress("radii", fraction)``; may raise to cancel.

    Returns
    -------
    dict of int to float or None
        By number, in mm; None where an edge cannot be blended, or no radius fits.
    """
    opened = as_part(part)
    found = part_edges(opened)
    wanted = found if edges is None else edges
    by_chain: dict[int, float | None] = {}
    result: dict[int, float | None] = {}
    for position, edge in enumerate(wanted):
        progress("radii", position / len(wanted))
        if edge.convexity not in ("convex", "concave", "mixed"):
            result[edge.number] = None
            continue
        if edge.chain not in by_chain:
            by_chain[edge.chain] = _alone(opened, found, edge)
        result[edge.number] = by_chain[edge.chain]
    progress("radii", 1.0)
    return result


def _alone(part: OpenPart, found: Sequence[Edge], edge: Edge) -> float | None:
    try:
        return largest_radius(part, found, choose(part, found, edge.number, 1.0)) or None
    except CadImplicitError:
        return None


def as_part(shape: Any, *, threads: int | None = None) -> OpenPart:
    """Shape as a part with edges.

    Raises
    ------
    SelectorError
        If it is an Implicit that is no part.
    """
    if isinstance(shape, LocalBlend):
        return open_part(contour(shape, threads=threads))
    if isinstance(shape, MeshDistance):
        return open_part(shape.mesh)
    if isinstance(shape, Implicit):
        raise SelectorError(
            f"a {type(shape).__name__} is a function of points and has no edges to choose from; give its mesh instead, "
            "contour(shape, spacing), or leave out edges to work on all of them"
        )
    return open_part(shape)
