"""Dual contouring: the surface of an Implicit as a closed mesh that keeps sharp edges and corners.

Edges of a sparse grid with a change of sign give points and normals of the surface; each piece of surface in a cell
gets the vertex nearest to its tangent planes; each edge gets a quad. Ju, Losasso, Schaefer and Warren 2002,
DOI 10.1145/566654.566586; one vertex for each piece of surface: Schaefer, Ju and Warren 2007,
DOI 10.1109/TVCG.2007.1012.

Promised: the mesh is closed, oriented outward and 2-manifold, whatever the function. Self-intersections are mended
(:mod:`cad_implicit.untangling`). Not promised: features thinner than the spacing.
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import parallel
from .cut_corners import FAR, mend_corners
from .implicit import Evaluate, FloatArray, Implicit
from .kernels import bricks as brick_kernels
from .kernels import crossings, flat, hermite, qef, slivers
from .kernels import dual_contour as mesh_kernels
from .mesh import Mesh
from .parallel import Progress, no_progress
from .projecting import Projector
from .refining import refine
from .regions import Region
from .sparse import PLANE_TOLERANCE, Bricks, sample_bricks
from .surface_cells import Cells, find_cells
from .untangling import Pieces, triangulate
from .vertex_names import Names, names_of

Faces = NDArray[np.int32]

#: Points evaluated at a time, so that a cancelled run ends soon and memory stays bounded.
_BATCH = 1 << 19

#: First-order distance in spacings at which a root on an edge is good enough, and the most evaluations for it. The
#: foot point is off by about its square over twice the radius of curvature. With 1e-6, curved parts took 0.6 more
#: evaluations for each vertex and nothing came closer; with 0.02 the smallest angle on a sphere fell from 16 to 3.
_ROOT_TOLERANCE = 1e-3

#: The same for drafts: a foot found from nearer an edge than this is on the other face (one in 5,000 vertices of a box,
#: off by 0.005 spacings, with 0.01).
_DRAFT_ROOT_TOLERANCE = 0.003
_ROOT_ROUNDS = 40


def dual_contour(
    implicit: Implicit,
    spacing: float,
    *,
    bounds: ArrayLike | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
    polish: Evaluate | None = None,
    draft: bool = False,
    region: Region | None = None,
    far: float = FAR,
) -> Mesh:
    """Contour the surface of an Implicit, keeping its sharp edges and corners.

    Parameters
    ----------
    implicit : Implicit
        In space; its gradients should be true ones almost everywhere. A positive factor does not matter.
    spacing : float
        Width of the grid's cells in mm.
    bounds : (2, 3) array_like, optional
        Box in mm; whatever sticks out of it is cut off flat. The bounds of the Implicit by default.
    threads : int, optional
        Number of threads of the kernels, all cores by default; the result does not depend on it.
    progress : callable
        Called as ``progress(stage, fraction)`` with the stages "sample", "hermite", "vertices" and "triangles"; may
        raise to cancel.
    polish : callable, optional
        Maps points (N, 3) to values (N,) and gradients (N, 3) more accurately than the Implicit does; used for all
        vertices. (For the points on edges too it cost a third more, and no vertex came closer.)
    draft : bool
        For distances only: sharp vertices are exact, smooth ones about as near to the surface as their triangles, which
        are not tidied up. Saves a third of the evaluations.
    region : Region, optional
        Contours only what is a brick of 8 cells within it; the Implicit need not be right elsewhere.
    far : float
        Edges whose middle is farther from the surface than this, in spacings, are split (:mod:`.cut_corners`).

    Returns
    -------
    Mesh
        2-manifold, normals outward; closed but at a region's border. No triangles thinner than 2 degrees, if possible.

    Raises
    ------
    EmptyResultError
        If no node of the grid is inside.
    SpacingError
        If the spacing is not positive and finite, or too small for the bounds.
    """
    options: Any = {"threads": threads, "progress": progress, "polish": polish, "draft": draft}
    position, faces, _ = contoured(implicit, spacing, bounds, region=region, far=far, **options)
    return Mesh(position, faces)


def contoured(
    implicit: Implicit,
    spacing: float,
    bounds: ArrayLike | None = None,
    *,
    threads: int | None = None,
    progress: Progress = no_progress,
    polish: Evaluate | None = None,
    draft: bool = False,
    region: Region | None = None,
    far: float = FAR,
) -> tuple[FloatArray, Faces, Names]:
    """Vertices (V, 3), faces (F, 3), and the vertices' names (V,) but for drafts; as :func:`dual_contour`."""
    bricks = sample_bricks(implicit, spacing, bounds, threads=threads, progress=progress, region=region)
    run = _Run(implicit, bricks, threads, progress, polish, draft, far)
    cells = find_cells(bricks, lambda points: run.evaluate(points, implicit.value_and_gradient, "hermite")[0], threads)
    projector = Projector(
        implicit.value_and_gradient, run.look, bricks.spacing, run.kernels, implicit.exact, run.evaluate
    )
    foot, normal = run.hermite(cells)
    vertices = run.vertices(cells, foot, normal, projector)
    return run.mesh(cells, foot, normal, vertices, projector)


