"""Where a surface is flat for certain, edges and cells need no more looks at the function.

Codes of edges and cells are those of :mod:`cad_implicit.kernels.crossings`; ``plane`` (B, 512) has the number of the
linear function around each node or -1, ``planes`` (P, 4) its gradient and its value at the origin of coordinates.
"""

from __future__ import annotations

import numba
import numpy as np

from .cell_tables import LOOPS
from .crossings import axis_steps, brick_at, decode_edge
from .jit import jit, parallel_jit
from .qef import crossed_edges

#: Two planes count as one if their normals agree to this cosine (1e-4 radians) …
_SAME_NORMAL = 1 - 5e-9

_CHUNK = 256


@jit
def _value(planes, p, x, y, z):
    return planes[p, 0] * x + planes[p, 1] * y + planes[p, 2] * z + planes[p, 3]


@parallel_jit
def plane_feet(code, plane, planes, neighbours, blocks, origin, spacing, tolerance, foot, normal):
    """Foot and outward normal (E, 3) of the edges whose two ends lie by the same plane; returns which do (E,).

    … and their values at both ends of the edge to ``tolerance`` mm.
    """
    flat = np.zeros(len(code), np.bool_)
    for n in numba.prange(len(code)):
        brick, axis, i, j, k = decode_edge(code[n])
        p = plane[brick, 64 * i + 8 * j + k]
        if p < 0:
            continue
        along = axis_steps(axis)[0]
        u, v, w = i + along[0], j + along[1], k + along[2]
        q = plane[brick_at(neighbours, brick, u, v, w), 64 * (u & 7) + 8 * (v & 7) + (w & 7)]
        if q < 0:
            continue
        x = origin[0] + spacing * (8 * blocks[brick, 0] + i)
        y = origin[1] + spacing * (8 * blocks[brick, 1] + j)
        z = origin[2] + spacing * (8 * blocks[brick, 2] + k)
        dx, dy, dz = spacing * along[0], spacing * along[1], spacing * along[2]
        low, high = _value(planes, p, x, y, z), _value(planes, p, x + dx, y + dy, z + dz)
        if p != q:
            cosine = planes[p, 0] * planes[q, 0] + planes[p, 1] * planes[q, 1] + planes[p, 2] * planes[q, 2]
            if not (
                cosine > _SAME_NORMAL
                and abs(_value(planes, q, x, y, z) - low) <= tolerance
                and abs(_value(planes, q, x + dx, y + dy, z + dz) - high) <= tolerance
            ):
                continue
        if (low > 0) == (high > 0):
            continue
        at = low / (low - high)
        foot[n, 0], foot[n, 1], foot[n, 2] = x + at * dx, y + at * dy, z + at * dz
        normal[n, 0], normal[n, 1], normal[n, 2] = -planes[p, 0], -planes[p, 1], -planes[p, 2]
        flat[n] = True
    return flat


@parallel_jit
def flat_vertices(
    cell_code, rows, first, edge_words, edge_start, neighbours, flat_edge, foot, normal, tolerance, directions
):
    """Whether all edges of each vertex (V,) lie in one plane; ``directions`` (V, 3) gets its outward normal."""
    flat = np.zeros(len(directions), np.bool_)
    for chunk in numba.prange((len(cell_code) + _CHUNK - 1) // _CHUNK):
        edges, loops = np.empty(12, np.int64), np.empty(12, np.int64)
        for cell in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, len(cell_code))):
            found = crossed_edges(cell_code[cell], rows[cell], edge_words, edge_start, neighbours, edges, loops)
            for loop in range(LOOPS[rows[cell]]):
                one = -1
                same = True
                for q in range(found):
                    if loops[q] != loop:
                        continue
                    e = edges[q]
                    if not flat_edge[e]:
                        same = False
                        break
                    if one < 0:
                        one = e
                        continue
                    cosine, height = 0.0, 0.0
                    for d in range(3):
                        cosine += normal[one, d] * normal[e, d]
                        height += normal[one, d] * (foot[e, d] - foot[one, d])
                    same &= cosine > _SAME_NORMAL and abs(height) <= tolerance
                if same and one >= 0:
                    flat[first[cell] + loop] = True
                    for d in range(3):
                        directions[first[cell] + loop, d] = normal[one, d]
    return flat
