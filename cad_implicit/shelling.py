"""Shells and infills: a part carved out to a wall, and the hollow filled with a lattice (section 5.1 of the paper).

Both take what :func:`cad_implicit.offset` takes, with the same options, by the same two engines. ``exact`` subtracts
the exact inner offset; its walls are as thick as asked to within the error of the contour. ``reinit`` subtracts the
offset of the re-distanced field by an R-function on the grid, as the paper does.

Not promised: a hollow where the part is thinner than twice the wall; it stays solid there.
"""

from __future__ import annotations

import warnings
from typing import Literal, get_args

import numpy as np

from . import exact, sizing
from .booleans import Boolean
from .errors import GeometryWarning, RadiusError
from .field import Field
from .grading import Size, as_length, constant
from .grid import Grid
from .implicit import Implicit
from .lattice import Crystal, slab_lattice, strut_lattice
from .minimal import Minimal, tpms
from .open_faces import Near, near_kept_faces
from .ops import Call, Shape, as_implicit
from .ops import Side as Face
from .parallel import Progress, no_progress
from .sizing import Engine

#: On which side of the surface the wall lies; "both" puts half of it on each.
Side = Literal["inward", "outward", "both"]

#: What fills a hollow: a minimal surface, struts, or slabs: square rods ("rods") or closed cells ("cells").
Filling = Minimal | Crystal | Literal["rods", "cells"]

#: Nodes along each side of the grid that looks for a hollow, and rounds in which cells that may hold one are halved.
_HOLLOW_NODES, _HOLLOW_ROUNDS = 24, 4

#: Walls thinner than this many spacings may be torn: the shell of a turned box has holes from 1.2 down by ``reinit``,
#: from 0.9 down by ``exact``; the wall of a gyroid from 0.9 down.
_RESOLVED = 1.5

#: Spacings outside the part up to which its lattice is sampled: where neither reaches zero, values need not be right.
_BEYOND = 2.0

#: Nodes at which a lattice is evaluated at a time.
_CHUNK = 1 << 17

#: The default spacing of an infill is that of this many times the radius of a fillet: three cells to a wall.
RADIUS_PER_WALL = sizing.CELLS_PER_RADIUS / 3.0


