"""Sizing: which spacing suits a radius, a tolerance and the memory; said before anything is allocated."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from . import exact, reinit
from .errors import MemoryLimitError, RadiusError, RefusedError, SpacingError
from .grid import Grid

#: How distances are computed: exactly from the mesh, or by the paper's scheme on a regular grid.
Engine = Literal["exact", "reinit"]

#: The default spacing resolves the radius by this many grid cells …
CELLS_PER_RADIUS = 6.0

#: or, where memory does not allow it, by this many at least …
FEWEST_CELLS = 2.0

#: … and the part's diagonal by this many.
CELLS_PER_DIAGONAL = 100.0

#: Curved faces are tessellated to this share of the spacing: little beside what the engine itself loses.
TESSELLATION_PER_SPACING: dict[Engine, float] = {"exact": 0.005, "reinit": 0.05}

#: Bytes at the peak: for each node of the regular grid (field, two working copies, sign, and the padded copy and tables
#: of the contour) …
BYTES_PER_NODE = 40

#: … and for each spacing² of surface in the exact engine (bricks, edges, vertices, tree of the ball centres).
BYTES_PER_SURFACE_CELL = 2500

#: The same where the part is done in tiles: for the result, and what joins it, …
BYTES_PER_TILED_CELL = 160

#: … for the checks of the result, when the tiles are gone (147 were measured with 30 million triangles), …
BYTES_PER_CHECKED_CELL = 200

#: … and for each brick of 8³ nodes near the surface in a tile (cells of 8, halo and ball centres included): so many at
#: most, for whom more costs nothing less, and so few at least, whose halo is then most of the work.
BYTES_PER_TILE_BRICK = 42_000
_MOST_BRICKS = 16_000
_FEWEST_BRICKS = 300

#: The same for the strips of local blends, which are joined to the part, too (measured 1600 to 3700).
BYTES_PER_STRIP_CELL = 4000

#: Share of the free memory that one operation may take …
MEMORY_SHARE = 0.6

#: … and of that what a default spacing aims at: free memory comes and goes between two looks.
_ROOM = 0.8

#: Bytes that a user allows, if fewer.
_memory_limit: int | None = None

#: Results beyond this many triangles are refused unless forced.
TRIANGLE_LIMIT = 20_000_000

#: Results of whole parts that become solids of facets have about so many triangles before they are simplified (a disc
#: of 109 mm rounded by 1 mm had 2.6 million, and took minutes) …
FACETED_TRIANGLES = 300_000

#: … but no fewer cells to a radius than this: the error bound is then 0.05 radii.
FEWEST_CELLS_PER_RADIUS = 3.0

#: Triangles of a contour for each spacing² of surface, on surfaces off the axes (measured 2.2 to 2.9).
_TRIANGLES_PER_CELL = 2.9


def positive(name: str, value: float, error: type[RadiusError] | type[SpacingError] = RadiusError) -> float:
    """Return ``value`` as a float, or raise ``error`` if it is not positive and finite."""
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise error(f"{name} must be a positive number of mm, not {value:g}")
    return number


def check_bounded(bounds: ArrayLike) -> None:
    """Raise SpacingError if a shape goes on for ever, as planes, slabs and lattices do."""
    endless = ~np.isfinite(np.asarray(bounds, np.float64)).all(axis=0)
    if endless.any():
        axes = ", ".join("xyz"[axis] for axis in np.flatnonzero(endless))
        raise SpacingError(f"the shape has no end along {axes}; intersect it (&) with a box or a part first")


def check_radius(radius: float, bounds: ArrayLike, *, opening: bool) -> float:
    """Return the radius if it is a sensible one for a part of that size.

    Raises
    ------
    RadiusError
        If it is not positive and finite, or larger than half the part: no ball of it fits inside (opening), or the
        result would have nothing in common with the part.
    """
    r = positive("radius", radius)
    low, high = np.asarray(bounds, np.float64)
    size = high - low
    limit = float(size.min()) / 2 if opening else float(np.linalg.norm(size)) / 2
    if r > limit * (1 + 1e-9):
        extents = " x ".join(f"{x:.6g}" for x in size)
        what = "half its smallest side" if opening else "half its diagonal"
        raise RadiusError(
            f"radius {r:g} mm is too large for a part of {extents} mm: it may be at most {limit:.6g} mm, {what}"
        )
    return r


def choose_spacing(
    bounds: ArrayLike,
    radius: float,
    *,
    engine: Engine,
    spacing: float | None = None,
    tolerance: float | None = None,
    margin: float = 0.0,
    area: float | None = None,
    in_tiles: bool = False,
) -> float:
    """Spacing in mm: the given one, the one that keeps a tolerance, or the default that fits into memory.

    Parameters
    ----------
    bounds : (2, D) array_like
        The part's box in mm.
    radius : float
        Radius or offset distance in mm.
    engine : "exact" or "reinit"
    spacing, tolerance : float, optional
        At most one of them.
    margin : float
        Room in mm that the operation needs around the part.
    area : float, optional
        Surface in mm² that is contoured, if it is not all of a part in that box.
    in_tiles : bool
        Whether large parts are done in tiles, down to smaller spacings; the default is no smaller for it.

    Raises
    ------
    SpacingError
        If both are given, or one is not positive and finite.
    MemoryLimitError
        If a given spacing needs more memory than there is; names the smallest that fits.
    """
    if spacing is not None and tolerance is not None:
        raise SpacingError("give either a spacing or a tolerance, not both")
    low, high = np.asarray(bounds, np.float64)
    default = min(radius / CELLS_PER_RADIUS, float(np.linalg.norm(high - low)) / CELLS_PER_DIAGONAL)
    if tolerance is not None:
        spacing = _spacing_for(positive("tolerance", tolerance, SpacingError), radius, engine, 2 * default)
    budget = available_memory()
    smallest = smallest_spacing(bounds, margin, engine, area, budget if spacing is not None else _ROOM * budget)
    if spacing is None and smallest > radius / FEWEST_CELLS:
        need = estimate_memory(bounds, radius / FEWEST_CELLS, margin, engine, area) / 2**30
        raise MemoryLimitError(
            f"a radius of {radius:g} mm is too small for all of a part of {float(np.linalg.norm(high - low)):.3g} mm: "
            f"half of it as spacing needs {need:.3g} GiB, but {budget / 2**30:.1f} GiB may be used; use a larger "
            "radius; on closed parts, choose edges"
        )
    if spacing is None:
        return max(default, smallest)
    h = positive("spacing", spacing, SpacingError)
    if h < smallest and not in_tiles:
        need, have = estimate_memory(bounds, h, margin, engine, area), budget
        raise MemoryLimitError(
            f"a spacing of {h:g} mm needs {need / 2**30:.1f} GiB, but {have / 2**30:.1f} GiB may be used; "
            f"use a spacing of {_rounded_up(smallest):g} mm or more"
        )
    return h


def unresolved(spacing: float, radius: float) -> list[str]:
    """Tell that a blend is hardly resolved; nothing if it is.

    Parameters
    ----------
    spacing, radius : float
        In mm.

    Raises
    ------
    SpacingError
        If it is not resolved at all.
    """
    if spacing > positive("radius", radius) * (1 + 1e-9):
        raise SpacingError(
            f"a spacing of {spacing:g} mm does not resolve a radius of {radius:g} mm; use at most half of that, better "
            f"{radius / CELLS_PER_RADIUS:.3g} mm"
        )
    if spacing <= radius / FEWEST_CELLS * (1 + 1e-9):
        return []
    return [
        f"a spacing of {spacing:g} mm hardly resolves a radius of {radius:g} mm: expect errors of up to "
        f"{error_bound(spacing, radius, 'exact'):.2g} mm"
    ]


def error_bound(spacing: float, radius: float, engine: Engine) -> float:
    """Largest expected distance in mm between a result at this spacing and the truth."""
    tessellation = TESSELLATION_PER_SPACING[engine] * spacing
    if engine == "reinit":
        return reinit.ERROR_PER_SPACING * spacing + tessellation
    return exact.SAGITTA * spacing**2 / radius + exact.SHARP_EDGE * spacing + tessellation


def _spacing_for(tolerance: float, radius: float, engine: Engine, largest: float) -> float:
    """Largest spacing whose error bound is the tolerance, but at most ``largest``."""
    linear = error_bound(1.0, math.inf, engine)
    if engine == "reinit":
        return tolerance / linear
    square = exact.SAGITTA / radius
    return min((math.sqrt(linear**2 + 4 * square * tolerance) - linear) / (2 * square), largest)


def smallest_spacing(bounds: ArrayLike, margin: float, engine: Engine, area: float | None, budget: float) -> float:
    """Smallest spacing in mm at which an operation on a part in that box fits into a budget of memory in bytes."""
    low, high = np.asarray(bounds, np.float64)
    fine = float(np.linalg.norm(high - low)) * 1e-6
    coarse = float(np.linalg.norm(high - low))
    for _ in range(60):
        middle = math.sqrt(fine * coarse)
        if estimate_memory(bounds, middle, margin, engine, area) > budget:
            fine = middle
        else:
            coarse = middle
    return coarse


def estimate_memory(
    bounds: ArrayLike, spacing: float, margin: float, engine: Engine, area: float | None = None
) -> float:
    """Bytes that an operation needs at its peak, from the box of the part or the surface in mm² that is contoured."""
    low, high = np.asarray(bounds, np.float64)
    size = high - low + 2 * margin
    if engine == "reinit":
        return float(np.prod(size / spacing + 2 * reinit.MARGIN + 1)) * BYTES_PER_NODE
    if area is not None:
        return area / spacing**2 * BYTES_PER_STRIP_CELL
    return estimate_surface(2 * float((size * np.roll(size, 1)).sum()), spacing)


def estimate_surface(area: float, spacing: float) -> float:
    """Bytes that an operation of the exact engine needs at its peak, from the surface in mm²."""
    return area / spacing**2 * BYTES_PER_SURFACE_CELL


def estimate_tiles(area: float, spacing: float, bricks: int) -> float:
    """Bytes that an operation needs at its peak if it is done in tiles of so many bricks, from the surface in mm²."""
    cells = area / spacing**2
    return max(cells * BYTES_PER_TILED_CELL + bricks * BYTES_PER_TILE_BRICK, cells * BYTES_PER_CHECKED_CELL)


def bricks_in_a_tile(area: float, spacing: float) -> int:
    """Give the number of bricks near the surface that a tile may have.

    Raises
    ------
    MemoryLimitError
        If even small tiles need more memory than there is; names the smallest spacing that fits.
    """
    budget = available_memory()
    least = estimate_tiles(area, spacing, _FEWEST_BRICKS)
    if least > budget:
        tiled = max(budget - _FEWEST_BRICKS * BYTES_PER_TILE_BRICK, 1) / BYTES_PER_TILED_CELL
        cells = max(min(tiled, budget / BYTES_PER_CHECKED_CELL), budget / BYTES_PER_SURFACE_CELL)
        raise MemoryLimitError(
            f"a spacing of {spacing:g} mm needs {least / 2**30:.2g} GiB, but {budget / 2**30:.2g} GiB may be used; "
            f"use a spacing of {_rounded_up(math.sqrt(area / cells)):g} mm or more"
        )
    room = budget - area / spacing**2 * BYTES_PER_TILED_CELL
    return int(min(room / BYTES_PER_TILE_BRICK, _MOST_BRICKS))


def available_memory() -> int:
    """Bytes that one operation may take."""
    import psutil

    free = int(psutil.virtual_memory().available * MEMORY_SHARE)
    return free if _memory_limit is None else min(free, _memory_limit)


def limit_memory(limit: float | None) -> None:
    """Let operations of this process take no more than so many bytes; None for most of what is free."""
    global _memory_limit
    _memory_limit = None if limit is None else int(limit)


def grid_over(bounds: ArrayLike, spacing: float, margin: float) -> Grid:
    """Grid over a part's box with room for what an operation builds, ``margin`` mm, and for the contour."""
    return Grid.cover(bounds, spacing, margin=margin + reinit.MARGIN * spacing)


