"""The exact kernel's blends along chosen edges, in a child process: what local blends are compared with.

Run as ``python -m validation.exact_blends IN.brep JOB.json OUT.brep``; prints one JSON object.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from cad_implicit.cad import occ

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
    status : "ok", "not done", "invalid", "crash" or "time out"
    before, after : float
        Volumes in mm³.
    shape : TopoDS_Shape or None
        The result, if ``status`` is "ok".
    blend : tuple of int
        Numbers in the result, from 1, of the faces that are new.
    kinds : dict of str to int
        How many of these are cylinders, tori and so on.
    message : str
        What the kernel said otherwise.
    """

    status: str
    seconds: float
    before: float = 0.0
    after: float = 0.0
    shape: Any = None
    blend: tuple[int, ...] = ()
    kinds: Mapping[str, int] = field(default_factory=dict)
    message: str = ""

    @property
    def ok(self) -> bool:
        """Whether there is a valid result."""
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
    right of the edge, as :class:`cad_implicit.cad.edges.Edge` tells them.
    """
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        source, job, target = (Path(folder, name) for name in ("in.brep", "job.json", "out.brep"))
        write_brep(shape, source)
        job.write_text(json.dumps({"blend": blend, "sizes": list(sizes.items())}))
        command = [sys.executable, "-m", __name__, str(source), str(job), str(target)]
        try:
            child = subprocess.run(command, capture_output=True, text=True, timeout=time_limit, check=False)
        except subprocess.TimeoutExpired:
            return ExactBlend("time out", time_limit, message=f"no answer within {time_limit:g} s")
        seconds = time.perf_counter() - start
        try:
            answer = json.loads(child.stdout.splitlines()[-1])
        except (IndexError, ValueError):
            return ExactBlend("crash", seconds, message=f"the process ended with code {child.returncode}")
        answer["blend"] = tuple(answer.get("blend", ()))
        return ExactBlend(**answer, seconds=seconds, shape=read_brep(target) if answer["status"] == "ok" else None)


def write_brep(shape: Any, path: Path) -> None:
    """Write a shape in the kernel's own format."""
    from OCP.BRepTools import BRepTools

    BRepTools.Write_s(shape, str(path))


def read_brep(path: Path) -> Any:
    """Read a shape in the kernel's own format."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Shape

    shape = TopoDS_Shape()
    BRepTools.Read_s(shape, str(path), BRep_Builder())
    return shape


def blended(shape: Any, sizes: Mapping[int, Size], blend: Blend) -> tuple[dict[str, Any], Any]:
    """Blend in this process: the answer for the parent, and the shape."""
    from OCP.BRepCheck import BRepCheck_Analyzer
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
    if not BRepCheck_Analyzer(result).IsValid():
        return answer | {"status": "invalid", "message": "the result is not a valid solid"}, None
    after = occ.volume(result)
    if after <= 0:
        return answer | {"status": "invalid", "message": f"the volume is {after:.6g} mm³"}, None
    numbers = occ.shape_map(result, TopAbs_FACE)
    new = {
        numbers.FindIndex(face)
        for kind in (TopAbs_EDGE, TopAbs_VERTEX)
        for source in occ.distinct(shape, kind)
        for face in maker.Generated(source)
    }
    blend_faces = sorted(new - {0})
    kinds = Counter(surface_name(numbers.FindKey(number)) for number in blend_faces)
    return answer | {"status": "ok", "after": after, "blend": blend_faces, "kinds": dict(kinds)}, result


def surface_name(face: Any) -> str:
    """Name of the type of a face's surface."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    from cad_implicit.cad.occ_edges import type_name

    return type_name(BRepAdaptor_Surface(occ.as_face(face), False).GetType())


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

    from cad_implicit.cad.occ_edges import shape_edges
    from cad_implicit.cad.occ_faces import all_faces

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


def _main(source: str, job: str, target: str) -> None:
    task = json.loads(Path(job).read_text())
    sizes = {int(number): tuple(size) if isinstance(size, list) else size for number, size in task["sizes"]}
    answer, result = blended(read_brep(Path(source)), sizes, task["blend"])
    if result is not None:
        write_brep(result, Path(target))
    print(json.dumps(answer))


if __name__ == "__main__":
    _main(*sys.argv[1:])
