"""Scripts are told when kernels are compiled, once, and not when they come from the cache; a process helps them."""

import os
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

_SCRIPT = """
import numpy as np
from cad_implicit.kernels.halfspaces import nearest_feasible
from cad_implicit.parallel import threads

found = np.zeros(3)
with threads():
    nearest_feasible(np.array([1.3, 0.4, 0.2]), np.array([[0.6, 0.8, 0.0]]), np.array([0.7]), 1, found)
print(found)
"""

_HELPED = """
import sys, time
from pathlib import Path
import numpy as np
import psutil
from cad_implicit.kernels.linked import linked
from cad_implicit.parallel import threads

with threads():
    print(linked(3, np.array([[0, 2]], np.int32)))
helpers = psutil.Process().children()
until = time.monotonic() + 300
while not any(Path(sys.argv[1]).rglob("*store_nodes*.nbc")) and helpers and time.monotonic() < until:
    time.sleep(0.1)  # a kernel of contours, which this process does not use
print(*[helper.pid for helper in helpers])
"""


def _run(cache: Path, script: str = _SCRIPT, **environment: str) -> tuple[str, str]:
    done = subprocess.run(
        [sys.executable, "-c", script, str(cache)],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache), **environment},
    )
    return done.stdout, done.stderr


def test_compiling_is_told_once_per_machine(tmp_path: Path) -> None:
    first, told = _run(tmp_path)
    assert told.count("compiling kernels, once per machine") == 1
    again, silent = _run(tmp_path)
    assert again == first != ""
    assert silent == ""


@pytest.mark.skipif(os.cpu_count() == 1, reason="one core")
def test_another_process_compiles_what_comes_later_and_ends_with_the_first(tmp_path: Path) -> None:
    groups, helpers = _run(tmp_path, _HELPED)[0].splitlines()
    assert groups == "[0 1 0]"
    (helper,) = helpers.split()
    assert any(tmp_path.rglob("*store_nodes*.nbc"))
    assert not psutil.pid_exists(int(helper))
    again, none = _run(tmp_path, _HELPED)[0].splitlines()
    assert again == groups
    assert none == ""


def test_no_process_helps_where_none_is_wanted(tmp_path: Path) -> None:
    groups, none = _run(tmp_path, _HELPED, CAD_IMPLICIT_COMPILE_ALONE="1")[0].splitlines()
    assert groups == "[0 1 0]"
    assert none == ""
    assert not any(tmp_path.rglob("*store_nodes*.nbc"))
