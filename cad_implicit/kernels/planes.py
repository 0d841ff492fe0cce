"""Where the distance to a mesh is that to one plane: all triangles in reach lie in it.

A closed mesh whose triangles within a ball all lie in one plane covers that plane there, so the distance is linear as
far as no point's nearest triangle can lie outside the ball.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .bvh import TRUST
from .closest import closest_scaled, scaled
from .jit import jit, parallel_jit
from .stack import CHUNK, dealt, new_stack
from .triangle import FACE, leaf_distances
from .visit import push_children, single

#: Triangles of a plane that face the same way have normals at least this close (cosine): not the two sides of a sheet.
_SAME_SIDE = 0.5


@jit
def _only_plane(tree, x, y, z, radius2, triangle, tolerance, stack):
    """Whether all triangles nearer than the root of ``radius2`` lie in the plane of one of them, scaled."""
    codes, _, near, far, _ = stack
    nx, ny, nz = tree.normals[triangle, FACE]
    height = nx * tree.corners[triangle, 0] + ny * tree.corners[triangle, 1] + nz * tree.corners[triangle, 2]
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
            start = tree.first[leaf]
            for c in range(tree.first[leaf + 1] - start):
                if far[c] > radius2:
                    continue
                t = start + c
                m = tree.normals[t, FACE]
                if nx * m[0] + ny * m[1] + nz * m[2] < _SAME_SIDE:
                    return False
                for q in range(0, 9, 3):
                    above = nx * tree.corners[t, q] + ny * tree.corners[t, q + 1] + nz * tree.corners[t, q + 2] - height
                    if abs(above) > tolerance:
                        return False
            continue
        waiting = push_children(tree, code, fx, fy, fz, limit, near, codes, waiting)
    return True


@parallel_jit
def affine_distances(tree, points, radius, tolerance):
    """Signed distances ``(N,)``, gradients ``(N, 3)``, and whether they hold, as a linear function, within a radius.

    Values and gradients are set where they hold. ``radius`` and ``tolerance``, the largest distance between the plane
    and its triangles, are in mm.
    """
    count = len(points)
    values, gradients, holds = np.zeros(count), np.zeros((count, 3)), np.zeros(count, np.bool_)
    reach, slack = 2 * radius / tree.frame[3], tolerance / tree.frame[3]
    chunks = (count + CHUNK - 1) // CHUNK
    for number in prange(chunks):
        chunk = dealt(np.int64(number), chunks)
        _affine_chunk(tree, points, chunk, reach, slack, values, gradients, holds)
    return values, gradients, holds


@jit
def _affine_chunk(tree, points, chunk, reach, slack, values, gradients, holds):
    stack = new_stack()
    t = np.int64(-1)  # plain, as in closest.py
    for q in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(points))):
        x, y, z = scaled(tree, points[q, 0], points[q, 1], points[q, 2])
        d2, _, _, _, t, _ = closest_scaled(tree, x, y, z, math.inf, t, stack)
        if t < 0 or tree.doubtful[t] != 0:
            continue
        n = tree.normals[t, FACE]
        if n[0] == 0 and n[1] == 0 and n[2] == 0:
            continue
        if not _only_plane(tree, x, y, z, (math.sqrt(d2) + reach) ** 2, t, slack, stack):
            continue
        c = tree.corners[t]
        above = (x - c[0]) * n[0] + (y - c[1]) * n[1] + (z - c[2]) * n[2]
        holds[q] = True
        values[q] = -above * tree.frame[3]
        for d in range(3):
            gradients[q, d] = -n[d]
