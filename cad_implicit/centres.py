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

from .distance import Surface
from .dual import dual_contour
from .errors import EmptyResultError
from .implicit import FloatArray, Implicit, polished
from .mesh import Mesh
from .parallel import Progress, no_progress
from .polish import polish_centres
from .sparse import lattice

#: Half the diagonal of a cube over its side, and slack for rounding.
_HALF = math.sqrt(3) / 2 * (1 + 1e-6)

#: The contour is at fault if a centre is nearer than it by more than this many spacings: the draft of S is off by its
#: sagitta, 0.1 spacings where S has a radius of one spacing.
_NEARER = 0.1

#: Balls smaller than the given one by this many spacings are looked for at first, against rounding, …
_BARELY = 5e-5

#: … and by this many where they do not fit: the facets of rods and holes, tessellated to 0.005 spacings, take as much.
#: A pushed ball counts as fitting up to twice this.
_FACETS = 0.01

#: A ball that only fits but for facets changes a point by more than this many spacings.
_TIGHT = 0.012

#: Images of the nodes count within this many spacings: a layer of cells around a plane in any direction.
_LAYER = 0.9

#: Pieces between images have edges up to this many spacings, and their middles lack at most so much room.
_LONGEST = 1.5
_SAGITTA = 0.05

#: Images closer together than this many spacings are one.
_SAME = 0.01

#: Blocks that are looked at together for the largest ball, and their last size relative to the part.
_BEAM = 2000
_PRECISE = 1e-7

#: Points evaluated at a time.
_BATCH = 1 << 19

