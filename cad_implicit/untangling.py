"""The triangles of a dual contour without self-intersections: where triangles meet, vertices go back to their cells.

A vertex on a crease may lie outside its cell, the diagonal of a quad may leave the cells around it, and collapsing a
sliver moves an edge: now and then triangles run through each other. Those are found, and each of their vertices takes
the next of these steps, until none are left:

1. it moves towards the middle of its piece of surface until it is near its cell;
2. until it is in it, and slivers around it stay;
3. its quads are cut where they pass from cell to cell, at the points where the grid's edges cross the surface;
4. it moves to the middle of its piece of surface.

From step 3 on the triangles around a vertex are a cone inside its cell over a closed curve on the cell's border, which
nothing from other cells can run through; compare Ju and Udeshi 2006, "Intersection-free contouring on an octree grid".
So the steps end, but for cells with several pieces of surface. Nothing changes farther away, and the mesh stays closed.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .implicit import FloatArray
from .kernels import crossings, slivers
from .kernels import dual_contour as mesh_kernels
from .kernels.intersections import intersecting
from .kernels.sagitta import turn_edges
from .sparse import Bricks
from .surface_cells import Cells

Faces = NDArray[np.int32]

#: The steps of a vertex.
_NEAR_CELL, _IN_CELL, _CUT, _MIDDLE = 1, 2, 3, 4

#: Distance in spacings from its cell that a vertex keeps after the first step. With 0 for this, 80 sharp vertices of 16
#: runs move by more than 0.02 spacings, with 0.25 or 0.5 it is 66 and 67.
_NEAR = 0.25

#: Most rounds, and the one from which on the neighbours are cut too. Of the runs of ``validation.runs``, 16 need any,
#: at most six; 360 fields of noise need at most eight.
_ROUNDS = 24
_GROWING = 12

#: After the first round only the quads within so many rings of vertices that took a step are looked at, and tangles
#: within so many rings, until there are none; then what came of the latter replaces what was there. With
#: all quads looked at once more an opening of 221,000 vertices with one tangle takes 2.12 s, so it takes 1.99 s.
_RINGS = 6
_TRUSTED_RINGS = 2

#: Edges that miss a curved face by more than this, in spacings, are turned if that helps. With 2e-4 errors were as
#: large, but where two cylinders cross half of the triangles had angles below 8 degrees.
_CURVED = 0.004

#: Vertices in their cells keep this distance in spacings from its faces, and points on its edges from its corners, so
#: that no triangle is without area.
_CLEARANCE = 0.02


@dataclass(frozen=True, eq=False)
class Pieces:
    """What the triangles are made of.

    Attributes
    ----------
    foot, normal : (E, 3) float64
        Point of the surface near each crossed edge, and the outward unit normal there.
    position, smooth : (V, 3) float64
        Vertices of the cells, then those on doubled mesh edges; their normals, zero for sharp ones.
    rank : (V,) int8
        Above 1 for sharp vertices.
    quads : (E, 4) int32
        Vertices around each crossed edge, or some of them at the border of a region.
    whole : (E,) bool
        Quads of which all vertices are there.
    between : (E, 4) int32 or (0, 4) int32
        Vertex on each side of the quads, or -1; empty if there are none.
    """

    bricks: Bricks
    cells: Cells
    foot: FloatArray
    normal: FloatArray
    position: FloatArray
    smooth: FloatArray
    rank: NDArray[np.int8]
    quads: NDArray[np.int32]
    whole: NDArray[np.bool_]
    between: NDArray[np.int32]


def triangulate(
    pieces: Pieces, threads: Callable[[int], AbstractContextManager[None]]
) -> tuple[FloatArray, Faces, FloatArray, NDArray[np.int8], NDArray[np.int64]]:
    """Triangulate the quads, remove slivers, and see to it that no triangles run through each other.

    Parameters
    ----------
    pieces : Pieces
    threads : callable
        Gives the context of parallel kernels over so many items.

    Returns
    -------
    vertices : (N, 3) float64
        The used ones.
    faces : (F, 3) int32
    normals : (N, 3) float64
        Outward unit normals of vertices on smooth faces, zero for others.
    rank : (N,) int8
        1 for vertices on smooth faces, more for those on creases, ``slivers.FIXED`` for those off the surface.
    origin : (N,) int64
        Number of each vertex among those of the pieces; of the middle of a quad, the quad's number plus that of those.
    """
    p = pieces
    step = np.zeros(len(p.position), np.int8)
    border = np.zeros(len(step), np.bool_)
    border[p.quads[~p.whole]] = True
    everywhere = _Zone(np.flatnonzero(p.whole), border, np.ones(len(step), np.bool_))
    zone = everywhere
    unmoved = tidy = _tidy_triangles(p, step, zone, threads)
    for number in range(_ROUNDS):
        used = _tangled(p, tidy, threads)
        used = used[zone.trusted[used]]
        if len(used) == 0 and zone is not everywhere:
            tidy = _replaced(p, step, zone, unmoved, tidy) or _tidy_triangles(p, step, everywhere, threads)
            zone = everywhere
            used = _tangled(p, tidy, threads)
        if len(used) == 0 or number == _ROUNDS - 1:
            break
        step[used] = np.minimum(step[used] + 1, _MIDDLE)
        if number >= _GROWING:
            around = np.unique(p.quads[np.isin(p.quads, used).any(axis=1)])
            step[around] = np.maximum(step[around], _CUT)
        zone = everywhere if number == _ROUNDS - 2 else _zone_around(p, step > 0, border)
        tidy = _tidy_triangles(p, step, zone, threads)
    vertices, faces, kept = slivers.compact(tidy.position, tidy.faces)
    origin = np.concatenate([np.arange(len(p.position)), len(p.position) + tidy.centres])
    return vertices, faces, tidy.normals[kept], tidy.rank[kept], origin[kept]


@dataclass(frozen=True, eq=False)
class _Tidy:
    """Triangles (F, 3), without slivers, and the quad (F,) that each one came from; their vertices.

    These are the ones of the pieces and then one in each of the quads ``centres`` (C,): positions (N, 3), normals
    (N, 3) and ranks (N,).
    """

    position: FloatArray
    faces: Faces
    quads: NDArray[np.int64]
    normals: FloatArray
    rank: NDArray[np.int8]
    centres: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Zone:
    """Some of the quads (N,), which vertices (V,) others share, and at which (V,) tangles count."""

    quads: NDArray[np.int64]
    border: NDArray[np.bool_]
    trusted: NDArray[np.bool_]


def _zone_around(p: Pieces, start: NDArray[np.bool_], border: NDArray[np.bool_]) -> _Zone:
    """Quads within some rings of vertices."""
    own = p.cells.vertices
    inner, trusted = start.copy(), start.copy()
    for ring in range(_RINGS):
        chosen = np.unique(np.flatnonzero(inner[p.quads]) // 4)
        closed = inner.copy()
        inner[p.quads[chosen]] = True
        if ring == _TRUSTED_RINGS:
            trusted = closed
    closed[own:] = True
    trusted[own:] = True
    return _Zone(chosen[p.whole[chosen]], ~closed | border, trusted)


def _replaced(p: Pieces, step: NDArray[np.int8], zone: _Zone, unmoved: _Tidy, moved: _Tidy) -> _Tidy | None:
    """Put what came of a zone into what all quads come to if no vertex takes a step.

    None if these do not fit: something was changed farther away for it.
    """
    own = len(p.position)
    inner = np.zeros(len(p.quads), np.bool_)
    inner[zone.quads] = zone.trusted[p.quads[zone.quads]].any(axis=1)
    centres = np.union1d(unmoved.centres, moved.centres)
    faces, left = [], []
    for tidy in (unmoved, moved):
        number = np.concatenate([np.arange(own), own + np.searchsorted(centres, tidy.centres)]).astype(np.int32)
        faces.append(number[tidy.faces])
        left.append(inner[tidy.quads] == (tidy is moved))
    if not _same_border(faces[0][~left[0]], faces[1][left[1]], own + len(centres)):
        return None
    position, normals, rank = (
        np.concatenate([new[:own], np.zeros((len(centres), *new.shape[1:]), new.dtype)])
        for new in (moved.position, moved.normals, np.where(step > 0, slivers.FIXED, unmoved.rank[:own]))
    )
    for tidy in (unmoved, moved):
        at = own + np.searchsorted(centres, tidy.centres)
        position[at], normals[at], rank[at] = tidy.position[own:], tidy.normals[own:], tidy.rank[own:]
    quads = np.concatenate([unmoved.quads[left[0]], moved.quads[left[1]]])
    return _Tidy(position, np.concatenate([faces[0][left[0]], faces[1][left[1]]]), quads, normals, rank, centres)


def _same_border(one: Faces, other: Faces, count: int) -> bool:
    """Whether two sets of triangles (N, 3) of ``count`` vertices have the same open sides."""
    start = np.concatenate([one.ravel(), np.roll(other, -1, axis=1).ravel()]).astype(np.int64)
    end = np.concatenate([np.roll(one, -1, axis=1).ravel(), other.ravel()]).astype(np.int64)
    _, side = np.unique(np.minimum(start, end) * count + np.maximum(start, end), return_inverse=True)
    return not np.bincount(side, np.sign(end - start)).any()


def _tangled(p: Pieces, tidy: _Tidy, threads: Callable[[int], AbstractContextManager[None]]) -> NDArray[np.int64]:
    """Vertices of the triangles that run through others; instead of a quad's centre, the vertices of the quad."""
    with threads(len(tidy.faces)):
        used = np.unique(tidy.faces[intersecting(tidy.position, tidy.faces, p.bricks.spacing)])
    own = len(p.position)
    return np.unique(np.concatenate([used[used < own], p.quads[tidy.centres[used[used >= own] - own]].ravel()]))


