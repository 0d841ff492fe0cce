"""Working memory of one walk through a tree, and how many points share it."""

from __future__ import annotations

import numpy as np

from .bvh import STACK, WIDTH
from .jit import jit

#: Points that one thread works through in order; the triangle found for one is the first guess for the next.
CHUNK = 256


@jit
def new_stack():
    """Codes of waiting nodes, lower bounds of their squared distance, and bounds of one node's children."""
    return np.zeros(STACK, np.int32), np.zeros(STACK, np.float32), np.zeros(WIDTH, np.float32)
