"""Names of vertices: the same for a vertex in whatever region of a lattice it is contoured.

A name is the number of a node of the lattice times its slots, plus one for each vertex of the node's cell, or for each
of its three edges from a first one on. Vertices between these, known by their position only, have negative ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .implicit import FloatArray
from .mesh import IntArray
from .surface_cells import Cells

Names = NDArray[np.int64]

#: Nodes of a lattice along each axis, the slots of a node, and the first one of an edge.
_NODES = 1 << 18
_SLOTS = 8
_FIRST_EDGE = 5


def names_of(cells: Cells, blocks: IntArray, origin: Names, own: int, count: int) -> Names:
    """Names (N,) of vertices.

    Parameters
    ----------
    cells : Cells
    blocks : (B, 3) int32
        Positions of the bricks on the lattice.
    origin : (M,) int64
        What the first vertices are: below the number of the cells' vertices one of these, from ``own`` on the middle of
        the quad around an edge.
    own : int
    count : int
        Number N of all vertices.
    """
    names = np.full(count, -1, np.int64)
    cell = np.flatnonzero(origin < cells.vertices)
    first = cells.tables[1]
    number = np.searchsorted(first, origin[cell], side="right") - 1
    names[cell] = _nodes(blocks, cells.cells[number]) * _SLOTS + origin[cell] - first[number]
    middle = np.flatnonzero(origin >= own)
    code = cells.edges[origin[middle] - own]
    names[middle] = _nodes(blocks, code // 1536 * 512 + code % 512) * _SLOTS + _FIRST_EDGE + (code >> 9) % 3
    return names


def _nodes(blocks: IntArray, code: Names) -> Names:
    """Give the number of the lattice's node (N,) from that of its brick, and of the node in it."""
    place = 8 * blocks[code >> 9].astype(np.int64)
    i, j, k = (place[:, d] + (code >> (6 - 3 * d) & 7) for d in range(3))
    return np.asarray((i * _NODES + j) * _NODES + k)


def bricks_of(names: Names) -> IntArray:
    """Bricks (N, 3) of the lattice in which named vertices lie."""
    node = names // _SLOTS
    place = np.stack([node // _NODES**2, node // _NODES % _NODES, node % _NODES], axis=1)
    return np.asarray((place >> 3).astype(np.int32))


def hashed(position: FloatArray) -> Names:
    """Negative names (V,) for vertices known by their position (V, 3) only."""
    bits = np.ascontiguousarray(position).view(np.uint64)
    mixed = np.zeros(len(bits), np.uint64)
    for axis in range(3):
        mixed = (mixed ^ bits[:, axis]) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    return -1 - (mixed >> np.uint64(2)).astype(np.int64)
