"""B-rep solids through OCP, the Python binding of Open CASCADE that CadQuery and build123d share.

Runs on OCP 7.9 (CadQuery) and 8.0 (build123d). Import this module before the other ``occ_`` modules: it says what
to install where there is no OCP.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from cad_implicit.errors import MissingHostError, NoSolidError
from cad_implicit.mesh import FloatArray

from .files import INSTALL_HOST

try:
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Builder, BRep_Tool
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.Geom import Geom_Plane
    from OCP.GProp import GProp_GProps
    from OCP.Message import Message
    from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
    from OCP.TopExp import TopExp, TopExp_Explorer
    from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Solid
except ImportError as error:
    raise MissingHostError(
        f"B-rep parts (STEP, BREP, CadQuery, build123d) need OCP, and it cannot be imported ({error}); it comes with "
        f"either host: {INSTALL_HOST}"
    ) from error
try:  # OCP 7.9
    from OCP.TopTools import TopTools_IndexedMapOfShape as _IndexedMap
    from OCP.TopTools import TopTools_ListOfShape as _List
except ImportError:  # OCP 8.0
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as _IndexedMap
    from OCP.collections import List_TopoDS_Shape as _List

Shape = Any  # a TopoDS_Shape: OCP has no stubs that hold for both versions

as_wire = getattr(TopoDS, "Wire_s", None) or TopoDS.Wire
as_face = getattr(TopoDS, "Face_s", None) or TopoDS.Face
as_edge = getattr(TopoDS, "Edge_s", None) or TopoDS.Edge
as_vertex = getattr(TopoDS, "Vertex_s", None) or TopoDS.Vertex

#: Share by which volumes are off that are asked for with an accuracy.
VOLUMES_OFF = 0.0

#: Shells that enclose something, but leak: their areas' vector sum is at most this share of their area. (A union that
#: lacks one of its twelve faces, since the kernel made it so: 0.06; a cube without its lid: 0.2.)
_LEAKY = 0.1


@contextmanager
def silence() -> Iterator[None]:
    """Keep the kernel's messages off the standard streams."""
    messenger = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    for printer in printers:
        messenger.RemovePrinter(printer)
    try:
        yield
    finally:
        for printer in printers:
            messenger.AddPrinter(printer)


def explore(shape: Shape, kind: Any) -> Iterator[Shape]:
    """Sub-shapes of a kind in the order of ``TopExp_Explorer``; shared ones come as often as they are used."""
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def shape_map(shape: Shape, kind: Any) -> Any:
    """Map 1-based numbers to distinct sub-shapes of a kind, as ``TopExp::MapShapes`` (and FreeCAD) number them."""
    found = _IndexedMap()
    TopExp.MapShapes_s(shape, kind, found)
    return found


def compound(shapes: Sequence[Shape]) -> Shape:
    """One shape: the only one, or a compound of several."""
    if len(shapes) == 1:
        return shapes[0]
    result, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(result)
    for shape in shapes:
        builder.Add(result, shape)
    return result


def is_null(shape: Shape) -> bool:
    """Whether a shape is none."""
    return bool(shape.IsNull())


def has_solid(shape: Shape) -> bool:
    """Whether there is a solid in a shape."""
    return bool(TopExp_Explorer(shape, TopAbs_SOLID).More())


def solids(shape: Shape) -> list[Shape]:
    """Distinct solids of a shape.

    Raises
    ------
    NoSolidError
        If there is none; says what was found instead.
    """
    if shape.IsNull():
        raise NoSolidError("the part is empty; give a shape that holds a solid")
    found = list(distinct(shape, TopAbs_SOLID)) or _enclosed(shape)
    if not found:
        shells, faces = (shape_map(shape, kind).Extent() for kind in (TopAbs_SHELL, TopAbs_FACE))
        raise NoSolidError(
            f"the part holds no solid, only {shells} shells and {faces} faces, so it has no inside; "
            "close the surfaces and make a solid of them, or thicken them"
        )
    return found


def _enclosed(shape: Shape) -> list[Shape]:
    """Solids of shells that only leak: STEP files hold no solids for those, though what they enclose is clear."""
    from .occ_mesh import tessellate

    result = []
    for shell in distinct(shape, TopAbs_SHELL):
        solid = TopoDS_Solid()
        BRep_Builder().MakeSolid(solid)
        BRep_Builder().Add(solid, shell)
        vectors = tessellate([solid])[0].face_vectors
        if np.linalg.norm(vectors.sum(axis=0)) > _LEAKY * np.linalg.norm(vectors, axis=1).sum():
            return []
        result.append(solid)
    return result


def volume(shape: Shape, accuracy: float | None = None) -> float:
    """Volume in mm³: by a fixed number of points on each face, or with a relative accuracy."""
    properties = GProp_GProps()
    if accuracy is None:
        BRepGProp.VolumeProperties_s(shape, properties)
    else:
        BRepGProp.VolumeProperties_s(shape, properties, accuracy, False, False)
    return float(properties.Mass())


def area(shape: Shape) -> float:
    """Exact surface area in mm²."""
    properties = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, properties)
    return float(properties.Mass())


def count_faces(shape: Shape) -> int:
    """Count the distinct faces of a shape."""
    return int(shape_map(shape, TopAbs_FACE).Extent())


def only_planes(shape: Shape) -> bool:
    """Whether all faces of a shape are plane."""
    faces = map(as_face, distinct(shape, TopAbs_FACE))
    return all(isinstance(BRep_Tool.Surface_s(face), Geom_Plane) for face in faces)


def is_valid(shape: Shape) -> bool:
    """Whether the kernel's own check finds nothing wrong."""
    with silence():
        return bool(BRepCheck_Analyzer(shape).IsValid())


def bounds(shape: Shape) -> FloatArray:
    """Lower and upper corner ``(2, 3)`` in mm of a box that holds the shape; for splines not the smallest."""
    box = Bnd_Box()
    BRepBndLib.Add_s(shape, box, False)
    corners = (box.CornerMin(), box.CornerMax())
    return np.array([[p.X(), p.Y(), p.Z()] for p in corners])


def fuse(parts: Sequence[Shape]) -> list[Shape]:
    """Solids of the union, none if the kernel fails at it."""
    try:
        with silence():
            return _fuse(parts)
    except Exception:  # OCP raises its own family of errors, which differs between versions
        return []


def _fuse(parts: Sequence[Shape]) -> list[Shape]:
    arguments, tools = _List(), _List()
    arguments.Append(parts[0])
    for part in parts[1:]:
        tools.Append(part)
    fuse = BRepAlgoAPI_Fuse()
    fuse.SetArguments(arguments)
    fuse.SetTools(tools)
    fuse.SetNonDestructive(True)
    fuse.Build()
    return list(distinct(fuse.Shape(), TopAbs_SOLID)) if fuse.IsDone() else []


def distinct(shape: Shape, kind: Any) -> Iterator[Shape]:
    """Distinct sub-shapes of a kind in the order of :func:`shape_map`."""
    found = shape_map(shape, kind)
    return (found.FindKey(i) for i in range(1, found.Extent() + 1))
