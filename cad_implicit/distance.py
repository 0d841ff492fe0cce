"""Mesh to exact signed distance: at any points (:class:`MeshDistance`), or on a grid (:func:`sample_distance`).

Not promised: inside a mesh whose parts overlap the distance is to the nearest triangle, which may lie inside the
solid; across the holes of an open mesh the sign changes without a surface, and with it the value jumps.
"""

from __future__ import annotations

import math
import warnings
from typing import Literal, NamedTuple

import numpy as np
from numba import get_num_threads
from numpy.typing import ArrayLike, NDArray

from . import parallel
from .errors import GeometryWarning, SpacingError
from .field import Field
from .grid import Grid
from .implicit import Affine, FloatArray, Implicit
from .kernels.bvh import Tree, build_tree
from .kernels.closest import any_within, closest_points, signed_distances, unsigned_distances
from .kernels.jit import frozen
from .kernels.planes import affine_distances
from .kernels.raster import WIDEN, fill_slabs, slab_members
from .kernels.triangle import FACE
from .kernels.winding import winding_numbers
from .mesh import Mesh
from .parallel import Progress, no_progress

#: How inside is told from outside.
Sign = Literal["auto", "pseudonormal", "winding"]

#: Triangles whose two sides are looked at to find overlaps, and how far off them relative to the diagonal.
_OVERLAP_SAMPLES = 500
_OVERLAP_OFFSET = 1e-6
#: Largest difference of a winding number from a whole number that is put down to rounding and to dipoles.
_WINDING_TOLERANCE = 0.2
#: Nodes between two calls of progress: about 0.1 s.
_BATCH_NODES = 8_000_000


class Closest(NamedTuple):
    """Closest points on a mesh.

    Attributes
    ----------
    distance : (N,) float64
        In mm, not signed.
    point : (N, 3) float64
        In mm.
    triangle : (N,) int32
        Number of the triangle in the mesh.
    normal : (N, 3) float64
        Outward unit pseudonormal there: of the face, the edge or the vertex.
    """

    distance: FloatArray
    point: FloatArray
    triangle: NDArray[np.int32]
    normal: FloatArray


