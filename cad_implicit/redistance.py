r"""Re-initialization: the signed distance to the zero level of any sampled function (section 3 of the paper).

The equation :math:`\phi_t = \mathrm{sign}(f) (1 - |\nabla\phi|)` is iterated on the grid of the field. The front
moves one time step per iteration, so the distance is right up to ``iterations * time step`` from the surface; beyond
that the values have the right sign and are rough.

Not promised: the surface outside the grid is not known, so a node whose nearest point of the surface lies outside
gets the distance to the part inside; the result is exact to first order in the spacing, and creases of the zero
level sets are blunt within a spacing.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .field import Field
from .grid import Grid
from .kernels import subcell as _subcell
from .kernels import upwind as _upwind
from .parallel import Progress, no_progress
from .rfunctions import as_spatial, diagonal, inverse_spacing, normalize, taubin

Scheme = Literal["upwind"]
Time = Literal["euler"]
Normalization = Literal["rvachev", "taubin"]

#: Default epsilon of the smoothed sign (3.5) relative to the smallest spacing.
_EPSILON = 1e-3

#: Iterations between two calls of the progress callback and two looks at convergence.
_BATCH = 8

#: Without a distance the iteration ends when no value moves by more than this share of the smallest spacing in a batch.
_CONVERGED = 1e-4


def redistance(
    field: Field,
    *,
    distance: float | None = None,
    iterations: int | None = None,
    scheme: Scheme = "upwind",
    time: Time = "euler",
    normalization: Normalization | None = "rvachev",
    subcell: bool = True,
    epsilon: float | None = None,
    cfl: float = 0.4,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Field:
    """Signed distance to the zero level of a field."""
    _check(field, distance, iterations, scheme, time, normalization, epsilon, cfl)
    f = as_spatial(field.values)
    limit = diagonal(field.grid)
    if f.min() > 0 or f.max() < 0:
        return Field(field.grid, np.full_like(field.values, math.copysign(limit, f.flat[0])), field.bounds)
    smallest = min(field.grid.spacing)
    time_step = cfl * smallest
    epsilon = _EPSILON * smallest if epsilon is None else epsilon
    if normalization is not None:
        field = normalize(field) if normalization == "rvachev" else taubin(field)
    values = np.clip(as_spatial(field.values), -limit, limit)
    rate = np.zeros_like(values)
    with parallel.threads(threads):
        _upwind.rates(values, rate, time_step, epsilon)
        if subcell:
            _subcell.hold(f, values, rate, inverse_spacing(field.grid))
    converge = distance is None and iterations is None
    if iterations is None:
        iterations = math.ceil((limit if distance is None else distance) / time_step - 1e-9)
    values = _iterate(values, rate, field.grid, iterations, converge, threads, progress)
    return Field(field.grid, values.reshape(field.grid.shape), field.bounds)


def _iterate(
    values: NDArray[np.floating],
    rate: NDArray[np.floating],
    grid: Grid,
    iterations: int,
    converge: bool,
    threads: int | None,
    progress: Progress,
) -> NDArray[np.floating]:
    """Iterate up to ``iterations`` times, or until nothing moves any more."""
    weights = [values.dtype.type(w * w) for w in inverse_spacing(grid)]
    spare = np.zeros_like(values)
    for done in range(0, iterations, _BATCH):
        progress("redistance", done / iterations)
        before = values.copy() if converge else values
        with parallel.threads(threads):
            for _ in range(min(_BATCH, iterations - done)):
                _upwind.step(values, spare, rate, *weights)
                values, spare = spare, values
        if converge and np.abs(values - before).max() <= _CONVERGED * min(grid.spacing):
            break
    progress("redistance", 1.0)
    return values


def _check(
    field: Field,
    distance: float | None,
    iterations: int | None,
    scheme: str,
    time: str,
    normalization: str | None,
    epsilon: float | None,
    cfl: float,
) -> None:
    """Raise ValueError for values that make no sense, saying what is allowed."""
    for name, value, allowed in (
        ("scheme", scheme, get_args(Scheme)),
        ("time", time, get_args(Time)),
        ("normalization", normalization, (*get_args(Normalization), None)),
    ):
        if value not in allowed:
            raise ValueError(f"{name} must be one of {', '.join(map(repr, allowed))}, not {value!r}")
    if distance is not None and not 0 < distance < math.inf:
        raise ValueError(f"distance must be positive and finite, in mm, not {distance}")
    if iterations is not None and iterations < 0:
        raise ValueError(f"iterations must be 0 or more, not {iterations}")
    if epsilon is not None and not 0 <= epsilon < math.inf:
        raise ValueError(f"epsilon must be 0 or more and finite, in mm, not {epsilon}")
    if not 0 < cfl <= 1 / math.sqrt(field.grid.dim):
        raise ValueError(f"cfl must be above 0 and at most 1/sqrt({field.grid.dim}) to be stable, not {cfl}")
    broken = int(np.count_nonzero(~np.isfinite(field.values)))
    if broken:
        raise ValueError(f"{broken} of {field.values.size} values of the field are not finite")
