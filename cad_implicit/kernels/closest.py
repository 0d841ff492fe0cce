"""Closest point, signed distance and "is anything within" by the tree. Coordinates in mm unless named scaled.

Answers depend on the point alone, not on the seed or the order of points: ties go to the triangle that comes
first in the mesh. Points that are not finite get NaN.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .bvh import TRUST
from .jit import jit, parallel_jit
from .lanes import bits_below, lowest_bit
from .stack import CHUNK, dealt, new_stack
from .triangle import FACE, closest_on_triangle, leaf_distances
from .visit import child_bounds, push_children, single
from .winding import winding_scaled

_ZERO = np.float32(0)
#: Scaled meshes end at 0.51; from afar rounding hides which feature is closest, and with it the sign.
_OUTSIDE = 2.0
#: Nearer than this to the surface (scaled), the pseudonormal is a better gradient than the difference of points.
TOUCH = 1e-10


@jit
def closest_scaled(tree, x, y, z, limit2, seed, stack):
    """Squared distance, closest point, triangle and feature, all scaled; triangle -1 if none is nearer than limit2.

    ``seed`` is a triangle that is probably near, or -1.
    """
    codes, keys, near, far, _ = stack
    order = tree.order
    best, found = limit2, np.int64(-1)
    limit = np.float32(min(limit2, 1e37)) * TRUST
    if seed >= 0:
        limit = min(limit, np.float32(closest_on_triangle(tree.corners, seed, x, y, z)[0]) * TRUST)
    fx, fy, fz = single(x), single(y), single(z)
    waiting = 1
    codes[0], keys[0] = 0, _ZERO
    while waiting > 0:
        waiting -= 1
        if keys[waiting] > limit:
            continue
        code = codes[waiting]
        if code < 0:
            leaf = -code - 1
            leaf_distances(tree.blocks[leaf], x, y, z, far)
            if min(min(far[0], far[1]), min(far[2], far[3])) > best:
                continue
            start = tree.first[leaf]
            for c in range(tree.first[leaf + 1] - start):
                if far[c] < best or (far[c] == best and found >= 0 and order[start + c] < order[found]):
                    best, found = far[c], start + c
                    limit = min(limit, np.float32(best) * TRUST)
            continue
        child_bounds(tree.bounds[code], fx, fy, fz, near)
        floor = waiting
        bits = bits_below(near, limit)
        while bits != 0:
            c = lowest_bit(bits)
            bits &= bits - 1
            key, at = near[c], waiting
            while at > floor and keys[at - 1] < key:
                keys[at], codes[at] = keys[at - 1], codes[at - 1]
                at -= 1
            keys[at], codes[at] = key, tree.children[code, c]
            waiting += 1
    if found < 0:
        return best, x, y, z, found, 0
    d2, cx, cy, cz, feature = closest_on_triangle(tree.corners, found, x, y, z)
    return d2, cx, cy, cz, found, feature


@jit
def within_scaled(tree, x, y, z, radius2, stack):
    """Whether a triangle is nearer than the root of ``radius2``, scaled."""
    codes, _, near, far, _ = stack
    limit = np.float32(min(radius2, 1e37)) * TRUST
    fx, fy, fz = single(x), single(y), single(z)
    waiting = 1
    codes[0] = 0
    while waiting > 0:
        waiting -= 1
        code = codes[waiting]
        if code < 0:
            leaf = -code - 1
            leaf_distances(tree.blocks[leaf], x, y, z, far)
            if min(min(far[0], far[1]), min(far[2], far[3])) < radius2:
                return True
            continue
        waiting = push_children(tree, code, fx, fy, fz, limit, near, codes, waiting)
    return False


@jit
def is_inside(tree, x, y, z, cx, cy, cz, triangle, feature, stack):
    """Side of a scaled point, given its closest point: by pseudonormal, or winding number where that is in doubt."""
    if max(abs(x), abs(y), abs(z)) > _OUTSIDE:
        return tree.exterior == 1
    if tree.by_winding == 1 or (tree.doubtful[triangle] >> feature) & 1:
        return winding_scaled(tree, x, y, z, stack) > 0.5
    n = tree.normals[triangle, feature]
    return (x - cx) * n[0] + (y - cy) * n[1] + (z - cz) * n[2] < 0.0


@jit
def scaled(tree, x, y, z):
    """Scaled coordinates of a point in mm."""
    frame = tree.frame
    return (x - frame[0]) / frame[3], (y - frame[1]) / frame[3], (z - frame[2]) / frame[3]


@jit
def nearest(tree, x, y, z, bound, seed, stack):
    """Distance, closest point, triangle (in the tree's order) and feature; triangle -1 if none is below ``bound``.

    Parameters
    ----------
    tree : Tree
    x, y, z : float
        Point in mm.
    bound : float
        Search no farther than this, in mm; ``math.inf`` for no bound.
    seed : int
        A triangle in the tree's order that is probably near, or -1.
    stack
        From :func:`new_stack`, one for each thread.
    """
    frame = tree.frame
    sx, sy, sz = scaled(tree, x, y, z)
    d2, cx, cy, cz, t, f = closest_scaled(tree, sx, sy, sz, (bound / frame[3]) ** 2, seed, stack)
    scale = frame[3]
    if t < 0:
        finite = abs(sx + sy + sz) < math.inf
        return bound if finite else math.nan, math.nan, math.nan, math.nan, t, f
    return math.sqrt(d2) * scale, frame[0] + cx * scale, frame[1] + cy * scale, frame[2] + cz * scale, t, f


@jit
def is_within(tree, x, y, z, radius, stack):
    """Whether a triangle is nearer to the point than ``radius``, in mm."""
    sx, sy, sz = scaled(tree, x, y, z)
    return within_scaled(tree, sx, sy, sz, (radius / tree.frame[3]) ** 2, stack)


@jit
def signed_nearest(tree, x, y, z, seed, stack):
    """Signed distance (positive inside), closest point, gradient (unit, inward) and triangle (in the tree's order).

    On the surface itself the gradient is the pseudonormal, turned inward.
    """
    frame = tree.frame
    sx, sy, sz = scaled(tree, x, y, z)
    d2, cx, cy, cz, t, f = closest_scaled(tree, sx, sy, sz, math.inf, seed, stack)
    if t < 0:
        nan = math.nan
        return nan, nan, nan, nan, nan, nan, nan, t
    distance = math.sqrt(d2)
    sign = 1.0 if is_inside(tree, sx, sy, sz, cx, cy, cz, t, f, stack) else -1.0
    n = tree.normals[t, f]
    gx, gy, gz = -n[0], -n[1], -n[2]
    if distance > TOUCH and (f != FACE or tree.by_winding == 1):
        gx, gy, gz = sign * (sx - cx) / distance, sign * (sy - cy) / distance, sign * (sz - cz) / distance
    scale = frame[3]
    px, py, pz = frame[0] + cx * scale, frame[1] + cy * scale, frame[2] + cz * scale
    return sign * distance * scale, px, py, pz, gx, gy, gz, t


@parallel_jit
def signed_distances(tree, points):
    """Signed distances ``(N,)`` and gradients ``(N, 3)`` at points ``(N, 3)``."""
    values, gradients = np.zeros(len(points)), np.zeros((len(points), 3))
    chunks = (len(points) + CHUNK - 1) // CHUNK
    for number in prange(chunks):
        _signed_chunk(tree, points, dealt(np.int64(number), chunks), values, gradients)
    return values, gradients


@jit
def _signed_chunk(tree, points, chunk, values, gradients):
    stack = new_stack()
    seed = np.int64(-1)  # plain, its value would be part of the type: all below would be compiled twice
    for q in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(points))):
        value, _, _, _, gx, gy, gz, seed = signed_nearest(tree, points[q, 0], points[q, 1], points[q, 2], seed, stack)
        values[q], gradients[q, 0], gradients[q, 1], gradients[q, 2] = value, gx, gy, gz


@parallel_jit
def closest_points(tree, points):
    """Distance ``(N,)``, closest point ``(N, 3)``, triangle in the mesh's order and feature at points ``(N, 3)``."""
    count = len(points)
    distance, closest = np.zeros(count), np.zeros((count, 3))
    triangle, position, feature = np.zeros(count, np.int32), np.zeros(count, np.int32), np.zeros(count, np.int8)
    chunks = (count + CHUNK - 1) // CHUNK
    for number in prange(chunks):
        chunk = dealt(np.int64(number), chunks)
        _closest_chunk(tree, points, chunk, distance, closest, triangle, position, feature)
    return distance, closest, triangle, position, feature


@jit
def _closest_chunk(tree, points, chunk, distance, closest, triangle, position, feature):
    stack = new_stack()
    seed = np.int64(-1)  # as above
    for q in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(points))):
        d, cx, cy, cz, seed, f = nearest(tree, points[q, 0], points[q, 1], points[q, 2], math.inf, seed, stack)
        distance[q], closest[q, 0], closest[q, 1], closest[q, 2] = d, cx, cy, cz
        triangle[q] = tree.order[seed] if seed >= 0 else -1
        position[q] = seed
        feature[q] = f


@parallel_jit
def unsigned_distances(tree, points):
    """Distances ``(N,)`` from points ``(N, 3)``."""
    out = np.zeros(len(points))
    chunks = (len(points) + CHUNK - 1) // CHUNK
    for number in prange(chunks):
        _unsigned_chunk(tree, points, dealt(np.int64(number), chunks), out)
    return out


@jit
def _unsigned_chunk(tree, points, chunk, out):
    stack = new_stack()
    seed = np.int64(-1)  # as above
    for q in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(points))):
        out[q], _, _, _, seed, _ = nearest(tree, points[q, 0], points[q, 1], points[q, 2], math.inf, seed, stack)


@parallel_jit
def any_within(tree, points, radii):
    """Whether anything lies nearer to points ``(N, 3)`` than their radii ``(N,)``."""
    out = np.zeros(len(points), np.bool_)
    chunks = (len(points) + CHUNK - 1) // CHUNK
    for number in prange(chunks):
        _within_chunk(tree, points, radii, dealt(np.int64(number), chunks), out)
    return out


@jit
def _within_chunk(tree, points, radii, chunk, out):
    stack = new_stack()
    for q in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(points))):
        out[q] = is_within(tree, points[q, 0], points[q, 1], points[q, 2], radii[q], stack)
