"""The vertex of each piece of surface in a cell: the point nearest to all of its tangent planes.

Quadratic error function about the mass point, solved by the pseudo-inverse with truncated eigenvalues: Ju et al.
2002, DOI 10.1145/566654.566586. All lengths are in spacings from the cell's lowest corner.
"""

import math

import numba
import numpy as np

from .cell_tables import LOOP_OF_EDGE, LOOPS
from .crossings import edge_index
from .jit import jit, parallel_jit

#: Eigenvalues below this part of the largest one are dropped: two equal weights at 16 degrees have a ratio of 0.02.
TRUNCATION = 0.02

#: How far a vertex may leave its cell, in spacings: a crease may pass a corner of the cell, and the tip of a wedge lies
#: beyond the last crossed cell. Share of the points on sharp edges that are off by more than 0.02 spacings, for
#: 0.5 / 1.0 / 1.5 / 2.5: edges of 60 degrees 2.9 / 0 / 0 / 0 %, a star with tips of 40 degrees 9 / 1.5 / 0 / 0 %,
#: a wedge of 22 degrees 11 / 5 / 1.3 / 0 %. Slivers and self-intersections stay the same up to 1.5; folds grow beyond.
MARGIN = 1.5

_CHUNK = 256


@jit
def jacobi(a, vectors):
    """Diagonalise the symmetric matrix ``a`` (3, 3) in place by Jacobi rotations; ``vectors`` gets the columns."""
    for i in range(3):
        for j in range(3):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(12):
        off = abs(a[0, 1]) + abs(a[0, 2]) + abs(a[1, 2])
        if off <= 1e-15 * (abs(a[0, 0]) + abs(a[1, 1]) + abs(a[2, 2])):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0:
                    continue
                theta = (a[q, q] - a[p, p]) / (2 * a[p, q])
                t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1))
                c = 1 / math.sqrt(t * t + 1)
                s = t * c
                for m in range(3):
                    x, y = a[m, p], a[m, q]
                    a[m, p], a[m, q] = c * x - s * y, s * x + c * y
                for m in range(3):
                    x, y = a[p, m], a[q, m]
                    a[p, m], a[q, m] = c * x - s * y, s * x + c * y
                    x, y = vectors[m, p], vectors[m, q]
                    vectors[m, p], vectors[m, q] = c * x - s * y, s * x + c * y


@jit
def _minimise(a, vectors, right, mass, position):
    """Minimiser of the error within the margin, its rank; fewer eigenvalues are kept until it fits."""
    jacobi(a, vectors)
    largest = max(a[0, 0], a[1, 1], a[2, 2])
    threshold = TRUNCATION
    for attempt in range(3):
        rank = 0
        for d in range(3):
            position[d] = mass[d]
        for e in range(3):
            if a[e, e] > threshold * largest:
                rank += 1
                amount = (vectors[0, e] * right[0] + vectors[1, e] * right[1] + vectors[2, e] * right[2]) / a[e, e]
                for d in range(3):
                    position[d] += amount * vectors[d, e]
        fits = True
        for d in range(3):
            fits &= -MARGIN <= position[d] <= 1 + MARGIN
        if fits:
            return rank
        threshold = 8 * TRUNCATION if attempt == 0 else 0.999
    for d in range(3):
        position[d] = min(max(position[d], -MARGIN), 1 + MARGIN)
    return 1


@jit
def _representatives(normal, edges, loops, loop, count, out):
    """Edges with the two most different normals of a loop, and the one farthest from their plane."""
    lowest = 2.0
    for p in range(count):
        for q in range(p):
            if loops[p] == loop and loops[q] == loop:
                m, n = edges[p], edges[q]
                cosine = normal[m, 0] * normal[n, 0] + normal[m, 1] * normal[n, 1] + normal[m, 2] * normal[n, 2]
                if cosine < lowest:
                    lowest = cosine
                    out[0], out[1] = m, n
    m, n = out[0], out[1]
    x = normal[m, 1] * normal[n, 2] - normal[m, 2] * normal[n, 1]
    y = normal[m, 2] * normal[n, 0] - normal[m, 0] * normal[n, 2]
    z = normal[m, 0] * normal[n, 1] - normal[m, 1] * normal[n, 0]
    largest = -1.0
    for p in range(count):
        if loops[p] == loop:
            e = edges[p]
            volume = abs(x * normal[e, 0] + y * normal[e, 1] + z * normal[e, 2])
            if volume > largest:
                largest = volume
                out[2] = e


