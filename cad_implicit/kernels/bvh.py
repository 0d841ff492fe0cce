"""Bounding volume hierarchy over triangles: eight children a node, each with a box and a disc.

Everything inside is in coordinates scaled by a power of two, so that the mesh is about 1 across, and relative to
its centre: float32 bounds with one fixed margin then hold for parts of any size anywhere. A disc is a cylinder
along the mean normal of its triangles; seen from a distance it bounds a patch of surface far better than a box.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import prange

from .jit import jit, parallel_jit
from .partition import WIDTH, partition
from .pseudonormal import pseudonormals
from .stack import dealt
from .triangle import leaf_blocks

#: Added to all float32 bounds, in scaled coordinates: 30 roundings of numbers up to 1.
MARGIN = np.float32(2e-6)
#: Squared bounds are trusted up to this factor (points far away, where rounding grows with the distance).
TRUST = np.float32(1.0 + 1e-5)
#: Stands for "no bound" in float32; its square is finite.
FAR = np.float32(3e18)
#: Mean normals shorter than this share of the area are no axis for a disc.
_MIN_RESULTANT = 0.3


class Tree(NamedTuple):
    """The hierarchy as kernels see it; triangles are in the order of the leaves.

    Attributes
    ----------
    bounds : (N, 14, 8) float32
        For each child: box low, high (6), disc centre, axis (6), half height, radius.
    children : (N, 8) int32
        Node number, or ``-leaf - 1``.
    first : (L + 1,) int32
        Triangles of each leaf: ``first[leaf]:first[leaf + 1]``.
    blocks : (L, 21, 4) float64
        What the distance to four triangles at once needs.
    corners : (F, 9) float64
        Triangles, scaled.
    order : (F,) int32
        Number of each triangle in the mesh.
    frame : (4,) float64
        Centre and scale in mm: position = centre + scale * scaled.
    normals : (F, 7, 3) float64
        Outward unit pseudonormals of the face, its edges and its corners; (0, 7, 3) in an unsigned tree.
    doubtful : (F,) uint8
        Bit f is set where the pseudonormal of feature f does not tell the side.
    dipoles : (N, 7, 8) float64
        For each child: area vector, centre, radius around it; (0, 7, 8) in an unsigned tree.
    by_winding : int
        1 if the winding number tells inside from outside everywhere, 0 if pseudonormals do.
    exterior : int
        1 if points far away are inside (the mesh is inside out), else 0.
    """

    bounds: np.ndarray
    children: np.ndarray
    first: np.ndarray
    blocks: np.ndarray
    corners: np.ndarray
    order: np.ndarray
    frame: np.ndarray
    normals: np.ndarray
    doubtful: np.ndarray
    dipoles: np.ndarray
    by_winding: int
    exterior: int


def build_tree(
    vertices: np.ndarray, faces: np.ndarray, signed: bool = True, even: bool = False, bounds: np.ndarray | None = None
) -> Tree:
    """Build the tree of triangles ``vertices[faces]``, which lie in a box ``bounds`` (2, 3) if it is given.

    In the same box the distance to a triangle does not depend on the others, to the last bit. Without pseudonormals and
    dipoles if only distances are asked for; in less time for ``even`` triangles, all of similar size. Call it inside
    :func:`cad_implicit.parallel.threads`.
    """
    used = vertices[faces].reshape(len(faces), 9)
    boxes = _boxes(used)
    low, high = _extent(boxes) if bounds is None else bounds
    diagonal = math.sqrt(float(((high - low) ** 2).sum()))
    scale = 2.0 ** math.ceil(math.log2(diagonal)) if diagonal > 0 else 1.0
    # A round centre keeps round coordinates exact.
    centre = np.round((low / 2 + high / 2) / scale * 1024) / 1024 * scale
    corners = (used - np.tile(centre, 3)) / scale
    order = np.arange(len(faces), dtype=np.int32)
    children, ranges, first = partition(_boxes(corners), order, even)
    corners = corners[order]
    vectors = _areas(corners)
    if signed:
        normals, doubtful = pseudonormals(corners, faces[order], len(vertices))
    else:
        normals, doubtful = np.zeros((0, 7, 3)), np.zeros(0, np.uint8)
    bounds = _bound(corners, vectors, ranges)
    dipoles = _dipoles(corners, vectors, children, ranges) if signed else np.zeros((0, 7, WIDTH))
    blocks = leaf_blocks(corners, first)
    frame = np.append(centre, scale)
    return Tree(bounds, children, first, blocks, corners, order, frame, normals, doubtful, dipoles, 0, 0)


@jit
def _extent(boxes):
    """Low and high corner of all boxes; a pass of NumPy along each of the columns took ten times as long."""
    low, high = np.full(3, math.inf), np.full(3, -math.inf)
    for t in range(len(boxes)):
        for d in range(3):
            low[d], high[d] = min(low[d], boxes[t, d]), max(high[d], boxes[t, 3 + d])
    return low, high


@jit
def _boxes(corners):
    """Low and high corner (F, 6) of each triangle."""
    boxes = np.zeros((len(corners), 6))
    for t in range(len(corners)):
        for d in range(3):
            x, y, z = corners[t, d], corners[t, 3 + d], corners[t, 6 + d]
            boxes[t, d], boxes[t, 3 + d] = min(x, y, z), max(x, y, z)
    return boxes


@jit
def _areas(corners):
    """Area vectors (F, 3) of triangles (F, 9)."""
    vectors = np.empty((len(corners), 3))
    for t in range(len(corners)):
        c = corners[t]
        ux, uy, uz, vx, vy, vz = c[3] - c[0], c[4] - c[1], c[5] - c[2], c[6] - c[0], c[7] - c[1], c[8] - c[2]
        vectors[t, 0], vectors[t, 1] = (uy * vz - uz * vy) / 2, (uz * vx - ux * vz) / 2
        vectors[t, 2] = (ux * vy - uy * vx) / 2
    return vectors


@jit
def _axis(vectors, start, stop, extent):
    """Mean normal of triangles, or the thinnest axis of their box if they face all ways."""
    x, y, z, total = 0.0, 0.0, 0.0, 0.0
    for t in range(start, stop):
        nx, ny, nz = vectors[t, 0], vectors[t, 1], vectors[t, 2]
        x += nx
        y += ny
        z += nz
        total += math.sqrt(nx * nx + ny * ny + nz * nz)
    length = math.sqrt(x * x + y * y + z * z)
    if length > _MIN_RESULTANT * total and length > 1e-150:
        return x / length, y / length, z / length
    thin = 0
    for d in range(1, 3):
        if extent[d] < extent[thin]:
            thin = d
    return 1.0 if thin == 0 else 0.0, 1.0 if thin == 1 else 0.0, 1.0 if thin == 2 else 0.0


@parallel_jit
def _bound(corners, vectors, ranges):
    """Box and disc of every child, rounded outward."""
    bounds = np.zeros((len(ranges), 14, WIDTH), np.float32)
    for number in prange(len(ranges)):
        node = dealt(np.int64(number), len(ranges))
        for c in range(WIDTH):
            _bound_child(corners, vectors, ranges[node, c, 0], ranges[node, c, 1], bounds[node, :, c])
    return bounds


@jit
def _bound_child(corners, vectors, start, stop, own):
    if start == stop:
        own[:6] = FAR
        own[12:] = FAR
        return
    low, high = np.full(3, math.inf), np.full(3, -math.inf)
    for t in range(start, stop):
        for d in range(9):
            low[d % 3] = min(low[d % 3], corners[t, d])
            high[d % 3] = max(high[d % 3], corners[t, d])
    nx, ny, nz = _axis(vectors, start, stop, high - low)
    mx, my, mz = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2
    bottom, top, radius2 = math.inf, -math.inf, 0.0
    for t in range(start, stop):
        for q in range(0, 9, 3):
            x, y, z = corners[t, q] - mx, corners[t, q + 1] - my, corners[t, q + 2] - mz
            height = x * nx + y * ny + z * nz
            bottom, top = min(bottom, height), max(top, height)
            radius2 = max(radius2, x * x + y * y + z * z - height * height)
    middle, half, radius = (bottom + top) / 2, (top - bottom) / 2, math.sqrt(radius2)
    for d in range(3):
        own[d] = np.float32(low[d]) - MARGIN
        own[3 + d] = np.float32(high[d]) + MARGIN
    own[6], own[7], own[8] = mx + middle * nx, my + middle * ny, mz + middle * nz
    own[9], own[10], own[11] = nx, ny, nz
    # In a cylinder higher than wide the distance from the axis cancels in float32: leave it to the box.
    flat = half <= radius
    own[12] = np.float32(half) + 2 * MARGIN if flat else FAR
    own[13] = np.float32(radius) + 2 * MARGIN if flat else FAR


@jit
def _dipoles(corners, vectors, children, ranges):
    """Area vector, centre of area and radius of every child, for the winding number far away."""
    dipoles = np.zeros((len(children), 7, WIDTH))
    weights = np.zeros((len(children), WIDTH))
    for node in range(len(children) - 1, -1, -1):  # children come after their parents
        for c in range(WIDTH):
            start, stop, child = ranges[node, c, 0], ranges[node, c, 1], children[node, c]
            low, high = np.full(3, np.inf), np.full(3, -np.inf)
            sums = np.zeros(7)
            if child < 0:
                for t in range(start, stop):
                    area = math.sqrt(vectors[t, 0] ** 2 + vectors[t, 1] ** 2 + vectors[t, 2] ** 2)
                    sums[6] += area
                    for d in range(3):
                        sums[d] += vectors[t, d]
                        sums[3 + d] += area * (corners[t, d] + corners[t, 3 + d] + corners[t, 6 + d]) / 3
            else:
                for g in range(WIDTH):
                    area = weights[child, g]
                    sums[6] += area
                    for d in range(3):
                        sums[d] += dipoles[child, d, g]
                        sums[3 + d] += area * dipoles[child, 3 + d, g]
            for t in range(start, stop):
                for d in range(9):
                    low[d % 3] = min(low[d % 3], corners[t, d])
                    high[d % 3] = max(high[d % 3], corners[t, d])
            weights[node, c] = sums[6]
            radius2 = 0.0
            for d in range(3):
                dipoles[node, d, c] = sums[d]
                if stop > start:
                    centre = sums[3 + d] / sums[6] if sums[6] > 0 else (low[d] + high[d]) / 2
                    dipoles[node, 3 + d, c] = centre
                    radius2 += max(high[d] - centre, centre - low[d]) ** 2
            dipoles[node, 6, c] = math.sqrt(radius2)
    return dipoles
