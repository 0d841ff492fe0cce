"""Job: one operation on one part, from reading to the checked mesh, with everything that a report needs.

Front ends (command line, hosts, reports) call :func:`run` and show its :class:`Outcome`.
"""

from __future__ import annotations

import dataclasses
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from . import ops, shelling, sizing
from .cad import open_part
from .contouring import contour
from .distance import MeshDistance
from .errors import GeometryWarning, OpenMeshError, RefusedError, SpacingError
from .field import Field, sample
from .implicit import Implicit
from .mesh import Mesh
from .parallel import Progress, no_progress
from .simplifying import simplify as simplified
from .sizing import Engine

#: An opening that loses more than this share of the volume is refused unless forced.
LOST_VOLUME_LIMIT = 0.5

#: What the amount of an operation is, where it is no radius.
_AMOUNTS = {"offset": "the offset's amount", "shell": "the wall's thickness", "infill": "the wall's thickness"}

#: Operations by name.
OPERATIONS = ("fillet", "round", "smooth", "offset", "shell", "infill")


@dataclass(frozen=True)
class Outcome:
    """What came of a job.

    Attributes
    ----------
    shape : Implicit
        The shape after the operation.
    mesh, before : Mesh
        Its contour, and the part's own mesh.
    spacing : float
        Grid spacing in mm.
    seconds : dict
        Wall time by stage.
    warnings : list of str
        What differs from what a user may expect.
    error_bound : float or None
        Largest expected distance in mm between the mesh and the true result; None if the part leaks.
    options : dict
        What an operation took besides its amount: side and open of a shell, cell of an infill.
    """

    operation: str
    amount: float
    engine: Engine
    shape: Implicit
    mesh: Mesh
    before: Mesh
    spacing: float
    error_bound: float | None
    seconds: dict[str, float]
    warnings: list[str] = dataclasses.field(default_factory=list)
    options: dict[str, Any] = dataclasses.field(default_factory=dict)

    def field(self) -> Field:
        """Sample the result on a regular grid at its spacing."""
        if isinstance(self.shape, Field):
            return self.shape
        bounds = self.shape.bounds
        h = sizing.choose_spacing(bounds, abs(self.amount), engine="reinit", spacing=self.spacing)
        return sample(self.shape, sizing.grid_over(bounds, h, 0.0))

    def as_dict(self) -> dict[str, Any]:
        """Figures of the job, ready for JSON; lengths in mm, volumes in mm³, times in seconds."""
        return {
            "input": self.before.source.get("name"),
            "operation": self.operation,
            "radius": self.amount,
            **self.options,
            "spacing": self.spacing,
            "engine": self.engine,
            "triangles": len(self.mesh.faces),
            "watertight": self.mesh.is_watertight,
            "volume_before": self.before.volume,
            "volume_after": self.mesh.volume,
            "components_before": self.before.components,
            "components_after": self.mesh.components,
            "seconds": self.seconds,
            "warnings": self.warnings,
            "error_bound": self.error_bound,
        }


def run(
    part: object,
    operation: str,
    amount: float,
    *,
    side: shelling.Side = "inward",
    open: str | None = None,
    cell: float | None = None,
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
    operation : "fillet", "round", "smooth", "offset", "shell" or "infill"
    amount : float
        Radius, the signed distance of an offset, or the thickness of walls, in mm.
    side, open
        Of a shell; see :func:`cad_implicit.shell`.
    cell : float, optional
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
    clock = _Clock(progress)
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
        h = sizing.choose_spacing(bounds, detail, engine=engine, spacing=spacing, tolerance=tolerance, margin=margin)
        with clock.stage("mesh"):
            before = opened.mesh(sizing.TESSELLATION_PER_SPACING[engine] * h)
            leak = _leak(before, force=force)
        sizing.check_triangles(before.area, h, force=force)
        with clock.stage(operation):
            function, options = _function(operation, side, open, cell)
            part_distance = MeshDistance(before, sign="winding" if leak else "auto", threads=threads)
            result = function(
                part_distance, amount, spacing=h, engine=engine, threads=threads, progress=progress, **options
            )
        with clock.stage("contour"):
            mesh = contour(result, threads=threads, progress=progress)
        if simplify is not None:
            with clock.stage("simplify"):
                mesh = simplified(mesh, simplify)
        with clock.stage("check"):
            thin = [str(w.message) for w in caught if issubclass(w.category, GeometryWarning)]
            notes = leak + thin + _changes(operation, amount, before, mesh, told=bool(thin), force=force)
    for w in caught:
        if not issubclass(w.category, GeometryWarning):
            warnings.warn_explicit(w.message, w.category, w.filename, w.lineno)
    bound = None if leak else sizing.error_bound(h, abs(amount), engine) + (simplify or 0.0)
    return Outcome(operation, float(amount), engine, result, mesh, before, h, bound, clock.seconds, notes, options)


def _function(
    operation: str, side: shelling.Side, open: str | None, cell: float | None
) -> tuple[Callable[..., Implicit], dict[str, Any]]:
    """Give the function of an operation, and what it takes besides an amount."""
    if operation == "shell":
        return shelling.shell, {"side": side, "open": open}
    if operation == "infill":
        if cell is None:
            raise ValueError("an infill needs the size of its cells in mm")
        return _infill, {"cell": cell}
    return (ops.offset if operation == "offset" else ops.BLENDS[operation]), {}


def _infill(part: Implicit, wall: float, *, cell: float, **options: Any) -> Implicit:
    return shelling.infill(part, cell, wall, **options)


def _leak(part: Mesh, *, force: bool) -> list[str]:
    """Tell what becomes of a part that is not closed; nothing if it is.

    Raises
    ------
    OpenMeshError
        If it is not, unless forced.
    """
    try:
        part.require_closed()
    except OpenMeshError as error:
        if force:
            return [
                f"the part is not closed: {error.open_edges} edges of its mesh are open or shared by more than two "
                "triangles; inside and outside were told apart by winding numbers, its holes were closed by guess, and "
                "the error bound does not hold"
            ]
        advice = "; or use --force to have its holes closed by guess, with no bound on the error"
        if part.source.get("kind") == "brep":
            advice += ". The part itself is invalid: where a union in CadQuery made it so, try clean=False there"
        raise OpenMeshError(f"{error}{advice}", error.open_edges) from None
    return []


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


class _Clock:
    """Wall time by stage; passes progress on."""

    def __init__(self, progress: Progress) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        self._progress(name, 0.0)
        start = time.perf_counter()
        yield
        self.seconds[name] = time.perf_counter() - start
        self._progress(name, 1.0)