def _tidy_triangles(
    p: Pieces, step: NDArray[np.int8], zone: _Zone, threads: Callable[[int], AbstractContextManager[None]]
) -> _Tidy:
    """Triangulate some quads."""
    cut = np.any(step[p.quads[zone.quads]] >= _CUT, axis=1)
    fanned = cut | np.any(p.between[zone.quads] >= 0, axis=1) if len(p.between) else cut
    plain, special, cut = zone.quads[~fanned], zone.quads[fanned], cut[fanned]
    position, edge_points = _moved(p, step)
    curved = _CURVED * p.bricks.spacing
    rank = np.where(step >= _MIDDLE, np.int8(1), p.rank)
    with threads(len(plain)):
        faces, facing = mesh_kernels.triangles(p.quads[plain], p.normal[plain], p.smooth, position, rank, curved)
    rank[(step >= _IN_CELL) | zone.border] = slivers.FIXED
    quads = np.repeat(plain, 2)
    if len(special):
        fans, source = _fans(p, step, special, cut)
        centre = np.where(cut[:, None], edge_points[special], p.foot[special])
        position = np.concatenate([position, centre])
        rank = np.concatenate([rank, np.where(cut, slivers.FIXED, 1).astype(np.int8)])
        faces = np.concatenate([faces, fans])
        facing = np.concatenate([facing, p.normal[special][source]])
        quads = np.concatenate([quads, special[source]])
    left = slivers.remove_slivers(position, faces, facing, rank, p.bricks.spacing)
    faces, quads = faces[left], quads[left]
    normals = np.where((step == 0)[:, None], p.smooth, 0.0)
    if len(special):
        normals = np.concatenate([normals, np.where(cut[:, None], 0.0, p.normal[special])])
    rank[: len(step)][step > 0] = slivers.FIXED
    with threads(len(faces)):
        turn_edges(position, faces, normals, rank, curved)
    return _Tidy(position, faces, quads, normals, rank, special)


