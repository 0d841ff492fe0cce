"""Sparse sampling: node values of an Implicit in bricks of 8³ nodes around its surface.

Memory grows with the surface, as spacing⁻²; so does time if the Lipschitz constant of the Implicit is known.

What is promised: every node on either side of an edge with a change of sign is held, with the right sign; a node
where the value is exactly zero counts as outside. Without a Lipschitz constant every node within the bounds is
evaluated once. What is not: features thinner than the spacing may fall between the nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import parallel
from .errors import SpacingError
from .implicit import FloatArray, Implicit
from .kernels import bricks as kernels
from .parallel import Progress, no_progress
from .regions import Region

#: Bricks whose nodes are evaluated together: bounds the array of points to 50 MB.
_CHUNK_BRICKS = 4096

#: Where the box lies between nodes, in spacings. Faces of parts lie on the box and on round numbers; nodes on a face
#: would take their sign from rounding errors. Three unlike fractions, none near a simple ratio.
_NODE_SHIFT = (0.3819, 0.4471, 0.4142)

#: Bricks along an axis that a Morton key can number.
_MAX_BRICKS = 2**21

#: A function counts as linear where it is so within this share of the spacing: single precision moves the corners of
#: planes by 1e-5 spacings at 200 cells across.
PLANE_TOLERANCE = 2e-5

#: Relative slack of the pruning, against rounding of values and centres.
_PRUNE_SLACK = 1 + 1e-6


@dataclass(frozen=True, eq=False)
class Bricks:
    """Values at the nodes of bricks of 8³ nodes, in Morton order.

    Attributes
    ----------
    origin : (3,) float64
        Position in mm of node (0, 0, 0) of brick (0, 0, 0).
    spacing : float
        Distance between nodes in mm.
    blocks : (B, 3) int32
        Integer position of each brick; its first node lies at ``origin + 8 * spacing * blocks``.
    values : (B, 512) float32
        Value at node ``64 i + 8 j + k``; infinite where only the sign is known.
    plane : (B, 512) int32
        Number of the linear function that the Implicit is around that node, or -1.
    planes : (P, 4) float64
        The linear functions: gradient, and value at the origin of coordinates.
    neighbours : (B, 27) int32
        Number of the brick at the offset ``13 + 9 dx + 3 dy + dz``, or -1.
    box : (2, 3) float64
        All nodes outside this box in mm are negative.
    cropped : bool
        Whether the box cut off nodes that the Implicit has inside.
    inner : (B,) bool, optional
        Bricks that lack no neighbour; if only a part of space was sampled.
    """

    origin: FloatArray
    spacing: float
    blocks: NDArray[np.int32]
    values: NDArray[np.float32]
    plane: NDArray[np.int32]
    planes: FloatArray
    neighbours: NDArray[np.int32]
    box: FloatArray
    cropped: bool
    inner: NDArray[np.bool_] | None = None


@dataclass(eq=False)
class _Samples:
    """Values and planes of bricks, as they are filled in (see :class:`Bricks`)."""

    values: NDArray[np.float32]
    plane: NDArray[np.int32]
    planes: list[FloatArray]

    @classmethod
    def empty(cls, count: int) -> _Samples:
        """Nothing known yet of so many bricks."""
        return cls(np.zeros((count, kernels.NODES), np.float32), np.full((count, kernels.NODES), -1, np.int32), [])


class _Sampler:
    """Values of an Implicit intersected with a box, at points of a grid."""

    def __init__(
        self,
        implicit: Implicit,
        box: FloatArray,
        origin: FloatArray,
        spacing: float,
        whole: bool,
        threads: int | None,
        region: Region | None,
    ) -> None:
        self.implicit = implicit
        self.box = box
        self.origin = origin
        self.spacing = spacing
        self.whole = whole
        self.threads = threads
        self.region = region
        self.slope = implicit.lipschitz or 1.0
        self.cropped = False
        self.planes_found = 0

    def centres(self, bricks: NDArray[np.int32], ids: NDArray[np.int64], size: int) -> FloatArray:
        """Centres (N, 3) of the sub-blocks ``ids`` of ``size`` nodes a side."""
        with parallel.threads(self.threads, len(ids)):
            return np.asarray(kernels.block_centres(bricks, ids, size, self.origin, self.spacing))

    def at_blocks(self, bricks: NDArray[np.int32], ids: NDArray[np.int64], size: int) -> FloatArray:
        """Values (N,) at the centres of the sub-blocks ``ids`` of ``size`` nodes a side."""
        return self(self.centres(bricks, ids, size))

    def fill(self, bricks: NDArray[np.int32], samples: _Samples, lipschitz: float) -> None:
        """Sample bricks from whole ones down to nodes, leaving out what is far from the surface or linear."""
        ids = np.arange(len(bricks))
        half_step = self.spacing * math.sqrt(3) / 2 * _PRUNE_SLACK
        for size in (8, 4, 2):
            if size < 8:
                values = self.at_blocks(bricks, ids, size)
                ids = kernels.prune(values, ids, size, lipschitz * half_step * (size - 1), samples.values)
            if self.whole:
                ids = self._fill_linear(bricks, ids, size, half_step * (size - 1), samples)
            ids = kernels.children(ids)
        kernels.store_nodes(self.at_blocks(bricks, ids, 1), ids, samples.values)

    def _fill_linear(
        self, bricks: NDArray[np.int32], ids: NDArray[np.int64], size: int, radius: float, samples: _Samples
    ) -> NDArray[np.int64]:
        """Fill in the sub-blocks in which the Implicit is linear; returns the others."""
        points = self.centres(bricks, ids, size)
        value, gradient, holds = self.implicit.affine_within(points, radius, PLANE_TOLERANCE * self.spacing)
        value, gradient, points = value[holds], gradient[holds], points[holds]
        planes = np.concatenate([gradient, (value - (gradient * points).sum(axis=1))[:, None]], axis=1)
        place = (bricks, self.origin, self.spacing)
        with parallel.threads(self.threads, size**3 * len(planes)):
            kernels.fill_planes(ids[holds], size, planes, self.planes_found, *place, samples.values, samples.plane)
        self.planes_found += len(planes)
        samples.planes.append(planes)
        return ids[~holds]

    def wanted(self, blocks: NDArray[np.integer], size: int) -> NDArray[np.bool_]:
        """Whether blocks (N, 3) of ``size`` bricks a side lie in the region, at least in part."""
        if self.region is None:
            return np.ones(len(blocks), np.bool_)
        side = 8 * size * self.spacing
        return self.region.overlaps(self.origin + side * blocks - self.spacing / 2, side)

    def near(self, blocks: NDArray[np.int32], size: int, limit: float) -> NDArray[np.bool_]:
        """Whether values in the middles of blocks (N, 3) of ``size`` bricks a side are within a limit."""
        points = self.origin + self.spacing * (8 * size * (blocks + 0.5) - 0.5)
        chosen = np.ones(len(blocks), np.bool_)
        if self.region is not None:
            low, high = (np.array(bound, np.float64) for bound in self.implicit.roughly(points))
            for bound in (low, high):
                kernels.crop_values(points, bound, self.box[0], self.box[1], self.slope)
            chosen = (low <= limit) & (high >= -limit)
        if self.region is None or size == 1:
            chosen[chosen] = np.abs(self(points[chosen])) <= limit
        return chosen

    def __call__(self, points: FloatArray) -> FloatArray:
        values = np.array(self.implicit(points), np.float64)
        self.cropped |= bool(kernels.crop_values(points, values, self.box[0], self.box[1], self.slope))
        return values


def sample_bricks(
    implicit: Implicit,
    spacing: float,
    bounds: ArrayLike | None = None,
    *,
    threads: int | None = None,
    progress: Progress = no_progress,
    region: Region | None = None,
) -> Bricks:
    """Sample an Implicit where its surface may be.

    Blocks are halved from the bounds down to single nodes; a block is dropped if the value at its centre, divided
    by the Lipschitz constant, is larger than its half diagonal.

    Parameters
    ----------
    implicit : Implicit
        In space.
    spacing : float
        Distance between nodes in mm.
    bounds : (2, 3) array_like, optional
        Box in mm; whatever sticks out of it is cut off. The bounds of the Implicit and one spacing by default.
    threads : int, optional
        Number of threads of the kernels, all cores by default; the result does not depend on it.
    progress : callable
        Called as ``progress("sample", fraction)``; may raise to cancel.
    region : Region, optional
        Only bricks that overlap it are sampled; the Implicit need not be right elsewhere, but has a Lipschitz constant.

    Raises
    ------
    SpacingError
        If the spacing is not positive and finite, or too small for the bounds, or the Implicit is not in space.
    """
    box, origin = lattice(implicit, spacing, bounds)
    counts = np.floor(((box[1] - origin) / spacing + 1) / 8).astype(np.int64) + 1
    if counts.max() > _MAX_BRICKS:
        need = float((box[1] - box[0]).max()) / (8 * _MAX_BRICKS)
        raise SpacingError(f"spacing {spacing:g} mm is too small for the bounds; use at least {need:.3g} mm")
    sampler = _Sampler(implicit, box, origin, float(spacing), bounds is None and implicit.bounded, threads, region)
    if implicit.lipschitz:
        blocks, samples = _by_octree(sampler, counts, implicit.lipschitz, progress)
    else:
        blocks, samples = _everywhere(sampler, counts, progress)
    blocks, samples, neighbours = _closed(sampler, counts, blocks, samples, progress)
    progress("sample", 1.0)
    planes = np.concatenate([np.zeros((0, 4)), *samples.planes])
    inner = None if region is None else ~_lacking(sampler, counts, blocks, neighbours)
    return Bricks(
        origin, float(spacing), blocks, samples.values, samples.plane, planes, neighbours, box, sampler.cropped, inner
    )


def near_bricks(implicit: Implicit, spacing: float) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Bricks (N, 3) near the surface of an Implicit with a Lipschitz constant, and how many (3,) its lattice has."""
    box, origin = lattice(implicit, spacing)
    counts = np.floor(((box[1] - origin) / spacing + 1) / 8).astype(np.int64) + 1
    assert implicit.lipschitz is not None
    limit = implicit.lipschitz * spacing * math.sqrt(3)

    def keep(blocks: NDArray[np.int32], size: int) -> NDArray[np.int32]:
        centres = origin + spacing * (8 * size * (blocks + 0.5) - 0.5)
        return blocks[np.abs(implicit(centres)) <= limit * 4 * size]

    return _descend(counts, keep), counts


