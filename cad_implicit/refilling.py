"""Refill: take single vertices out of a mesh, and fill the hole with the triangles that are nearest to a shape.

Where two surfaces nearly touch, the facets of both run through each other as chance will have it, and leave vertices
that are off both. Their place would be in a triangle beside them, or beyond it: moved there they would fold it, so they
go.

Not promised: vertices stay if the triangles without them were farther from the shape, or met others.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from .implicit import FloatArray, Implicit

#: Rings of more vertices are left alone: the work grows with the cube.
_MOST = 40

#: Places in a triangle at which it is compared with the shape: its middle, beside its corners, and on its sides.
_PLACES = np.array(
    [[1 / 3, 1 / 3, 1 / 3], [0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8],
     [0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]]
)  # fmt: skip
_INNER = 4

#: Triangles face as the shape does at one of these places: cosine (60 degrees). At creases the others are across them.
_FACING = 0.5

#: Thinnest triangles: height over the longest side.
_THIN = 1e-3

#: Relative rounding error of distances: the sides of a ring are sides of old and new triangles.
_ROUNDING = 1e-9

#: Share of the squares of the longest sides, times the spacing, that counts beside the volume between triangles and
#: shape: where that is nothing, on planes, the shortest sides decide.
_SHORT = 1e-3


def ring(faces: NDArray[np.int32], vertex: int) -> NDArray[np.int64] | None:
    """Vertices (N,) around a vertex in the order of its triangles (N, 3); None if they are not one closed ring."""
    after = {}
    for a, b, c in faces.tolist():
        one, other = (b, c) if a == vertex else ((c, a) if b == vertex else (a, b))
        after[one] = other
    start = next(iter(after))
    found, at = [start], after[start]
    while at != start and at in after and len(found) < len(after):
        found.append(at)
        at = after[at]
    return np.array(found) if at == start and len(found) == len(faces) else None


def filled(
    vertices: FloatArray, around: NDArray[np.int64], shape: Implicit, old: FloatArray, spacing: float
) -> NDArray[np.int64] | None:
    """Triangles (N - 2, 3) that fill the ring of a vertex; rows of its numbers from 0.

    Parameters
    ----------
    vertices : (V, 3) float64
    around : (N,) int64
        The ring in order, counterclockwise seen from outside.
    shape : Implicit
        Its values are distances near the surface.
    old : (N, 3, 3) float64
        Corners of the triangles that are there now.
    spacing : float
        Of the grid, in mm.

    Returns
    -------
    None if there are none that are as near to the shape as the old ones, and facing as it does as much as these.
    """
    count = len(around)
    if not 3 <= count <= _MOST:
        return None
    rows = np.array(list(combinations(range(count), 3)))
    corners = vertices[around[rows]]
    off, facing = compared(corners, shape)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    cost = off.mean(axis=1) * area + _SHORT * spacing * longest**2
    known, turned = compared(old, shape)
    bad = (off.max(axis=1) > (1 + _ROUNDING) * known.max()) | (2 * area < _THIN * longest**2)
    for least in (_FACING, min(_FACING, turned.min())):
        table = np.full((count, count, count), np.inf)
        table[tuple(rows.T)] = np.where(bad | (facing < least), np.inf, cost)
        found = _cheapest(table)
        if found is not None:
            break
    return found


def compared(corners: FloatArray, shape: Implicit) -> tuple[FloatArray, FloatArray]:
    """How far (N, 7) in mm triangles (N, 3, 3) are from the shape, and the best cosine (N,) with its direction."""
    places = _PLACES @ corners
    value, slope = shape.value_and_gradient(places.reshape(-1, 3))
    slope = slope.reshape(places.shape)[:, :_INNER]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)[:, None] * np.linalg.norm(slope, axis=2)
    cosine = -(slope * normal[:, None]).sum(axis=2) / np.where(size > 0, size, 1.0)
    return np.abs(value).reshape(places.shape[:2]), np.asarray(cosine.max(axis=1))


def _cheapest(cost: FloatArray) -> NDArray[np.int64] | None:
    """Triangles of a polygon (N - 2, 3) with the least sum of costs (N, N, N): Klincsek 1980."""
    count = len(cost)
    best, split = np.zeros((count, count)), np.zeros((count, count), np.int64)
    for width in range(2, count):
        for first in range(count - width):
            last = first + width
            middle = np.arange(first + 1, last)
            total = best[first, middle] + best[middle, last] + cost[first, middle, last]
            at = int(total.argmin())
            best[first, last], split[first, last] = total[at], middle[at]
    if not np.isfinite(best[0, count - 1]):
        return None
    rows: list[tuple[int, int, int]] = []
    waiting = [(0, count - 1)]
    while waiting:
        low, high = waiting.pop()
        if high - low > 1:
            between = int(split[low, high])
            rows.append((low, between, high))
            waiting += [(low, between), (between, high)]
    return np.array(rows)