class MeshDistance(Implicit):
    """Exact signed distance to a mesh, positive inside.

    Points that are not finite get NaN.

    Parameters
    ----------
    mesh : Mesh
    sign : "auto", "pseudonormal" or "winding"
        How to tell inside from outside. Pseudonormals (Bærentzen and Aanæs 2005, DOI 10.1109/TVCG.2005.49) are
        right for closed meshes that do not run through themselves; winding numbers above 1/2 (Barill et al. 2018,
        DOI 10.1145/3197517.3201337) for any mesh. "auto" takes pseudonormals, unless the mesh is open or samples
        find that it overlaps itself.
    threads : int, optional
        Number of threads; all cores by default.

    Warns
    -----
    GeometryWarning
        If "auto" falls back on winding numbers; says why.

    Examples
    --------
    >>> import trimesh
    >>> cube = trimesh.creation.box((2, 2, 2))
    >>> distance = MeshDistance(Mesh(cube.vertices, cube.faces))
    >>> distance([[0, 0, 0], [3, 0, 0]])
    array([ 1., -2.])
    """

    lipschitz = 1.0
    exact_inside = exact_outside = True

    def __init__(self, mesh: Mesh, *, sign: Sign = "auto", threads: int | None = None) -> None:
        if sign not in ("auto", "pseudonormal", "winding"):
            raise ValueError(f'sign must be "auto", "pseudonormal" or "winding", not {sign!r}')
        self.mesh = mesh
        self.bounds = mesh.bounds
        self.threads = threads
        with parallel.threads(threads, len(mesh.faces)):
            tree = build_tree(mesh.vertices, mesh.faces)
        reason = "" if sign == "pseudonormal" else "asked for"
        if sign == "auto":
            reason = _doubts(mesh, tree, threads)
            if reason:
                warnings.warn(
                    GeometryWarning(f"{reason}; inside and outside are told apart by winding numbers"), stacklevel=2
                )
        #: The hierarchy of triangles, for kernels.
        self.tree: Tree = tree._replace(by_winding=1 if reason else 0)
        beyond = mesh.bounds[1] + (mesh.bounds[1] - mesh.bounds[0]).max() / 2
        self.tree = self.tree._replace(exterior=1 if self(beyond[None])[0] > 0 else 0)

    @property
    def sign(self) -> Literal["pseudonormal", "winding"]:
        """How inside is told from outside."""
        return "winding" if self.tree.by_winding else "pseudonormal"

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Give unit gradients ``(N, 3)``, the way in; on the surface, the pseudonormal turned inward."""
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Signed distances ``(N,)`` in mm and unit gradients ``(N, 3)`` at points ``(N, 3)`` in mm."""
        x = _as_points(points)
        with parallel.threads(self.threads, parallel.QUERY * len(x)):
            value, gradient = signed_distances(self.tree, x)
        return value, gradient

    def closest(self, points: ArrayLike) -> Closest:
        """Closest point, triangle and pseudonormal for points ``(N, 3)`` in mm."""
        with parallel.threads(self.threads):
            distance, point, triangle, position, feature = closest_points(self.tree, _as_points(points))
        normal = np.where(position[:, None] >= 0, self.tree.normals[position, feature], np.nan)
        return Closest(distance, point, triangle, normal)

    def within(self, points: ArrayLike, radius: ArrayLike) -> NDArray[np.bool_]:
        """Whether the surface comes nearer to points ``(N, 3)`` than a radius, one for all or ``(N,)``, in mm."""
        x = _as_points(points)
        radii = np.ascontiguousarray(np.broadcast_to(np.asarray(radius, np.float64), len(x)))
        with parallel.threads(self.threads, parallel.QUERY * len(x)):
            return np.asarray(any_within(self.tree, x, frozen(radii)))

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where one plane alone is near: values ``(N,)``, gradients ``(N, 3)`` and whether they hold ``(N,)``."""
        if self.tree.by_winding:
            return super().affine_within(points, radius, tolerance)
        with parallel.threads(self.threads, parallel.QUERY * len(points)):
            values, gradients, holds = affine_distances(self.tree, _as_points(points), radius, tolerance)
        return values, gradients, holds

    def unsigned(self, points: ArrayLike) -> FloatArray:
        """Distances ``(N,)`` in mm from points ``(N, 3)``, not signed."""
        with parallel.threads(self.threads):
            return np.asarray(unsigned_distances(self.tree, _as_points(points)))

    def winding(self, points: ArrayLike) -> FloatArray:
        """Winding numbers ``(N,)`` of the mesh around points ``(N, 3)``, to about 0.03: 1 inside, 0 outside."""
        with parallel.threads(self.threads):
            return np.asarray(winding_numbers(self.tree, _as_points(points)))


class Surface:
    """Triangles of which only distances are asked, not signed: a third of the work to prepare, and need not be closed.

    They should be of similar size.

    Parameters
    ----------
    mesh : Mesh
    threads : int, optional
        Number of threads; all cores by default.
    bounds : (2, 3) array, optional
        Box in mm that holds them: distances to a triangle are then the same whatever others there are.
    """

    def __init__(self, mesh: Mesh, *, threads: int | None = None, bounds: FloatArray | None = None) -> None:
        self.mesh = mesh
        self._threads = threads
        with parallel.threads(threads, len(mesh.faces)):
            self._tree = build_tree(mesh.vertices, mesh.faces, signed=False, even=True, bounds=bounds)

    def closest(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Distances ``(N,)`` in mm and closest points ``(N, 3)`` for points ``(N, 3)``."""
        x = _as_points(points)
        with parallel.threads(self._threads, parallel.QUERY * len(x)):
            distance, point, *_ = closest_points(self._tree, x)
        return distance, point


