"""The one compiler configuration of all kernels.

``fastmath`` allows contraction, reciprocals, reassociation and ignored signed zeros, but keeps NaN and infinity,
which kernels use on purpose. Results do not depend on the number of threads: no kernel reduces across threads.
"""

from __future__ import annotations

import numba
import numpy as np

_FASTMATH = {"contract", "arcp", "nsz", "reassoc"}

#: Decorator of serial kernels.
jit = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=_FASTMATH)

#: Decorator of kernels with ``prange`` loops; call them inside :func:`cad_implicit.parallel.threads`.
parallel_jit = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=_FASTMATH, parallel=True)


def frozen(array: np.ndarray) -> np.ndarray:
    """View that cannot be written to: for the compiler arrays that can be are another type, to be compiled again."""
    view = array.view()
    view.flags.writeable = False
    return view
