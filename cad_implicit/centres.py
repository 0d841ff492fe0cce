"""Ball centres that a contour cannot see: where a ball fits so barely that the room for its centre is thinner than h.

The room at a point is its distance from the part less the ball's radius; centres have room zero or more, and S is their
surface. Where the room stays below 0.87 h (a wall twice as thick as the radius, a hole hardly wider than the ball, a
cube as wide as the ball) S falls between the nodes of a grid of spacing h. There S is a sheet, a line or a point, or
encloses next to nothing.

No centre is nearer to a point than its lack of room. So if the contour of S is as near as that, nothing is missing: one
look at a grid of 2 h finds out wherever S is regular. Elsewhere the nearest centre is found by projection
(:mod:`cad_implicit.polish`); if it is nearer than the contour, then the nodes around are projected too, and their
images are joined as the nodes are. Distances are all that is asked of S, so that these pieces need not be closed.
"""

from __future__ import annotations

import math
from contextlib import suppress
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import parallel
from .distance import Surface
from .dual import dual_contour
from .errors import EmptyResultError
from .grid_images import joined_images, nodes_of
from .implicit import Affine, FloatArray, Implicit, polished
from .kernels.halfspaces import nearest_feasible_many
from .mesh import IntArray, Mesh
from .parallel import Progress, no_progress
from .polish import polish_centres
from .regions import Region
from .sparse import lattice

#: Half the diagonal of a cube over its side, and slack for rounding.
_HALF = math.sqrt(3) / 2 * (1 + 1e-6)

#: The contour is at fault if a centre is nearer than it by more than this many spacings: the draft of S is off by its
#: sagitta, 0.2 spacings where S has a radius of one spacing. Gaps in a sheet that this overlooks are 1.5 spacings wide,
#: and change distances by 0.05 spacings at a radius of 6. …
_AT_FAULT = 0.25

#: … Then whatever is nearer by this is added. With 0.1 for both, a bracket with a hole wider than the ball by 1.4
#: spacings took 15 % longer, and rough distances in such holes came to 0.1 spacings instead of 0.2.
_NEARER = 0.1

#: Balls smaller than the given one by this many spacings are looked for: at first against rounding; then, where they
#: do not fit, by what the facets of rods and holes take, tessellated to 0.005 spacings. (A pushed ball counts as
#: fitting up to twice this.)
_SMALLER = (5e-5, 0.01)

#: The same for polished values, where they miss what the pieces fill by more than this many spacings, …
_TIGHT = (1e-3, 0.01)
_UNFILLED = 0.003

#: (by no more than this: what is left where the polish finds nothing, and what chords are off by), …
_FARTHEST = 0.15

#: … or are those of the pieces, which are made of chords, to so many.
_ROUGH = 1e-6

#: Looks for centres nearer than the contour end after so many, or where the ball fits but for so many spacings.
_LOOKS = 6
_NEARLY = 0.04

#: Images of the nodes count within this many spacings: a layer of cells around a plane in any direction.
_LAYER = 0.9

#: Middles of pieces between images lack at most so much room, in spacings.
_SAGITTA = 0.05

#: Width in spacings around a block of what a region must hold, so that its contour is there as far as is looked at: two
#: bricks of 8 on each side.
_INNER = 34

#: Points evaluated at a time.
_BATCH = 1 << 19


