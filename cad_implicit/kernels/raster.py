"""Signed distance on the nodes of a grid near a mesh: triangles scattered over the nodes within a band.

The grid is cut into slabs along its first axis; a slab is filled by one thread, triangles in the order of the mesh,
so the values do not depend on the number of threads. Coordinates are the tree's scaled ones; ``origin`` and
``step`` give the grid in them.
"""

from __future__ import annotations

import math

import numpy as np
from numba import prange

from .fences import clip, fences_of
from .jit import jit, parallel_jit
from .stack import new_stack
from .triangle import FACE, closest_on_triangle
from .winding import winding_scaled

#: Planes of nodes in a slab: 8 × 128² nodes with 12 bytes of scratch each stay in the second-level cache.
SLAB = 8
#: The band is widened by this factor, so that nodes next to one beyond the band are not on the surface.
WIDEN = 1.0 + 1e-6
#: Steps between probes of the winding number along a row beyond the band of an open mesh.
_PROBE = 8
#: Slopes of a plane along a row, per band, below which the row counts as parallel to it.
_PARALLEL = 1e-9


@jit
def slab_members(corners, order, origin_x, step_x, planes, band):
    """Triangles that reach each slab, in the order of the mesh: ``members[first[s]:first[s + 1]]``."""
    position = np.zeros(len(order), np.int32)
    for t in range(len(order)):
        position[order[t]] = t
    slabs = (planes + SLAB - 1) // SLAB
    span = np.zeros((len(order), 2), np.int32)
    first = np.zeros(slabs + 1, np.int64)
    for m in range(len(order)):
        t = position[m]
        low = min(corners[t, 0], corners[t, 3], corners[t, 6]) - band
        high = max(corners[t, 0], corners[t, 3], corners[t, 6]) + band
        bottom, top = math.ceil((low - origin_x) / step_x), math.floor((high - origin_x) / step_x)
        span[m, 0] = int(min(max(bottom, 0), planes)) // SLAB
        span[m, 1] = (int(min(max(top, -1), planes - 1)) + SLAB) // SLAB
        for s in range(span[m, 0], span[m, 1]):
            first[s + 1] += 1
    for s in range(slabs):
        first[s + 1] += first[s]
    members = np.zeros(first[slabs], np.int32)
    cursor = first[:-1].copy()
    for m in range(len(order)):
        for s in range(span[m, 0], span[m, 1]):
            members[cursor[s]] = position[m]
            cursor[s] += 1
    return first, members


@jit
def _steps(corners, t, axis, origin, step, band, start, stop):
    """Range of nodes along an axis within the band of the triangle's box, inside ``start:stop``."""
    low = min(corners[t, axis], corners[t, 3 + axis], corners[t, 6 + axis]) - band
    high = max(corners[t, axis], corners[t, 3 + axis], corners[t, 6 + axis]) + band
    first = math.ceil((low - origin) / step)
    last = math.floor((high - origin) / step)
    return int(min(max(first, start), stop)), int(max(min(last + 1, stop), start))


@jit
def _scatter(tree, t, origin, step, band, start, stop, best, who, touched, fences, slopes):
    """Lower the squared distances of all nodes within the band of triangle t, between planes start and stop."""
    corners = tree.corners
    i0, i1 = _steps(corners, t, 0, origin[0], step[0], band, start, stop)
    j0, j1 = _steps(corners, t, 1, origin[1], step[1], band, 0, best.shape[1])
    k0, k1 = _steps(corners, t, 2, origin[2], step[2], band, 0, best.shape[2])
    count = fences_of(tree, t, band, fences)
    for q in range(count):
        slopes[q] = fences[q, 2] * step[2]
        if abs(slopes[q]) * (k1 - k0) < _PARALLEL * band:
            slopes[q] = 0.0
    z0 = origin[2]
    for i in range(i0, i1):
        x = origin[0] + i * step[0]
        for j in range(j0, j1):
            y = origin[1] + j * step[1]
            low, high = clip(fences, count, slopes, x, y, z0, float(k0), float(k1 - 1))
            if low > high:
                continue
            touched[i - start, j] = True
            if count == 5:
                _scatter_row(
                    corners, t, fences, band, x, y, z0, step[2], low, high, best[i - start, j], who[i - start, j]
                )
                continue
            for k in range(math.ceil(low), math.floor(high) + 1):
                d2, _, _, _, feature = closest_on_triangle(corners, t, x, y, z0 + k * step[2])
                if d2 < best[i - start, j, k]:
                    best[i - start, j, k] = d2
                    who[i - start, j, k] = t * 8 + feature


