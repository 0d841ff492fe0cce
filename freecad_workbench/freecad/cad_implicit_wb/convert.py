"""Solids of results that go on without the workbench, and files of them.

A solid of a mesh has a plane face for each flat region, and one for each triangle of a curved one: :func:`cost` tells
how many at most, and what that takes, before anything is computed.
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import Mesh
import MeshPart
import Part

from . import client, feature, preferences, sources
from .errors import WorkbenchError

#: Kinds of files.
MESH_FILES = (".stl", ".3mf", ".obj", ".ply")
SOLID_FILES = (".step", ".stp", ".brep")

#: Each face of a solid takes so many seconds to make, and so many bytes in a STEP file (measured with OpenCASCADE 7.6).
_SECONDS, _BYTES = 3e-4, 1.1e3

#: Triangles of files are so near to the surface, as a share of the diagonal, where the result knows of no error.
_DEFLECTION = 2e-4

#: Largest angle in radians between triangles of a curved surface, of the library's tessellation, too.
_ANGLE = 0.2


@dataclass(frozen=True)
class Cost:
    """What a solid of a mesh costs at most: faces, seconds, and bytes in a STEP file."""

    faces: int
    seconds: float
    bytes: float


def cost(obj: Any) -> Cost:
    """Tell what a solid of an object costs."""
    faces = obj.getLinkedObject(True).Mesh.CountFacets if sources.is_mesh(obj) else len(Part.getShape(obj).Faces)
    return Cost(faces, _SECONDS * faces, _BYTES * faces)


def solid_request(obj: Any, tolerance: float | None = None) -> tuple[client.Request, Any]:
    """Request for the solid of a mesh object, simplified within so many mm first, and where it is placed."""
    arrays, placement = sources.located_mesh(obj)
    return client.Request(None, arrays, "solid", None, None, {"simplify": tolerance, **preferences.limits()}), placement


def to_solid(obj: Any, tolerance: float | None = None) -> Any:
    """Add a plain solid to the document that looks as an object does, and depends on nothing.

    Parameters
    ----------
    obj : App.DocumentObject
        A result of the workbench, a mesh, or a shape.
    tolerance : float, optional
        Triangles of a mesh are simplified within so many mm first; that needs manifold3d.

    Raises
    ------
    WorkbenchError
        If no solid can be made of it.
    """
    shape = _shape(obj, tolerance)
    solid = obj.Document.addObject("Part::Feature", f"{obj.Name}_solid")
    solid.Label = f"{obj.Label} (solid)"
    placement = shape.Placement
    solid.Shape = shape
    solid.Placement = placement
    return solid


def export(obj: Any, path: str | Path, tolerance: float | None = None) -> None:
    """Write an object to a file, by its suffix; the file is replaced when all is written.

    Parameters
    ----------
    obj : App.DocumentObject
        A result of the workbench, a mesh, or a shape.
    path : path
        .stl, .3mf, .obj, .ply for triangles; .step, .stp, .brep for solids.
    tolerance : float, optional
        Largest distance in mm of triangles from the surfaces of a solid; by default the error of the result, or
        1/5000 of the diagonal.

    Raises
    ------
    WorkbenchError
        If the suffix is not known, or nothing can be written.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in MESH_FILES + SOLID_FILES:
        raise WorkbenchError(f"files {suffix or 'without a suffix'} are not known; use {', '.join(_all())}")
    if not target.parent.is_dir():
        raise WorkbenchError(f"there is no folder {target.parent}")
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        written = Path(folder, f"{target.stem}{suffix}")
        if suffix in MESH_FILES:
            _mesh(obj, tolerance).write(str(written))
        elif suffix == ".brep":
            _shape(obj, None).exportBrep(str(written))
        else:
            _shape(obj, None).exportStep(str(written))
        if not written.is_file() or not written.stat().st_size:
            raise WorkbenchError(f"FreeCAD could not write {target}")
        os.replace(written, target)


def _all() -> tuple[str, ...]:
    return MESH_FILES + SOLID_FILES


def _shape(obj: Any, tolerance: float | None) -> Any:
    """Shape of an object in its place."""
    if not sources.is_mesh(obj):
        return sources.placed(*sources.located(obj))
    request, placement = solid_request(obj, tolerance)
    answer = feature.answered(request, obj.Label)
    assert answer.brep is not None  # a solid was asked for
    return sources.placed(sources.shape_of(answer.brep), placement)


def _mesh(obj: Any, tolerance: float | None) -> Any:
    """Triangles of an object in its place."""
    if sources.is_mesh(obj):
        (vertices, faces), placement = sources.located_mesh(obj)
        return sources.mesh_of(sources.moved(vertices, placement), faces)
    shape = sources.placed(*sources.located(obj))
    known = getattr(obj, "ErrorBound", None)
    deflection = tolerance or (known.Value if known is not None and known.Value > 0 else None)
    deflection = deflection or _DEFLECTION * shape.BoundBox.DiagonalLength
    mesh = MeshPart.meshFromShape(Shape=shape, LinearDeflection=deflection, AngularDeflection=_ANGLE, Relative=False)
    return Mesh.Mesh(mesh)
