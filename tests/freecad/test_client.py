"""The child process that computes: answers, progress, cancel, crashes, estimates."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from freecad.cad_implicit_wb import client, estimates
from freecad.cad_implicit_wb.client import Request
from freecad_parts import rounded

from cad_implicit import shelling, sizing

pytestmark = pytest.mark.freecad

#: Seconds after which a test gives up; kernels are compiled on the way.
PATIENCE = 600.0

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    + [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]],
    np.int32,
)
#: Off the axes.
_TURN = np.linalg.qr(np.array([[1.0, 0.3, -0.2], [0.1, 1.0, 0.5], [-0.4, 0.2, 1.0]]))[0]
_TURN *= np.linalg.det(_TURN)


def box(*sides: float) -> tuple[Any, Any]:
    """Triangles of a box, turned."""
    return _CORNERS * sides @ _TURN.T, _FACES


def answer(request: Request) -> Any:
    task = client.start(request)
    assert task.wait(PATIENCE)
    return task.result()


def children() -> list[psutil.Process]:
    return [p for p in psutil.Process().children() if any("worker.py" in word for word in p.cmdline())]


def test_a_round_of_a_mesh_is_the_rounded_box() -> None:
    sides = (11.3, 17.7, 9.1)
    result = answer(Request(None, box(*sides), "round", 1.7, None, {"result": "mesh"}))
    assert result.volume_before == pytest.approx(math.prod(sides), rel=1e-12)
    assert 0.999 * rounded(sides, 1.7) < result.volume_after < rounded(sides, 1.7)
    assert result.brep is None
    assert result.vertices.shape[1] == result.faces.shape[1] == 3
    assert 0 < result.error_bound < 0.1
    assert result.spacing == pytest.approx(1.7 / 6)


def test_errors_at_vertices_are_within_the_bound_and_found_where_there_are_some() -> None:
    options = {"result": "mesh", "error": True}
    result = answer(Request(None, box(11.3, 17.7, 9.1), "round", 1.7, None, options))
    known = np.isfinite(result.error)
    assert len(result.error) == len(result.vertices)
    assert known.mean() > 0.2
    assert 1e-7 < np.abs(result.error[known]).max() < result.error_bound
    grown = answer(Request(None, box(11.3, 17.7, 9.1), "offset", 1.7, None, options))
    assert np.abs(grown.error).max() < grown.error_bound
    hollow = answer(Request(None, box(11.3, 17.7, 9.1), "shell", 1.1, None, options))
    assert np.abs(hollow.error).max() < hollow.error_bound


def test_a_draft_is_coarser() -> None:
    fine, draft = (
        answer(Request(None, box(31.0, 20.0, 12.0), "round", 1.0, None, {"result": "mesh", "draft": draft}))
        for draft in (None, True)
    )
    assert draft.spacing > 1.5 * fine.spacing
    assert len(draft.faces) < 0.5 * len(fine.faces)
    assert draft.volume_after == pytest.approx(fine.volume_after, rel=5e-3)


def test_starting_a_child_and_a_job_returns_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    client.shutdown()
    large = (np.random.default_rng(1).random((300_000, 3)), np.arange(300_000, dtype=np.int32).reshape(-1, 3))
    took = []
    for mesh in (large, box(5, 6, 7)):
        before = time.perf_counter()
        task = client.start(Request(None, mesh, "offset", 1.0, None, {"result": "mesh"}))
        task.poll()
        took.append(time.perf_counter() - before)
        task.cancel()
        assert task.wait(PATIENCE)
    with capsys.disabled():
        sys.stdout.write(f"\nstart took {', '.join(f'{1e3 * seconds:.1f} ms' for seconds in took)}\n")


def test_progress_is_told() -> None:
    seen = []
    task = client.start(Request(None, box(11.3, 17.7, 9.1), "round", 1.3, None, {"result": "mesh"}))
    assert not task.done
    task.wait(PATIENCE, lambda t: seen.append((t.stage, t.fraction)))
    assert {"round", "contour"} <= {stage for stage, _ in seen}
    assert all(0 <= fraction <= 1 for _, fraction in seen)


def test_errors_are_in_the_users_words() -> None:
    task = client.start(Request(None, box(11.3, 17.7, 9.1), "round", 40.0, None, {"result": "mesh"}))
    assert task.wait(PATIENCE)
    with pytest.raises(client.WorkbenchError, match=r"radius 40 mm is too large.* at most") as caught:
        task.result()
    assert "--force" not in str(caught.value)
    with pytest.raises(client.WorkbenchError, match="not finished"):
        client.Task.result(_unfinished())


def _unfinished() -> client.Task:
    task = client.Task.__new__(client.Task)
    task._outcome = None
    return task


def test_cancel_is_quick_and_the_next_job_works(capsys: pytest.CaptureFixture[str]) -> None:
    request = Request(None, box(40.0, 30.0, 25.0), "round", 3.0, None, {"result": "mesh", "spacing": 0.08})
    latencies = []
    for seconds in (0.0, 0.3, 2.0):
        task = client.start(request)
        task.wait(seconds)
        assert not task.done
        before = time.perf_counter()
        task.cancel()
        assert task.wait(PATIENCE)
        latencies.append(time.perf_counter() - before)
        with pytest.raises(client.CancelledError):
            task.result()
    with capsys.disabled():
        sys.stdout.write(f"\ncancel took {', '.join(f'{seconds:.3f} s' for seconds in latencies)}\n")
    assert answer(Request(None, box(5, 6, 7), "offset", 1.0, None, {"result": "mesh"})).volume_after > 5 * 6 * 7


def test_a_task_that_waits_for_another_can_be_cancelled() -> None:
    long = Request(None, box(40.0, 30.0, 25.0), "round", 3.0, None, {"result": "mesh", "spacing": 0.08})
    first, second = client.start(long), client.start(long)
    second.wait(0.2)
    second.cancel()
    assert second.wait(5)
    assert not first.done
    first.cancel()
    assert first.wait(5)


def test_a_killed_child_is_an_error_and_the_next_job_works() -> None:
    task = client.start(Request(None, box(40.0, 30.0, 25.0), "round", 3.0, None, {"result": "mesh", "spacing": 0.08}))
    task.wait(2.0)
    (child,) = children()
    child.kill()
    assert task.wait(PATIENCE)
    with pytest.raises(client.WorkbenchError, match="ended unexpectedly"):
        task.result()
    result = answer(Request(None, box(5, 6, 7), "round", 1.0, None, {"result": "mesh"}))
    assert 0.999 * rounded((5, 6, 7), 1.0) < result.volume_after < rounded((5, 6, 7), 1.0)


def test_the_child_stays_warm_and_ends_with_its_parent() -> None:
    answer(Request(None, box(5, 6, 7), "offset", 1.0, None, {"result": "mesh"}))
    (first,) = children()
    answer(Request(None, box(5, 6, 7), "offset", 1.1, None, {"result": "mesh"}))
    assert children() == [first]
    client.shutdown()
    assert not children()
    code = (
        "import sys; sys.path[:] = eval(sys.argv[1])\n"
        "from freecad.cad_implicit_wb.child import Child; import os\n"
        "print(Child().pid, flush=True); os._exit(1)"
    )
    done = subprocess.run([sys.executable, "-c", code, repr(sys.path)], capture_output=True, text=True, check=False)
    pid = int(done.stdout.split()[-1])
    gone = time.monotonic() + PATIENCE
    while psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < gone
        time.sleep(0.05)


def test_freecads_process_imports_no_kernels() -> None:
    code = (
        "import sys; sys.path[:] = eval(sys.argv[1])\n"
        "from freecad.cad_implicit_wb import client, feature, making, estimates\n"
        "print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code, repr(sys.path)], capture_output=True, text=True, check=True)
    assert not {"numba", "scipy", "skimage", "trimesh", "OCP", "manifold3d"} & set(done.stdout.split())


def test_estimates_come_from_the_librarys_constants() -> None:
    for name in ("CELLS_PER_RADIUS", "CELLS_PER_DIAGONAL", "FEWEST_CELLS_PER_RADIUS", "FACETED_TRIANGLES"):
        assert getattr(estimates, name) == getattr(sizing, name)
    for name in ("BYTES_PER_NODE", "BYTES_PER_SURFACE_CELL", "BYTES_PER_STRIP_CELL"):
        assert getattr(estimates, name) == getattr(sizing, name)
    assert estimates.RADIUS_PER_WALL == shelling.RADIUS_PER_WALL
    assert sizing._TRIANGLES_PER_CELL == estimates.TRIANGLES_PER_CELL


def test_estimates_grow_as_the_work_does() -> None:
    def of(**options: Any) -> dict[str, float]:
        return client.estimate(Request(None, box(30, 20, 10), "round", 2.0, None, {"result": "mesh", **options}))

    assert of()["spacing"] == pytest.approx(2.0 / 6, rel=0.2)
    assert of(spacing=0.1)["cells"] == pytest.approx(4 * of(spacing=0.2)["cells"])
    assert of(spacing=0.1)["memory_bytes"] > of(draft=True)["memory_bytes"]
    grid = of(spacing=0.1, engine="reinit")
    corners = box(30, 20, 10)[0]
    bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])
    assert grid["memory_bytes"] == pytest.approx(sizing.estimate_memory(bounds, 0.1, 2.0, "reinit"), rel=1e-9)
    assert of(spacing=0.1)["seconds"] > of(spacing=0.2)["seconds"] > 0


def test_keys_tell_what_changes_an_answer() -> None:
    def of(radius: float = 2.0, **options: Any) -> str:
        return client.key(Request(None, box(3, 2, 1), "round", radius, None, options))

    assert of() == of(threads=2) == of(spacing=None)
    assert len({of(), of(2.5), of(spacing=0.1), of(force=True)}) == 4
    assert of(2) == of(2.0)


def test_the_child_finds_a_python_from_within_freecad(tmp_path: Path) -> None:
    """FreeCAD's own program is not a Python; it finds one all the same."""
    script = tmp_path / "inside.py"
    lines = [
        "import sys",
        "from freecad.cad_implicit_wb import child",
        "print('executable', sys.executable)",
        "c = child.Child(); print('child', c._process.args[0]); c.close()",
    ]
    script.write_text("\n".join(lines))
    folders = [p for p in sys.path if p.endswith(("freecad_workbench", "site-packages"))]
    command = ["freecadcmd", *(word for folder in folders for word in ("-P", folder)), str(script)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, timeout=120)
    assert "python" in done.stdout.split("child ")[1].splitlines()[0], done.stdout + done.stderr