@dataclass(frozen=True, eq=False)
class _Vertices:
    """Vertices of the cells, then those that keep doubled mesh edges apart."""

    position: FloatArray
    rank: NDArray[np.int8]
    normal: FloatArray
    quads: Faces
    whole: NDArray[np.bool_]
    between: NDArray[np.int32]


class _Run:
    """One contouring: the stages share the function, the bricks, the threads and the progress callback."""

    def __init__(
        self,
        implicit: Implicit,
        bricks: Bricks,
        threads: int | None,
        progress: Progress,
        polish: Evaluate | None,
        draft: bool,
        far: float,
    ) -> None:
        self.implicit = implicit
        self.bricks = bricks
        self.threads = threads
        self.progress = progress
        self.draft = draft
        self.far = far
        self.look = polish or implicit.value_and_gradient

    def evaluate(
        self, points: FloatArray, function: Evaluate, stage: str, done: float = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        """Values and gradients within the bounds, in batches."""
        values, gradients = np.zeros(len(points)), np.zeros((len(points), 3))
        for start in range(0, len(points), _BATCH):
            self.progress(stage, done)
            part = slice(start, start + _BATCH)
            with self.kernels(parallel.QUERY * len(points)):
                values[part], gradients[part] = function(points[part])
        if self.bricks.cropped:
            brick_kernels.crop_gradients(points, values, gradients, *self.bricks.box)
        return values, gradients

    def kernels(self, items: int) -> AbstractContextManager[None]:
        """Threads for a kernel over so many items."""
        return parallel.threads(self.threads, items)

    def hermite(self, cells: Cells) -> tuple[FloatArray, FloatArray]:
        """Points of the surface (E, 3) near the crossed edges, and outward unit normals (E, 3) there."""
        b, code = self.bricks, cells.edges
        count = len(code)
        tolerance = _DRAFT_ROOT_TOLERANCE if self.draft else _ROOT_TOLERANCE
        foot, normal = np.zeros((count, 3)), np.zeros((count, 3))
        values = cells.end_values.copy()
        bracket = np.repeat([[0.0, 1.0]], count, axis=0)
        with self.kernels(count):
            cells.flat[:] = flat.plane_feet(
                code, b.plane, b.planes, b.neighbours, b.blocks, b.origin, b.spacing, 2 * PLANE_TOLERANCE * b.spacing,
                foot, normal,
            )  # fmt: skip
        at = self._first_guess(cells, values)
        pending = np.flatnonzero(~cells.flat)
        for number in range(_ROOT_ROUNDS):
            with self.kernels(len(pending)):
                points = crossings.edge_points(code[pending], at[pending], b.blocks, b.origin, b.spacing)
            f, gradient = self.evaluate(points, self.implicit.value_and_gradient, "hermite", 0.8 * (1 - 0.5**number))
            with self.kernels(len(pending)):
                unsettled = hermite.narrow(
                    pending, code, values, bracket, at, points, f, gradient, b.spacing, tolerance, foot, normal
                )
            pending = pending[unsettled]
            if len(pending) == 0:
                break
        self.progress("hermite", 1.0)
        return foot, normal

    def _first_guess(self, cells: Cells, values: FloatArray) -> FloatArray:
        """Fractions (E,) to start from; ends of which only the sign is known are evaluated first."""
        b = self.bricks
        for side in (0, 1):
            unknown = np.flatnonzero(np.isinf(values[:, side]))
            if len(unknown):
                with self.kernels(len(unknown)):
                    at = np.full(len(unknown), float(side))
                    points = crossings.edge_points(cells.edges[unknown], at, b.blocks, b.origin, b.spacing)
                f = self.evaluate(points, self.implicit.value_and_gradient, "hermite")[0]
                right = (f > 0) == (values[unknown, side] > 0)
                values[unknown[right], side] = f[right]
        with self.kernels(len(values)):
            return np.asarray(hermite.first_guess(values))

    def vertices(self, cells: Cells, foot: FloatArray, normal: FloatArray, projector: Projector) -> _Vertices:
        """Place the vertices of the cells and those on doubled mesh edges."""
        b = self.bricks
        self.progress("vertices", 0.0)
        with self.kernels(len(cells.cells)):
            place = (b.neighbours, b.blocks, b.origin, b.spacing)
            position, mass, rank, planes = qef.cell_vertices(
                cells.cells, *cells.tables, *cells.edge_lookup, *place, foot, normal, cells.vertices
            )
            quads = mesh_kernels.quads(cells.edges, cells.inside_first, *cells.cell_lookup, b.neighbours, *cells.tables)
        whole = quads.min(axis=1) >= 0
        quads = np.where(quads >= 0, quads, quads.max(axis=1)[:, None]) if b.inner is not None else quads
        between, extra = self._split_doubled(cells, quads, foot)
        position = np.concatenate([position, extra])
        mass = np.concatenate([mass, extra])
        rank = np.concatenate([rank, np.ones(len(extra), np.int8)])
        planes = np.concatenate([planes, np.zeros((len(extra), 3), np.int32)])
        directions = np.zeros_like(position)
        with self.kernels(len(cells.cells)):
            is_flat = flat.flat_vertices(
                cells.cells, *cells.tables, *cells.edge_lookup, b.neighbours, cells.flat, foot, normal,
                2 * PLANE_TOLERANCE * b.spacing, directions,
            )  # fmt: skip
        projector.onto_creases(position, mass, rank, planes, foot, normal)
        if not self.draft:
            projector.settle(position, np.flatnonzero(rank > 1))
            projector.smooth(position, mass, rank, is_flat, directions)
        self.progress("vertices", 1.0)
        return _Vertices(position, rank, directions, quads, whole, between)

    def _split_doubled(
        self, cells: Cells, quads: NDArray[np.int32], foot: FloatArray
    ) -> tuple[NDArray[np.int32], FloatArray]:
        """Vertices on doubled mesh edges: their number (E, 4) on each side of each quad or -1, and positions."""
        lookups = (*cells.edge_lookup, *cells.cell_lookup, self.bricks.neighbours, *cells.tables)
        pairs, ends = mesh_kernels.doubled_edges(cells.faces, cells.joined, cells.inside_first, *lookups)
        if len(pairs) == 0:
            return np.zeros((0, 4), np.int32), np.zeros((0, 3))
        between = np.full((len(quads), 4), -1, np.int32)
        number = (cells.vertices + np.arange(len(pairs))).astype(np.int32)
        for column in (0, 1):
            edge = pairs[:, column]
            following = np.roll(quads[edge], -1, axis=1)
            low, high = np.minimum(quads[edge], following), np.maximum(quads[edge], following)
            here = (low == ends.min(axis=1)[:, None]) & (high == ends.max(axis=1)[:, None])
            between[edge, here.argmax(axis=1)] = number
        return between, foot[pairs].mean(axis=1)

    def mesh(
        self, cells: Cells, foot: FloatArray, normal: FloatArray, vertices: _Vertices, projector: Projector
    ) -> tuple[FloatArray, Faces, Names]:
        """Triangles without slivers that do not run through each other, and their vertices' names; a draft has none."""
        self.progress("triangles", 0.0)
        v = vertices
        if self.draft:
            with self.kernels(len(v.quads)):
                quads, facing = v.quads[v.whole], normal[v.whole]
                faces, _ = mesh_kernels.triangles(quads, facing, v.normal, v.position, v.rank, math.inf)
            return v.position, faces, np.zeros(0, np.int64)
        pieces = Pieces(self.bricks, cells, foot, normal, v.position, v.normal, v.rank, v.quads, v.whole, v.between)
        position, faces, normals, rank, origin = triangulate(pieces, self.kernels)
        position, faces = refine(position, faces, normals, rank, projector, self.implicit.radius, self.kernels)
        rough, look = (
            partial(self.evaluate, function=f, stage="triangles", done=0.5)
            for f in (self.implicit.value_and_gradient, self.look)
        )
        mesh = mend_corners(Mesh(position, faces), rough, look, self.bricks.spacing, self.threads, self.far)
        self.progress("triangles", 1.0)
        names = names_of(cells, self.bricks.blocks, origin, len(v.position), len(mesh.vertices))
        position, faces, kept = slivers.compact(mesh.vertices, mesh.faces)
        return position, faces, names[kept]
