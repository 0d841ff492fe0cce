"""Sources of features: their shape or triangles in their own frame, and where that frame is.

Features are computed in the frame of their source and placed with it, so that moving the source computes nothing anew.
Sources are whatever ``Part.getShape`` gives a shape for (Part features, bodies of PartDesign, links, compounds), and
meshes.
"""

from __future__ import annotations

import io
from typing import Any

import FreeCAD as App
import Mesh
import numpy as np
import Part

from .errors import WorkbenchError

#: So many texts of shapes are kept.
_KEPT = 4

#: Triangles as binary PLY writes them: three, and their vertices.
_TRIANGLE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])

_HEADER = """ply
format binary_little_endian 1.0
element vertex {vertices}
property double x
property double y
property double z
element face {faces}
property list uchar int vertex_indices
end_header
"""


def is_mesh(obj: Any) -> bool:
    """Whether an object, or what it links to, is a mesh."""
    return bool(obj.getLinkedObject(True).isDerivedFrom("Mesh::Feature"))


def located(obj: Any) -> tuple[Any, Any]:
    """Shape of an object in its own frame, without triangles, and its placement.

    Raises
    ------
    WorkbenchError
        If there is no solid in it.
    """
    shape = Part.getShape(obj)
    if shape.isNull():
        raise WorkbenchError(f"{obj.Label} has no shape; recompute it, or choose another object")
    if not shape.Solids:
        raise WorkbenchError(f"{obj.Label} holds no solid ({shape.ShapeType}); make a solid of it first")
    return placed(shape.copy(True, False), App.Placement()), shape.Placement


class _Texts:
    """Texts of the last shapes: a panel asks again with every keystroke, and writing takes 0.1 s for 600 faces."""

    def __init__(self) -> None:
        self._known: list[tuple[Any, Any, str]] = []

    def of(self, obj: Any) -> tuple[Any, Any, str]:
        """Shape of an object in its own frame, its placement, and the shape as text; errors as :func:`located`."""
        shape = Part.getShape(obj)
        for before, own, text in self._known:
            if before.isPartner(shape):
                return own, shape.Placement, text
        own, placement = located(obj)
        text = own.exportBrepToString()
        self._known = [(shape, own, text), *self._known[: _KEPT - 1]]
        return own, placement, text


def located_mesh(obj: Any) -> tuple[tuple[Any, Any], Any]:
    """Vertices ``(V, 3)`` in mm and faces ``(F, 3)`` of a mesh object in its own frame, and its placement.

    Raises
    ------
    WorkbenchError
        If it holds no triangles.
    """
    placement = _mesh_placement(obj)
    mesh = obj.getLinkedObject(True).Mesh.copy()
    if not mesh.CountFacets:
        raise WorkbenchError(f"{obj.Label} holds no triangles")
    mesh.Placement = App.Placement()
    points, facets = mesh.Topology
    return (np.array([(p.x, p.y, p.z) for p in points]), np.array(facets, np.int32)), placement


#: Texts of the shapes of sources.
texts = _Texts()


def _mesh_placement(obj: Any) -> Any:
    if not obj.isDerivedFrom("App::Link"):
        return obj.Placement
    return obj.Placement.multiply(_mesh_placement(obj.LinkedObject)) if obj.LinkTransform else obj.Placement


def moved(vertices: Any, placement: Any) -> Any:
    """Vertices moved by a placement."""
    matrix = np.array(placement.toMatrix().A).reshape(4, 4)
    return vertices @ matrix[:3, :3].T + matrix[:3, 3]


def mesh_of(vertices: Any, faces: Any) -> Any:
    """FreeCAD mesh of arrays; by way of PLY, for 0.20 crashes at long lists of points."""
    table = np.zeros(len(faces), _TRIANGLE)
    table["count"], table["corners"] = 3, faces
    header = _HEADER.format(vertices=len(vertices), faces=len(faces)).encode()
    mesh = Mesh.Mesh()
    data = header + np.ascontiguousarray(vertices, "<f8").tobytes() + table.tobytes()
    mesh.read(Stream=io.BytesIO(data), Format="PLY")
    return mesh


def placed(shape: Any, placement: Any) -> Any:
    """Shape at a placement."""
    shape.Placement = placement
    return shape


def shape_of(brep: str) -> Any:
    """Shape that an Answer holds: the solid itself if it is one."""
    shape = Part.Shape()
    shape.importBrepFromString(brep)
    return shape.Solids[0] if shape.ShapeType == "Compound" and len(shape.Solids) == 1 else shape
