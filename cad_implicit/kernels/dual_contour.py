"""From crossed edges to triangles: a quad around each crossed edge, two triangles of each quad.

Two cells at an ambiguous face may share both pieces of surface there; the two mesh edges between the same two
vertices are then kept apart by a vertex on each.
"""

import math

import numba
import numpy as np

from . import sagitta
from .cell_tables import LOOP_OF_EDGE
from .crossings import axis_steps, decode_edge, edge_index
from .jit import jit, parallel_jit
from .open_cells import active_cell

#: Both diagonals are good if no triangle turns from the normal by more than this (cosine of 10 degrees); then the
#: better shaped pair of triangles is taken.
_GOOD_COSINE = 0.985

_CHUNK = 256


@parallel_jit
def quads(edge_code, inside_first, cell_words, cell_start, neighbours, rows, first):
    """Vertices (E, 4) around each crossed edge, counter-clockwise seen from outside; -1 for cells left out."""
    out = np.empty((len(edge_code), 4), np.int32)
    for e in numba.prange(len(edge_code)):
        brick, axis, i, j, k = decode_edge(edge_code[e])
        _, one, two = axis_steps(axis)
        turned = inside_first[e] == (axis == 1)
        for corner in range(4):
            u = 1 if corner == 1 or corner == 2 else 0
            v = 1 if corner >= 2 else 0
            cell = active_cell(
                cell_words,
                cell_start,
                neighbours,
                brick,
                i - u * one[0] - v * two[0],
                j - u * one[1] - v * two[1],
                k - u * one[2] - v * two[2],
            )
            vertex = first[cell] + LOOP_OF_EDGE[rows[cell], 4 * axis + 2 * u + v] if cell >= 0 else -1
            out[e, 3 - corner if turned else corner] = vertex
    return out


@jit
def _face_edges(face_code, edge_words, edge_start, neighbours, out):
    """Find the four edges of an ambiguous face: low, high along the first axis; low, high along the second."""
    brick, axis, i, j, k = decode_edge(face_code)
    _, one, two = axis_steps(axis)
    first_axis = 1 if axis == 0 else 0
    second_axis = 1 if axis == 2 else 2
    out[0] = edge_index(edge_words, edge_start, neighbours, brick, first_axis, i, j, k)
    out[1] = edge_index(edge_words, edge_start, neighbours, brick, first_axis, i + two[0], j + two[1], k + two[2])
    out[2] = edge_index(edge_words, edge_start, neighbours, brick, second_axis, i, j, k)
    out[3] = edge_index(edge_words, edge_start, neighbours, brick, second_axis, i + one[0], j + one[1], k + one[2])


@jit
def _shared_vertex(cell, rows, first, axis, side):
    """Find the vertex of a cell that owns all four edges of its face, or -1."""
    first_axis = 1 if axis == 0 else 0
    second_axis = 1 if axis == 2 else 2
    first_bit = 2 if axis < second_axis else 1
    second_bit = 2 if axis < first_axis else 1
    loop = -1
    for other in range(2):
        # Of an edge's two offsets, one is along the face's axis; the other one says low or high.
        a = LOOP_OF_EDGE[rows[cell], 4 * first_axis + first_bit * side + (3 - first_bit) * other]
        b = LOOP_OF_EDGE[rows[cell], 4 * second_axis + second_bit * side + (3 - second_bit) * other]
        if loop < 0:
            loop = a
        if a != loop or b != loop:
            return -1
    return first[cell] + loop


@jit
def doubled_edges(
    face_code,
    joined,
    inside_first,
    edge_words,
    edge_start,
    cell_words,
    cell_start,
    neighbours,
    rows,
    first,
):
    """Pairs of grid edges whose quads share a doubled mesh edge.

    Returns edge pairs (D, 2) and the two vertices (D, 2) that the mesh edge joins.
    """
    pairs = np.empty((2 * len(face_code), 2), np.int64)
    ends = np.empty((2 * len(face_code), 2), np.int64)
    edges = np.empty(4, np.int64)
    n = 0
    for q in range(len(face_code)):
        brick, axis, i, j, k = decode_edge(face_code[q])
        along = axis_steps(axis)[0]
        upper = active_cell(cell_words, cell_start, neighbours, brick, i, j, k)
        lower = active_cell(cell_words, cell_start, neighbours, brick, i - along[0], j - along[1], k - along[2])
        if upper < 0 or lower < 0:
            continue
        above = _shared_vertex(upper, rows, first, axis, 0)
        below = _shared_vertex(lower, rows, first, axis, 1)
        if above < 0 or below < 0:
            continue
        _face_edges(face_code[q], edge_words, edge_start, neighbours, edges)
        around_lowest = inside_first[edges[0]] != joined[q]
        for side in range(2):
            pairs[n, 0] = edges[side]
            pairs[n, 1] = edges[2 + side] if around_lowest else edges[3 - side]
            ends[n, 0], ends[n, 1] = above, below
            n += 1
    return pairs[:n], ends[:n]


