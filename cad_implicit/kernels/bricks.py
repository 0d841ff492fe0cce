"""Bricks of 8³ nodes: Morton order, neighbours, sub-blocks on the way from a brick down to single nodes.

Node ``(i, j, k)`` of a brick has the linear number ``64 i + 8 j + k``. A sub-block of ``size`` nodes a side has the
number ``brick * (8 / size)³ + m`` where ``m`` counts the sub-blocks of one brick along the Morton curve, so that
the children of block ``n`` are ``8 n … 8 n + 7`` and neighbouring numbers are close in space.
"""

import math

import numba
import numpy as np

from .jit import jit, parallel_jit

#: Nodes of a brick.
NODES = 512

#: Value of a node of which only the sign is known.
SIGN_ONLY = np.float32(np.inf)


def _nodes_along_morton_curve():
    m = np.arange(NODES)
    i, j, k = ((((m >> (s + 6)) & 1) << 2) | (((m >> (s + 3)) & 1) << 1) | ((m >> s) & 1) for s in (2, 1, 0))
    return (64 * i + 8 * j + k).astype(np.int32)


#: Linear number of the m-th node of a brick along the Morton curve.
MORTON_NODE = _nodes_along_morton_curve()


@jit
def _spread(value):
    """Bits of a number below 2²¹, each followed by two zeros."""
    x = np.uint64(value)
    x = (x | (x << np.uint64(32))) & np.uint64(0x1F00000000FFFF)
    x = (x | (x << np.uint64(16))) & np.uint64(0x1F0000FF0000FF)
    x = (x | (x << np.uint64(8))) & np.uint64(0x100F00F00F00F00F)
    x = (x | (x << np.uint64(4))) & np.uint64(0x10C30C30C30C30C3)
    return (x | (x << np.uint64(2))) & np.uint64(0x1249249249249249)


@jit
def morton_key(i, j, k):
    """Place of a block along the Morton curve; coordinates from 0 to 2²¹ - 1."""
    return np.int64((_spread(i) << np.uint64(2)) | (_spread(j) << np.uint64(1)) | _spread(k))


@parallel_jit
def morton_keys(blocks):
    """Morton keys (N,) int64 of blocks (N, 3)."""
    keys = np.empty(len(blocks), np.int64)
    for b in numba.prange(len(blocks)):
        keys[b] = morton_key(blocks[b, 0], blocks[b, 1], blocks[b, 2])
    return keys


@jit
def split(blocks, counts):
    """Halve blocks along each axis, keeping the halves whose coordinates are below ``counts``, in Morton order."""
    out = np.empty((8 * len(blocks), 3), np.int32)
    n = 0
    for b in range(len(blocks)):
        for octant in range(8):
            i = 2 * blocks[b, 0] + (octant >> 2)
            j = 2 * blocks[b, 1] + ((octant >> 1) & 1)
            k = 2 * blocks[b, 2] + (octant & 1)
            if i < counts[0] and j < counts[1] and k < counts[2]:
                out[n, 0], out[n, 1], out[n, 2] = i, j, k
                n += 1
    return out[:n]


@jit
def find_key(keys, key):
    """Position of ``key`` in sorted ``keys``, or -1."""
    position = np.searchsorted(keys, key)
    if position < len(keys) and keys[position] == key:
        return position
    return -1


@parallel_jit
def neighbour_table(blocks, keys):
    """Numbers (B, 27) of the bricks around each brick, -1 where there is none; ``13 + 9 dx + 3 dy + dz``."""
    table = np.empty((len(blocks), 27), np.int32)
    for b in numba.prange(len(blocks)):
        for n in range(27):
            i = blocks[b, 0] + n // 9 - 1
            j = blocks[b, 1] + n // 3 % 3 - 1
            k = blocks[b, 2] + n % 3 - 1
            table[b, n] = -1 if i < 0 or j < 0 or k < 0 else find_key(keys, morton_key(i, j, k))
    return table


@jit
def _side(offset):
    """First node, and the one after the last, of the nodes that touch a neighbour at an offset along an axis."""
    if offset < 0:
        return 0, 1
    if offset > 0:
        return 7, 8
    return 0, 8


