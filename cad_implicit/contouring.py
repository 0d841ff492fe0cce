"""Contour: the zero level of a Field as a closed mesh in space, as closed curves in the plane.

Marching cubes cuts sharp edges by up to about 0.9 grid spacings; that is the price of the regular grid.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from .errors import EmptyResultError, GeometryWarning, SpacingError
from .field import Field
from .mesh import Mesh

#: Values closer to zero than this fraction of the spacing are moved there: a vertex is never closer to a node, which
#: would give triangles without area in the single precision of the marching cubes. Moves the surface by as much.
_NODE_CLEARANCE = 1e-4


def contour(field: Field) -> Mesh:
    """Zero level of a field as a closed mesh, by marching cubes.

    Lewiner et al. 2003, DOI 10.1080/10867651.2003.10487582.

    Parameters
    ----------
    field : Field
        In 3-D. Where the shape runs into the border of the grid it is closed there, with a GeometryWarning.

    Returns
    -------
    Mesh
        Closed, oriented outward, in mm.

    Raises
    ------
    EmptyResultError
        If the field has no positive value.
    SpacingError
        If the field is not in 3-D.
    """
    if field.grid.dim != 3:
        raise SpacingError("contour() works in 3-D; use contour_curves() for a field in the plane")
    from skimage.measure import marching_cubes

    values, padding = _prepared(field)
    vertices, faces, _, _ = marching_cubes(values, 0.0, gradient_direction="ascent")
    vertices = vertices.astype(np.float64) - padding
    return Mesh(vertices * field.grid.spacing + field.grid.origin, faces)


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
    curves = find_contours(values, 0.0, fully_connected="low", positive_orientation="low")
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
    return np.pad(values, 1, constant_values=-clearance), 1
