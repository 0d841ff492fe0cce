"""Sign bits of bricks: crossed edges, active cells and ambiguous faces, found a row of 64 nodes at a time.

The nodes of one brick with the same ``i`` fill a word of 64 bits, node ``(j, k)`` at bit ``8 j + k``. Words of edges
and faces are numbered ``brick * 24 + axis * 8 + i``, words of cells ``brick * 8 + i``; edge and face of an axis start
at their lowest node, cells too. The ``code`` of such a thing is ``word number * 64 + bit``; its index counts the set
bits before it, so that no dense table of indices is needed.
"""

import numba
import numpy as np

from .cell_tables import AMBIGUOUS, FIRST_ROW
from .jit import jit, parallel_jit

_ONE = np.uint64(1)
_ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_NOT_LAST_K = np.uint64(0x7F7F7F7F7F7F7F7F)
_LAST_K = np.uint64(0x8080808080808080)


@jit
def count_bits(word):
    """Count the set bits of a 64-bit word."""
    x = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
    x = (x & np.uint64(0x3333333333333333)) + ((x >> np.uint64(2)) & np.uint64(0x3333333333333333))
    x = (x + (x >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    x += x >> np.uint64(8)
    x += x >> np.uint64(16)
    return np.int64((x + (x >> np.uint64(32))) & np.uint64(127))


@jit
def bits_before(word, bit):
    """Count the set bits below ``bit``."""
    return count_bits(word & ((_ONE << np.uint64(bit)) - _ONE))


@jit
def brick_at(neighbours, brick, i, j, k):
    """Find the brick of node (i, j, k), each from -8 to 15, seen from ``brick``."""
    return neighbours[brick, 13 + 9 * (i >> 3) + 3 * (j >> 3) + (k >> 3)]


@parallel_jit
def sign_words(values):
    """Bits (B, 8) of the inside nodes of values (B, 512); exact zeros are outside."""
    words = np.zeros((len(values), 8), np.uint64)
    for b in numba.prange(len(values)):
        for i in range(8):
            word = np.uint64(0)
            for bit in range(64):
                if values[b, 64 * i + bit] > 0:
                    word |= _ONE << np.uint64(bit)
            words[b, i] = word
    return words


@jit
def _word(signs, neighbours, brick, number, i, missing):
    other = neighbours[brick, number]
    return signs[other, i] if other >= 0 else missing


@jit
def _next_j(own, following):
    return (own >> np.uint64(8)) | (following << np.uint64(56))


@jit
def _next_k(own, following):
    return ((own >> np.uint64(1)) & _NOT_LAST_K) | ((following << np.uint64(7)) & _LAST_K)


@jit
def _row_words(signs, neighbours, brick, i):
    """Signs at (0, 0), (0, 1), (1, 0), (1, 1) steps along (j, k) from each node of row ``i``, 0 to 8.

    All missing neighbours touch the last node of the brick, whose sign they share.
    """
    missing = _ALL if (signs[brick, 7] >> np.uint64(63)) & _ONE else np.uint64(0)
    base = 13 + 9 * (i >> 3)
    own = _word(signs, neighbours, brick, base, i & 7, missing)
    next_j = _word(signs, neighbours, brick, base + 3, i & 7, missing)
    next_k = _word(signs, neighbours, brick, base + 1, i & 7, missing)
    next_jk = _word(signs, neighbours, brick, base + 4, i & 7, missing)
    j_step = _next_j(own, next_j)
    return own, _next_k(own, next_k), j_step, _next_k(j_step, _next_j(next_k, next_jk))


@jit
def _ambiguous(low, first, second, high):
    return ~(low ^ high) & ~(first ^ second) & (low ^ first)


@parallel_jit
def crossing_words(signs, neighbours):
    """Words of crossed edges (B, 24), active cells (B, 8) and ambiguous faces (B, 24)."""
    count = len(signs)
    edges = np.zeros((count, 24), np.uint64)
    cells = np.zeros((count, 8), np.uint64)
    faces = np.zeros((count, 24), np.uint64)
    for b in numba.prange(count):
        c0 = c1 = c2 = c3 = np.uint64(0)
        for row in range(9):
            c4, c5, c6, c7 = _row_words(signs, neighbours, np.int64(b), row)
            if row > 0:
                i = row - 1
                edges[b, i], edges[b, 8 + i], edges[b, 16 + i] = c0 ^ c4, c0 ^ c2, c0 ^ c1
                cells[b, i] = (c0 | c1 | c2 | c3 | c4 | c5 | c6 | c7) & ~(c0 & c1 & c2 & c3 & c4 & c5 & c6 & c7)
                faces[b, i] = _ambiguous(c0, c2, c1, c3)
                faces[b, 8 + i] = _ambiguous(c0, c4, c1, c5)
                faces[b, 16 + i] = _ambiguous(c0, c4, c2, c6)
            c0, c1, c2, c3 = c4, c5, c6, c7
    return edges, cells, faces


@jit
def starts(words):
    """Count the set bits before each word: (W + 1,) int64."""
    flat = words.ravel()
    start = np.zeros(len(flat) + 1, np.int64)
    for w in range(len(flat)):
        start[w + 1] = start[w] + count_bits(flat[w])
    return start


@parallel_jit
def codes(words, start):
    """Codes (N,) int64 of all set bits, in order."""
    flat = words.ravel()
    out = np.empty(start[len(flat)], np.int64)
    for w in numba.prange(len(flat)):
        rest = flat[w]
        n = start[w]
        while rest:
            lowest = rest & (~rest + _ONE)
            out[n] = 64 * w + count_bits(lowest - _ONE)
            rest ^= lowest
            n += 1
    return out


@jit
def edge_index(words, start, neighbours, brick, axis, i, j, k):
    """Index of the crossed edge (or ambiguous face) of ``axis`` at node (i, j, k) seen from ``brick``."""
    w = 24 * brick_at(neighbours, brick, i, j, k) + 8 * axis + (i & 7)
    return start[w] + bits_before(words[w // 24, w % 24], 8 * (j & 7) + (k & 7))


@jit
def decode_edge(code):
    """Brick, axis and node (i, j, k) of the code of an edge or a face."""
    w = code >> 6
    return w // 24, (w >> 3) % 3, w & 7, (code >> 3) & 7, code & 7


@jit
def axis_steps(axis):
    """Give unit steps (i, j, k) along ``axis``, and along the first and second of the other axes."""
    if axis == 0:
        return (1, 0, 0), (0, 1, 0), (0, 0, 1)
    if axis == 1:
        return (0, 1, 0), (1, 0, 0), (0, 0, 1)
    return (0, 0, 1), (1, 0, 0), (0, 1, 0)


@parallel_jit
def edge_points(code, at, blocks, origin, spacing):
    """Points (N, 3) in mm on the edges ``code``, at the fraction ``at`` from their lower end."""
    points = np.empty((len(code), 3))
    for n in numba.prange(len(code)):
        brick, axis, i, j, k = decode_edge(code[n])
        points[n, 0] = origin[0] + spacing * (8 * blocks[brick, 0] + i + (at[n] if axis == 0 else 0.0))
        points[n, 1] = origin[1] + spacing * (8 * blocks[brick, 1] + j + (at[n] if axis == 1 else 0.0))
        points[n, 2] = origin[2] + spacing * (8 * blocks[brick, 2] + k + (at[n] if axis == 2 else 0.0))
    return points


@parallel_jit
def edge_values(code, values, neighbours):
    """Node values (N, 2) at the lower and upper end of the edges ``code``; SIGN_ONLY where only the sign is known."""
    out = np.empty((len(code), 2))
    for n in numba.prange(len(code)):
        brick, axis, i, j, k = decode_edge(code[n])
        along = axis_steps(axis)[0]
        out[n, 0] = values[brick, 64 * i + 8 * j + k]
        i, j, k = i + along[0], j + along[1], k + along[2]
        upper = brick_at(neighbours, brick, i, j, k)
        out[n, 1] = values[upper, 64 * (i & 7) + 8 * (j & 7) + (k & 7)]
    return out


@parallel_jit
def face_centres(code, blocks, origin, spacing):
    """Centres (N, 3) in mm of the cell faces ``code``."""
    points = np.empty((len(code), 3))
    for n in numba.prange(len(code)):
        brick, axis, i, j, k = decode_edge(code[n])
        points[n, 0] = origin[0] + spacing * (8 * blocks[brick, 0] + i + (0.0 if axis == 0 else 0.5))
        points[n, 1] = origin[1] + spacing * (8 * blocks[brick, 1] + j + (0.0 if axis == 1 else 0.5))
        points[n, 2] = origin[2] + spacing * (8 * blocks[brick, 2] + k + (0.0 if axis == 2 else 0.5))
    return points


@jit
def joined_words(code, centre_values, words):
    """Words like ``words`` with the bits of the ambiguous faces whose centre lies inside."""
    out = np.zeros_like(words)
    for n in range(len(code)):
        if centre_values[n] > 0:
            w = code[n] >> 6
            out[w // 24, w % 24] |= _ONE << np.uint64(code[n] & 63)
    return out


@parallel_jit
def cell_rows(code, signs, joined, neighbours):
    """Row (N,) int32 of the cell tables for each active cell."""
    rows = np.empty(len(code), np.int32)
    for n in numba.prange(len(code)):
        brick, i, j, k = code[n] >> 9, (code[n] >> 6) & 7, (code[n] >> 3) & 7, code[n] & 7
        mask = 0
        for corner in range(8):
            x, y, z = i + (corner >> 2), j + ((corner >> 1) & 1), k + (corner & 1)
            word = signs[brick_at(neighbours, brick, x, y, z), x & 7]
            mask |= np.int64((word >> np.uint64(8 * (y & 7) + (z & 7))) & _ONE) << corner
        row = FIRST_ROW[mask]
        choice = 1
        for face in range(6):
            if (AMBIGUOUS[mask] >> face) & 1:
                axis, side = face >> 1, face & 1
                along = axis_steps(axis)[0]
                x, y, z = i + side * along[0], j + side * along[1], k + side * along[2]
                word = joined[brick_at(neighbours, brick, x, y, z), 8 * axis + (x & 7)]
                if (word >> np.uint64(8 * (y & 7) + (z & 7))) & _ONE:
                    row += choice
                choice *= 2
        rows[n] = row
    return rows
