"""Threads and processes: the same bytes from any number of them, and no hang where they do not go together."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import cad_implicit as ci

PART = ci.to_mesh(ci.contour((ci.box((9, 7, 5)) | ci.box((3, 3, 9))).turned((0.48, -0.6, 0.64), 0.7), 0.5))

#: Fillets the same part twice in this process, and once in one started from it as its argument says.
SCRIPT = """
import multiprocessing, sys
import cad_implicit as ci
def work(number):
    part = (ci.box((9, 7, 5)) | ci.box((3, 3, 9))).turned((0.48, -0.6, 0.64), 0.7)
    return ci.contour(ci.fillet(ci.to_mesh(ci.contour(part, 0.5)), 0.8, spacing=0.3)).vertices.tobytes()
if __name__ == "__main__":
    here = work(0)
    with multiprocessing.get_context(sys.argv[1]).Pool(1) as pool:
        try:
            print("same" if pool.map_async(work, [0]).get(200)[0] == here else "other")
        except ci.errors.ForkedError as error:
            print(error)
"""


def result(operation: str, threads: int) -> bytes:
    if operation == "edges":
        mesh = ci.contour(ci.fillet(PART, 0.5, edges="concave", spacing=0.2, threads=threads), threads=threads)
    else:
        mesh = ci.contour(getattr(ci, operation)(PART, 0.8, spacing=0.3, threads=threads), threads=threads)
    return mesh.vertices.tobytes() + mesh.faces.tobytes()


@pytest.mark.parametrize("operation", ["fillet", "round", "smooth", "edges"])
def test_any_number_of_threads_gives_the_same_bytes(operation: str) -> None:
    one = result(operation, 1)
    assert all(result(operation, threads) == one for threads in (2, 4))


def test_two_operations_at_once() -> None:
    alone = [result("fillet", 1), result("round", 1)]
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(result, ["fillet", "round"], [2, 2])) == alone


@pytest.mark.skipif(os.name == "nt", reason="there is no fork")
@pytest.mark.parametrize(("layer", "how", "answer"), [
    ("omp", "fork", "pip install tbb"), ("workqueue", "fork", "same"), ("workqueue", "spawn", "same"),
])  # fmt: skip
def test_processes_started_from_one_that_has_worked(layer: str, how: str, answer: str, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    environment = {**os.environ, "NUMBA_THREADING_LAYER": layer, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, script, how], capture_output=True, text=True, timeout=400, check=False, env=environment
    )
    if layer == "omp" and "No threading layer" in done.stderr:
        pytest.skip("numba has no OpenMP here")
    assert answer in done.stdout, done.stderr
