"""The exact kernel's own fillets and chamfers, in a child process, because it can crash the process or never end.

"No exception" is not success: a result counts if the kernel's check finds it valid, its volume is positive and changed
in the right direction, and its triangles are closed.

Run as ``python -m cad_implicit.cad.occ_exact IN.brep JOB.json OUT.brep``; prints one JSON object.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import cad_implicit

from . import occ

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
    shape : TopoDS_Shape or None
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
    """Blend some edges of a ``TopoDS_Shape``, numbered from 1 as ``TopExp::MapShapes`` does, in a child process.

    The kernel goes on along tangent edges by itself. A chamfer's lengths are measured on the faces on the left and the
    right of the edge, as :class:`cad_implicit.cad.edges.Edge` tells them. Starting the process takes about 2 s.
    """
    start = time.perf_counter()
    if not sizes:
        return ExactBlend("not done", 0.0, message="there are no edges to blend")
    if getattr(sys, "frozen", False) or not sys.executable:
        return ExactBlend("not tried", 0.0, message="this program has no Python interpreter for a child process")
    with tempfile.TemporaryDirectory() as folder:
        source, job, target = (Path(folder, name) for name in ("in.brep", "job.json", "out.brep"))
        _write(shape, source)
        job.write_text(json.dumps({"blend": blend, "sizes": list(sizes.items())}))
        command = [sys.executable, "-m", __name__, str(source), str(job), str(target)]
        try:
            child = subprocess.run(
                command, capture_output=True, text=True, timeout=time_limit, check=False, env=_environment()
            )
        except subprocess.TimeoutExpired:
            return ExactBlend("time out", time_limit, message=f"no answer within {time_limit:g} s")
        seconds = time.perf_counter() - start
        try:
            answer = json.loads(child.stdout.splitlines()[-1])
        except (IndexError, ValueError):
            return ExactBlend("crash", seconds, message=f"the process ended with code {child.returncode}")
        answer["blend"] = tuple(answer.get("blend", ()))
        return ExactBlend(**answer, seconds=seconds, shape=_read(target) if answer["status"] == "ok" else None)


def _environment() -> dict[str, str]:
    """Environment in which the child finds this very package."""
    here = str(Path(cad_implicit.__file__).parents[1])
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [here, os.environ.get("PYTHONPATH")]))}


def blended(shape: Any, sizes: Mapping[int, Size], blend: Blend) -> tuple[dict[str, Any], Any]:
    """Blend in this process: the answer for the parent, and the shape."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_VERTEX

    edges = occ.shape_map(shape, TopAbs_EDGE)
    before = occ.volume(shape)
    answer: dict[str, Any] = {"status": "not done", "before": before}
    try:
        maker = (_fillets if blend == "fillet" else _chamfers)(
            shape, {n: occ.as_edge(edges.FindKey(n)) for n in sizes}, sizes
        )
        maker.Build()
        result = maker.Shape()
    except Exception as error:  # OCP raises its own classes, all derived from Exception
        return answer | {"message": str(error) or type(error).__name__}, None
    after = occ.volume(result)
    fault = _fault(result, before, after, _direction(shape, sizes))
    if fault:
        return answer | {"status": "invalid", "after": after, "message": fault}, None
    numbers = occ.shape_map(result, TopAbs_FACE)
    new = {
        numbers.FindIndex(face)
        for kind in (TopAbs_EDGE, TopAbs_VERTEX)
        for source in occ.distinct(shape, kind)
        for face in maker.Generated(source)
    }
    answer |= {"after": after, "tolerance": _tolerance(result), "blend": sorted(new - {0})}
    return answer | {"status": "ok"}, result


def _fault(result: Any, before: float, after: float, direction: int) -> str:
    """Tell what is wrong with a result, if anything."""
    from .occ_mesh import tessellate

    if not occ.is_valid(result) or not occ.has_solid(result):
        return "the result is not a valid solid"
    if after <= 0:
        return f"the volume is {after:.6g} mm³"
    if (after - before) * direction < 0 or (direction and after == before):
        return f"the volume changed the wrong way, from {before:.6g} to {after:.6g} mm³"
    mesh, _ = tessellate(occ.solids(result))
    return "" if mesh.is_watertight else f"its surface is not closed: {mesh.open_edges} edges of its triangles are open"


def _direction(shape: Any, numbers: Mapping[int, Size]) -> int:
    """Sign of the change of volume that blends of these edges make; 0 if some are convex and others concave."""
    from .occ_edges import shape_edges

    kinds = {edge.convexity for edge in shape_edges(shape) if edge.number in numbers}
    return {frozenset({"convex"}): -1, frozenset({"concave"}): 1}.get(frozenset(kinds), 0)


def _tolerance(shape: Any) -> float:
    from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance

    return float(ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1))


def _fillets(shape: Any, edges: Mapping[int, Any], sizes: Mapping[int, Size]) -> Any:
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet

    maker = BRepFilletAPI_MakeFillet(shape)
    for number, edge in edges.items():
        size = sizes[number]
        if isinstance(size, float | int):
            maker.Add(float(size), edge)
        else:
            maker.Add(float(size[0]), float(size[1]), edge)
    return maker


def _chamfers(shape: Any, edges: Mapping[int, Any], sizes: Mapping[int, Size]) -> Any:
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeChamfer

    from .occ_edges import shape_edges
    from .occ_faces import all_faces

    faces = all_faces(shape)
    left = {edge.number: faces[edge.faces[0] - 1] for edge in shape_edges(shape) if edge.faces}
    maker = BRepFilletAPI_MakeChamfer(shape)
    for number, edge in edges.items():
        size = sizes[number]
        if isinstance(size, float | int):
            maker.Add(float(size), edge)
        else:
            maker.Add(float(size[0]), float(size[1]), edge, occ.as_face(left[number]))
    return maker


def _write(shape: Any, path: Path) -> None:
    from OCP.BRepTools import BRepTools

    BRepTools.Write_s(shape, str(path))


def _read(path: Path) -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Shape

    shape = TopoDS_Shape()
    BRepTools.Read_s(shape, str(path), BRep_Builder())
    return shape


def _main(arguments: Sequence[str]) -> None:
    source, job, target = map(Path, arguments)
    task = json.loads(job.read_text())
    sizes = {int(number): tuple(size) if isinstance(size, list) else size for number, size in task["sizes"]}
    answer, result = blended(_read(source), sizes, task["blend"])
    if result is not None:
        _write(result, target)
    sys.stdout.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    _main(sys.argv[1:])
