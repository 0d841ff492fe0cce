"""Tiles: large parts a piece at a time, so that memory does not grow with their size.

The lattice of the contour is cut into boxes with about the same amount of surface. Of each the result is made in the
box and a halo wide enough that nothing beyond changes it; the triangles of its own cells go to disk. In the end they
are joined by the names of their vertices. The mesh is the one that would come of the whole.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .dual import contoured
from .errors import EmptyResultError
from .implicit import FloatArray, Implicit, polished
from .mesh import IntArray, Mesh
from .parallel import Progress, no_progress
from .regions import Region, box_region
from .sparse import lattice, near_bricks
from .vertex_names import Names, bricks_of, hashed

#: Bricks of 8 cells around a tile that are contoured too: the outermost is left out by the contour, and vertices move
#: and slivers collapse in no more than one of the others.
HALO = 3

#: Makes the result from where it is needed.
Make = Callable[[Region], Implicit]


@dataclass(frozen=True, eq=False)
class Tile:
    """Box of bricks, from ``low`` (3,) to those before ``high`` (3,)."""

    low: IntArray
    high: IntArray


def tiles_over(shape: Implicit, spacing: float, most: int) -> list[Tile]:
    """Boxes that fill the lattice, each with at most so many bricks near the surface of a shape.

    Parameters
    ----------
    shape : Implicit
        With a Lipschitz constant, and the bounds of what is to be contoured.
    spacing : float
        In mm.
    most : int
        A tile is halved along its longest side until it has no more, or is only twice as wide as its halo.
    """
    near, counts = near_bricks(shape, spacing)
    return _halved(Tile(np.zeros(3, np.int32), counts.astype(np.int32)), near, most)


def _halved(tile: Tile, near: IntArray, most: int) -> list[Tile]:
    size = tile.high - tile.low
    axis = int(size.argmax())
    if len(near) <= most or size[axis] < 4 * HALO:
        return [tile]
    room = 2 * HALO
    place = int(np.clip(np.median(near[:, axis]) + 1, tile.low[axis] + room, tile.high[axis] - room))
    middle_low, middle_high = tile.low.copy(), tile.high.copy()
    middle_low[axis] = middle_high[axis] = place
    first = near[:, axis] < place
    one, other = Tile(tile.low, middle_high), Tile(middle_low, tile.high)
    return [*_halved(one, near[first], most), *_halved(other, near[~first], most)]


def contour_in_tiles(
    make: Make,
    tiles: Sequence[Tile],
    bounds: Implicit,
    spacing: float,
    *,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Mesh:
    """Contour a result that is made a tile at a time.

    Parameters
    ----------
    make : callable
        Makes the result, given the Region in which it is needed.
    tiles : sequence of Tile
        They fill the lattice.
    bounds : Implicit
        With the bounds of the result.
    spacing : float
        In mm.
    threads : int, optional
        Default: all cores.
    progress : callable
        Called as ``progress("tiles", fraction)`` before each tile; may raise to cancel, which deletes what was done.

    Returns
    -------
    Mesh
        Closed; the vertices in the order of the lattice.

    Raises
    ------
    EmptyResultError
        If there is no surface.
    """
    origin = lattice(bounds, spacing)[1]
    with tempfile.TemporaryDirectory(prefix="cad-implicit-", ignore_cleanup_errors=True) as folder:
        done: list[Path] = []
        for number, tile in enumerate(tiles):
            progress("tiles", number / len(tiles))
            piece = _piece(make, tile, origin, spacing, threads, progress)
            if piece is not None:
                done.append(Path(folder) / f"{number}.npz")
                np.savez(done[-1], position=piece.position, faces=piece.faces, names=piece.names)
            del piece
        progress("tiles", 1.0)
        if not done:
            raise EmptyResultError("nothing is left: the result has no surface at this spacing")
        return _joined(done)


@dataclass(frozen=True, eq=False)
class _Piece:
    """Triangles of a tile: vertices (V, 3), faces (F, 3) and the vertices' names (V,)."""

    position: FloatArray
    faces: IntArray
    names: Names


def _piece(
    make: Make, tile: Tile, origin: FloatArray, h: float, threads: int | None, progress: Progress
) -> _Piece | None:
    """Triangles that belong to a tile; None if there are none."""
    region = box_region(origin - h / 2, 8 * h, tile.low - HALO, tile.high + HALO)
    shape = make(region)
    polish = partial(polished, shape) if hasattr(shape, "polished") else None
    options: Any = {"threads": threads, "progress": progress, "polish": polish, "region": region}
    try:
        position, faces, names = contoured(shape, h, **options)
    except EmptyResultError:
        return None
    unnamed = names < 0
    brick = np.floor((position - origin) / (8 * h)).astype(np.int32)
    brick[~unnamed] = bricks_of(names[~unnamed])
    names = np.where(unnamed, hashed(position), names)
    own = np.asarray(((brick >= tile.low) & (brick < tile.high)).all(axis=1))
    corner = names[faces].argmax(axis=1)
    faces = faces[own[faces[np.arange(len(faces)), corner]]]
    if len(faces) == 0:
        return None
    used = np.zeros(len(position), np.bool_)
    used[faces] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    return _Piece(position[used], number[faces], names[used])


def _joined(done: Sequence[Path]) -> Mesh:
    """Mesh of the pieces on disk."""
    loaded = [np.load(path)["names"] for path in done]
    starts = np.cumsum([0, *(len(names) for names in loaded)])
    names, number = np.unique(np.concatenate(loaded), return_inverse=True)
    number = number.astype(np.int32)
    del loaded
    position, faces = np.empty((len(names), 3)), []
    for path, start, stop in zip(done, starts[:-1], starts[1:], strict=True):
        with np.load(path) as piece:
            position[number[start:stop]] = piece["position"]
            faces.append(number[start:stop][piece["faces"]])
    return Mesh(position, np.concatenate(faces))
