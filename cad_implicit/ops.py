"""Operations: functions from a shape to a shape, by repeated offset and re-distancing.

``offset``, ``round`` (opening: convex edges), ``fillet`` (closing: concave edges) and ``smooth`` (both) take any
Implicit, a Mesh, or a part that :func:`cad_implicit.to_mesh` reads, and return a new Implicit, so they nest. All are
global: the whole shape is worked on by a ball of the given radius.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Literal

import numpy as np

from . import reinit, sizing
from .cad import to_mesh
from .contouring import contour
from .distance import MeshDistance
from .errors import EmptyResultError, GeometryWarning
from .field import Field
from .grid import Grid
from .implicit import Implicit
from .mesh import Mesh
from .parallel import Progress, no_progress
from .thickness import thin_spots

#: What an operation takes: an Implicit, a Mesh, or whatever ``to_mesh`` reads.
Shape = object

Side = Literal["inside", "outside"]


def offset(
    shape: Shape,
    distance: float,
    *,
    spacing: float | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Field:
    """Grow (positive distance) or shrink (negative) a shape by a constant distance (section 4.1 of the paper).

    Parameters
    ----------
    shape : Implicit, Mesh or part
    distance : float
        In mm; not zero.
    spacing : float, optional
        Grid spacing in mm; by default a sixth of the distance or a hundredth of the diagonal, whichever is less.
    tolerance : float, optional
        Largest accepted error in mm instead of a spacing.
    threads : int, optional
        Default: all cores.
    progress : callable
        Called as ``progress(stage, fraction)``; may raise to cancel.

    Raises
    ------
    RadiusError, SpacingError, MemoryLimitError, OpenMeshError, EmptyResultError
        With what was wrong, the figures, and what to do.
    """
    size = sizing.positive("the offset's amount", abs(distance))
    source = as_implicit(shape)
    sizing.check_radius(size, source.bounds, opening=distance < 0)
    phi = _start(source, size, max(distance, 0.0), size, spacing, tolerance, threads, progress)
    side: Side = "outside" if distance > 0 else "inside"
    _check_medial_axis(source, phi, size, (side,), threads)
    return _nonempty(reinit.offset(phi, distance), size)


def fillet(
    shape: Shape,
    radius: float,
    *,
    spacing: float | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Field:
    """Fillet all concave edges: the closing by a ball (section 4.3 of the paper). Parameters as for :func:`offset`."""
    source = as_implicit(shape)
    sizing.check_radius(radius, source.bounds, opening=False)
    phi = _start(source, radius, radius, radius, spacing, tolerance, threads, progress)
    _check_medial_axis(source, phi, radius, ("outside",), threads)
    return reinit.closing(phi, radius, threads=threads, progress=progress)


def round(
    shape: Shape,
    radius: float,
    *,
    spacing: float | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Field:
    """Round all convex edges: the opening by a ball (section 4.2 of the paper). Parameters as for :func:`offset`.

    Whatever is thinner than twice the radius is deleted, with a GeometryWarning.
    """
    source = as_implicit(shape)
    sizing.check_radius(radius, source.bounds, opening=True)
    phi = _start(source, radius, 0.0, radius, spacing, tolerance, threads, progress)
    _check_medial_axis(source, phi, radius, ("inside",), threads)
    return _nonempty(reinit.opening(phi, radius, threads=threads, progress=progress), radius)


def smooth(
    shape: Shape,
    radius: float,
    *,
    first: Literal["round", "fillet"] = "round",
    spacing: float | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Field:
    """Round all convex and fillet all concave edges (section 4.4 of the paper). Parameters as for :func:`offset`.

    ``first`` tells which of the two comes first; the results differ where both kinds of edge meet.
    """
    source = as_implicit(shape)
    sizing.check_radius(radius, source.bounds, opening=True)
    phi = _start(source, radius, radius, radius, spacing, tolerance, threads, progress)
    _check_medial_axis(source, phi, radius, ("inside", "outside"), threads)
    result = reinit.smoothing(phi, radius, first=first, threads=threads, progress=progress)
    return _nonempty(result, radius)


#: The operations that take a radius, by name.
BLENDS: dict[str, Callable[..., Field]] = {"fillet": fillet, "round": round, "smooth": smooth}


def as_implicit(shape: Shape) -> Implicit:
    """Shape as an Implicit: itself, or the exact distance to its mesh.

    Raises
    ------
    OpenMeshError
        If the mesh is not closed.
    """
    if isinstance(shape, Implicit):
        return shape
    return MeshDistance(to_mesh(shape).require_closed())


def _start(
    source: Implicit,
    radius: float,
    margin: float,
    reach: float,
    spacing: float | None,
    tolerance: float | None,
    threads: int | None,
    progress: Progress,
) -> Field:
    """Distance field of the source on a grid that holds everything the operation builds."""
    grid = _grid(source, radius, margin, spacing, tolerance)
    return reinit.distance_field(source, grid, reach, threads=threads, progress=progress)


def _grid(source: Implicit, radius: float, margin: float, spacing: float | None, tolerance: float | None) -> Grid:
    if isinstance(source, Field) and spacing is None and tolerance is None:
        return _widened(source.grid, source.bounds, margin)
    h = sizing.choose_spacing(source.bounds, radius, spacing=spacing, tolerance=tolerance, margin=margin)
    return sizing.grid_over(source.bounds, h, margin)


def _widened(grid: Grid, bounds: np.ndarray, margin: float) -> Grid:
    """Grid with the same nodes, and more around them where an operation builds beyond its border."""
    steps = np.asarray(grid.spacing)
    room = margin + reinit.MARGIN * steps
    missing = np.maximum(bounds[1] + room - grid.bounds[1], grid.bounds[0] - bounds[0] + room)
    nodes = int(np.ceil((missing / steps).max() - 1e-9))
    return grid.padded(nodes) if nodes > 0 else grid


def _check_medial_axis(
    source: Implicit, phi: Field, radius: float, sides: tuple[Side, ...], threads: int | None
) -> None:
    """Warn where no ball of the radius fits against the surface: the condition on r of section 4.1."""
    if phi.grid.dim == 2:
        return
    mesh: Mesh = source.mesh if isinstance(source, MeshDistance) else contour(phi)
    for side in sides:
        spot = thin_spots(mesh, radius, side, threads=threads)
        if spot is None:
            continue
        place = ", ".join(f"{x:.4g}" for x in spot.place)
        what, fate = ("material", "is removed") if side == "inside" else ("a gap", "is closed")
        warnings.warn(
            f"{what} {spot.thickness:.4g} mm wide at ({place}) mm is narrower than twice the radius {radius:g} mm "
            f"and {fate} there; the largest radius that keeps it is {spot.safe_radius:.4g} mm",
            GeometryWarning,
            stacklevel=3,
        )


def _nonempty(field: Field, radius: float) -> Field:
    if not bool((field.values > 0).any()):
        raise EmptyResultError(
            f"nothing is left of the part at {radius:g} mm: it is nowhere thick enough; use a smaller value"
        )
    return field
