"""The exact kernel's own fillets and chamfers through FreeCAD: the child of :mod:`cad_implicit.cad.exact_blends`.

Run as ``python -m cad_implicit.cad.freecad_exact IN.brep JOB.json OUT.brep``; prints one JSON object.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import FreeCAD
import Part

from . import freecad
from .exact_blends import Blend, Size, direction, fault, run_child
from .freecad_edges import shape_edges
from .freecad_mesh import tessellate

#: Surfaces that are nowhere farther from each other than so many mm are one: the kernel's own resolution.
_SAME = 1e-7


def interpreter() -> list[str]:
    """Command that starts a child: FreeCAD's Python, or the system's of the same version; empty if there is none."""
    if Path(sys.executable or "").name.startswith("python"):
        return [sys.executable]
    found = shutil.which(f"python{sys.version_info.major}.{sys.version_info.minor}")
    return [found] if found else []


def search_path() -> list[str]:
    """Folders in which the child looks for modules, FreeCAD's among them."""
    library = os.path.dirname(Part.__file__)
    return [folder for folder in [*sys.path, library] if folder]


def blended(shape: Any, sizes: Mapping[int, Size], blend: Blend) -> tuple[dict[str, Any], Any]:
    """Blend in this process: the answer for the parent, and the shape."""
    found = {edge.number: edge for edge in shape_edges(shape)}
    before = freecad.volume(shape)
    answer: dict[str, Any] = {"status": "not done", "before": before}
    edges = []
    for number, size in sizes.items():
        first, second = size if isinstance(size, tuple) else (size, size)
        faces = found[number].faces
        if blend == "chamfer" and faces and faces[0] > faces[-1]:
            first, second = second, first  # FreeCAD measures the first length on the face of the lower number
        edges.append((number, float(first), float(second)))
    document = FreeCAD.newDocument("exact", hidden=True, temp=True)
    try:
        base = document.addObject("Part::Feature", "Base")
        base.Shape = shape
        feature = document.addObject("Part::Fillet" if blend == "fillet" else "Part::Chamfer", "Blend")
        feature.Base, feature.Edges = base, edges
        document.recompute()
        if not feature.isValid():
            return answer | {"message": feature.getStatusString()}, None
        result = feature.Shape.copy()
    finally:
        FreeCAD.closeDocument(document.Name)
    after = freecad.volume(result)
    expected = direction({found[number].convexity for number in sizes})
    sound = freecad.is_valid(result) and freecad.has_solid(result)
    wrong = fault(sound, before, after, expected, lambda: tessellate(freecad.solids(result))[0].open_edges)
    if wrong:
        return answer | {"status": "invalid", "after": after, "message": wrong}, None
    known = [face.Surface for face in shape.Faces]
    new = [number for number, face in enumerate(result.Faces, 1) if not any(_same(face, own) for own in known)]
    answer |= {"status": "ok", "after": after, "tolerance": result.getTolerance(1), "blend": new}
    return answer, result


def _same(face: Any, surface: Any) -> bool:
    """Whether a face lies on a surface, by the same parameters: the kernel keeps those of faces that it trims."""
    own = face.Surface
    if type(own) is not type(surface):
        return False
    low_u, high_u, low_v, high_v = face.ParameterRange
    corners = ((u, v) for u in (low_u, high_u) for v in (low_v, high_v))
    return all(own.value(*corner).distanceToPoint(surface.value(*corner)) < _SAME for corner in corners)


def write(shape: Any, path: Path) -> None:
    """Write a shape to a BREP file."""
    shape.exportBrep(str(path))


def read(path: Path) -> Any:
    """Read a shape from a BREP file."""
    shape = Part.Shape()
    shape.importBrep(str(path))
    return shape


if __name__ == "__main__":
    sys.stdout.write(run_child(sys.argv[1:], read, write, blended))
