"""The normalization of implicit functions; for R-functions see :mod:`cad_implicit.rjoins`.

A function is normalized to first order if its gradient has length one on its zero level; near the surface it then
behaves like the distance. The gradient is taken on the grid, so creases are blunt within one spacing of them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .field import Field
from .grid import Grid
from .kernels import normalization as _kernel


def normalize(field: Field, *, threads: int | None = None) -> Field:
    r"""First-order normalization after Rvachev, :math:`f / \sqrt{f^2 + |\nabla f|^2}`.

    Near the surface the result is the distance in mm, up to terms of second order. Away from it the result saturates
    at ±1, because f and its gradient (f per mm) are added as if they had one unit: the form is useful only where
    the distance is well below 1 mm, and a starting value for :func:`cad_implicit.redistancing.redistance` elsewhere.
    Multiplying f by a positive constant changes nothing near the surface, where f is small against its gradient.

    Parameters
    ----------
    field : Field
        Values of f, positive inside; planar or spatial, any spacing.
    threads : int, optional
        All cores by default.

    Returns
    -------
    Field
        On the same grid and of the same type. Where the gradient vanishes: ±1 by the sign of f, and 0 where f is 0.

    Notes
    -----
    Equation (3.1) of the paper; V. Shapiro, "Semi-analytic geometry with R-functions", Acta Numerica 16 (2007),
    doi:10.1017/S096249290631001X. Central differences, one-sided at the border of the grid.

    Examples
    --------
    >>> import numpy as np
    >>> from cad_implicit.grid import Grid
    >>> plane = Field(Grid((-0.2, 0.0), (0.1, 0.1), (5, 2)), 7.0 * np.linspace([-0.2] * 2, [0.2] * 2, 5))
    >>> normalize(plane).values[:, 0].round(3)
    array([-0.196, -0.1  ,  0.   ,  0.1  ,  0.196])
    """
    return _normalized(field, rvachev=True, limit=1.0, threads=threads)


def taubin(field: Field, *, threads: int | None = None) -> Field:
    r"""First-order approximation of the distance after Taubin, :math:`f / |\nabla f|`.

    Near the surface the result is the distance in mm, up to terms of second order, in any unit of f.

    Parameters
    ----------
    field : Field
        Values of f, positive inside; planar or spatial, any spacing.
    threads : int, optional
        All cores by default.

    Returns
    -------
    Field
        On the same grid and of the same type. Never more than the diagonal of the grid in absolute value, which it
        takes, with the sign of f, where the gradient vanishes; 0 where f is 0.

    Notes
    -----
    Equation (3.2) of the paper; G. Taubin, "Distance approximations for rasterizing implicit curves", ACM
    Transactions on Graphics 13 (1994), doi:10.1145/174462.174531.
    """
    return _normalized(field, rvachev=False, limit=diagonal(field.grid), threads=threads)


def diagonal(grid: Grid) -> float:
    """Largest distance in mm between two nodes of a grid."""
    low, high = grid.bounds
    return math.dist(low, high)


def as_spatial(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Values as the contiguous 3-D array of floats that the kernels take; a planar field is one node thick."""
    dtype = np.float32 if values.dtype == np.float32 else np.float64
    spatial = values.reshape((1,) * (3 - values.ndim) + values.shape)
    return np.ascontiguousarray(spatial, dtype)


def inverse_spacing(grid: Grid) -> tuple[float, float, float]:
    """Nodes per mm along the three axes of :func:`as_spatial`; the axis that a planar grid lacks has none."""
    x, *rest = (0.0,) * (3 - grid.dim) + tuple(1 / h for h in grid.spacing)
    y, z = rest
    return x, y, z


def _normalized(field: Field, *, rvachev: bool, limit: float, threads: int | None) -> Field:
    """Run the kernel on a planar or spatial field."""
    values = as_spatial(field.values)
    out = np.zeros_like(values)
    scale = 1 / max(float(values.max()), -float(values.min()), np.finfo(np.float64).tiny)
    with parallel.threads(threads):
        _kernel.normalize(values, out, scale, inverse_spacing(field.grid), rvachev, limit)
    return Field(field.grid, out.reshape(field.grid.shape), field.bounds)