class Centres:
    """All centres at which a ball fits outside a part, and touches it.

    Parameters
    ----------
    parent : Implicit
        Exact distance to the part in mm, positive inside.
    offset : Implicit
        The same, grown by the radius, or its complement: whichever is bounded.
    radius : float
        Of the ball in mm.
    spacing : float
        Grid spacing in mm.
    threads : int, optional
        Default: all cores.
    progress : callable
        May raise to cancel.
    region : Region, optional
        Where centres are looked for, but for its border of some bricks of 8 cells.

    Attributes
    ----------
    surface : Surface
        The surface that they make.

    Raises
    ------
    EmptyResultError
        If the ball fits nowhere; in a region that is no error.
    """

    def __init__(
        self,
        parent: Implicit,
        offset: Implicit,
        radius: float,
        spacing: float,
        *,
        threads: int | None = None,
        progress: Progress = no_progress,
        region: Region | None = None,
    ) -> None:
        self.radius, self.spacing = radius, spacing
        watched = _Watched(offset, spacing, -1.0 if parent.bounded else 1.0)
        contoured: Surface | None = None
        with suppress(EmptyResultError):
            mesh = dual_contour(watched, spacing, threads=threads, progress=progress, draft=True, region=region)
            contoured = Surface(mesh, threads=threads, bounds=watched.bounds)
        search = _Search(parent, radius, spacing, watched, contoured, threads, progress)
        blocks = search.missing_blocks(region)
        thin = search.pieces(nodes_of(blocks)) if len(blocks) else None
        added = None if thin is None else Surface(thin, threads=threads, bounds=watched.bounds)
        found = _Both(contoured, added) if contoured and added else contoured or added
        if found is None and region is not None:
            found = _Far(float(np.linalg.norm(offset.bounds[1] - offset.bounds[0])))
        if found is None:
            raise EmptyResultError(f"a ball of radius {radius:g} mm fits nowhere")
        self.surface: Surface = found
        self._search = search
        self._added = added

    def fill_tight(self, points: FloatArray, value: FloatArray, gradient: FloatArray) -> None:
        """Set polished values and gradients of a closing where the ball only fits but for the facets of curved faces.

        No place is right there for a ball of the full radius; that of a slightly smaller one is as near as facets are.
        """
        if self._added is None:
            return
        h, radius = self.spacing, self.radius
        low, high = self._added.mesh.bounds
        which = np.flatnonzero(((points > low - radius - h) & (points < high + radius + h)).all(axis=1))
        distance, centre = np.full(len(points), np.inf), points.copy()
        distance[which], centre[which] = self._added.closest(points[which])
        more = distance - radius - value
        which = np.flatnonzero((more > -_UNFILLED * h) & (more < _FARTHEST * h))
        which = which[distance[which] <= self.surface.closest(points[which])[0] + _SAGITTA * h]
        rough = distance[which] - radius
        missed, chord = rough > value[which] + _UNFILLED * h, np.abs(rough - value[which]) <= _ROUGH * h
        which, chord = which[missed | chord], chord[missed | chord]
        better, found = self._search.polish(points[which], centre[which], _TIGHT)
        arm = points[which] - better
        length = np.linalg.norm(arm, axis=1)
        # Where a smaller ball does not help, the piece itself must do.
        filled = length - radius > value[which] + np.where(found, 0.0, _SAGITTA * h)
        lower = found & chord & (length - radius < value[which] - _UNFILLED * h)
        if lower.any():
            own = self._search.parent(points[which[lower]])
            lower[lower] = own < length[lower] - radius
        filled |= lower
        value[which[filled]] = length[filled] - radius
        filled &= length > 0  # a point at a centre, where sheets of a part run through each other
        gradient[which[filled]] = arm[filled] / length[filled, None]