def sample_distance(
    mesh: Mesh | MeshDistance,
    grid: Grid,
    *,
    band: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Field:
    """Signed distance to a mesh on a grid: exact near the surface, plus or minus the band beyond.

    Parameters
    ----------
    mesh : Mesh or MeshDistance
        A Mesh is wrapped first, with ``sign="auto"``.
    grid : Grid
        In space, and holding the mesh.
    band : float, optional
        Distance in mm up to which values are exact, at least the largest spacing; by default 1.5 times that.
    threads : int, optional
        Number of threads; all cores by default. Values do not depend on it.
    progress : callable
        Called as ``progress("distance", fraction)``; may raise to cancel.

    Returns
    -------
    Field
        float32, positive inside.

    Raises
    ------
    SpacingError
        If the grid is not in space or does not hold the mesh, or the band is narrower than the spacing.
    """
    distance = mesh if isinstance(mesh, MeshDistance) else MeshDistance(mesh, threads=threads)
    width = _check_band(grid, band)
    _check_holds(grid, distance.mesh)
    tree = distance.tree
    scale = float(tree.frame[3])
    origin = (np.array(grid.origin) - tree.frame[:3]) / scale
    step = np.array(grid.spacing) / scale
    scaled_band = width / scale * WIDEN
    first, members = slab_members(tree.corners, tree.order, origin[0], step[0], grid.shape[0], scaled_band)
    is_open = bool(tree.by_winding) and distance.mesh.open_edges > 0
    values: NDArray[np.float32] = np.zeros(grid.shape, np.float32)
    slabs = len(first) - 1
    batch = max(1, _BATCH_NODES * slabs // grid.size)
    for start in range(0, slabs, batch):
        progress("distance", start / slabs)
        stop = min(start + batch, slabs)
        with parallel.threads(threads):
            workers = get_num_threads()
            fill_slabs(tree, origin, step, scaled_band, (start, stop), workers, first, members, is_open, values)
    progress("distance", 1.0)
    return Field(grid, values, distance.bounds, lipschitz=1.0)


def _as_points(points: ArrayLike) -> FloatArray:
    x = np.ascontiguousarray(points, np.float64)
    if x.ndim != 2 or x.shape[1] != 3:
        raise ValueError(f"points must be (N, 3), not {x.shape}")
    return frozen(x)


def _check_band(grid: Grid, band: float | None) -> float:
    if grid.dim != 3:
        raise SpacingError(f"the distance to a mesh needs a grid in 3-D, not {grid.dim}-D")
    coarsest = max(grid.spacing)
    if band is None:
        return 1.5 * coarsest
    if not (math.isfinite(band) and band >= coarsest):
        raise SpacingError(f"the band must be at least the largest spacing, {coarsest:g} mm, not {band:g} mm")
    return float(band)


def _check_holds(grid: Grid, mesh: Mesh) -> None:
    low, high = grid.bounds
    outside = max(float((low - mesh.bounds[0]).max()), float((mesh.bounds[1] - high).max()))
    if outside > 1e-9 * mesh.diagonal:
        raise SpacingError(f"the mesh sticks out of the grid by {outside:g} mm; cover the mesh's bounds with the grid")


def _doubts(mesh: Mesh, tree: Tree, count: int | None) -> str:
    """Why pseudonormals would not tell inside from outside, or nothing."""
    if mesh.open_edges:
        return f"the mesh is not closed: {mesh.open_edges} edges are open or shared by more than two triangles"
    normals = tree.normals[:, FACE]
    good = np.flatnonzero(normals.any(axis=1))
    if len(good) == 0:
        return "the mesh has no area"
    chosen = good[np.linspace(0, len(good) - 1, min(len(good), _OVERLAP_SAMPLES)).astype(np.int64)]
    centres = mesh.vertices[mesh.faces[tree.order[chosen]]].mean(axis=1)
    shift = normals[chosen] * (_OVERLAP_OFFSET * mesh.diagonal)
    with parallel.threads(count):
        number = winding_numbers(tree, frozen(np.concatenate([centres - shift, centres + shift])))
    behind, before = number[: len(chosen)], number[len(chosen) :]
    # A mesh that is inside out as a whole is consistent too: 0 behind and -1 before all of its triangles. Solids that
    # share a face are told only by what is before it.
    level = float(np.round(before[0]))
    wrong = (abs(before - level) > _WINDING_TOLERANCE) | (abs(behind - level - 1) > _WINDING_TOLERANCE)
    if level not in (0.0, -1.0) or wrong.any():
        share = 100 * max(float(wrong.mean()), 1 / len(chosen))
        return f"the mesh overlaps itself or has parts that are inside out ({share:.2g} % of its triangles)"
    return ""
