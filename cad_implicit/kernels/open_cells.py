"""Surfaces of a part of space: which cells, edges and faces are left at its border.

Cells of bricks that lack a neighbour are left out; of edges and faces those are kept that belong to a cell that is.
Words and codes are those of :mod:`cad_implicit.kernels.crossings`.
"""

import numba
import numpy as np

from .crossings import axis_steps, bits_before, brick_at
from .jit import jit, parallel_jit

_ONE = np.uint64(1)


@jit
def active_cell(words, start, neighbours, brick, i, j, k):
    """Index of the active cell at node (i, j, k) seen from ``brick``, or -1 if it was left out."""
    other = brick_at(neighbours, brick, i, j, k)
    if other < 0:
        return -1
    word, bit = words[other, i & 7], 8 * (j & 7) + (k & 7)
    if (word >> np.uint64(bit)) & _ONE == 0:
        return -1
    return start[8 * other + (i & 7)] + bits_before(word, bit)


@jit
def _inner(neighbours, inner, brick, i, j, k):
    other = brick_at(neighbours, brick, i, j, k)
    return other >= 0 and inner[other]


@parallel_jit
def leave_out(edges, cells, faces, neighbours, inner):
    """Clear the bits of cells in bricks that are not ``inner`` (B,), and of edges and faces around no cell."""
    for b in numba.prange(len(cells)):
        if inner[b]:
            continue
        for row in range(8):
            cells[b, row] = np.uint64(0)
        for row in range(24):
            axis, i = row // 8, row % 8
            along, one, two = axis_steps(axis)
            for bit in range(64):
                mask = _ONE << np.uint64(bit)
                j, k = bit >> 3, bit & 7
                if edges[b, row] & mask:
                    kept = False
                    for c in range(4):
                        u, v = c >> 1, c & 1
                        kept |= _inner(
                            neighbours,
                            inner,
                            b,
                            i - u * one[0] - v * two[0],
                            j - u * one[1] - v * two[1],
                            k - u * one[2] - v * two[2],
                        )
                    if not kept:
                        edges[b, row] &= ~mask
                if faces[b, row] & mask and not _inner(neighbours, inner, b, i - along[0], j - along[1], k - along[2]):
                    faces[b, row] &= ~mask
