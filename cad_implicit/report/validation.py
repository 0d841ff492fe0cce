"""Validate one blend: run it, build the exact kernel's, measure, judge."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import cad_implicit
from cad_implicit.cad import open_part
from cad_implicit.cad.edges import part_edges
from cad_implicit.cad.parts import OpenPart
from cad_implicit.choices import choose
from cad_implicit.distance import MeshDistance
from cad_implicit.errors import CadImplicitError, SelectorError
from cad_implicit.job import run
from cad_implicit.local_blend import LocalBlend
from cad_implicit.outcome import Outcome
from cad_implicit.parallel import Progress, no_progress
from cad_implicit.sizing import Engine

from .bending import Bending, bending
from .health import Health, health
from .measuring import REGIONS, SIGNS, Measured, against_kernel, by_rolling_ball
from .statistics import Statistics, statistics

if TYPE_CHECKING:
    from cad_implicit.cad.exact_blends import ExactBlend

#: Version of ``report.json``.
SCHEMA = 1

#: Errors that free balls tell where result and exact kernel differ by nature; more is allowed there, in spacings: a
#: closing fades out at open ends within less than a cell (measured up to 0.15 on a turned L).
BY_THE_BALL = "differs by nature, by the ball"
_FADING = 0.2

#: Spacings of the convergence, in spacings of the run, the coarsest first.
LEVELS = (4.0, 2.0, 1.0, 0.5)

_KINDS = {"fillet": ("concave",), "round": ("convex",), "smooth": ("convex", "concave")}


@dataclass(frozen=True)
class Level:
    """One spacing of the convergence."""

    engine: str
    spacing: float
    max: float
    rms: float
    seconds: float


@dataclass(frozen=True, eq=False)
class Validation:
    """A blend with all that is known of its error.

    Attributes
    ----------
    part : str
    operation, radius, edges
        What was done; ``edges`` is None for the whole part.
    outcome : Outcome or None
        None if the operation failed; ``failure`` says why then.
    kernel : dict
        The exact kernel's fate.
    measured : Measured or None
    regions : dict of str to Statistics
    health : Health or None
    bending : Bending or None
        Radius of curvature along the blends, and their tangency.
    limits : dict of str to (float, float)
        Figures that are judged, and what they may be at most.
    """

    part: str
    operation: str
    radius: float
    edges: str | None
    outcome: Outcome | None
    failure: str
    kernel: dict[str, Any]
    measured: Measured | None = None
    regions: dict[str, Statistics] = field(default_factory=dict)
    health: Health | None = None
    bending: Bending | None = None
    levels: list[Level] = field(default_factory=list)
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def faults(self) -> list[str]:
        """What is wrong, nothing for a sound result."""
        if self.outcome is None:
            return [self.failure]
        found = []
        if self.health is not None and not self.health.sound:
            found.append(
                f"the mesh is not sound: {self.health.open_edges} open edges, manifold3d says {self.health.manifold}, "
                f"{self.health.self_intersections} triangles run through others"
            )
        found += [
            f"{name} is {value:.4g}, more than {limit:.4g}"
            for name, (value, limit) in self.limits.items()
            if not value <= limit
        ]
        return found

    @property
    def passed(self) -> bool:
        """Whether the mesh is sound and all figures are within their limits."""
        return not self.faults

    @property
    def order(self) -> dict[str, float]:
        """Order of convergence by engine, from the maximum errors."""
        found = {}
        for engine in {level.engine for level in self.levels}:
            own = [level for level in self.levels if level.engine == engine and level.max > 0]
            if len(own) > 1:
                h, e = (np.log([getattr(level, name) for level in own]) for name in ("spacing", "max"))
                found[engine] = float(np.polyfit(h, e, 1)[0])
        return found

    def as_dict(self) -> dict[str, Any]:
        """All figures for ``report.json``; lengths in mm, volumes in mm³, areas in mm²."""
        base: dict[str, Any] = {
            "schema": SCHEMA,
            "version": cad_implicit.__version__,
            "created": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
            "part": self.part,
            "operation": self.operation,
            "radius": self.radius,
            "edges": self.edges,
            "verdict": "passed" if self.passed else "failed",
            "faults": self.faults,
            "kernel": self.kernel,
            "seconds": self.seconds,
        }
        if self.outcome is None or self.measured is None or self.health is None:
            return base
        h, mesh = self.outcome.spacing, self.outcome.mesh
        after = self.kernel.get("volume")
        return base | {
            "result": self.outcome.as_dict(),
            "against": self.measured.against,
            "kernel_defect": self.measured.defect,
            "error": self.regions["all"].as_dict(h, self.radius),
            "regions": {n: s.as_dict(h, self.radius) for n, s in self.regions.items() if n != "all"},
            "volume_error": None if after is None else mesh.volume - after,
            "volume_error_share": None if after is None else mesh.volume / after - 1,
            "area": mesh.area,
            "health": self.health.as_dict(),
            "bending": self.bending.as_dict() if self.bending else None,
            "convergence": [vars(level) for level in self.levels],
            "order": self.order,
            "limits": {n: {"value": v, "limit": limit} for n, (v, limit) in self.limits.items()},
        }


def validate(
    part: Any,
    radius: float,
    *,
    operation: str = "fillet",
    edges: str | None = None,
    spacing: float | None = None,
    engine: Engine = "exact",
    max_error: str | None = None,
    time_limit: float = 120.0,
    convergence: bool = False,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Validation:
    """Fillet, round or smooth a part and measure the error of the result.

    Parameters
    ----------
    part : path, host object or triangles
        The exact kernel's blend is built for a B-rep.
    radius : float
        In mm.
    operation : "fillet", "round" or "smooth"
    edges : str, optional
        A selector; by default the whole part, compared with the exact blend of all edges of the operation's kind.
    spacing : float, optional
        In mm.
    engine : "exact" or "reinit"
    max_error : str, optional
        Largest error that passes: in mm, or in spacings as "0.02h", or in per cent of the radius as "1%"; by default
        the result's own error bound.
    time_limit : float
        Seconds for the exact kernel.
    convergence : bool
        Measure at four, two and half a spacing, too, and with both engines for the whole part.
    threads : int, optional
    progress : callable
        May raise to cancel.

    Raises
    ------
    CadImplicitError
        If the part cannot be read.
    ValueError
        If ``max_error`` cannot be read.
    """
    start = time.perf_counter()
    limit_of(max_error)
    opened = open_part(part)
    truth = exact_truth(opened, radius, operation, edges, time_limit)
    name = opened.name if not isinstance(part, str | Path) else Path(part).name
    try:
        outcome = _run(opened, radius, operation, edges, spacing, engine, threads, progress)
    except CadImplicitError as error:
        seconds = time.perf_counter() - start
        return Validation(name, operation, radius, edges, None, str(error), _told(truth), seconds=seconds)
    progress("measure", 0.0)
    levels = _levels(opened, radius, operation, edges, outcome, truth, threads, progress) if convergence else []
    result = assess(name, outcome, truth, radius, operation, edges, max_error, levels)
    progress("measure", 1.0)
    return replace(result, seconds=time.perf_counter() - start)


def assess(
    name: str,
    outcome: Outcome,
    truth: ExactBlend | None,
    radius: float,
    operation: str,
    edges: str | None = None,
    max_error: str | None = None,
    levels: Sequence[Level] = (),
) -> Validation:
    """Measure and judge what came of a blend; see :func:`validate`.

    Parameters
    ----------
    name : str
        Of the part.
    outcome : Outcome
    truth : ExactBlend or None
        The exact kernel's blend of the same edges with ``radius``.
    radius, operation, edges, max_error
        As for :func:`validate`.
    levels : sequence of Level
        Errors at other spacings.
    """
    measured, regions = measure(outcome, truth, radius, operation)
    bound = outcome.error_bound if outcome.error_bound is not None else math.inf
    largest = limit_of(max_error)(outcome.spacing, radius, bound + (measured.defect or 0.0))
    limits = {"the largest error in mm": (regions["all"].max, largest)}
    if BY_THE_BALL in regions:
        fades = largest + _FADING * outcome.spacing
        limits["the largest error by the ball, in mm, where both differ by nature,"] = regions[BY_THE_BALL].max, fades
    mesh, spacing = outcome.mesh, outcome.spacing
    bends = bending(mesh, outcome.shape, part_of(outcome), radius, spacing)
    return Validation(
        name, operation, radius, edges, outcome, "", _told(truth), measured, regions, health(mesh, spacing), bends,
        list(levels), limits,
    )  # fmt: skip


def measure(
    outcome: Outcome, truth: ExactBlend | None, radius: float, operation: str
) -> tuple[Measured, dict[str, Statistics]]:
    """Take samples with their errors, and the figures of all that is judged ("all") and by region."""
    blend = outcome.shape if isinstance(outcome.shape, LocalBlend) else None
    part = part_of(outcome)
    if truth is not None and truth.ok:
        measured = against_kernel(outcome.mesh, truth, part, blend, radius, outcome.spacing, SIGNS[operation])
    else:
        measured = by_rolling_ball(outcome.mesh, part, blend, radius, outcome.spacing, SIGNS[operation])
    told, nature = np.isfinite(measured.judged), measured.regions == REGIONS.index("differs by nature")
    found = {"all": statistics(measured.judged[told & ~nature], measured.points[told & ~nature])}
    if (told & nature).any():
        found[BY_THE_BALL] = statistics(measured.judged[told & nature], measured.points[told & nature])
    for number, region in enumerate(REGIONS):
        own = measured.regions == number
        if own.any():
            found[region] = statistics(measured.errors[own], measured.points[own])
    return measured, found


def part_of(outcome: Outcome) -> MeshDistance:
    """Distance to the part before the blend."""
    return outcome.shape.parent if isinstance(outcome.shape, LocalBlend) else MeshDistance(outcome.before)


def _run(
    part: OpenPart,
    radius: float,
    operation: str,
    edges: str | None,
    spacing: float | None,
    engine: Engine,
    threads: int | None,
    progress: Progress,
) -> Outcome:
    return run(part, operation, radius, edges=edges, spacing=spacing, engine=engine, threads=threads, progress=progress)


def exact_truth(
    part: OpenPart, radius: float, operation: str, edges: str | None = None, time_limit: float = 120.0
) -> ExactBlend | None:
    """Give the exact kernel's blend of the same edges; None for a part without a B-rep."""
    if part.shape is None:
        return None
    from cad_implicit.cad.exact_blends import exact_blend

    found = part_edges(part)
    if edges is None:
        numbers = [edge.number for edge in found if edge.convexity in _KINDS[operation]]
    else:
        try:
            numbers = [choice.edge.number for choice in choose(part, found, edges, radius)]
        except SelectorError:
            numbers = []
    return exact_blend(part.shape, dict.fromkeys(numbers, radius), time_limit=time_limit)