IntArray = NDArray[np.int32]


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

    Attributes
    ----------
    surface : Surface
        The surface that they make.

    Raises
    ------
    EmptyResultError
        If the ball fits nowhere.
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
    ) -> None:
        self.radius, self.spacing = radius, spacing
        watched = _Watched(offset, spacing, -1.0 if parent.bounded else 1.0)
        contoured: Surface | None = None
        with suppress(EmptyResultError):
            mesh = dual_contour(watched, spacing, threads=threads, progress=progress, draft=True)
            contoured = Surface(mesh, threads=threads)
        search = _Search(parent, radius, spacing, watched, contoured, threads, progress)
        blocks = search.missing_blocks()
        thin, tight = search.pieces(_nodes_of(blocks)) if len(blocks) else (None, None)
        if thin is not None:
            contoured = Surface(thin if contoured is None else _together(contoured.mesh, thin), threads=threads)
        if contoured is None:
            raise EmptyResultError(f"a ball of radius {radius:g} mm fits nowhere")
        self.surface = contoured
        #: Where the ball only fits but for the facets of a curved face.
        self._tight = None if tight is None else Surface(tight, threads=threads)

    def fill_tight(self, points: FloatArray, value: FloatArray, gradient: FloatArray) -> None:
        """Set polished values and gradients of a closing where the ball only fits but for facets.

        No place there is right for the polish.
        """
        if self._tight is None:
            return
        distance, centre = self._tight.closest(points)
        which = np.flatnonzero(distance - self.radius > value + _TIGHT * self.spacing)
        which = which[distance[which] <= self.surface.closest(points[which])[0] * (1 + 1e-9)]
        value[which] = distance[which] - self.radius
        gradient[which] = (points[which] - centre[which]) / distance[which, None]


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

    def affine_within(
        self, points: FloatArray, radius: float, tolerance: float
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Where the shape is linear."""
        return self.shape.affine_within(points, radius, tolerance)

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

    def missing_blocks(self) -> IntArray:
        """Blocks (N, 3) of two spacings from whose middles a centre is nearer than the contour."""
        h = self.spacing
        blocks, room = self.watched.found()
        points = self.watched.middles(blocks)
        at = self._distance(points)[0]
        doubtful = at > np.abs(room) + _NEARER * h
        blocks, points, at = blocks[doubtful], points[doubtful], at[doubtful]
        room, direction = self.room(points)
        _, distance, _ = self._project(points, room, direction)
        return blocks[(distance < at - _NEARER * h) & (distance <= 2 * _HALF * h)]

    def pieces(self, nodes: IntArray) -> tuple[Mesh | None, Mesh | None]:
        """Images of the nodes (N, 3) among the centres, joined; None if the contour has them all.

        Then those pieces alone where the ball only fits but for facets.
        """
        h = self.spacing
        points = self.watched.origin + h * nodes
        room, direction = self.room(points)
        near = (room >= -_LAYER * h) & (room <= _HALF * h)
        nodes, points, room, direction = nodes[near], points[near], room[near], direction[near]
        at, image = self._distance(points)
        doubtful = np.flatnonzero(at > np.abs(room) + _NEARER * h)
        centre, distance, is_tight = self._project(points[doubtful], room[doubtful], direction[doubtful])
        nearer = distance < at[doubtful] - _NEARER * h
        new, tight = np.zeros((2, len(nodes)), np.bool_)
        new[doubtful[nearer]], tight[doubtful[nearer]] = True, is_tight[nearer]
        image[doubtful[nearer]], at[doubtful[nearer]] = centre[nearer], distance[nearer]
        kept = at <= _LAYER * h
        nodes, image, new, tight = nodes[kept], image[kept], new[kept], tight[kept]
        thin, barely = (self._joined(nodes, image, which) if which.any() else None for which in (new, tight))
        return thin, barely

    def _distance(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances (N,) from the contour, and its nearest points."""
        if self.contoured is None:
            return np.full(len(points), np.inf), points.copy()
        distance, nearest = self.contoured.closest(points)
        return distance, np.array(nearest)

    def _project(
        self, points: FloatArray, room: FloatArray, direction: FloatArray
    ) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Nearest centres (N, 3), distances (N,), infinite where there is none, and whether facets are in the way."""
        centre = points - np.minimum(room, 0.0)[:, None] * direction
        found, tight = room >= 0, np.zeros(len(points), np.bool_)
        better = partial(polished, self.parent) if self.parent.rough else None
        for less in (_BARELY, _FACETS):
            tight = ~found
            which = np.flatnonzero(tight)
            if len(which):
                centre[which], found[which] = polish_centres(
                    self.parent.value_and_gradient, self.radius - less * self.spacing, self.spacing, points[which],
                    centre[which], better=better, threads=self.threads,
                )  # fmt: skip
        return centre, np.where(found, np.linalg.norm(centre - points, axis=1), np.inf), tight

    def _joined(self, nodes: IntArray, image: FloatArray, new: NDArray[np.bool_]) -> Mesh:
        """Images of faces and edges of the grid that have at least one new corner."""
        h = self.spacing
        keys = _keys(nodes, nodes.min(axis=0) - 1, nodes.max(axis=0) + 2)
        order = np.argsort(keys)
        nodes, image, new, keys = nodes[order], image[order], new[order], keys[order]
        low, high = nodes.min(axis=0) - 1, nodes.max(axis=0) + 2

        def neighbour(*steps: int) -> NDArray[np.intp]:
            """Numbers of the nodes some unit steps further; -1 where there is none."""
            offset = np.zeros(3, np.int32)
            for axis in steps:
                offset[axis] += 1
            key = _keys(nodes + offset, low, high)
            at = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
            return np.where(keys[at] == key, at, -1)

        every = np.arange(len(nodes))
        edges = np.concatenate([np.stack([every, neighbour(axis)], axis=1) for axis in range(3)])
        quads = np.concatenate(
            [
                np.stack([every, neighbour(a), neighbour(a, b), neighbour(b)], axis=1)
                for a, b in ((0, 1), (0, 2), (1, 2))
            ]
        )
        pieces = []
        for corners in (quads, edges):
            corners = corners[(corners >= 0).all(axis=1)]
            corners = corners[new[corners].any(axis=1)]
            side = np.linalg.norm(image[corners] - image[np.roll(corners, -1, axis=1)], axis=2)
            corners = corners[side.max(axis=1, initial=0.0) <= _LONGEST * h]
            corners = corners[self.room(image[corners].mean(axis=1))[0] >= -_SAGITTA * h]
            pieces.append(corners)
        a, b, c, d = pieces[0].T
        faces = [
            np.stack([a, b, c], axis=1),
            np.stack([a, c, d], axis=1),
            pieces[1][:, [0, 1, 1]],
            np.repeat(np.flatnonzero(new)[:, None], 3, axis=1),
        ]
        return _simplest(image, np.concatenate(faces), _SAME * h)


def _together(first: Mesh, second: Mesh) -> Mesh:
    """Triangles of both meshes."""
    vertices = np.concatenate([first.vertices, second.vertices])
    return Mesh(vertices, np.concatenate([first.faces, second.faces + len(first.vertices)]))


def _keys(nodes: IntArray, low: IntArray, high: IntArray) -> NDArray[np.int64]:
    """Count the nodes of the box from ``low`` to ``high`` before each one."""
    size = (high - low).astype(np.int64)
    place = (nodes - low).astype(np.int64)
    return np.asarray((place[:, 0] * size[1] + place[:, 1]) * size[2] + place[:, 2])


def _nodes_of(blocks: IntArray) -> IntArray:
    """Nodes (N, 3) of blocks of two, and of those around them."""
    around = np.stack(np.meshgrid(*[[-1, 0, 1, 2]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = (2 * blocks[:, None] + around).reshape(-1, 3)
    return np.unique(nodes, axis=0).astype(np.int32)


def _simplest(vertices: FloatArray, faces: NDArray[np.intp], same: float) -> Mesh:
    """Triangles with vertices that are close together made one, and without those that are part of others."""
    _, first, number = np.unique(np.round(vertices / same), axis=0, return_index=True, return_inverse=True)
    faces = np.unique(np.sort(number.ravel()[faces], axis=1), axis=0)
    used = (np.diff(faces, axis=1) != 0).sum(axis=1) + 1  # different corners
    full, flat, points = (faces[used == count] for count in (3, 2, 1))
    flat = np.unique(flat[:, [0, 2]], axis=0)
    sides = full[:, [[0, 1], [0, 2], [1, 2]]].reshape(-1, 2)
    flat = flat[~_among(flat, sides, len(first))]
    points = points[~np.isin(points[:, 0], np.concatenate([full.ravel(), flat.ravel()]))]
    return Mesh(vertices[first], np.concatenate([full, flat[:, [0, 1, 1]], points]))


def _among(pairs: NDArray[np.intp], others: NDArray[np.intp], count: int) -> NDArray[np.bool_]:
    """Which pairs of numbers below ``count`` are among other pairs."""
    return np.isin(pairs[:, 0] * count + pairs[:, 1], others[:, 0] * count + others[:, 1])


def largest_ball(shape: Implicit) -> tuple[float, tuple[float, float, float]]:
    """Radius in mm and centre of the largest ball inside a bounded shape of exact distances.

    Blocks are halved; those are kept that may hold a larger ball than the largest found, at most ``_BEAM``.
    """
    low, high = shape.bounds
    side = float((high - low).max())
    blocks = np.asarray((low + high) / 2)[None]
    best, centre = -math.inf, blocks[0]
    corners = np.stack(np.meshgrid(*[[-0.25, 0.25]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    while True:
        depth = shape(blocks)
        deepest = int(depth.argmax())
        if depth[deepest] > best:
            best, centre = float(depth[deepest]), blocks[deepest]
        hope = depth + _HALF * side
        keep = np.argsort(-hope, kind="stable")[:_BEAM]
        keep = keep[hope[keep] > best]
        if side < _PRECISE * float((high - low).max()) or len(keep) == 0:
            x, y, z = centre.tolist()
            return best, (x, y, z)
        blocks = (blocks[keep, None] + side * corners).reshape(-1, 3)
        side /= 2