def _moved(p: Pieces, step: NDArray[np.int8]) -> tuple[FloatArray, FloatArray]:
    """Positions (V, 3) of the vertices after their steps, and points (E, 3) on the grid's edges around those moved."""
    at_edges = p.foot.copy()
    if not step.any():
        return p.position.copy(), at_edges
    b, h = p.bricks, p.bricks.spacing
    corners = np.concatenate([p.quads, p.between], axis=1) if len(p.between) else p.quads
    near = np.flatnonzero(((corners >= 0) & (step[corners] > 0)).any(axis=1))
    code = p.cells.edges[near]
    axis = (code >> 9) % 3
    start = crossings.edge_points(code, np.zeros(len(code)), b.blocks, b.origin, h)
    at = ((p.foot[near] - start) / h)[np.arange(len(code)), axis]
    at = np.clip(at, _CLEARANCE, 1 - _CLEARANCE)
    at_edges[near] = crossings.edge_points(code, at, b.blocks, b.origin, h)

    position = p.position.copy()
    middle = np.zeros_like(position)
    count = np.zeros(len(position))
    for column in corners.T:
        some = near[column[near] >= 0]
        np.add.at(middle, column[some], at_edges[some])
        np.add.at(count, column[some], 1)
    own = p.cells.vertices
    extra = own + np.flatnonzero(step[own:])
    position[extra] = middle[extra] / count[extra, None]

    moved = np.flatnonzero(step[:own])
    low, high = _cell_boxes(p, moved)
    centre = np.clip(middle[moved] / count[moved, None], low, high)
    around = np.where(step[moved] > _NEAR_CELL, 0.0, _NEAR * h)[:, None]
    low, high = low - around, high + around
    way = position[moved] - centre
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(way > 0, (high - centre) / way, np.where(way < 0, (low - centre) / way, np.inf))
    share = np.where(step[moved] >= _MIDDLE, 0.0, np.minimum(room.min(axis=1), 1.0))
    position[moved] = centre + share[:, None] * way
    return position, at_edges