def lattice(implicit: Implicit, spacing: float, bounds: ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
    """Box (2, 3) that is sampled, and the position (3,) of node (0, 0, 0). Parameters as for :func:`sample_bricks`."""
    box = _box(implicit, spacing, bounds)
    return box, box[0] - spacing * (1 + np.asarray(_NODE_SHIFT))


def _box(implicit: Implicit, spacing: float, bounds: ArrayLike | None) -> FloatArray:
    if not (math.isfinite(spacing) and spacing > 0):
        raise SpacingError(f"spacing must be positive and finite, not {spacing}")
    if implicit.dim != 3:
        raise SpacingError(f"bricks sample shapes in space, not in {implicit.dim}-D")
    if bounds is None:
        return np.asarray(implicit.bounds, np.float64) + spacing * np.array([[-1.0], [1.0]])
    box = np.array(bounds, np.float64)
    if box.shape != (2, 3) or not np.isfinite(box).all() or not (box[1] > box[0]).all():
        raise SpacingError(f"bounds must be a lower and a higher corner (2, 3) in mm, not {bounds!r}")
    return box


def _descend(
    counts: NDArray[np.int64], keep: Callable[[NDArray[np.int32], int], NDArray[np.int32]]
) -> NDArray[np.int32]:
    """Bricks in Morton order, halving from one block; ``keep`` filters the blocks of each level by their side."""
    size = 1 << int(counts.max() - 1).bit_length()
    blocks = np.zeros((1, 3), np.int32)
    blocks = keep(blocks, size)
    while size > 1:
        size //= 2
        blocks = keep(kernels.split(blocks, -(-counts // size)), size)
    return blocks


def _by_octree(
    sampler: _Sampler, counts: NDArray[np.int64], lipschitz: float, progress: Progress
) -> tuple[NDArray[np.int32], _Samples]:
    limit = lipschitz * sampler.spacing * math.sqrt(3) * _PRUNE_SLACK

    def keep(blocks: NDArray[np.int32], size: int) -> NDArray[np.int32]:
        # One node beyond the block on each side: both ends of an edge that crosses the border stay.
        chosen = np.zeros(len(blocks), np.bool_)
        step = 512 * _CHUNK_BRICKS
        for start in range(0, len(blocks), step):
            progress("sample", 0.0)
            part = start + np.flatnonzero(sampler.wanted(blocks[start : start + step], size))
            chosen[part] = sampler.near(blocks[part], size, limit * (8 * size + 1) / 2)
        return blocks[chosen]

    blocks = _descend(counts, keep)
    samples = _Samples.empty(len(blocks))
    for start in range(0, len(blocks), _CHUNK_BRICKS):
        progress("sample", start / len(blocks))
        part = slice(start, start + _CHUNK_BRICKS)
        sampler.fill(blocks[part], _Samples(samples.values[part], samples.plane[part], samples.planes), lipschitz)
    return blocks, samples


def _closed(
    sampler: _Sampler,
    counts: NDArray[np.int64],
    blocks: NDArray[np.int32],
    samples: _Samples,
    progress: Progress,
) -> tuple[NDArray[np.int32], _Samples, NDArray[np.int32]]:
    """Add the missing bricks that nodes of both signs touch, and return the table of neighbours too.

    There are none if the Lipschitz constant holds. A function that breaks it (a distance with jumps) would otherwise
    have surface in bricks that are not there.
    """
    offsets = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(27, 3)
    while True:
        with parallel.threads(sampler.threads, 27 * len(blocks)):
            neighbours = kernels.neighbour_table(blocks, kernels.morton_keys(blocks))
            seen = kernels.signs_around_missing(samples.values, neighbours)
        brick, place = np.nonzero(seen)
        size = counts + 2  # from one brick before the lattice to one beyond
        names, which = np.unique(
            np.ravel_multi_index(tuple((blocks[brick] + offsets[place] + 1).T), size), return_inverse=True
        )
        missing = np.stack(np.unravel_index(names, size), axis=1) - 1
        signs = np.zeros(len(missing), np.uint8)
        np.bitwise_or.at(signs, which, seen[brick, place])
        extra = missing[(signs == 3) & (missing >= 0).all(axis=1) & (missing < counts).all(axis=1)].astype(np.int32)
        extra = extra[sampler.wanted(extra, 1)]
        if len(extra) == 0:
            return blocks, samples, neighbours
        progress("sample", 1.0)
        more = _Samples.empty(len(extra))
        ids = np.arange(kernels.NODES * len(extra))
        kernels.store_nodes(sampler.at_blocks(extra, ids, 1), ids, more.values)
        blocks = np.concatenate([blocks, extra])
        order = np.argsort(kernels.morton_keys(blocks))
        blocks = blocks[order]
        values = np.concatenate([samples.values, more.values])[order]
        samples = _Samples(values, np.concatenate([samples.plane, more.plane])[order], samples.planes)


def _lacking(
    sampler: _Sampler, counts: NDArray[np.int64], blocks: NDArray[np.int32], neighbours: NDArray[np.int32]
) -> NDArray[np.bool_]:
    """Bricks (B,) with a neighbour on the lattice that was not sampled, as it is not in the region."""
    lacking = np.zeros(len(blocks), np.bool_)
    for number in range(27):
        alone = np.flatnonzero(neighbours[:, number] < 0)
        other = blocks[alone] + np.array([number // 9 - 1, number // 3 % 3 - 1, number % 3 - 1])
        there = ((other >= 0) & (other < counts)).all(axis=1)
        lacking[alone[there]] |= ~sampler.wanted(other[there], 1)
    return lacking


def _everywhere(sampler: _Sampler, counts: NDArray[np.int64], progress: Progress) -> tuple[NDArray[np.int32], _Samples]:
    blocks = _descend(counts, lambda blocks, size: blocks)
    state = np.zeros(len(blocks), np.int8)
    mixed: list[NDArray[np.float32]] = []
    for start in range(0, len(blocks), _CHUNK_BRICKS):
        progress("sample", start / len(blocks))
        part = blocks[start : start + _CHUNK_BRICKS]
        ids = np.arange(kernels.NODES * len(part))
        out = np.zeros((len(part), kernels.NODES), np.float32)
        kernels.store_nodes(sampler.at_blocks(part, ids, 1), ids, out)
        state[start : start + _CHUNK_BRICKS] = kernels.sign_states(out)
        mixed.append(out[state[start : start + _CHUNK_BRICKS] == 0])
    with parallel.threads(sampler.threads, 27 * len(blocks)):
        needed = kernels.blocks_beside_others(blocks, kernels.morton_keys(blocks), state)
    signs = np.where(state[needed] > 0, kernels.SIGN_ONLY, -kernels.SIGN_ONLY)
    samples = _Samples.empty(int(needed.sum()))
    samples.values[:] = signs[:, None]
    samples.values[state[needed] == 0] = np.concatenate(mixed)
    return blocks[needed], samples
