"""Working memory of one walk through a tree, and how many points share it."""

from __future__ import annotations

import numpy as np

from .jit import jit
from .partition import LEAF, STACK, WIDTH

#: Points that one thread works through in order; the triangle found for one is the first guess for the next.
CHUNK = 256


@jit
def new_stack():
    """Return waiting nodes, bounds of their squared distances, and room for one node.

    That is for the bounds of its children, for distances in a leaf, and for fields of its children.
    """
    return (
        np.zeros(STACK, np.int32),
        np.zeros(STACK, np.float32),
        np.zeros(WIDTH, np.float32),
        np.zeros(LEAF),
        np.zeros(WIDTH),
    )
