"""Edges of triangles: counted, and paired."""

from __future__ import annotations

import math

import numpy as np

from .jit import jit


@jit
def open_edges(count, faces):
    """Directed edges of triangles (F, 3) among ``count`` vertices that are not met by exactly one opposite edge.

    0 for a closed mesh. Edges and opposite edges, both in order, are gone through side by side: an eighth of the time
    that NumPy takes to find unique edges.
    """
    one, other = np.zeros(3 * len(faces), np.int32), np.zeros(3 * len(faces), np.int32)
    for f in range(len(faces)):
        for c in range(3):
            one[3 * f + c], other[3 * f + c] = faces[f, c], faces[f, (c + 1) % 3]
    start, end = _in_order(count, one, other)
    back, front = _in_order(count, other, one)  # of opposite edges: start, end
    wrong, i, j = 0, 0, 0
    while i < len(start) or j < len(back):
        at = np.int64(count) * count if i == len(start) else np.int64(start[i]) * count + end[i]
        against = np.int64(count) * count if j == len(back) else np.int64(back[j]) * count + front[j]
        first = min(at, against)
        number, partners = 0, 0
        while i < len(start) and np.int64(start[i]) * count + end[i] == first:
            i, number = i + 1, number + 1
        while j < len(back) and np.int64(back[j]) * count + front[j] == first:
            j, partners = j + 1, partners + 1
        if number > 0:
            wrong += abs(number - partners) if number != partners else number - 1
    return wrong


@jit
def _in_order(count, first, second):
    """Pairs in the order of the first, then the second number."""
    order = _sorted_by(count, first, _sorted_by(count, second, np.arange(len(first), dtype=np.int32)))
    return first[order], second[order]


@jit
def paired_sides(count, faces):
    """Sides (E, 2) of the edges that triangles (F, 3) among ``count`` vertices share.

    Side s is from corner s % 3 of triangle s // 3 to the next. In the order of the lower, then the higher of an edge's
    vertices; both sides of one edge in the order of triangles. Edges of more than two triangles are there more than
    once. A third of the time that NumPy takes to sort.
    """
    low, high = np.empty(3 * len(faces), np.int32), np.empty(3 * len(faces), np.int32)
    for f in range(len(faces)):
        for c in range(3):
            a, b = faces[f, c], faces[f, (c + 1) % 3]
            low[3 * f + c], high[3 * f + c] = min(a, b), max(a, b)
    order = _sorted_by(count, low, _sorted_by(count, high, np.arange(len(low), dtype=np.int32)))
    sides = np.empty((len(low), 2), np.int32)
    n = 0
    for q in range(len(order) - 1):
        one, other = order[q], order[q + 1]
        if low[one] == low[other] and high[one] == high[other]:
            sides[n, 0], sides[n, 1] = one, other
            n += 1
    return sides[:n].copy()


@jit
def _sorted_by(count, key, order):
    """Items in the order of their keys below ``count``; alike ones stay in theirs."""
    place = np.zeros(count + 1, np.int64)
    for k in key:
        place[k + 1] += 1
    for v in range(count):
        place[v + 1] += place[v]
    result = np.zeros_like(order)
    for item in order:
        result[place[key[item]]] = item
        place[key[item]] += 1
    return result


@jit
def bent_sides(position, faces, flat):
    """Those of :func:`paired_sides` at which triangles turn by more than an angle of cosine ``flat``.

    ``position`` (V, 3). Triangles without area turn by 90 degrees.
    """
    normal = np.zeros((len(faces), 3))
    for f in range(len(faces)):
        x, y, z = _normal(position, faces, f)
        length = math.sqrt(x * x + y * y + z * z)
        if length > 0:
            normal[f, 0], normal[f, 1], normal[f, 2] = x / length, y / length, z / length
    sides = paired_sides(len(position), faces)
    n = 0
    for e in range(len(sides)):
        s, t = sides[e, 0] // 3, sides[e, 1] // 3
        cosine = normal[s, 0] * normal[t, 0] + normal[s, 1] * normal[t, 1] + normal[s, 2] * normal[t, 2]
        if cosine < flat:
            sides[n, 0], sides[n, 1] = sides[e, 0], sides[e, 1]
            n += 1
    return sides[:n].copy()


@jit
def _normal(position, faces, f):
    """Give the normal of a triangle, twice as long as its area."""
    a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
    ux, uy, uz = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1], position[b, 2] - position[a, 2]
    vx, vy, vz = position[c, 0] - position[a, 0], position[c, 1] - position[a, 1], position[c, 2] - position[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@jit
def cone_volumes(position, faces, centre, shell, shells):
    """Signed volumes (S,) of the cones from a point (3,) to all triangles (F, 3) of each of ``shells`` shells.

    ``shell`` (F,) tells of which shell each triangle is.
    """
    volume = np.zeros(shells)
    for f in range(len(faces)):
        x, y, z = _normal(position, faces, f)
        a = faces[f, 0]
        x, y, z = x * (position[a, 0] - centre[0]), y * (position[a, 1] - centre[1]), z * (position[a, 2] - centre[2])
        volume[shell[f]] += (x + y + z) / 6
    return volume
