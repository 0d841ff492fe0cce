"""Operations: functions from a shape to a shape, by repeated offset and re-distancing.

``offset``, ``round`` (opening: convex edges), ``fillet`` (closing: concave edges) and ``smooth`` (both) take any
Implicit, a Mesh, or a part that :func:`cad_implicit.to_mesh` reads, and return a new Implicit, so they nest. They are
global: the whole shape is worked on by a ball of the given radius; but for edges that are chosen
(:mod:`cad_implicit.local_ops`).

Two engines stand behind one signature. ``exact`` (the default for parts, meshes, primitives with exact distances and
what it made itself) computes exact distances and keeps sharp edges (:mod:`cad_implicit.exact`). ``reinit`` (the default
for functions and fields) is the paper's scheme on a regular grid (:mod:`cad_implicit.reinit`); its result is a Field.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Literal, get_args

import numpy as np

from . import exact, reinit, sizing
from .booleans import Boolean
from .cad import to_mesh
from .choices import Edges
from .contouring import contour
from .distance import MeshDistance
from .errors import EmptyResultError, GeometryWarning, RadiusError
from .field import Field
from .grid import Grid
from .implicit import Implicit
from .kernels.bvh import Tree
from .mesh import Mesh
from .parallel import Progress, no_progress
from .rails import Radius
from .sizing import Engine
from .thickness import thin_spots
from .transforms import Placed

#: Layers of ball centres thinner than this many spacings may be lost between the nodes of a regular grid.
_RESOLVED = 1.5

#: Widths within this share of twice the radius count as equal to it, …
_TOUCHING = 1e-4

#: … and, for the exact engine, within this many spacings: facets take as much.
_FACETS = 0.02

#: What an operation takes: an Implicit, a Mesh, or whatever ``to_mesh`` reads.
Shape = object

Side = Literal["inside", "outside"]


def offset(
    shape: Shape,
    distance: float,
    *,
    spacing: float | None = None,
    tolerance: float | None = None,
    engine: Engine | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Implicit:
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
    engine : "exact" or "reinit", optional
        Default: exact, but reinit for functions, fields and in the plane.
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
    call = Call(shape, size, max(distance, 0.0), distance < 0, spacing, tolerance, engine, threads, progress)
    sides: tuple[Side, ...] = ("outside",) if distance > 0 else ("inside",)
    if call.engine == "reinit":
        return _nonempty(reinit.offset(call.field(sides), distance), size)
    return exact.offset(call.distance(sides), distance, call.spacing, threads=threads)


def fillet(
    shape: Shape,
    radius: Radius | None = None,
    *,
    edges: Edges | None = None,
    tangent: bool = True,
    spacing: float | None = None,
    tolerance: float | None = None,
    engine: Engine | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Implicit:
    """Fillet concave edges by the closing of the whole shape (section 4.3 of the paper), or chosen edges of both kinds.

    Parameters
    ----------
    shape : Implicit, Mesh or part
        With ``edges`` a part: a path, a host object, triangles, a MeshDistance or a LocalBlend.
    radius : float, pair of float, or callable
        In mm. A pair is for the start and the end of each edge, a callable takes the fraction of its length; both for
        chosen edges only. None if each has its own.
    edges : selector, number, Edge, edge of the host, points (N, 3), a sequence of these, or a mapping of these to radii
        Which edges to fillet; a selector is "all", "concave", "convex", "|Z", ">Z", "3,5,7" …
        (:mod:`cad_implicit.cad.selectors`). The ball then touches the two faces beside an edge, continued beyond their
        borders, and no others: the radius is constant up to the ends, thin parts do not matter, and nothing but the
        neighbourhood of these edges changes. Convex edges are rounded, concave ones filled.
    tangent : bool
        Whether edges that go on smoothly from the chosen ones are filleted, too.
    spacing, tolerance, engine, threads, progress
        As for :func:`offset`; chosen edges take the engine "exact".

    Returns
    -------
    Implicit
        For chosen edges a LocalBlend; :func:`cad_implicit.contour` keeps the part's own triangles elsewhere.

    Raises
    ------
    RadiusError
        If a radius is not positive and finite, or does not fit: for chosen edges names the edge and the largest that
        does.
    SelectorError
        If no edge is chosen, or one that cannot be filleted is, or the shape is no part.
    SpacingError, MemoryLimitError, OpenMeshError, EmptyResultError
        With what was wrong, the figures, and what to do.

    Examples
    --------
    >>> import trimesh
    >>> from cad_implicit import contour
    >>> block = trimesh.creation.box((20, 20, 10))
    >>> part = contour(fillet(block, edges={"|Z and >X": 3.0, ">Z and >Y": 2.0}, spacing=0.5))
    >>> part.is_watertight, bool(abs(4000 - (1 - np.pi / 4) * (2 * 9 * 10 + 4 * 18) - part.volume) < 2)
    (True, True)
    """
    if edges is not None:
        from .local_ops import blend

        return blend(
            "fillet", shape, radius, edges, tangent=tangent, spacing=spacing, tolerance=tolerance, engine=engine,
            threads=threads, progress=progress,
        )  # fmt: skip
    radius = _constant(radius)
    call = Call(shape, radius, radius, False, spacing, tolerance, engine, threads, progress)
    if call.engine == "reinit":
        return reinit.closing(call.field(("outside",)), radius, threads=threads, progress=progress)
    return exact.Closing(call.distance(("outside",)), radius, call.spacing, threads=threads, progress=progress)


def round(  # the operation's name in CAD and in the paper
    shape: Shape,
    radius: Radius | None = None,
    *,
    edges: Edges | None = None,
    tangent: bool = True,
    spacing: float | None = None,
    tolerance: float | None = None,
    engine: Engine | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Implicit:
    """Round convex edges by the opening of the whole shape (section 4.2 of the paper), or chosen convex edges.

    Parameters and errors as for :func:`fillet`; edges that are concave are an error. Without chosen edges, whatever is
    thinner than twice the radius is deleted, with a GeometryWarning.
    """
    if edges is not None:
        from .local_ops import blend

        return blend(
            "round", shape, radius, edges, tangent=tangent, spacing=spacing, tolerance=tolerance, engine=engine,
            threads=threads, progress=progress,
        )  # fmt: skip
    radius = _constant(radius)
    call = Call(shape, radius, 0.0, True, spacing, tolerance, engine, threads, progress)
    if call.engine == "reinit":
        return _nonempty(reinit.opening(call.field(("inside",)), radius, threads=threads, progress=progress), radius)
    return exact.opening(call.distance(("inside",)), radius, call.spacing, threads=threads, progress=progress)


def smooth(
    shape: Shape,
    radius: Radius | None = None,
    *,
    edges: Edges | None = None,
    tangent: bool = True,
    first: Literal["round", "fillet"] = "round",
    spacing: float | None = None,
    tolerance: float | None = None,
    engine: Engine | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Implicit:
    """Round convex and fillet concave edges: all of them (section 4.4 of the paper), or chosen ones.

    Parameters and errors as for :func:`fillet`. ``first`` tells which of the two comes first on the whole shape; the
    results differ where both kinds of edge meet.
    """
    if edges is not None:
        from .local_ops import blend

        return blend(
            "smooth", shape, radius, edges, tangent=tangent, spacing=spacing, tolerance=tolerance, engine=engine,
            threads=threads, progress=progress,
        )  # fmt: skip
    radius = _constant(radius)
    call = Call(shape, radius, radius, True, spacing, tolerance, engine, threads, progress)
    sides: tuple[Side, ...] = ("inside", "outside")
    if call.engine == "reinit":
        field = reinit.smoothing(call.field(sides), radius, first=first, threads=threads, progress=progress)
        return _nonempty(field, radius)
    part = call.distance(sides)
    return exact.smoothing(part, radius, call.spacing, first=first, threads=threads, progress=progress)


#: The operations that take a radius, by name.
BLENDS: dict[str, Callable[..., Implicit]] = {"fillet": fillet, "round": round, "smooth": smooth}


def _constant(radius: Radius | None) -> float:
    """Radius of a ball that works on the whole shape.

    Raises
    ------
    RadiusError
        If there is none, or it varies.
    """
    if radius is None or callable(radius) or isinstance(radius, tuple):
        raise RadiusError("give one radius in mm; radii that vary need chosen edges")
    return float(radius)


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


def of_distances(shape: Implicit) -> bool:
    """Whether a shape is made of exact distances, so that the exact engine suits it."""
    if isinstance(shape, Boolean):
        return of_distances(shape.first) and of_distances(shape.second)
    if isinstance(shape, Placed):
        return of_distances(shape.parent)
    # what has a spacing was made by the exact engine
    return shape.exact_inside or shape.exact_outside or shape.spacing is not None


class Call:
    """What all operations do first: understand the shape, choose engine and spacing, check the radius.

    ``check`` tells whether to warn where no ball of the radius fits; ``in_tiles`` that not all is done at once.
    """

    def __init__(
        self,
        shape: Shape,
        radius: float,
        margin: float,
        opening: bool,
        spacing: float | None,
        tolerance: float | None,
        engine: Engine | None,
        threads: int | None,
        progress: Progress,
        in_tiles: bool = False,
    ) -> None:
        if engine not in (None, *get_args(Engine)):
            raise ValueError(f"engine must be one of {', '.join(get_args(Engine))}, not {engine!r}")
        self.source = as_implicit(shape)
        sizing.check_bounded(self.source.bounds)
        self.radius = sizing.check_radius(radius, self.source.bounds, opening=opening)
        self.engine: Engine = engine or ("exact" if self.source.dim == 3 and of_distances(self.source) else "reinit")
        self.threads, self.progress, self.margin = threads, progress, margin
        if self.engine == "exact" and self.source.dim != 3:
            raise ValueError('the exact engine works in 3-D; use engine="reinit" in the plane')
        if spacing is None and tolerance is None:
            spacing = self.source.spacing
        self.given = spacing is not None or tolerance is not None
        self.spacing = sizing.choose_spacing(
            self.source.bounds,
            radius,
            engine=self.engine,
            spacing=spacing,
            tolerance=tolerance,
            margin=margin,
            in_tiles=in_tiles,
        )

    def distance(self, sides: tuple[Side, ...], *, check: bool = True) -> Implicit:
        """Exact distance on the sides that matter, for the exact engine."""
        side: Literal["inside", "outside", "both"] = sides[0] if len(sides) == 1 else "both"
        source = self.source
        if hasattr(source, "kept_part"):  # a LocalBlend: its contour keeps the part's own triangles
            source = MeshDistance(contour(source, threads=self.threads, progress=self.progress), threads=self.threads)
        part = exact.distance_to(source, self.spacing, side, threads=self.threads, progress=self.progress)
        if check and isinstance(part, MeshDistance):
            self._check_medial_axis(part.mesh, sides, part.tree)
        elif check and part.spacing is None:  # not made by an operation, which has looked already
            self._check_medial_axis(contour(part, self.spacing, threads=self.threads, progress=self.progress), sides)
        return part

    def field(self, sides: tuple[Side, ...], *, check: bool = True) -> Field:
        """Distance field on a grid that holds everything the operation builds, for the reinit engine."""
        grid = sizing.grid_over(self.source.bounds, self.spacing, self.margin)
        if isinstance(self.source, Field) and not self.given:
            grid = _widened(self.source.grid, self.source.bounds, self.margin)
        phi = reinit.distance_field(self.source, grid, self.radius, threads=self.threads, progress=self.progress)
        if check and phi.grid.dim == 3:
            self._check_medial_axis(self.source.mesh if isinstance(self.source, MeshDistance) else contour(phi), sides)
        return phi

    def _check_medial_axis(self, mesh: Mesh, sides: tuple[Side, ...], tree: Tree | None = None) -> None:
        """Warn where no ball of the radius fits against the surface: the condition on r of section 4.1.

        With a regular grid, a ball that barely fits is told too: the balls' centres there fill a layer that the grid
        does not resolve.
        """
        regular = self.engine == "reinit"
        doubt = _RESOLVED / 2 * self.spacing if regular else 0.0
        touching = 2 * self.radius * _TOUCHING + (0.0 if regular else _FACETS * self.spacing)
        for side in sides:
            spot = thin_spots(mesh, self.radius + doubt, side, tree=tree, threads=self.threads)
            if spot is None:
                continue
            place = ", ".join(f"{x:.4g}" for x in spot.place)
            what, fate = ("material", "is removed") if side == "inside" else ("a gap", "is closed")
            where = f"{what} {spot.thickness:.4g} mm wide at ({place}) mm"
            if spot.thickness < 2 * self.radius - touching:
                message = (
                    f"{where} is narrower than twice the radius {self.radius:g} mm and {fate} there; "
                    f"the largest radius that keeps it is {spot.safe_radius:.4g} mm"
                )
            elif regular:
                message = (
                    f"{where} is so near to twice the radius {self.radius:g} mm that the result may be wrong there "
                    f"at a spacing of {self.spacing:.3g} mm; use a radius up to "
                    f"{spot.safe_radius - doubt:.4g} mm, or a smaller spacing"
                )
            else:
                continue
            warnings.warn(message, GeometryWarning, stacklevel=4)


def _widened(grid: Grid, bounds: np.ndarray, margin: float) -> Grid:
    """Grid with the same nodes, and more around them where an operation builds beyond its border."""
    steps = np.asarray(grid.spacing)
    room = margin + reinit.MARGIN * steps
    missing = np.maximum(bounds[1] + room - grid.bounds[1], grid.bounds[0] - bounds[0] + room)
    nodes = int(np.ceil((missing / steps).max() - 1e-9))
    return grid.padded(nodes) if nodes > 0 else grid


def _nonempty(field: Field, radius: float) -> Field:
    if not bool((field.values > 0).any()):
        raise EmptyResultError(
            f"nothing is left of the part at {radius:g} mm: it is nowhere thick enough; use a smaller value"
        )
    return field
