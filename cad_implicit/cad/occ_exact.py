"""The exact kernel's own fillets and chamfers through OCP: the child process of :mod:`cad_implicit.cad.exact_blends`.

Run as ``python -m cad_implicit.cad.occ_exact IN.brep JOB.json OUT.brep``; prints one JSON object.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from . import occ
from .exact_blends import Blend, Size, direction, fault, run_child
from .occ_edges import shape_edges
from .occ_faces import all_faces
from .occ_mesh import tessellate


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


def _fault(result: Any, before: float, after: float, expected: int) -> str:
    """Tell what is wrong with a result, if anything."""
    sound = occ.is_valid(result) and occ.has_solid(result)
    return fault(sound, before, after, expected, lambda: tessellate(occ.solids(result))[0].open_edges)


def _direction(shape: Any, numbers: Mapping[int, Size]) -> int:
    """Sign of the change of volume that blends of these edges make."""
    return direction({edge.convexity for edge in shape_edges(shape) if edge.number in numbers})


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


def write(shape: Any, path: Path) -> None:
    """Write a shape to a BREP file."""
    from OCP.BRepTools import BRepTools

    BRepTools.Write_s(shape, str(path))


def read(path: Path) -> Any:
    """Read a shape from a BREP file."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Shape

    shape = TopoDS_Shape()
    BRepTools.Read_s(shape, str(path), BRep_Builder())
    return shape


def interpreter() -> list[str]:
    """Command that starts a child; empty if there is none."""
    return [] if getattr(sys, "frozen", False) or not sys.executable else [sys.executable]


def search_path() -> list[str]:
    """Folders in which the child looks for modules, besides its own."""
    return []


if __name__ == "__main__":
    sys.stdout.write(run_child(sys.argv[1:], read, write, blended))
