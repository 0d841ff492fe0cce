"""Contour: the surface of a shape as a closed mesh in space, as closed curves in the plane.

A Field is contoured by marching cubes, which cut sharp edges by up to about 0.9 grid spacings: that is the price of the
regular grid. Any other Implicit is contoured by dual contouring, which keeps them.
"""

from __future__ import annotations

import warnings
from copy import copy
from functools import partial
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from .booleans import Boolean
from .distance import MeshDistance
from .dual import dual_contour
from .errors import EmptyResultError, GeometryWarning, SpacingError, tell
from .exact import surface_of
from .field import Field
from .implicit import Implicit, polished
from .mesh import Mesh
from .parallel import Progress, no_progress
from .simplifying import has_manifold
from .sizing import check_bounded
from .transforms import Placed

if TYPE_CHECKING:
    from .local_blend import LocalBlend

#: Values closer to zero than this fraction of the spacing are moved there: a vertex is never closer to a node, which
#: would give triangles without area in the single precision of the marching cubes. Moves the surface by as much.
_NODE_CLEARANCE = 1e-4

#: The tables of the marching cubes leave a hole where two diagonals of a face tie (5 % of random whole numbers, 0.03 %
#: of random fields). Values changed by a share of the clearance break the tie; after this many tries another method.
_TRIES = 4

#: Triangles are on the part's own if they are within so many spacings of them.
_ON = 0.02

#: What is told where blends cannot be joined to the part's own triangles.
_NOT_JOINED = (
    "manifold3d is not installed, so all of the part was contoured anew, not only its blends, and solids of it may "
    "have more plane facets: pip install manifold3d"
)


def contour(
    shape: Implicit,
    spacing: float | None = None,
    *,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Mesh:
    """Surface of a shape as a closed mesh.

    Parameters
    ----------
    shape : Implicit
        In 3-D. A Field is contoured on its own grid by marching cubes (Lewiner et al. 2003,
        DOI 10.1080/10867651.2003.10487582), anything else by dual contouring. Where the shape runs into the border of
        its grid or bounds it is closed there, a Field with a GeometryWarning. A LocalBlend at its own spacing gives its
        :meth:`~cad_implicit.LocalBlend.mesh`, unless the part leaks or overlaps itself, or manifold3d is not installed
        (with a GeometryWarning). Without scikit-image Fields, too, are contoured by dual contouring.
    spacing : float, optional
        Width of the cells in mm; by default the one that the shape was made with. Not for a Field.
    threads : int, optional
        Default: all cores.
    progress : callable
        Called as ``progress(stage, fraction)``; may raise to cancel.

    Returns
    -------
    Mesh
        Closed, oriented outward, in mm.

    Raises
    ------
    EmptyResultError
        If there is no surface.
    SpacingError
        If the shape is not in 3-D or has no end, or a spacing is missing.
    """
    if shape.dim != 3:
        raise SpacingError("contour() works in 3-D; use contour_curves() for a field in the plane")
    if isinstance(shape, Field):
        return _marching_cubes(shape)
    h = shape.spacing if spacing is None else spacing
    if h is None:
        raise SpacingError("give the spacing in mm at which this shape is to be contoured")
    check_bounded(shape.bounds)
    part = shape.kept_part(h) if hasattr(shape, "kept_part") else None
    if part is not None and has_manifold():
        return cast("LocalBlend", shape).mesh(threads=threads, progress=progress)
    bounded = _cheapest(shape)
    polish = partial(polished, bounded) if hasattr(bounded, "polished") else None
    mesh = dual_contour(bounded, h, threads=threads, progress=progress, polish=polish)
    if part is None:
        return mesh
    tell(_NOT_JOINED)
    return _with_faces(mesh, part, h)


def _with_faces(mesh: Mesh, part: MeshDistance, spacing: float) -> Mesh:
    """Mesh whose triangles know the faces of the part on whose triangles they lie; -1 for others."""
    if part.mesh.face_ids is None:
        return mesh
    corners = mesh.vertices[mesh.faces]
    middle = part.closest(corners.mean(axis=1))
    off = np.max([middle.distance, *(part.closest(corners[:, i]).distance for i in range(3))], axis=0)
    facing = (mesh.face_vectors * part.mesh.face_vectors[middle.triangle]).sum(axis=1)
    own = (off < _ON * spacing) & (facing > 0)
    return Mesh(mesh.vertices, mesh.faces, np.where(own, part.mesh.face_ids[middle.triangle], -1), mesh.source)


def _cheapest(shape: Implicit) -> Implicit:
    """Shape with the same surface whose values cost least, also within booleans and transforms."""
    if isinstance(shape, Placed):
        return Placed(_cheapest(shape.parent), shape.matrix, shape.shift)
    if isinstance(shape, Boolean):
        joined = copy(shape)
        joined.first, joined.second = _cheapest(shape.first), _cheapest(shape.second)
        return joined
    return surface_of(shape)


def _marching_cubes(field: Field) -> Mesh:
    values, padding = _prepared(field)
    try:
        from skimage.measure import marching_cubes
    except ImportError:  # some hosts come without it
        return dual_contour(field, min(field.grid.spacing))
    rng = np.random.default_rng(0)
    for _ in range(_TRIES):
        vertices, faces, _, _ = marching_cubes(values, 0.0, gradient_direction="ascent")
        vertices = (vertices.astype(np.float64) - padding) * field.grid.spacing + field.grid.origin
        mesh = Mesh(vertices, faces)
        if mesh.is_watertight:
            return mesh
        values *= 1 + rng.uniform(-_NODE_CLEARANCE, _NODE_CLEARANCE, values.shape).astype(np.float32)
    return dual_contour(field, min(field.grid.spacing))


def contour_curves(field: Field) -> list[NDArray[np.float64]]:
    """Zero level of a field in the plane as closed curves, by marching squares.

    Parameters
    ----------
    field : Field
        In 2-D. Where the shape runs into the border of the grid it is closed there, with a GeometryWarning.

    Returns
    -------
    list of (N, 2) arrays
        Closed polylines in mm (first point equals last), counter-clockwise around material.

    Raises
    ------
    EmptyResultError
        If the field has no positive value.
    SpacingError
        If the field is not in 2-D.
    """
    if field.grid.dim != 2:
        raise SpacingError("contour_curves() works in the plane; use contour() for a field in 3-D")
    from skimage.measure import find_contours

    values, padding = _prepared(field)
    curves = find_contours(values, 0.0, fully_connected="low", positive_orientation="high")
    return [(curve - padding) * field.grid.spacing + field.grid.origin for curve in curves]


def _prepared(field: Field) -> tuple[NDArray[np.float32], int]:
    """Values off zero by the clearance, and the number of nodes padded around them to close the shape."""
    if not bool((field.values > 0).any()):
        raise EmptyResultError("nothing is left: the field is nowhere positive on its grid")
    clearance = np.float32(_NODE_CLEARANCE * min(field.grid.spacing))
    values = field.values.astype(np.float32)
    np.copyto(values, -clearance, where=(values <= 0) & (values > -clearance))
    np.copyto(values, clearance, where=(values > 0) & (values < clearance))
    borders = [np.take(values, index, axis) for axis in range(values.ndim) for index in (0, -1)]
    if not any(bool((border > 0).any()) for border in borders):
        return values, 0
    warnings.warn(
        "the shape runs into the border of its grid and was closed there; use wider bounds or a larger margin",
        GeometryWarning,
        stacklevel=3,
    )
    return np.pad(values, 1, constant_values=-float(np.abs(values).max()) / _NODE_CLEARANCE), 1