def _cell_boxes(p: Pieces, vertices: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """Low and high corners (N, 3) of the cells of vertices, with the clearance."""
    b = p.bricks
    code = p.cells.cells[np.searchsorted(p.cells.tables[1], vertices, side="right") - 1]
    place = 8 * b.blocks[code >> 9] + np.stack([code >> 6 & 7, code >> 3 & 7, code & 7], axis=1)
    low = b.origin + b.spacing * place
    return low + _CLEARANCE * b.spacing, low + (1 - _CLEARANCE) * b.spacing


def _fans(
    p: Pieces, step: NDArray[np.int8], special: NDArray[np.int64], cut: NDArray[np.bool_]
) -> tuple[Faces, NDArray[np.int64]]:
    """Triangles (T, 3) around the centres of quads, and the number (T,) in ``special`` of the quad of each one.

    On the side between two quads that are ``cut`` and a vertex that is to be cut, the two triangles that share the side
    are replaced by two that share the edge from centre to centre.
    """
    quads = p.quads[special]
    source = np.repeat(np.arange(len(special)), 4)
    start, end = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    between = p.between[special].ravel() if len(p.between) else np.full(len(source), -1, np.int32)
    centre = (len(p.position) + source).astype(np.int32)
    turned = cut[source] & (between < 0) & ((step[start] >= _CUT) | (step[end] >= _CUT))
    key = np.minimum(start, end).astype(np.int64) * len(p.position) + np.maximum(start, end)
    order = np.flatnonzero(turned)
    order = order[np.argsort(key[order], kind="stable")]
    twin = np.flatnonzero(key[order[:-1]] == key[order[1:]])
    one, other = order[twin], order[twin + 1]
    whole = between < 0
    whole[one] = whole[other] = False
    halved = between >= 0
    parts = [
        (start[whole], end[whole], centre[whole], source[whole]),
        (start[halved], between[halved], centre[halved], source[halved]),
        (between[halved], end[halved], centre[halved], source[halved]),
        (start[one], centre[other], centre[one], source[one]),
        (end[one], centre[one], centre[other], source[other]),
    ]
    fans = np.concatenate([np.stack(part[:3], axis=1) for part in parts])
    return fans, np.concatenate([part[3] for part in parts])
