"""What every walk through a tree asks at a node: how near the eight children may be."""

from __future__ import annotations

import numpy as np

from .jit import jit
from .lanes import bits_below, lanes, larger, lowest_bit, root
from .partition import WIDTH

_REACH = 1e18


@lanes(WIDTH)
def child_bounds(rows, x, y, z):
    """Lower bounds of the squared distance to the eight children: the better of box and disc.

    6.6 ns, against 39.5 ns as a loop.
    """
    dx = larger(larger(rows[0] - x, x - rows[3]), 0)
    dy = larger(larger(rows[1] - y, y - rows[4]), 0)
    dz = larger(larger(rows[2] - z, z - rows[5]), 0)
    vx, vy, vz = x - rows[6], y - rows[7], z - rows[8]
    along = vx * rows[9] + vy * rows[10] + vz * rows[11]
    across = root(larger(vx * vx + vy * vy + vz * vz - along * along, 0))
    above = larger(larger(along, 0 - along) - rows[12], 0)
    beside = larger(across - rows[13], 0)
    return larger(dx * dx + dy * dy + dz * dz, above * above + beside * beside)


@jit
def single(x):
    """Round a scaled coordinate to float32, so that squares stay finite: moved to the mesh, bounds stay below."""
    return np.float32(min(max(x, -_REACH), _REACH))


@jit
def push_children(tree, code, x, y, z, limit, near, codes, waiting):
    """Put the children of a node that may be within ``limit`` on the stack ``codes``; returns how many are waiting."""
    child_bounds(tree.bounds[code], x, y, z, near)
    bits = bits_below(near, limit)
    while bits != 0:
        codes[waiting] = tree.children[code, lowest_bit(bits)]
        bits &= bits - 1
        waiting += 1
    return waiting
