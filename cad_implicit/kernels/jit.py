"""The one compiler configuration of all kernels.

Arithmetic is strict (no ``fastmath``), and no kernel reduces across threads: results do not depend on the number of
threads, the processor, or whether a kernel was compiled in this process or comes from the cache, where copies of the
functions that it calls are optimized in another context. It costs no time; only :mod:`.lanes` gain 3 % by contraction.
"""

from __future__ import annotations

import numba
import numpy as np

#: Decorator of serial kernels.
jit = numba.njit(cache=True, nogil=True, error_model="numpy")

#: Decorator of kernels with ``prange`` loops; call them inside :func:`cad_implicit.parallel.threads`.
parallel_jit = numba.njit(cache=True, nogil=True, error_model="numpy", parallel=True)


def frozen(array: np.ndarray) -> np.ndarray:
    """View that cannot be written to: for the compiler arrays that can be are another type, to be compiled again."""
    view = array.view()
    view.flags.writeable = False
    return view
