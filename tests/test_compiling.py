"""Scripts are told when kernels are compiled, once, and not when they come from the cache."""

import os
import subprocess
import sys
from pathlib import Path

_SCRIPT = """
import numpy as np
from cad_implicit.kernels.halfspaces import nearest_feasible
from cad_implicit.parallel import threads

found = np.zeros(3)
with threads():
    nearest_feasible(np.array([1.3, 0.4, 0.2]), np.array([[0.6, 0.8, 0.0]]), np.array([0.7]), 1, found)
print(found)
"""


def _run(cache: Path) -> tuple[str, str]:
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
    )
    return done.stdout, done.stderr


def test_compiling_is_told_once_per_machine(tmp_path: Path) -> None:
    first, told = _run(tmp_path)
    assert told.count("compiling kernels, once per machine") == 1
    again, silent = _run(tmp_path)
    assert again == first != ""
    assert silent == ""
