"""Job: one operation on one part, from reading to the checked mesh, with everything that a report needs.

Front ends (command line, hosts, reports) call :func:`run` and show its :class:`Outcome`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from . import ops, shelling, sizing
from .cad import open_part
from .choices import KINDS, Edges
from .contouring import contour
from .distance import MeshDistance
from .errors import GeometryWarning, RadiusError, RefusedError, SpacingError
from .implicit import Implicit
from .mesh import Mesh
from .outcome import Clock, Outcome, crossings, leaks, repairs
from .parallel import Progress, no_progress
from .piecewise import PIECEWISE, in_tiles, is_large
from .rails import Radius
from .simplifying import simplify as simplified
from .sizing import Engine

#: An opening that loses more than this share of the volume is refused unless forced.
LOST_VOLUME_LIMIT = 0.5

#: Vertices whose distance to the part is looked at together.
_BATCH = 1 << 19

#: … and about so many of all of them first.
_FEW = 2000

#: What the amount of an operation is, where it is no radius.
_AMOUNTS = {"offset": "the offset's amount", "shell": "the wall's thickness", "infill": "the wall's thickness"}

#: What is told of a global blend that changed nothing.
_UNCHANGED = {
    "fillet": "the fillet changed nothing: without chosen edges it fills concave edges, and the part has none that a "
    "ball of {radius:g} mm does not reach into; use round for its convex edges, or smooth for both",
    "round": "the rounding changed nothing: without chosen edges it rounds convex edges, and a ball of {radius:g} mm "
    "reaches into all of the part; use fillet for its concave edges, or smooth for both",
    "smooth": "the smoothing changed nothing: a ball of {radius:g} mm reaches everywhere within and around the part",
}

#: Operations by name.
OPERATIONS = ("fillet", "round", "smooth", "offset", "shell", "infill", "chamfer")


def run(
    part: object,
    operation: str,
    amount: Radius | None = None,
    *,
    edges: Edges | None = None,
    edge_radius: Mapping[Any, Radius] | None = None,
    second: float | None = None,
    tangent: bool = True,
    side: shelling.Side = "inward",
    open: str | None = None,
    cell: float | None = None,
    kind: shelling.Filling = "gyroid",
    skin: float | None = None,
    spacing: float | None = None,
    tolerance: float | None = None,
    engine: Engine = "exact",
    simplify: float | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Outcome:
    """Work on one part and check the result.

    Parameters
    ----------
    part : path, CAD object, Mesh, or (vertices, faces)
        Whatever :func:`cad_implicit.to_mesh` reads.
    operation : "fillet", "round", "smooth", "chamfer", "offset", "shell" or "infill"
    amount : float
        Radius, length of a chamfer, signed distance of an offset, or thickness of walls, in mm. Of chosen edges also a
        pair or a function, for radii that vary; None if ``edge_radius`` holds them all.
    edges, tangent
        Edges to fillet, round, smooth or chamfer, and whether those that go on smoothly are worked on, too; see
        :func:`cad_implicit.fillet`. By default all edges, by the ball that works on the whole part.
    edge_radius : mapping, optional
        Edges to their own radii; ``amount`` is for the rest of ``edges``.
    second : float, optional
        Second length of a chamfer in mm.
    side, open
        Of a shell; see :func:`cad_implicit.shell`.
    cell, kind, skin
        Of an infill, in mm; see :func:`cad_implicit.infill`.
    spacing, tolerance : float, optional
        At most one of them, in mm.
    engine : "exact" or "reinit"
        See :mod:`cad_implicit.ops`.
    simplify : float, optional
        Collapse edges of the result within this tolerance in mm.
    force : bool
        Go past refusals (lost pieces, size, parts that leak), never past memory.
    threads : int, optional
        Default: all cores.
    progress : callable
        Called as ``progress(stage, fraction)``; may raise to cancel.

    Raises
    ------
    CadImplicitError
        One of :mod:`cad_implicit.errors`, with the figures and what to do.
    """
    if operation not in OPERATIONS:
        raise ValueError(f"operation must be one of {', '.join(OPERATIONS)}, not {operation!r}")
    if simplify is not None:
        sizing.positive("simplify", simplify, SpacingError)
    if edges is not None or edge_radius or operation == "chamfer":
        _check_local(operation, amount, second, edges, edge_radius, engine)
        from .local_job import run_local  # brings much that a ball on the whole part does not need

        return run_local(
            part,
            operation,
            amount,
            edges=edges,
            edge_radius=edge_radius,
            second=second,
            tangent=tangent,
            spacing=spacing,
            tolerance=tolerance,
            simplify=simplify,
            force=force,
            threads=threads,
            progress=progress,
        )
    if not isinstance(amount, float | int):
        raise RadiusError("give a radius in mm; one that varies needs chosen edges")
    clock = Clock(progress)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", GeometryWarning)
        with clock.stage("read"):
            opened = open_part(part)
            bounds = opened.bounds
        if operation in _AMOUNTS:
            sizing.positive(_AMOUNTS[operation], abs(amount) if operation == "offset" else amount)
        opening = operation in ("round", "smooth") or (operation == "offset" and amount < 0)
        sizing.check_radius(abs(amount), bounds, opening=opening)
        margin = abs(amount) if operation in ("fillet", "smooth") or amount > 0 else 0.0
        detail = abs(amount) * (shelling.RADIUS_PER_WALL if operation == "infill" else 1.0)
        piecewise = engine == "exact" and operation in PIECEWISE
        h = sizing.choose_spacing(
            bounds, detail, engine=engine, spacing=spacing, tolerance=tolerance, margin=margin, in_tiles=piecewise
        )
        coarse = sizing.unresolved(h, amount) if operation in KINDS else []
        with clock.stage("mesh"):
            before = opened.mesh(sizing.TESSELLATION_PER_SPACING[engine] * h)
            leak = leaks(before, force=force)
            doubts = leak or crossings(before)
        sizing.check_triangles(before.area, h, force=force)
        with clock.stage(operation):
            function, options = _function(operation, side, open, cell, kind, skin)
            part_distance = MeshDistance(before, sign="winding" if doubts else "auto", threads=threads)
            if piecewise and is_large(before.area, h):
                result, mesh = in_tiles(part_distance, operation, amount, h, threads=threads, progress=progress)
            else:
                result = function(
                    part_distance, amount, spacing=h, engine=engine, threads=threads, progress=progress, **options
                )
                mesh = None
        if mesh is None:
            with clock.stage("contour"):
                mesh = contour(result, threads=threads, progress=progress)
        if simplify is not None:
            with clock.stage("simplify"):
                mesh = simplified(mesh, simplify)
        with clock.stage("check"):
            thin = [str(w.message) for w in caught if issubclass(w.category, GeometryWarning)]
            notes = (
                repairs(before)
                + coarse
                + doubts
                + thin
                + _changes(operation, amount, before, mesh, told=bool(thin), force=force)
            )
            if not leak and _unchanged(operation, part_distance, mesh, h, engine):
                notes.append(_UNCHANGED[operation].format(radius=amount))
    for w in caught:
        if not issubclass(w.category, GeometryWarning):
            warnings.warn_explicit(w.message, w.category, w.filename, w.lineno)
    bound = None if leak else sizing.error_bound(h, abs(amount), engine) + (simplify or 0.0)
    return Outcome(operation, float(amount), engine, result, mesh, before, h, bound, clock.seconds, notes, options)


def _function(
    operation: str,
    side: shelling.Side,
    open: str | None,
    cell: float | None,
    kind: shelling.Filling,
    skin: float | None,
) -> tuple[Callable[..., Implicit], dict[str, Any]]:
    """Give the function of an operation, and what it takes besides an amount."""
    if operation == "shell":
        return shelling.shell, {"side": side, "open": open}
    if operation == "infill":
        if cell is None:
            raise ValueError("an infill needs the size of its cells in mm")
        return _infill, {"cell": cell, "kind": kind, "skin": skin}
    return (ops.offset if operation == "offset" else ops.BLENDS[operation]), {}


def _check_local(
    operation: str,
    amount: Radius | None,
    second: float | None,
    edges: Edges | None,
    edge_radius: Mapping[Any, Radius] | None,
    engine: Engine,
) -> None:
    """Raise ValueError if the arguments do not go together."""
    if operation not in KINDS:
        raise ValueError(f"{operation} works on the whole part; edges can be chosen for {', '.join(KINDS)}")
    if engine != "exact":
        raise ValueError(f'chosen edges are worked on by the engine "exact", not {engine!r}')
    if operation == "chamfer":
        if edges is None or edge_radius:
            raise ValueError("a chamfer needs edges, and has one length for all of them")
        if not isinstance(amount, float | int):
            raise RadiusError("give the chamfer's length in mm")
        for length in (amount, amount if second is None else second):
            sizing.positive("the chamfer's length", length)
    elif edges is None and amount is not None:
        raise ValueError("a radius for the rest of the edges needs edges; leave it out, or say which")


def _infill(part: Implicit, wall: float, *, cell: float, **options: Any) -> Implicit:
    return shelling.infill(part, cell, wall, **options)


def _unchanged(operation: str, part: MeshDistance, after: Mesh, spacing: float, engine: Engine) -> bool:
    """Whether a global blend left the surface where it was, but for what facets take."""
    if operation not in _UNCHANGED or engine != "exact":
        return False
    facets = sizing.TESSELLATION_PER_SPACING[engine] * spacing
    few = after.vertices[:: len(after.vertices) // _FEW + 1]  # tells already of most blends
    some = (after.vertices[start : start + _BATCH] for start in range(0, len(after.vertices), _BATCH))
    return all(bool(np.abs(part(points)).max() <= facets) for points in (few, *some))


def _changes(operation: str, amount: float, before: Mesh, after: Mesh, *, told: bool, force: bool) -> list[str]:
    """Tell what was lost or joined; refuse the loss of most of the part.

    ``told`` says that a warning was given already, and the change of volume belongs to it.
    """
    notes = []
    lost = before.components - after.components
    change = after.volume - before.volume
    removes = operation in ("round", "smooth") or (operation == "offset" and amount < 0)
    if removes and operation != "offset" and -change > LOST_VOLUME_LIMIT * before.volume:
        message = (
            f"{operation} with {amount:g} mm removes {-change:.6g} of {before.volume:.6g} mm³ "
            f"({-change / before.volume:.0%}): most of the part is thinner than {2 * amount:g} mm"
        )
        if not force:
            raise RefusedError(f"{message}; use a smaller radius, or --force")
        notes.append(message)
    elif told:
        notes.append(f"the volume changed by {change:+.6g} mm³ ({change / before.volume:+.2%})")
    if removes and lost > 0:
        notes.append(
            f"{lost} of {before.components} separate pieces vanished, with them {-change:.6g} mm³ "
            f"({-change / before.volume:.2%} of the volume): they are thinner than {2 * abs(amount):g} mm"
        )
    elif lost > 0:
        notes.append(f"{before.components} separate pieces became {after.components}: gaps between them were filled")
    elif lost < 0:
        notes.append(f"the part fell into {after.components} pieces (it was {before.components})")
    if operation not in ("shell", "infill") and before.is_watertight and before.genus != after.genus:
        notes.append(f"the number of through holes changed from {before.genus} to {after.genus}")
    return notes
