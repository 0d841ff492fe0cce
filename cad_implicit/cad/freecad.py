"""B-rep solids through FreeCAD's ``Part`` module.

Runs on FreeCAD 0.20 and later, within it or in a program that has its libraries on ``sys.path``. OCP, which comes with
a copy of Open CASCADE of its own, is not imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cad_implicit.errors import MissingHostError, NoSolidError
from cad_implicit.mesh import FloatArray

try:
    import FreeCAD
    import Part
except ImportError as error:
    raise MissingHostError(f"shapes of FreeCAD need its Part module, and it cannot be imported ({error})") from error

Shape = Any  # a Part.Shape: FreeCAD has no stubs

#: Share by which volumes are off beside borders that are splines of hundreds of pieces: 5.5e-5 for a fillet around a
#: cone, which with an accuracy asked for is good to 1e-10.
VOLUMES_OFF = 2e-4


def vector(point: Sequence[float] | FloatArray) -> Any:
    """Vector of FreeCAD at a point (3,)."""
    return FreeCAD.Vector(*map(float, point))


def is_null(shape: Shape) -> bool:
    """Whether a shape is none."""
    return bool(shape.isNull())


def compound(shapes: Sequence[Shape]) -> Shape:
    """One shape: the only one, or a compound of several."""
    return shapes[0] if len(shapes) == 1 else Part.makeCompound(list(shapes))


def has_solid(shape: Shape) -> bool:
    """Whether there is a solid in a shape."""
    return bool(shape.Solids)


def solids(shape: Shape) -> list[Shape]:
    """Distinct solids of a shape.

    Raises
    ------
    NoSolidError
        If there is none; says what was found instead.
    """
    if shape.isNull():
        raise NoSolidError("the part is empty; give a shape that holds a solid")
    if not shape.Solids:
        raise NoSolidError(
            f"the part holds no solid, only {len(shape.Shells)} shells and {len(shape.Faces)} faces, so it has no "
            "inside; close the surfaces and make a solid of them, or thicken them"
        )
    return list(shape.Solids)


def volume(shape: Shape, accuracy: float | None = None) -> float:
    """Volume in mm³, by a fixed number of points on each face: FreeCAD gives no choice of accuracy."""
    return float(shape.Volume)


def area(shape: Shape) -> float:
    """Exact surface area in mm²."""
    return float(shape.Area)


def count_faces(shape: Shape) -> int:
    """Count the distinct faces of a shape."""
    return len(shape.Faces)


def is_valid(shape: Shape) -> bool:
    """Whether the kernel's own check finds nothing wrong."""
    return bool(shape.isValid())


def bounds(shape: Shape) -> FloatArray:
    """Lower and upper corner ``(2, 3)`` in mm of a box that holds the shape; for splines not the smallest."""
    box = shape.BoundBox
    return np.array([[box.XMin, box.YMin, box.ZMin], [box.XMax, box.YMax, box.ZMax]])


def fuse(parts: Sequence[Shape]) -> list[Shape]:
    """Solids of the union, none if the kernel fails at it."""
    try:
        return list(parts[0].fuse(list(parts[1:])).Solids)
    except Part.OCCError:
        return []