def _told(truth: ExactBlend | None) -> dict[str, Any]:
    """Give what became of the exact kernel's try."""
    if truth is None:
        return {"fate": "not tried", "message": "the part is a mesh", "seconds": 0.0, "volume": None, "change": None}
    return {
        "fate": truth.status,
        "message": truth.message,
        "seconds": truth.seconds,
        "volume": truth.after if truth.ok else None,
        "change": truth.change if truth.ok else None,
    }


def _levels(
    part: OpenPart,
    radius: float,
    operation: str,
    edges: str | None,
    outcome: Outcome,
    truth: ExactBlend | None,
    threads: int | None,
    progress: Progress,
) -> list[Level]:
    """Errors at several spacings, for the whole part with both engines."""
    found = []
    engines: tuple[Engine, ...] = ("exact",) if edges is not None else ("exact", "reinit")
    for engine in engines:
        for factor in LEVELS:
            h = factor * outcome.spacing
            start = time.perf_counter()
            try:
                own = _run(part, radius, operation, edges, h, engine, threads, progress)
            except CadImplicitError:
                continue
            seconds = time.perf_counter() - start
            errors = measure(own, truth, radius, operation)[1]["all"]
            found.append(Level(engine, h, errors.max, errors.rms, seconds))
    return found


def limit_of(text: str | None) -> Any:
    """Read the largest error that passes: a function of spacing, radius and bound, all in mm."""
    if text is None:
        return lambda spacing, radius, bound: bound
    number = text.strip().removesuffix("mm").strip()
    try:
        if number.endswith("h"):
            value = float(number[:-1])
            return lambda spacing, radius, bound: value * spacing
        if number.endswith("%"):
            value = float(number[:-1])
            return lambda spacing, radius, bound: value / 100 * radius
        value = float(number)
    except ValueError:
        raise ValueError(f"the largest error is a number of mm, or such as 0.02h or 1%, not {text!r}") from None
    return lambda spacing, radius, bound: value
