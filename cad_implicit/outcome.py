"""Outcome: what came of a job, and what jobs of all kinds do: time their stages, look for leaks."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from . import parallel, sizing
from .cad.files import BREP_EXTENSIONS, FIELD_EXTENSIONS
from .cad.solids import SolidPart, described
from .errors import OpenMeshError
from .field import Field, sample
from .implicit import Implicit
from .mesh import Mesh
from .parallel import Progress
from .rails import Radius
from .sizing import Engine


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
    amount : float, pair, function or None
        Radius, distance or thickness in mm, as it was given; None if each chosen edge has its own.
    options : dict
        What an operation took besides its amount: side and open of a shell, cell of an infill; of chosen edges their
        numbers ``edges``, their ``radii`` by number (a pair for the two ends, None for a function) or the ``second``
        length of chamfers, and ``tangent``.
    """

    operation: str
    amount: Radius | None
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
        h = sizing.choose_spacing(bounds, self.spacing, engine="reinit", spacing=self.spacing)
        return sample(self.shape, sizing.grid_over(bounds, h, 0.0))

    def result_for(self, suffix: str, progress: Progress) -> Mesh | Field | SolidPart:
        """Give what is written to a file of a kind: the mesh, a field, or a solid."""
        if suffix.lower() in FIELD_EXTENSIONS:
            return self.field()
        if suffix.lower() in BREP_EXTENSIONS:
            from .parting import to_part

            return described(to_part(self.shape, mesh=self.mesh, progress=progress), self.before.source)
        return self.mesh

    def as_dict(self) -> dict[str, Any]:
        """Figures of the job, ready for JSON; lengths in mm, volumes in mm³, times in seconds."""
        return {
            "input": self.before.source.get("name"),
            "operation": self.operation,
            "radius": plain(self.amount),
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


def plain(radius: Radius | None) -> float | list[float] | None:
    """Radius as it is written to JSON: a number, a list of two, None for a function or none."""
    if radius is None or callable(radius):
        return None
    return [float(r) for r in radius] if isinstance(radius, tuple) else float(radius)


def leaks(part: Mesh, *, force: bool) -> list[str]:
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


def repairs(part: Mesh) -> list[str]:
    """Tell what was done to the triangles of a part when it was read."""
    done = part.source.get("repairs", [])
    return [f"the part as it was read: {what}" for what in done] if isinstance(done, list) else []


def crossings(part: Mesh) -> list[str]:
    """Tell whether triangles of a part that came as triangles run through each other; nothing if none do."""
    from .kernels.intersections import intersecting

    if part.source.get("kind") == "brep":
        return []
    with parallel.threads(None, len(part.faces)):
        count = int(intersecting(part.vertices, part.faces).sum())
    if not count:
        return []
    return [
        f"{count} of {len(part.faces)} triangles of the part run through others or lie on others; inside and outside "
        "were told apart by winding numbers"
    ]


class Clock:
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