@jit
def _scatter_row(corners, t, fences, band, x, y, z0, dz, low, high, best, who):
    """Lower the squared distances of the nodes from low to high of one row, for a triangle with a normal.

    The distances above the face and beyond the edges bound the distance from below; nine of ten nodes go no further.
    """
    gh, g0, g1, g2 = fences[0, 2], fences[2, 2], fences[3, 2], fences[4, 2]
    above = fences[0, 0] * x + fences[0, 1] * y - fences[0, 3] + band
    past0 = fences[2, 0] * x + fences[2, 1] * y - fences[2, 3] + band
    past1 = fences[3, 0] * x + fences[3, 1] * y - fences[3, 3] + band
    past2 = fences[4, 0] * x + fences[4, 1] * y - fences[4, 3] + band
    for k in range(math.ceil(low), math.floor(high) + 1):
        z = z0 + k * dz
        height = above + gh * z
        past = max(past0 + g0 * z, past1 + g1 * z, past2 + g2 * z)
        known = best[k]
        if past <= 0.0:
            if height * height < known:
                best[k] = height * height
                who[k] = t * 8 + FACE
        elif height * height + past * past < known:
            d2, _, _, _, feature = closest_on_triangle(corners, t, x, y, z)
            if d2 < known:
                best[k] = d2
                who[k] = t * 8 + feature


@jit
def _probe(tree, x, y, z0, dz, k, stop, row, far, stack):
    """Fill ``row[k:stop]``, which is beyond the band, by winding numbers a few steps apart."""
    before = winding_scaled(tree, x, y, z0 + k * dz, stack) > 0.5
    while k < stop:
        after_at = min(k + _PROBE, stop - 1)
        after = winding_scaled(tree, x, y, z0 + after_at * dz, stack) > 0.5
        for q in range(k, after_at + 1):
            inside = before
            if before != after:
                inside = winding_scaled(tree, x, y, z0 + q * dz, stack) > 0.5
            row[q] = far if inside else -far
        before = after
        k = after_at + 1


@jit
def _is_inside(tree, x, y, z, code, stack):
    """Side of a node whose closest triangle and feature are known."""
    t, feature = code >> 3, code & 7
    if tree.by_winding == 1 or (tree.doubtful[t] >> feature) & 1:
        return winding_scaled(tree, x, y, z, stack) > 0.5
    cx, cy, cz = tree.corners[t, 0], tree.corners[t, 1], tree.corners[t, 2]
    if feature != FACE:
        _, cx, cy, cz, _ = closest_on_triangle(tree.corners, t, x, y, z)
    normals = tree.normals
    nx, ny, nz = normals[t, feature, 0], normals[t, feature, 1], normals[t, feature, 2]
    return (x - cx) * nx + (y - cy) * ny + (z - cz) * nz < 0.0


@jit
def _sign_row(tree, x, y, z0, dz, best, who, row, band, is_open, stack):
    """Turn squared distances of one row into signed distances; beyond the band the side is that of the node before.

    A node beyond the band has no surface within a step of it, so its neighbours lie on its side. The first node of
    a row is outside, since the grid holds the mesh.
    """
    inside = tree.exterior == 1
    scale = tree.frame[3]
    far = band / WIDEN * scale
    k = 0
    while k < len(row):
        code = who[k]
        if code >= 0:
            inside = _is_inside(tree, x, y, z0 + k * dz, code, stack)
            distance = min(math.sqrt(best[k]) * scale, far)
            row[k] = distance if inside else -distance
        elif is_open:
            stop = k + 1
            while stop < len(row) and who[stop] < 0:
                stop += 1
            _probe(tree, x, y, z0, dz, k, stop, row, far, stack)
            k = stop - 1
        else:
            row[k] = far if inside else -far
        k += 1


@parallel_jit
def fill_slabs(tree, origin, step, band, slabs, workers, first, members, is_open, values):
    """Write the signed distances in mm of a range of slabs into ``values``.

    Parameters
    ----------
    tree : Tree
        Signed.
    origin, step : (3,) float64
        Grid in scaled coordinates.
    band : float
        Scaled, times WIDEN.
    slabs : (int, int)
        First slab and the one after the last.
    workers : int
        Number of threads; each has scratch for one slab and takes every so many-th.
    first, members
        From :func:`slab_members`.
    is_open : bool
        Whether inside and outside meet without a surface between them.
    values : (X, Y, Z) float32
    """
    planes, rows, length = values.shape
    for worker in prange(workers):
        stack = new_stack()
        fences, slopes = np.zeros((5, 4)), np.zeros(5)
        best = np.full((SLAB, rows, length), band * band)
        who = np.full((SLAB, rows, length), -1, np.int32)
        touched = np.zeros((SLAB, rows), np.bool_)
        for slab in range(slabs[0] + worker, slabs[1], workers):
            start, stop = slab * SLAB, min((slab + 1) * SLAB, planes)
            for m in range(first[slab], first[slab + 1]):
                _scatter(tree, members[m], origin, step, band, start, stop, best, who, touched, fences, slopes)
            for i in range(start, stop):
                x = origin[0] + i * step[0]
                for j in range(rows):
                    row = values[i, j]
                    if not (touched[i - start, j] or is_open):
                        row[:] = band / WIDEN * tree.frame[3] * (1.0 if tree.exterior == 1 else -1.0)
                        continue
                    y = origin[1] + j * step[1]
                    _sign_row(
                        tree, x, y, origin[2], step[2], best[i - start, j], who[i - start, j], row,
                        band, is_open, stack,
                    )  # fmt: skip
                    best[i - start, j] = band * band
                    who[i - start, j] = -1
                    touched[i - start, j] = False