@jit
def _triangle_normal(p, a, b, c, out):
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    out[0], out[1], out[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    x, y, z = ux - vx, uy - vy, uz - vz
    squares = ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz + x * x + y * y + z * z
    return area, squares


@jit
def _score(p, a, b, c, normal, scratch):
    """Agreement with the normal (cosine) and shape (1 for an equilateral triangle)."""
    area, squares = _triangle_normal(p, a, b, c, scratch)
    if area == 0 or squares == 0:
        return -1.0, 0.0
    cosine = (scratch[0] * normal[0] + scratch[1] * normal[1] + scratch[2] * normal[2]) / area
    return cosine, 3.4641016151377544 * area / squares


@jit
def _reference(hermite, smooth, a, b, c, out):
    """Outward direction that a triangle should have: that of its smooth vertices, else the grid edge's normal."""
    length = 0.0
    for d in range(3):
        out[d] = smooth[a, d] + smooth[b, d] + smooth[c, d]
        length += out[d] * out[d]
    length = math.sqrt(length)
    for d in range(3):
        out[d] = out[d] / length if length > 0.1 else hermite[d]


@jit
def _judge(p, a, b, c, hermite, smooth, scratch):
    _reference(hermite, smooth, a, b, c, scratch[0])
    return _score(p, a, b, c, scratch[0], scratch[1])


@jit
def _takes_straight(straight, crossed, least, straight_shape, crossed_shape):
    """Which diagonal to take by how far both miss the surface and the worse shape beside them."""
    if max(straight, crossed) < least:
        return straight_shape >= crossed_shape
    return straight <= crossed


@parallel_jit
def triangles(quad, normal, smooth, position, rank, least):
    """Two triangles (2 E, 3) of each quad, and the direction (2 E, 3) that each one should face.

    ``normal`` (E, 3) belongs to the quads, ``smooth`` (V, 3) to the vertices, zero for sharp ones. The diagonal
    joins two sharp vertices if only one does; else it is the one whose worse triangle agrees better with the
    normals, or if both agree well, the one that is nearer to the surface; where no diagonal of four smooth vertices
    misses it by ``least`` mm, the one whose worse triangle has the better shape.
    """
    out = np.empty((2 * len(quad), 3), np.int32)
    facing = np.empty((2 * len(quad), 3))
    for chunk in numba.prange((len(quad) + _CHUNK - 1) // _CHUNK):
        scratch = np.empty((2, 3))
        for e in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, len(quad))):
            a, b, c, d = quad[e, 0], quad[e, 1], quad[e, 2], quad[e, 3]
            cos1, shape1 = _judge(position, a, b, c, normal[e], smooth, scratch)
            cos2, shape2 = _judge(position, a, c, d, normal[e], smooth, scratch)
            cos3, shape3 = _judge(position, b, c, d, normal[e], smooth, scratch)
            cos4, shape4 = _judge(position, b, d, a, normal[e], smooth, scratch)
            straight, crossed = min(cos1, cos2), min(cos3, cos4)
            sharp_straight = rank[a] > 1 and rank[c] > 1
            sharp_crossed = rank[b] > 1 and rank[d] > 1
            if sharp_straight != sharp_crossed:
                take = sharp_straight
            elif straight > _GOOD_COSINE and crossed > _GOOD_COSINE:
                take = _takes_straight(
                    sagitta.shared_sagitta(position, smooth, a, c, b, d),
                    sagitta.shared_sagitta(position, smooth, b, d, a, c),
                    least,
                    min(shape1, shape2),
                    min(shape3, shape4),
                )
            else:
                take = straight >= crossed
            if not take:
                a, b, c, d = b, c, d, a
            out[2 * e, 0], out[2 * e, 1], out[2 * e, 2] = a, b, c
            out[2 * e + 1, 0], out[2 * e + 1, 1], out[2 * e + 1, 2] = a, c, d
            _reference(normal[e], smooth, a, b, c, facing[2 * e])
            _reference(normal[e], smooth, a, c, d, facing[2 * e + 1])
    return out, facing
