"""Self-intersections of a triangle mesh, counted independently of everything that makes meshes.

Candidates come from a tree of boxes over the triangles in Morton order. Two triangles cross if an edge of one runs
through the other; the signs of the volumes that decide it are trusted only beyond their rounding error (Shewchuk 1997,
DOI 10.1007/PL00009321, stage A), so that everything counted is certain, and surfaces that merely touch do not count.

Not promised: crossings shallower than rounding, about 1e-16 of the part, are missed, and so are pairs of which edges
meet edges exactly.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from cad_implicit import parallel
from cad_implicit.kernels.jit import jit, parallel_jit
from cad_implicit.mesh import Mesh

#: Rounding error of the volumes and of the areas relative to the sum of their absolute products.
_VOLUME_ERROR = 7.8e-16
_AREA_ERROR = 3.4e-16

#: Neighbours across an edge that enclose less than this angle are folded onto each other.
FOLD_DEGREES = 0.1

#: Triangles in a leaf of the tree, and steps of a Morton code along each axis (2 to the power).
_LEAF = 4
_MORTON_BITS = 10
_STACK = 64

_CROSSING, _AT_VERTEX, _FOLD = 1, 2, 3


class Intersections(NamedTuple):
    """Pairs of triangles that share points they should not share.

    Attributes
    ----------
    crossings : (N, 2) int64
        Pairs without a common vertex that run through each other or overlap in one plane.
    at_vertices : (N, 2) int64
        Pairs with one common vertex that run through each other or overlap in one plane.
    folds : (N, 2) int64
        Pairs with a common edge that lie on each other, and double triangles.
    """

    crossings: NDArray[np.int64]
    at_vertices: NDArray[np.int64]
    folds: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of pairs of all kinds."""
        return len(self.crossings) + len(self.at_vertices) + len(self.folds)


def find_intersections(mesh: Mesh, *, fold_degrees: float = FOLD_DEGREES) -> Intersections:
    """Find all pairs of triangles that run through each other or lie on each other.

    Parameters
    ----------
    mesh : Mesh
    fold_degrees : float
        Smallest angle that neighbours across an edge may enclose.
    """
    # Not moved to the middle: that would round, and edges that all but meet would cross.
    corners = mesh.vertices[mesh.faces]
    order = _morton_order(corners.mean(axis=1))
    corners = corners[order]
    faces = np.ascontiguousarray(mesh.faces[order])
    low, high = corners.min(axis=1), corners.max(axis=1)
    levels, node_low, node_high = _tree(low, high)
    cosine = math.cos(math.radians(fold_degrees))
    args = (corners, faces, low, high, levels, node_low, node_high, cosine)
    with parallel.threads():
        found = _count(*args)
        start = np.concatenate([[0], np.cumsum(found)])
        pairs, kind = _collect(*args, start)
    pairs = order[pairs]
    return Intersections(*(pairs[kind == k] for k in (_CROSSING, _AT_VERTEX, _FOLD)))


def count_intersections(mesh: Mesh) -> int:
    """Count the pairs of triangles that run through each other or lie on each other."""
    return find_intersections(mesh).count


