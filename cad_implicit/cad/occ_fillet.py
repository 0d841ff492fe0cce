"""The exact kernel's own fillet, to compare with: run in a child process, because it can crash the process.

Run as ``python -m cad_implicit.cad.occ_fillet IN.brep RADIUS KIND OUT.brep``; prints one JSON object.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

Kind = Literal["concave", "convex"]

#: Edges whose faces meet at less than this angle are tangent: neither convex nor concave.
TANGENT_DEGREES = 1.0

#: Seconds after which the child process is given up.
TIME_LIMIT = 120.0


@dataclass(frozen=True)
class ExactFillet:
    """What the exact kernel made of a fillet.

    Attributes
    ----------
    status : "ok", "not done", "invalid", "crash" or "time out"
    edges : int
        Number of edges asked for.
    shape : OCP ``TopoDS_Shape`` or None
        The filleted part, if ``status`` is "ok".
    message : str
        What the kernel said otherwise.
    """

    status: str
    edges: int
    shape: Any
    message: str


def exact_fillet(shape: Any, radius: float, kind: Kind, *, time_limit: float = TIME_LIMIT) -> ExactFillet:
    """Fillet all concave, or round all convex, edges of a ``TopoDS_Shape`` by the exact kernel, in a child process.

    The result counts only if it is valid and its volume changed in the right direction.
    """
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "in.brep"), Path(folder, "out.brep")
        _write(shape, source)
        command = [sys.executable, "-m", __name__, str(source), repr(float(radius)), kind, str(target)]
        try:
            child = subprocess.run(command, capture_output=True, text=True, timeout=time_limit, check=False)
        except subprocess.TimeoutExpired:
            return ExactFillet("time out", 0, None, f"no answer within {time_limit:g} s")
        try:
            answer = json.loads(child.stdout.splitlines()[-1])
        except (IndexError, ValueError):
            return ExactFillet("crash", 0, None, f"the process ended with code {child.returncode}")
        result = _read(target) if answer["status"] == "ok" else None
        return ExactFillet(answer["status"], answer["edges"], result, answer["message"])


def edges_by_kind(shape: Any, kind: Kind) -> list[Any]:
    """Edges (``TopoDS_Edge``) of a solid at which two different faces meet at a concave or convex angle."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
    from OCP.TopExp import TopExp
    from OCP.TopoDS import TopoDS

    as_edge = getattr(TopoDS, "Edge_s", None) or TopoDS.Edge  # before and since OCCT 8
    as_face = getattr(TopoDS, "Face_s", None) or TopoDS.Face
    ancestors = _shape_list_map()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, ancestors)
    edges = []
    for index in range(1, ancestors.Extent() + 1):
        edge = as_edge(ancestors.FindKey(index))
        faces = [as_face(face) for face in ancestors.FindFromIndex(index)]
        if len(faces) == 2 and not faces[0].IsSame(faces[1]):
            angle = _turn(edge, faces[0], faces[1])
            if abs(angle) > TANGENT_DEGREES and (angle > 0) == (kind == "convex"):
                edges.append(edge)
    return edges


def _shape_list_map() -> Any:
    """Empty map from shapes to lists of shapes, as it is called before and since OCCT 8."""
    try:
        from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape as Map
    except ImportError:
        from OCP.collections import IndexedDataMap_TopoDS_Shape_List_TopoDS_Shape_TopTools_ShapeMapHasher as Map
    return Map()


def _turn(edge: Any, first: Any, second: Any) -> float:
    """Angle in degrees by which the outward normal turns over an edge at its middle: positive at convex edges."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.gp import gp_Pnt, gp_Vec

    if BRep_Tool.Degenerated_s(edge):
        return 0.0
    curve = BRepAdaptor_Curve(edge)
    middle = (curve.FirstParameter() + curve.LastParameter()) / 2
    point, tangent = gp_Pnt(), gp_Vec()
    curve.D1(middle, point, tangent)
    if tangent.Magnitude() < 1e-12:
        return 0.0
    tangent.Normalize()
    if _is_reversed_in(edge, first):
        tangent.Reverse()
    a, b = _normal(edge, first, middle), _normal(edge, second, middle)
    turn = a.Crossed(b)
    return math.degrees(math.atan2(turn.Dot(tangent), a.Dot(b)))


def _is_reversed_in(edge: Any, face: Any) -> bool:
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(face, TopAbs_EDGE)
    while explorer.More():
        if explorer.Current().IsSame(edge):
            return bool(explorer.Current().Orientation() == TopAbs_REVERSED)
        explorer.Next()
    return False


def _normal(edge: Any, face: Any, parameter: float) -> Any:
    """Outward normal of a face at a point of one of its edges."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d, BRepAdaptor_Surface
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TopAbs import TopAbs_REVERSED

    uv = BRepAdaptor_Curve2d(edge, face).Value(parameter)
    point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
    BRepAdaptor_Surface(face).D1(uv.X(), uv.Y(), point, du, dv)
    normal = du.Crossed(dv)
    if normal.Magnitude() > 0:
        normal.Normalize()
    return normal.Reversed() if face.Orientation() == TopAbs_REVERSED else normal


def _fillet(shape: Any, radius: float, kind: Kind) -> tuple[dict[str, Any], Any]:
    """Fillet in this process: the answer for the parent, and the shape."""
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    def volume(part: Any) -> float:
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(part, properties)
        return float(properties.Mass())

    edges = edges_by_kind(shape, kind)
    answer = {"status": "not done", "edges": len(edges), "message": ""}
    if not edges:
        return answer | {"message": f"the part has no {kind} edges"}, None
    maker = BRepFilletAPI_MakeFillet(shape)
    for edge in edges:
        maker.Add(radius, edge)
    try:
        maker.Build()
        result = maker.Shape()
    except Exception as error:  # OCP raises its own classes, all derived from Exception
        return answer | {"message": str(error) or type(error).__name__}, None
    if not BRepCheck_Analyzer(result).IsValid():
        return answer | {"status": "invalid", "message": "the result is not a valid solid"}, None
    before, after = volume(shape), volume(result)
    if after <= 0 or (after > before) != (kind == "concave"):
        message = f"the volume changed the wrong way, from {before:.6g} to {after:.6g} mm³"
        return answer | {"status": "invalid", "message": message}, None
    return answer | {"status": "ok"}, result


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


def _main(source: str, radius: str, kind: Kind, target: str) -> None:
    answer, result = _fillet(_read(Path(source)), float(radius), kind)
    if result is not None:
        _write(result, Path(target))
    sys.stdout.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    _main(*sys.argv[1:])  # type: ignore[arg-type]
