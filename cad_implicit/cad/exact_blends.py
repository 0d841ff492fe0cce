"""The exact kernel's own fillets and chamfers, in a child process, because it can crash the process or never end.

"No exception" is not success: a result counts if the kernel's check finds it valid, its volume is positive and changed
in the right direction, and its triangles are closed.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cad_implicit

from .kernel import kernel

Blend = Literal["fillet", "chamfer"]

#: Radius, or those at the start and the end of the edge; of a chamfer the length, or those on the left face and the
#: right one.
Size = float | tuple[float, float]

#: Seconds after which the child process is given up.
TIME_LIMIT = 120.0


@dataclass(frozen=True, eq=False)
class ExactBlend:
    """What the exact kernel made of a blend.

    Attributes
    ----------
    status : "ok", "not done", "invalid", "crash", "time out" or "not tried"
    seconds : float
        Wall time.
    before, after : float
        Volumes in mm³.
    tolerance : float
        Largest gap in mm that the kernel knows of between the faces, edges and vertices of the result.
    shape : TopoDS_Shape, Part.Shape or None
        The result, if ``status`` is "ok".
    blend : tuple of int
        Numbers in the result, from 1, of the faces that are new.
    message : str
        What the kernel said otherwise.
    """

    status: str
    seconds: float
    before: float = 0.0
    after: float = 0.0
    tolerance: float = 0.0
    shape: Any = None
    blend: tuple[int, ...] = ()
    message: str = ""

    @property
    def ok(self) -> bool:
        """Whether there is a sound result."""
        return self.status == "ok"

    @property
    def change(self) -> float:
        """Volume after less volume before in mm³."""
        return self.after - self.before


def exact_blend(
    shape: Any, sizes: Mapping[int, Size], blend: Blend = "fillet", *, time_limit: float = TIME_LIMIT
) -> ExactBlend:
    """Blend some edges of a shape of either kernel, numbered from 1 as ``TopExp::MapShapes`` does, in a child process.

    The kernel goes on along tangent edges by itself. A chamfer's lengths are measured on the faces on the left and the
    right of the edge, as :class:`cad_implicit.cad.edges.Edge` tells them. Starting the process takes about 2 s.
    """
    start = time.perf_counter()
    if not sizes:
        return ExactBlend("not done", 0.0, message="there are no edges to blend")
    own = kernel(shape, "exact")
    start_of_child = own.interpreter()
    if not start_of_child:
        return ExactBlend("not tried", 0.0, message="this program has no Python interpreter for a child process")
    with tempfile.TemporaryDirectory() as folder:
        source, job, target = (Path(folder, name) for name in ("in.brep", "job.json", "out.brep"))
        own.write(shape, source)
        job.write_text(json.dumps({"blend": blend, "sizes": list(sizes.items())}))
        command = [*start_of_child, "-m", own.__name__, str(source), str(job), str(target)]
        try:
            child = subprocess.run(
                command,
                capture_output=True,
                text=True,
                timeout=time_limit,
                check=False,
                env=_environment(own.search_path()),
            )
        except subprocess.TimeoutExpired:
            return ExactBlend("time out", time_limit, message=f"no answer within {time_limit:g} s")
        seconds = time.perf_counter() - start
        try:
            answer = json.loads(child.stdout.splitlines()[-1])
        except (IndexError, ValueError):
            return ExactBlend("crash", seconds, message=f"the process ended with code {child.returncode}")
        answer["blend"] = tuple(answer.get("blend", ()))
        return ExactBlend(**answer, seconds=seconds, shape=own.read(target) if answer["status"] == "ok" else None)


def _environment(folders: list[str]) -> dict[str, str]:
    """Environment in which the child finds this very package, and what is in some folders."""
    here = str(Path(cad_implicit.__file__).parents[1])
    path = [here, *folders, os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, path))}


def run_child(
    arguments: list[str], read: Callable[[Path], Any], write: Callable[[Any, Path], None], blended: Callable[..., Any]
) -> str:
    """Do what the parent asked for, in the child: ``IN.brep JOB.json OUT.brep``. The answer is a JSON object."""
    source, job, target = map(Path, arguments)
    task = json.loads(job.read_text())
    sizes = {int(number): tuple(size) if isinstance(size, list) else size for number, size in task["sizes"]}
    answer, result = blended(read(source), sizes, task["blend"])
    if result is not None:
        write(result, target)
    return json.dumps(answer) + "\n"


def direction(convexities: set[str]) -> int:
    """Sign of the change of volume that blends of edges make; 0 if some are convex and others concave."""
    return {frozenset({"convex"}): -1, frozenset({"concave"}): 1}.get(frozenset(convexities), 0)


def fault(sound: bool, before: float, after: float, direction: int, open_edges: Callable[[], int]) -> str:
    """Tell what is wrong with a result, if anything.

    Parameters
    ----------
    sound : bool
        Whether the kernel finds it a valid solid.
    before, after : float
        Volumes in mm³.
    direction : int
        Sign of the change that is expected, or 0.
    open_edges : callable
        Counts the open edges of its triangles, if it comes to that.
    """
    if not sound:
        return "the result is not a valid solid"
    if after <= 0:
        return f"the volume is {after:.6g} mm³"
    if (after - before) * direction < 0 or (direction and after == before):
        return f"the volume changed the wrong way, from {before:.6g} to {after:.6g} mm³"
    count = open_edges()
    return f"its surface is not closed: {count} edges of its triangles are open" if count else ""