def _morton_order(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Order of points along a Z curve."""
    low, high = points.min(axis=0), points.max(axis=0)
    cell = ((points - low) / np.maximum(high - low, 1e-300) * (2**_MORTON_BITS - 1)).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for bit in range(_MORTON_BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def _tree(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Boxes of runs of 4, 8, 16 … triangles: first node of each level, and all boxes, the leaves first."""
    lows, highs, levels = [], [], [0]
    width = _LEAF
    while True:
        starts = np.arange(0, len(low), width)
        low, high = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
        lows.append(low)
        highs.append(high)
        levels.append(levels[-1] + len(low))
        if len(low) == 1:
            return np.array(levels), np.concatenate(lows), np.concatenate(highs)
        width = 2


@jit
def _volume_sign(a, b, c, d):
    """Sign of the volume of a tetrahedron; 0 if it is within rounding error."""
    ax, ay, az = a[0] - d[0], a[1] - d[1], a[2] - d[2]
    bx, by, bz = b[0] - d[0], b[1] - d[1], b[2] - d[2]
    cx, cy, cz = c[0] - d[0], c[1] - d[1], c[2] - d[2]
    value = az * (bx * cy - cx * by) + bz * (cx * ay - ax * cy) + cz * (ax * by - bx * ay)
    size = (
        abs(az) * (abs(bx * cy) + abs(cx * by))
        + abs(bz) * (abs(cx * ay) + abs(ax * cy))
        + abs(cz) * (abs(ax * by) + abs(bx * ay))
    )
    if abs(value) <= _VOLUME_ERROR * size:
        return 0
    return 1 if value > 0 else -1


@jit
def _area_sign(a, b, c, u, v):
    """Sign of the area of a triangle seen along one axis, by the axes ``u`` and ``v``."""
    left = (a[u] - c[u]) * (b[v] - c[v])
    right = (a[v] - c[v]) * (b[u] - c[u])
    if abs(left - right) <= _AREA_ERROR * (abs(left) + abs(right)):
        return 0
    return 1 if left > right else -1


@jit
def _pierces(p, q, t):
    """Whether the segment p-q runs through the inside of the triangle from one side to the other."""
    below, above = _volume_sign(t[0], t[1], t[2], p), _volume_sign(t[0], t[1], t[2], q)
    if below * above >= 0:
        return False
    first = _volume_sign(p, q, t[0], t[1])
    return first != 0 and first == _volume_sign(p, q, t[1], t[2]) and first == _volume_sign(p, q, t[2], t[0])


@jit
def _in_one_plane(one, other):
    """Whether the corners of one triangle are in the plane of the other."""
    flat = 0
    for k in range(3):
        flat += _volume_sign(one[0], one[1], one[2], other[k]) == 0
    return flat == 3


@jit
def _overlap(one, other):
    """Whether two triangles in one plane share area."""
    a, b = one[1] - one[0], one[2] - one[0]
    nx, ny, nz = abs(a[1] * b[2] - a[2] * b[1]), abs(a[2] * b[0] - a[0] * b[2]), abs(a[0] * b[1] - a[1] * b[0])
    u, v = 0, 1
    if nx >= ny and nx >= nz:
        u, v = 1, 2
    elif ny >= nz:
        u, v = 2, 0
    for triangle in range(2):
        t, s = (one, other) if triangle == 0 else (other, one)
        turn = _area_sign(t[0], t[1], t[2], u, v)
        if turn == 0:
            return False
        for k in range(3):  # an edge of one triangle has all of the other beyond it: apart
            p, q = t[k], t[(k + 1) % 3]
            beyond = True
            for m in range(3):
                if _area_sign(p, q, s[m], u, v) * turn > 0:
                    beyond = False
            if beyond:
                return False
    return True


@jit
def _folded(one, other, f, g, cosine):
    """Whether two triangles with a common edge enclose next to no angle."""
    i, j = 0, 0
    for k in range(3):
        if f[k] != g[0] and f[k] != g[1] and f[k] != g[2]:
            i = k
        if g[k] != f[0] and g[k] != f[1] and g[k] != f[2]:
            j = k
    start = one[(i + 1) % 3]
    edge = one[(i + 2) % 3] - start
    length2 = (edge * edge).sum()
    if length2 == 0:
        return False
    a, b = one[i] - start, other[j] - start
    a = a - edge * ((a * edge).sum() / length2)
    b = b - edge * ((b * edge).sum() / length2)
    size = math.sqrt((a * a).sum() * (b * b).sum())
    return size > 0 and (a * b).sum() > cosine * size


@jit
def _relation(one, other, f, g, cosine):
    """Return how two triangles meet that should not: crossing, crossing at a common vertex, folded, or 0."""
    common = 0
    for k in range(3):
        if f[k] == g[0] or f[k] == g[1] or f[k] == g[2]:
            common += 1
    if common == 3:
        return _FOLD
    if common == 2:
        return _FOLD if _folded(one, other, f, g, cosine) else 0
    kind = _AT_VERTEX if common == 1 else _CROSSING
    if _in_one_plane(one, other):
        return kind if _overlap(one, other) else 0
    for k in range(3):
        if _pierces(one[k], one[(k + 1) % 3], other) or _pierces(other[k], other[(k + 1) % 3], one):
            return kind
    return 0


@jit
def _visit(i, corners, faces, low, high, levels, node_low, node_high, cosine, waiting, pairs, kinds):
    """Partners of triangle ``i`` that come after it: their number; noted in ``pairs`` where that has room."""
    found = 0
    top = len(levels) - 2
    waiting[0, 0], waiting[0, 1] = top, 0
    size = 1
    while size > 0:
        size -= 1
        level, node = waiting[size, 0], waiting[size, 1]
        box = levels[level] + node
        last = (node + 1) * (_LEAF << level) - 1
        if last <= i:
            continue
        apart = False
        for k in range(3):
            if node_low[box, k] > high[i, k] or node_high[box, k] < low[i, k]:
                apart = True
        if apart:
            continue
        if level > 0:
            for child in (2 * node, 2 * node + 1):
                if child < levels[level] - levels[level - 1]:
                    waiting[size, 0], waiting[size, 1] = level - 1, child
                    size += 1
            continue
        for j in range(max(node * _LEAF, i + 1), min((node + 1) * _LEAF, len(corners))):
            apart = False
            for k in range(3):
                if low[j, k] > high[i, k] or high[j, k] < low[i, k]:
                    apart = True
            if apart:
                continue
            kind = _relation(corners[i], corners[j], faces[i], faces[j], cosine)
            if kind > 0:
                if found < len(pairs):
                    pairs[found, 0], pairs[found, 1], kinds[found] = i, j, kind
                found += 1
    return found


@parallel_jit
def _count(corners, faces, low, high, levels, node_low, node_high, cosine):
    """Count the partners (N,) of each triangle."""
    found = np.zeros(len(corners), np.int64)
    for i in prange(len(corners)):
        waiting = np.zeros((_STACK, 2), np.int64)
        none, kinds = np.zeros((0, 2), np.int64), np.zeros(0, np.int8)
        found[i] = _visit(
            i, corners, faces, low, high, levels, node_low, node_high, cosine, waiting, none, kinds
        )  # fmt: skip
    return found


@jit
def _collect(corners, faces, low, high, levels, node_low, node_high, cosine, start):
    """Pairs (N, 2) and their kinds (N,), for the triangles that have any."""
    pairs, kinds = np.zeros((start[-1], 2), np.int64), np.zeros(start[-1], np.int8)
    waiting = np.zeros((_STACK, 2), np.int64)
    for i in range(len(corners)):
        a, b = start[i], start[i + 1]
        if b > a:
            _visit(
                i, corners, faces, low, high, levels, node_low, node_high, cosine, waiting, pairs[a:b], kinds[a:b]
            )  # fmt: skip
    return pairs, kinds