class _Both(Surface):
    """A surface and a few more pieces of it: building one tree of all would take twice as long."""

    def __init__(self, first: Surface, second: Surface) -> None:
        vertices = np.concatenate([first.mesh.vertices, second.mesh.vertices])
        faces = np.concatenate([first.mesh.faces, second.mesh.faces + len(first.mesh.vertices)])
        self.mesh = Mesh(vertices, faces)
        self._first, self._second = first, second

    def closest(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Distances ``(N,)`` in mm and closest points ``(N, 3)`` for points ``(N, 3)``."""
        x = np.asarray(points, np.float64)
        distance, point = self._first.closest(x)
        low, high = self._second.mesh.bounds
        beside = np.maximum(np.maximum(low - x, x - high), 0.0)
        ask = np.flatnonzero((beside * beside).sum(axis=1) < distance * distance)
        other, other_point = self._second.closest(x[ask])
        nearer = other < distance[ask]
        distance[ask[nearer]], point[ask[nearer]] = other[nearer], other_point[nearer]
        return distance, point


class _Far(Surface):
    """Surface of which nothing is near: all that is known is that it is farther than ``distance`` mm."""

    def __init__(self, distance: float) -> None:
        self._distance = distance

    def closest(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Give that distance ``(N,)``, and points ``(N, 3)`` so far away."""
        x = np.asarray(points, np.float64)
        return np.full(len(x), self._distance), x + np.array([self._distance, 0.0, 0.0])


class _Watched(Implicit):
    """An Implicit that keeps the values found in the middles of blocks of two spacings while it is sampled."""

    def __init__(self, shape: Implicit, spacing: float, sign: float) -> None:
        self.shape, self.step, self.sign = shape, spacing, sign
        self.bounds, self.bounded, self.lipschitz = shape.bounds, shape.bounded, shape.lipschitz
        self.origin = lattice(shape, spacing)[1]
        self.blocks: list[IntArray] = []
        self.rooms: list[FloatArray] = []

    def __call__(self, points: ArrayLike) -> FloatArray:
        value = self.shape(points)
        x = np.asarray(points, np.float64)
        for size in (2, 4):
            if len(x) and _is_whole(self._numbers(x[:1], size)):
                self._keep(x, self.sign * value, size)
        return value

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        return self.shape.value_and_gradient(points)

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where the shape is linear."""
        return self.shape.affine_within(points, radius, tolerance)

    def roughly(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Bounds ``(N,)`` of the values."""
        return self.shape.roughly(points)

    def found(self) -> tuple[IntArray, FloatArray]:
        """Blocks (N, 3) of two spacings that may hold barely fitting centres, and the rooms (N,) in their middles."""
        blocks = np.concatenate([np.zeros((0, 3), np.int32), *self.blocks])
        return blocks, np.concatenate([np.zeros(0), *self.rooms])

    def middles(self, blocks: IntArray) -> FloatArray:
        """Middles (N, 3) of blocks of two spacings."""
        return np.asarray(self.origin + self.step * (2 * blocks + 0.5))

    def _numbers(self, points: FloatArray, size: int) -> FloatArray:
        """Numbers (N, 3) of blocks of so many nodes a side, whole ones for their middles."""
        return np.asarray(((points - self.origin) / self.step - (size - 1) / 2) / size)

    def _keep(self, points: FloatArray, room: FloatArray, size: int) -> None:
        """Keep what was found in blocks of two nodes, and look into those blocks of four that were not halved."""
        h = self.step
        if size == 4:
            left = (room >= -4 * _HALF * h) & (room < -3 * h * math.sqrt(3) / 2)
            halves = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
            blocks = np.round(self._numbers(points[left], 4)).astype(np.int32)
            blocks = (2 * blocks[:, None] + halves).reshape(-1, 3).astype(np.int32)
            room = self.sign * self.shape(self.middles(blocks))
        else:
            blocks = np.round(self._numbers(points, 2)).astype(np.int32)
        near = (room >= -2 * _HALF * h) & (room <= _HALF * h)
        self.blocks.append(blocks[near])
        self.rooms.append(room[near])


def _is_whole(numbers: FloatArray) -> bool:
    return bool(np.allclose(numbers, np.round(numbers), rtol=0.0, atol=0.01))


class _Search:
    """One search; the stages share the part and the contour."""

    def __init__(
        self,
        parent: Implicit,
        radius: float,
        spacing: float,
        watched: _Watched,
        contoured: Surface | None,
        threads: int | None,
        progress: Progress,
    ) -> None:
        self.parent, self.radius, self.spacing, self.watched = parent, radius, spacing, watched
        self.contoured, self.threads, self.progress = contoured, threads, progress

    def room(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Room (N,) for centres at points, and the directions (N, 3) in which it grows."""
        room, direction = np.zeros(len(points)), np.zeros((len(points), 3))
        for start in range(0, len(points), _BATCH):
            self.progress("centres", 0.0)
            part = slice(start, start + _BATCH)
            value, gradient = self.parent.value_and_gradient(points[part])
            room[part], direction[part] = -value - self.radius, -gradient
        return room, direction

    def missing_blocks(self, region: Region | None) -> IntArray:
        """Blocks (N, 3) of two spacings from whose middles a centre is nearer than the contour."""
        h = self.spacing
        blocks, room = self.watched.found()
        if region is not None:
            well_in = region.holds(self.watched.middles(blocks) - _INNER / 2 * h, _INNER * h)
            blocks, room = blocks[well_in], room[well_in]
        points = self.watched.middles(blocks)
        at = self._distance(points)[0]
        doubtful = at > np.abs(room) + _AT_FAULT * h
        blocks, points, at = blocks[doubtful], points[doubtful], at[doubtful]
        return blocks[self._nearer(points, np.minimum(at - _AT_FAULT * h, 2 * _HALF * h))]

    def pieces(self, nodes: IntArray) -> Mesh | None:
        """Images of the nodes (N, 3) among the centres, joined; None if the contour has them all."""
        h = self.spacing
        points = self.watched.origin + h * nodes
        room, direction = self.room(points)
        near = (room >= -_LAYER * h) & (room <= _HALF * h)
        nodes, points, room, direction = nodes[near], points[near], room[near], direction[near]
        at, image = self._distance(points)
        doubtful = np.flatnonzero(at > np.abs(room) + _NEARER * h)
        centre, distance = self._project(points[doubtful], room[doubtful], direction[doubtful])
        nearer = distance < at[doubtful] - _NEARER * h
        new = np.zeros(len(nodes), np.bool_)
        new[doubtful[nearer]] = True
        image[doubtful[nearer]], at[doubtful[nearer]] = centre[nearer], distance[nearer]
        kept = at <= _LAYER * h
        if not (new & kept).any():
            return None
        return joined_images(nodes[kept], image[kept], new[kept], h, self._fits)

    def _fits(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether pieces may be as far from centres as chords are."""
        return np.asarray(self.room(points)[0] >= -_SAGITTA * self.spacing)

    def _nearer(self, points: FloatArray, limit: FloatArray) -> NDArray[np.bool_]:
        """Whether a centre may be nearer to points than ``limit`` (N,): projects onto the features seen so far."""
        h, count = self.spacing, len(points)
        place, start = np.zeros((2, count, 3))
        normals, offsets = np.zeros((count, _LOOKS, 3)), np.zeros((count, _LOOKS))
        nearer, active = np.zeros(count, np.bool_), np.arange(count)
        for number in range(_LOOKS):
            room, direction = self.room(points[active] + h * place[active])
            fits = room >= -_NEARLY * h
            nearer[active[fits]] = True
            active, room, direction = active[~fits], room[~fits], direction[~fits]
            normals[active, number] = direction
            offsets[active, number] = (direction * place[active]).sum(axis=1) - room / h - _NEARLY / 2
            with parallel.threads(self.threads, len(active)):
                place[active], held = nearest_feasible_many(
                    active, start, normals, offsets, np.full(count, number + 1), place
                )
            near = np.linalg.norm(place[active], axis=1) * h < limit[active]
            active = active[near & (held >= 0)]
        nearer[active] = True
        return nearer

    def _distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances (N,) from the contour, and its nearest points."""
        if self.contoured is None:
            return np.full(len(points), np.inf), points.copy()
        distance, nearest = self.contoured.closest(points)
        return distance, np.array(nearest)

    def polish(
        self, points: FloatArray, centres: FloatArray, smaller: tuple[float, ...]
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Nearest centres (N, 3) from rough ones, of balls smaller by so many spacings, and whether any fits."""
        centres, found = centres.copy(), np.zeros(len(points), np.bool_)
        better = partial(polished, self.parent) if self.parent.rough else None
        look, h = self.parent.value_and_gradient, self.spacing
        for less in smaller:
            which = np.flatnonzero(~found)
            if len(which):
                centres[which], found[which] = polish_centres(
                    look, self.radius - less * h, h, points[which], centres[which], better=better, threads=self.threads
                )
        return centres, found

    def _project(self, points: FloatArray, room: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Nearest centres (N, 3), and their distances (N,), infinite where there is none."""
        centre = points - np.minimum(room, 0.0)[:, None] * direction
        found = room >= 0
        which = np.flatnonzero(~found)
        centre[which], found[which] = self.polish(points[which], centre[which], _SMALLER)
        return centre, np.where(found, np.linalg.norm(centre - points, axis=1), np.inf)