def shell(
    shape: Shape,
    thickness: float,
    *,
    side: Side = "inward",
    open: str | None = None,
    spacing: float | None = None,
    tolerance: float | None = None,
    engine: Engine | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Implicit:
    """Carve a part out to a wall of constant thickness (section 5.1 of the paper).

    Parameters
    ----------
    shape : Implicit, Mesh or part
    thickness : float
        Of the wall in mm.
    side : "inward", "outward" or "both"
        Where the wall lies: within the part, around it, or half and half.
    open : str, optional
        Faces of a B-rep part that get no wall, by a selector such as ``">Z"`` (:mod:`cad_implicit.cad.selectors`): the
        cavity runs through them. Inward only.
    spacing, tolerance, engine, threads, progress
        As for :func:`cad_implicit.offset`.

    Raises
    ------
    RadiusError
        If the thickness is not positive and finite, or leaves no hollow.
    SelectorError
        If the part has no faces to open, or the selector cannot be read or opens none, or all.
    SpacingError, MemoryLimitError, OpenMeshError
        With what was wrong, the figures, and what to do.

    Warns
    -----
    GeometryWarning
        If the wall is too thin for the spacing.

    Examples
    --------
    >>> from cad_implicit import contour, sphere
    >>> hollow = contour(shell(sphere(5), 1.0, spacing=0.5))
    >>> hollow.components, bool(abs(hollow.volume - 4 / 3 * np.pi * (5**3 - 4**3)) < 2)
    (1, True)
    """
    if side not in get_args(Side):
        raise ValueError(f"side must be one of {', '.join(get_args(Side))}, not {side!r}")
    wall = sizing.positive("the wall's thickness", thickness)
    inward, outward = {"inward": (wall, 0.0), "outward": (0.0, wall), "both": (wall / 2, wall / 2)}[side]
    if open is not None and side != "inward":
        raise ValueError(f'faces can be left open by walls that lie inward, not "{side}"')
    source = as_implicit(shape)
    if open is not None:
        near = near_kept_faces(source, open, wall, threads=threads)
        _check_room(source, wall, near)
        call = Call(source, wall, 0.0, False, spacing, tolerance, engine, threads, progress)
        _check_resolved(wall, call.spacing)
        return _opened(call, near)
    _check_room(source, inward)
    call = Call(source, wall, outward, False, spacing, tolerance, engine, threads, progress)
    _check_resolved(wall, call.spacing)
    return _carved(call, inward, outward, None)


def infill(
    shape: Shape,
    cell: Size,
    wall: Size,
    *,
    kind: Filling | Implicit = "gyroid",
    skin: float | None = None,
    spacing: float | None = None,
    tolerance: float | None = None,
    engine: Engine | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Implicit:
    """Carve a part out to a skin and fill the hollow with a lattice (section 5.1 of the paper).

    Parameters
    ----------
    shape : Implicit, Mesh or part
    cell : float or callable
        Period of the lattice in mm; :func:`cad_implicit.graded` makes it denser near a surface. Not graded for struts.
    wall : float or callable
        Thickness of the lattice's walls, or diameter of its struts, in mm.
    kind : str or Implicit
        "gyroid", "schwarz_p", "diamond" or "iwp" (:func:`cad_implicit.tpms`), "cubic", "bcc", "fcc" or "octet"
        (:func:`cad_implicit.strut_lattice`), "rods" or "cells" (:func:`cad_implicit.slab_lattice`); or a lattice of
        your own, an Implicit, for which ``wall`` tells how fine it is.
    skin : float, optional
        Thickness of the shell in mm; that of the walls by default, and 0 for none.
    spacing : float, optional
        Grid spacing in mm; by default a third of the walls or a hundredth of the diagonal, whichever is less.
    tolerance, engine, threads, progress
        As for :func:`cad_implicit.offset`.

    Raises
    ------
    RadiusError
        If a size is not positive and finite, or the wall too thick for its cell, or the skin leaves no hollow.
    ValueError
        If the kind is none of those, or the skin is not given beside graded walls.
    SpacingError, MemoryLimitError, OpenMeshError
        With what was wrong, the figures, and what to do.

    Warns
    -----
    GeometryWarning
        If walls are too thin for the spacing.
    """
    filling = _lattice(kind, cell, wall)
    walls = constant(as_length("the wall", wall))
    depth = walls if skin is None else float(skin)
    if depth is None:
        raise ValueError("give the skin's thickness, since that of the walls is graded")
    if depth != 0:
        sizing.positive("the skin's thickness", depth)
    source = as_implicit(shape)
    _check_room(source, depth)
    diagonal = float(np.linalg.norm(source.bounds[1] - source.bounds[0]))
    thinnest = min((x for x in (walls, depth) if x), default=diagonal / sizing.CELLS_PER_DIAGONAL)
    radius = RADIUS_PER_WALL * thinnest
    call = Call(source, radius, 0.0, False, spacing, tolerance, engine, threads, progress)
    call.radius = max(call.radius, depth)  # distances are needed that far
    _check_resolved(thinnest, call.spacing)
    return _carved(call, depth, 0.0, filling)


def _carved(call: Call, inward: float, outward: float, filling: Implicit | None) -> Implicit:
    """Part grown outward, less the hollow: its core ``inward`` mm below the surface, but for a filling.

    Without a depth the filling itself, in the part.
    """
    faces: tuple[Face, ...] = ("inside", "outside") if inward and outward else ("outside",) if outward else ("inside",)
    if call.engine == "reinit":
        return carved(call.field(faces, check=False), inward, outward, filling)
    part = call.distance(faces, check=False)
    outer_part: Implicit = exact.Shifted(part, outward) if outward else part
    if inward or outward:
        core: Implicit = exact.Shifted(part, -inward) if inward else part
        if filling is not None:
            core = Boolean(core, filling, union=False, second_sign=-1.0)
        result = Boolean(outer_part, core, union=False, second_sign=-1.0)
    else:
        assert filling is not None
        result = Boolean(part, filling, union=False)
    result.spacing = call.spacing
    return result


def _opened(call: Call, near: Near) -> Implicit:
    """Part as far as it is near the faces that are kept."""
    if call.engine == "reinit":
        phi = call.field(("inside",), check=False)
        return _less(phi, _negative(_sampled_inside(near, phi, 0.0)))
    result = Boolean(call.distance(("inside",), check=False), near, union=False)
    result.spacing = call.spacing
    return result


def carved(phi: Field, inward: float, outward: float = 0.0, filling: Implicit | None = None) -> Field:
    """Carve out a field of distances: a wall ``inward`` mm deep and ``outward`` mm high, and a filling in the hollow.

    Without a depth, the filling itself within the part.

    Raises
    ------
    RadiusError
        If nothing lies deeper than the wall.
    """
    if not bool((phi.values > inward).any()):
        raise _no_hollow(inward)
    hollow = phi.shifted(-inward)
    if filling is not None:
        lattice = _sampled_inside(filling, phi, inward)
        hollow = _less(hollow, lattice) if inward else _negative(lattice)
    return _less(phi.shifted(outward), hollow)


def _less(first: Field, second: Field) -> Field:
    """First field without the second, by the R-function of the system R_1, which keeps distances near the surface."""
    return Field(first.grid, np.minimum(first.values, -second.values), first.bounds, lipschitz=1.0)


def _sampled_inside(filling: Implicit, phi: Field, skin: float) -> Field:
    """Lattice on the nodes of a part's distance where the result depends on it; elsewhere a value that changes nothing.

    Up to half the skin's depth the nearest surface is the part's own; without a skin, it is outside.
    """
    within = phi.values > (skin / 2 if skin else -_BEYOND * max(phi.grid.spacing))
    low, high = phi.grid.bounds
    nothing = float(np.linalg.norm(high - low)) * (-1 if skin else 1)
    values, axes = np.full(phi.grid.size, nothing, phi.values.dtype), phi.grid.axes()
    which = np.flatnonzero(within)
    for start in range(0, len(which), _CHUNK):
        nodes = which[start : start + _CHUNK]
        places = np.unravel_index(nodes, phi.grid.shape)
        values[nodes] = filling(np.stack([axis[place] for axis, place in zip(axes, places, strict=True)], axis=1))
    return Field(phi.grid, values.reshape(phi.grid.shape), phi.bounds)


def _negative(field: Field) -> Field:
    return Field(field.grid, -field.values, field.bounds)


def _lattice(kind: Filling | Implicit, cell: Size, wall: Size) -> Implicit:
    """Lattice by its name, or the one that is given."""
    if isinstance(kind, Implicit):
        return kind
    if kind in get_args(Minimal):
        return tpms(kind, cell, wall)  # type: ignore[arg-type]
    if kind in get_args(Crystal):
        if callable(cell):
            raise ValueError(f"the cell of {kind} struts must be a number; only minimal surfaces and slabs are graded")
        return strut_lattice(kind, cell, wall)  # type: ignore[arg-type]
    if kind not in ("rods", "cells"):
        names = ", ".join((*get_args(Minimal), *get_args(Crystal), "rods", "cells"))
        raise ValueError(f"kind must be one of {names}, not {kind!r}")
    return slab_lattice(cell, wall, closed=kind == "cells")


def _check_room(source: Implicit, depth: float, near: Near | None = None) -> None:
    """Raise RadiusError if certainly nothing lies deeper than a wall of that depth, along all faces or some."""
    low, high = source.bounds
    thinnest = float((high - low).min())
    if near is None and not depth < thinnest / 2:
        raise RadiusError(
            f"a wall of {depth:g} mm leaves no hollow in a part {thinnest:.6g} mm thin; use a thinner one"
        )
    if not (depth and source.exact_inside and np.isfinite(source.bounds).all()):
        return
    hollow = exact.Shifted(source, -depth) if near is None else Boolean(source, near, union=False, second_sign=-1.0)
    grid = Grid.cover(source.bounds, shape=_HOLLOW_NODES)
    places, step = grid.nodes(), np.array(grid.spacing)
    corners = np.stack(np.meshgrid(*[[-0.25, 0.25]] * source.dim, indexing="ij"), axis=-1).reshape(-1, source.dim)
    for _ in range(_HOLLOW_ROUNDS):
        value = hollow(places)
        if value.max() > 0:
            return
        places = places[value + np.linalg.norm(step) / 2 > 0]
        places = (places[:, None] + corners * step).reshape(-1, source.dim)
        step = step / 2
        if len(places) == 0:
            break
    raise _no_hollow(depth)


def _no_hollow(depth: float) -> RadiusError:
    return RadiusError(
        f"a wall of {depth:g} mm leaves no hollow: the part is nowhere more than {2 * depth:g} mm thick; "
        "use a thinner wall"
    )


def _check_resolved(wall: float, spacing: float) -> None:
    if wall < _RESOLVED * spacing:
        message = (
            f"walls of {wall:g} mm are too thin for a spacing of {spacing:.3g} mm and may be torn; "
            f"use a spacing of {wall / _RESOLVED:.3g} mm or less"
        )
        warnings.warn(message, GeometryWarning, stacklevel=3)