@parallel_jit
def signs_around_missing(values, neighbours):
    """Signs (B, 27) of the nodes that touch each missing neighbour: bit 1 for inside, bit 2 for outside, 0 if held."""
    seen = np.zeros((len(values), 27), np.uint8)
    for b in numba.prange(len(values)):
        for n in range(27):
            if neighbours[b, n] >= 0:
                continue
            (i0, i1), (j0, j1), (k0, k1) = _side(n // 9 - 1), _side(n // 3 % 3 - 1), _side(n % 3 - 1)
            bits = np.uint8(0)
            for i in range(i0, i1):
                for j in range(j0, j1):
                    for k in range(k0, k1):
                        bits |= np.uint8(1) if values[b, 64 * i + 8 * j + k] > 0 else np.uint8(2)
            seen[b, n] = bits
    return seen


@parallel_jit
def blocks_beside_others(blocks, keys, state):
    """Whether a block (N,) is of mixed sign (state 0) or has a neighbour of another state."""
    needed = np.zeros(len(blocks), np.bool_)
    for b in numba.prange(len(blocks)):
        needed[b] = state[b] == 0
        n = 0
        while not needed[b] and n < 27:
            i = blocks[b, 0] + n // 9 - 1
            j = blocks[b, 1] + n // 3 % 3 - 1
            k = blocks[b, 2] + n % 3 - 1
            if i >= 0 and j >= 0 and k >= 0:
                other = find_key(keys, morton_key(i, j, k))
                needed[b] = other >= 0 and state[other] != state[b]
            n += 1
    return needed


@parallel_jit
def block_centres(blocks, ids, size, origin, spacing):
    """Centres (N, 3) in mm of the nodes of the sub-blocks ``ids`` of ``size`` nodes a side."""
    per_brick = NODES // size**3
    points = np.empty((len(ids), 3))
    half = 0.5 * (size - 1)
    for n in numba.prange(len(ids)):
        brick = ids[n] // per_brick
        node = MORTON_NODE[ids[n] % per_brick * size**3]
        points[n, 0] = origin[0] + spacing * (8 * blocks[brick, 0] + (node >> 6) + half)
        points[n, 1] = origin[1] + spacing * (8 * blocks[brick, 1] + ((node >> 3) & 7) + half)
        points[n, 2] = origin[2] + spacing * (8 * blocks[brick, 2] + (node & 7) + half)
    return points


@jit
def prune(centre_values, ids, size, limit, values):
    """Write the sign of sub-blocks beyond ``limit`` to ``values`` (B, 512); return the others."""
    per_brick = NODES // size**3
    volume = size**3
    rest = np.empty(len(ids), np.int64)
    n = 0
    for q in range(len(ids)):
        value = centre_values[q]
        if abs(value) > limit:
            brick = ids[q] // per_brick
            first = ids[q] % per_brick * volume
            for m in range(first, first + volume):
                values[brick, MORTON_NODE[m]] = SIGN_ONLY if value > 0 else -SIGN_ONLY
        else:
            rest[n] = ids[q]
            n += 1
    return rest[:n]


@jit
def children(ids):
    """Numbers of the eight sub-blocks of each sub-block."""
    out = np.empty(8 * len(ids), np.int64)
    for q in range(len(ids)):
        for octant in range(8):
            out[8 * q + octant] = 8 * ids[q] + octant
    return out


@parallel_jit
def fill_planes(ids, size, planes, first, blocks, origin, spacing, values, plane):
    """Write the values of linear functions to the nodes of sub-blocks, and the numbers of their planes to ``plane``.

    Row q of ``planes`` (N, 4), the gradient and the value at the origin of coordinates, belongs to sub-block
    ``ids[q]`` and has the number ``first + q``.
    """
    per_brick = NODES // size**3
    volume = size**3
    for q in numba.prange(len(ids)):
        brick = ids[q] // per_brick
        start = ids[q] % per_brick * volume
        for m in range(start, start + volume):
            node = MORTON_NODE[m]
            x = origin[0] + spacing * (8 * blocks[brick, 0] + (node >> 6))
            y = origin[1] + spacing * (8 * blocks[brick, 1] + ((node >> 3) & 7))
            z = origin[2] + spacing * (8 * blocks[brick, 2] + (node & 7))
            values[brick, node] = planes[q, 0] * x + planes[q, 1] * y + planes[q, 2] * z + planes[q, 3]
            plane[brick, node] = first + q


@jit
def store_nodes(node_values, ids, values):
    """Write node values (N,) of nodes ``ids`` to ``values`` (B, 512)."""
    for q in range(len(ids)):
        values[ids[q] // NODES, MORTON_NODE[ids[q] % NODES]] = node_values[q]


@jit
def sign_states(values):
    """State (B,) of each brick: 1 all inside, -1 none inside, 0 mixed."""
    state = np.empty(len(values), np.int8)
    for b in range(len(values)):
        inside = 0
        for n in range(NODES):
            inside += values[b, n] > 0
        state[b] = 1 if inside == NODES else (-1 if inside == 0 else 0)
    return state


@jit
def box_depth(points, n, low, high):
    """How deep point ``n`` lies inside a box, with the axis and the direction of the nearest side."""
    depth = math.inf
    axis = 0
    inward = 1.0
    for d in range(3):
        if points[n, d] - low[d] < depth:
            depth, axis, inward = points[n, d] - low[d], d, 1.0
        if high[d] - points[n, d] < depth:
            depth, axis, inward = high[d] - points[n, d], d, -1.0
    return depth, axis, inward


@jit
def crop_values(points, values, low, high, slope):
    """Intersect with a box in place: ``min(f, slope * depth)``; whether the box cut off any inside point."""
    cut = False
    for n in range(len(points)):
        depth = slope * box_depth(points, n, low, high)[0]
        if depth < values[n]:
            cut |= depth <= 0 < values[n]
            values[n] = depth
    return cut


@jit
def crop_gradients(points, values, gradients, low, high):
    """Intersect values and gradients with a box in place; compared by first-order distances."""
    for n in range(len(points)):
        depth, axis, inward = box_depth(points, n, low, high)
        slope = math.sqrt(gradients[n, 0] ** 2 + gradients[n, 1] ** 2 + gradients[n, 2] ** 2)
        if slope == 0 or depth * slope < values[n]:
            slope = 1.0 if slope == 0 else slope
            if depth * slope < values[n]:
                values[n] = depth * slope
                gradients[n] = 0.0
                gradients[n, axis] = inward * slope
