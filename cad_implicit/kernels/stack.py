"""Working memory of one walk through a tree, how many points share it, and which thread takes which points."""

from __future__ import annotations

import numpy as np

from .jit import jit
from .partition import LEAF, STACK, WIDTH

#: Points that one thread works through in order; the triangle found for one is the first guess for the next.
CHUNK = 256

#: Chunks are dealt in turns to so many runs of iterations. (The number of threads cannot be asked for in kernels that
#: are cached.)
_HANDS = 16


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


@jit
def dealt(number, chunks):
    """Chunk for an iteration of a parallel loop: threads, which take runs of iterations, get chunks from all over.

    Neighbouring points take alike long: of two threads with half of the chunks each, one waited for a sixth of the
    time.
    """
    least, more = chunks // _HANDS, chunks % _HANDS
    if number < more * (least + 1):
        hand, turn = number // (least + 1), number % (least + 1)
    else:
        rest = number - more * (least + 1)
        hand, turn = more + rest // least, rest % least
    return turn * _HANDS + hand
