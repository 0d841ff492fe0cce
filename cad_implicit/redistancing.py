r"""Re-initialization: the signed distance to the zero level of any sampled function (section 3 of the paper).

The equation :math:`\phi_t = \mathrm{sign}(f) (1 - |\nabla\phi|)` is iterated on the grid of the field. The front
moves one time step per iteration, so the distance is right up to ``iterations * time step`` from the surface; beyond
that the values have the right sign and are rough.

Not promised: the surface outside the grid is not known, so a node whose nearest point of the surface lies outside
gets the distance to the part inside; the creases of the level sets are blunt within a spacing with every scheme.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .field import Field
from .grid import Grid
from .kernels import crossing as _crossing
from .kernels import highorder as _highorder
from .kernels import subcell as _subcell
from .kernels import upwind as _upwind
from .parallel import Progress, no_progress
from .rfunctions import as_spatial, diagonal, inverse_spacing, normalize, taubin

Scheme = Literal["upwind", "eno2", "weno5", "fmm"]
Time = Literal["euler", "rk2", "gauss-seidel"]
Normalization = Literal["rvachev", "taubin"]

_Array = NDArray[np.floating]
#: Writes the values after a forward Euler step into the second array.
_Step = Callable[[_Array, _Array], object]
#: Does a forward Euler step in place; the number says in which of the eight directions.
_Sweep = Callable[[_Array, int], object]

#: Default epsilon of the smoothed sign (3.5) relative to the smallest spacing. With the sub-cell fix, errors at 0.1 are
#: within 1 % of those at 0, at 1 they double in a band of 6 spacings; without it, the sphere f = 1 - r² moves by 0.18,
#: 0.16, 0.06 spacings at 0, 0.1, 1 (64³, single precision).
_EPSILON = 0.1

#: Iterations between two calls of the progress callback and two looks at convergence; all eight sweeping directions.
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
    r"""Signed distance to the zero level of a field, by re-initialization.

    Parameters
    ----------
    field : Field
        Any continuous function, positive inside; planar or spatial, spacing may differ between the axes.
    distance : float, optional
        How far from the surface, in mm, the result must be right. By default everywhere: the iteration then goes on
        until it stands still, or until the front has crossed the diagonal of the grid twice.
    iterations : int, optional
        Number of iterations, ⌈distance / time step⌉ by default (section 4.1 of the paper).
    scheme : {"upwind", "eno2", "weno5", "fmm"}
        Spatial differences: first order (the paper's), second or fifth order, or the fast marching method of
        scikit-fmm, which does not iterate and takes note of ``field``, ``distance`` and ``progress`` only.
    time : {"euler", "rk2", "gauss-seidel"}
        Forward Euler (the paper's), second-order Runge-Kutta (TVD; two steps per iteration), or forward Euler in
        place in alternating directions (on one thread). WENO with forward Euler jitters by about 0.05 spacings.
    normalization : {"rvachev", "taubin", None}
        Start from (3.1), from (3.2), or from the field as it is.
    subcell : bool
        Hold the nodes next to the surface at their normalized distance (``upwind``), or end differences at the
        surface (``eno2``, ``weno5``), so that the surface stays where it is.
    epsilon : float, optional
        Of the smoothed sign (3.5) of the start, in mm; by default a tenth of the smallest spacing. Without
        normalization, a start much flatter than a distance slows the iteration unless it is 0.
    cfl : float
        Time step relative to the smallest spacing.
    threads : int, optional
        All cores by default. The result is the same for any number.
    progress : callable
        Called as ``progress("redistance", fraction)`` every few iterations; may raise to cancel.

    Returns
    -------
    Field
        Signed distance in mm on the same grid, float32 if ``field`` is (the higher-order schemes compute in float64).
        If the field has one sign there is no surface: every value is then ± the diagonal of the grid, the largest
        distance that a grid can hold, which no result exceeds.

    Raises
    ------
    ValueError
        If an option is none of the above or a value of the field is not finite.
    ImportError
        If scikit-fmm is needed and not installed.

    Notes
    -----
    Equations (3.3) to (3.9): M. Sussman, P. Smereka, S. Osher, J. Comput. Phys. 114 (1994),
    doi:10.1006/jcph.1994.1155; the sub-cell fix: G. Russo, P. Smereka, J. Comput. Phys. 163 (2000),
    doi:10.1006/jcph.2000.6553; times: C. Min, J. Comput. Phys. 229 (2010), doi:10.1016/j.jcp.2009.12.032.

    Examples
    --------
    >>> grid = Grid.cover([[-2, -2], [2, 2]], shape=65)
    >>> x, y = np.meshgrid(*grid.axes(), indexing="ij")
    >>> disc = redistance(Field(grid, 1 - x**2 - y**2), distance=0.5)
    >>> disc([[0.7, 0.0], [0.0, 1.4]]).round(1)
    array([ 0.3, -0.4])
    """
    _check_options(scheme, time, normalization, distance, iterations, epsilon)
    _check_field(field, cfl)
    f = as_spatial(field.values)
    limit = diagonal(field.grid)
    if f.min() > 0 or f.max() < 0:
        return _result(field, np.full_like(f, math.copysign(limit, f.flat[0])))
    if scheme == "fmm":
        progress("redistance", 0.0)
        values = _fast_marching(field, distance, limit)
        progress("redistance", 1.0)
        return _result(field, values)

    start = field
    if normalization is not None:
        start = (normalize if normalization == "rvachev" else taubin)(field, threads=threads)
    values = np.clip(as_spatial(start.values), -limit, limit)
    smallest = min(field.grid.spacing)
    time_step = cfl * smallest
    epsilon = _EPSILON * smallest if epsilon is None else epsilon
    converge = distance is None and iterations is None
    if iterations is None:
        iterations = math.ceil((2 * limit if distance is None else distance) / time_step - 1e-9)
    with parallel.threads(threads):
        if scheme == "upwind":
            step, sweep = _first_order(f, values, field.grid, time_step, epsilon, subcell)
        else:
            values = values.astype(np.float64)
            step, sweep = _higher_order(f, values, field.grid, time_step, epsilon, subcell, scheme == "weno5")
    still = _CONVERGED * smallest if converge else None
    return _result(field, _iterate(values, step, sweep, time, iterations, still, threads, progress))


def _result(field: Field, values: _Array) -> Field:
    """Field of the same grid, bounds and type."""
    dtype = np.float32 if field.values.dtype == np.float32 else np.float64
    return Field(field.grid, values.reshape(field.grid.shape).astype(dtype, copy=False), field.bounds)


def _first_order(
    f: _Array, values: _Array, grid: Grid, time_step: float, epsilon: float, subcell: bool
) -> tuple[_Step, _Sweep]:
    """Set up the paper's steps; with ``subcell``, ``values`` get the distances of the nodes that are held."""
    rate = np.zeros_like(values)
    _upwind.rates(values, rate, time_step, epsilon)
    if subcell:
        _subcell.hold(f, _signs(f), values, rate, inverse_spacing(grid))
    weights = [values.dtype.type(w * w) for w in inverse_spacing(grid)]
    return (
        lambda old, new: _upwind.step(old, new, rate, *weights),
        lambda old, order: _upwind.sweep(old, rate, *weights, order),
    )


def _higher_order(
    f: _Array, values: _Array, grid: Grid, time_step: float, epsilon: float, subcell: bool, weno: bool
) -> tuple[_Step, _Sweep]:
    """Set up the steps of the ENO or WENO scheme, with differences that end at the interface if ``subcell``."""
    rate = np.zeros_like(values)
    _upwind.rates(values, rate, time_step, epsilon)
    spacing = (math.inf,) * (3 - grid.dim) + grid.spacing
    slots = np.full(f.shape, -1, np.int32)
    distances = np.zeros((0, 6))
    if subcell:
        scaled = f.astype(np.float64) / np.abs(f).max(initial=np.finfo(np.float64).tiny)
        signs = _signs(f)
        counts = np.zeros(f.shape[0] * f.shape[1], np.int64)
        _crossing.count(signs, counts)
        ends = np.cumsum(counts)
        distances = np.zeros((int(ends[-1]), 6))
        _crossing.locate(scaled, signs, ends - counts, slots, distances, rate, spacing)
    return (
        lambda old, new: _highorder.step(old, new, rate, slots, distances, spacing, weno),
        lambda old, order: _highorder.sweep(old, rate, slots, distances, spacing, weno, order),
    )


def _signs(f: _Array) -> NDArray[np.int8]:
    """Sign of every node."""
    signs = np.zeros(f.shape, np.int8)
    _subcell.signs(f, signs)
    return signs


def _iterate(
    values: _Array,
    step: _Step,
    sweep: _Sweep,
    time: Time,
    iterations: int,
    still: float | None,
    threads: int | None,
    progress: Progress,
) -> _Array:
    """Iterate so many times, or until no value moves by more than ``still`` in a batch."""
    spare = np.zeros_like(values)
    for done in range(0, iterations, _BATCH):
        progress("redistance", done / iterations)
        before = None if still is None else values.copy()
        with parallel.threads(threads):
            for n in range(done, min(done + _BATCH, iterations)):
                if time == "gauss-seidel":
                    sweep(values, n % 8)
                elif time == "euler":
                    step(values, spare)
                    values, spare = spare, values
                else:
                    step(values, spare)
                    second = np.zeros_like(values)
                    step(spare, second)
                    values = (values + second) / 2
        if before is not None and np.abs(values - before).max() <= still:
            break
    progress("redistance", 1.0)
    return values


def _fast_marching(field: Field, distance: float | None, limit: float) -> _Array:
    """Distance by scikit-fmm, up to two spacings past ``distance``; the rest has the value of the band's end."""
    try:
        import skfmm
    except ImportError:
        raise ImportError(
            "scheme 'fmm' needs scikit-fmm: pip install scikit-fmm, or pip install cad_implicit[fmm]"
        ) from None
    f = field.values.astype(np.float64)
    end = limit if distance is None else distance + 2 * max(field.grid.spacing)
    found = skfmm.distance(f, dx=list(field.grid.spacing), narrow=0.0 if distance is None else end)
    return np.where(np.ma.getmaskarray(found), np.copysign(end, f), np.ma.getdata(found))


def _check_options(
    scheme: str,
    time: str,
    normalization: str | None,
    distance: float | None,
    iterations: int | None,
    epsilon: float | None,
) -> None:
    """Raise ValueError for options that make no sense, saying what is allowed."""
    for name, value, allowed in (
        ("scheme", scheme, get_args(Scheme)),
        ("time", time, get_args(Time)),
        ("normalization", normalization, (*get_args(Normalization), None)),
    ):
        if value not in allowed:
            raise ValueError(f"{name} must be one of {', '.join(map(repr, allowed))}, not {value!r}")
    if scheme == "fmm" and (time != "euler" or iterations is not None):
        raise ValueError("scheme 'fmm' does not iterate: it takes neither iterations nor a time other than 'euler'")
    if distance is not None and not 0 < distance < math.inf:
        raise ValueError(f"distance must be positive and finite, in mm, not {distance}")
    if iterations is not None and iterations < 0:
        raise ValueError(f"iterations must be 0 or more, not {iterations}")
    if epsilon is not None and not 0 <= epsilon < math.inf:
        raise ValueError(f"epsilon must be 0 or more and finite, in mm, not {epsilon}")


def _check_field(field: Field, cfl: float) -> None:
    """Raise ValueError if values are not finite or the time step is not stable."""
    if not 0 < cfl <= 1 / math.sqrt(field.grid.dim):
        raise ValueError(f"cfl must be above 0 and at most 1/sqrt({field.grid.dim}) to be stable, not {cfl}")
    broken = int(np.count_nonzero(~np.isfinite(field.values)))
    if broken:
        raise ValueError(f"{broken} of {field.values.size} values of the field are not finite")