@jit
def crossed_edges(code, row, edge_words, edge_start, neighbours, edges, loops):
    """Find the crossed edges of a cell with their loops; returns how many."""
    brick, i, j, k = code >> 9, (code >> 6) & 7, (code >> 3) & 7, code & 7
    count = 0
    for local in range(12):
        loop = LOOP_OF_EDGE[row, local]
        if loop >= 0:
            axis, u, v = local >> 2, (local >> 1) & 1, local & 1
            x = i + (0 if axis == 0 else u)
            y = j + (u if axis == 0 else (0 if axis == 1 else v))
            z = k + (0 if axis == 2 else v)
            edges[count] = edge_index(edge_words, edge_start, neighbours, brick, axis, x, y, z)
            loops[count] = loop
            count += 1
    return count


@jit
def _quadric(edges, loops, loop, count, foot, normal, corner, spacing, a, right, mass):
    """Set up the error function of a loop about its mass point: matrix ``a`` and right-hand side."""
    weight = 0
    mass[:] = 0.0
    a[:] = 0.0
    right[:] = 0.0
    for p in range(count):
        if loops[p] == loop:
            weight += 1
            for d in range(3):
                mass[d] += (foot[edges[p], d] - corner[d]) / spacing
    mass /= weight
    for p in range(count):
        if loops[p] == loop:
            n = normal[edges[p]]
            height = 0.0
            for d in range(3):
                height += n[d] * ((foot[edges[p], d] - corner[d]) / spacing - mass[d])
            for d in range(3):
                right[d] += height * n[d]
                for c in range(3):
                    a[d, c] += n[d] * n[c]


@parallel_jit
def cell_vertices(
    cell_code, rows, first, edge_words, edge_start, neighbours, blocks, origin, spacing, foot, normal, count
):
    """Vertices of all cells.

    Returns positions (V, 3) and mass points (V, 3) in mm, ranks (V,) int8, and for rank 2 and 3 the edges (V, 3)
    that represent the tangent planes.
    """
    position = np.empty((count, 3))
    centre = np.empty((count, 3))
    rank = np.empty(count, np.int8)
    planes = np.zeros((count, 3), np.int32)
    for chunk in numba.prange((len(cell_code) + _CHUNK - 1) // _CHUNK):
        _vertices_of_chunk(
            np.int64(chunk), cell_code, rows, first, edge_words, edge_start, neighbours, blocks, origin, spacing, foot,
            normal, position, centre, rank, planes,
        )  # fmt: skip
    return position, centre, rank, planes


@jit
def _vertices_of_chunk(
    chunk, cell_code, rows, first, edge_words, edge_start, neighbours, blocks, origin, spacing, foot, normal,
    position, centre, rank, planes,
):  # fmt: skip
    edges, loops = np.empty(12, np.int64), np.empty(12, np.int64)
    a, vectors = np.empty((3, 3)), np.empty((3, 3))
    right, mass, best, corner = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for cell in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, len(cell_code))):
        code = cell_code[cell]
        for d in range(3):
            corner[d] = origin[d] + spacing * (8 * blocks[code >> 9, d] + ((code >> (6 - 3 * d)) & 7))
        found = crossed_edges(code, rows[cell], edge_words, edge_start, neighbours, edges, loops)
        for loop in range(LOOPS[rows[cell]]):
            _quadric(edges, loops, loop, found, foot, normal, corner, spacing, a, right, mass)
            vertex = first[cell] + loop
            rank[vertex] = _minimise(a, vectors, right, mass, best)
            for d in range(3):
                position[vertex, d] = corner[d] + spacing * best[d]
                centre[vertex, d] = corner[d] + spacing * mass[d]
            if rank[vertex] > 1:
                _representatives(normal, edges, loops, loop, found, planes[vertex])