def spacing_for_facets(bounds: ArrayLike, radius: float) -> float:
    """Spacing in mm of results that become solids of facets: the default one, but coarser on large parts.

    Where a print may have millions of triangles, a solid of CAD has some thousand faces. So a result gets about
    ``FACETED_TRIANGLES`` before it is simplified, as long as there are ``FEWEST_CELLS_PER_RADIUS`` cells to a radius.

    Parameters
    ----------
    bounds : (2, 3) array_like
        The part's box in mm.
    radius : float
        In mm.
    """
    low, high = np.asarray(bounds, np.float64)
    size = high - low
    area = 2 * float((size * np.roll(size, 1)).sum())
    default = min(radius / CELLS_PER_RADIUS, float(np.linalg.norm(size)) / CELLS_PER_DIAGONAL)
    coarse = math.sqrt(_TRIANGLES_PER_CELL * area / FACETED_TRIANGLES)
    return max(default, min(coarse, radius / FEWEST_CELLS_PER_RADIUS))


def check_triangles(area: float, spacing: float, *, force: bool) -> None:
    """Refuse a result of more than ``TRIANGLE_LIMIT`` triangles, from the surface area in mm².

    Raises
    ------
    RefusedError
        Unless forced; names the spacing that stays below.
    """
    count = _TRIANGLES_PER_CELL * area / spacing**2
    if count > TRIANGLE_LIMIT and not force:
        fits = _rounded_up(math.sqrt(_TRIANGLES_PER_CELL * area / TRIANGLE_LIMIT))
        raise RefusedError(
            f"a spacing of {spacing:g} mm would give about {count / 1e6:.0f} million triangles (limit "
            f"{TRIANGLE_LIMIT // 10**6} million); use a spacing of {fits:g} mm or more, or --force"
        )


def _rounded_up(value: float) -> float:
    """``value`` rounded up to two significant digits."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(math.ceil(value / unit) * unit)
