"""Which B-rep kernel a shape is of: OCP's, under CadQuery and build123d, or FreeCAD's own.

Both offer the same functions, in modules of the same names but for their beginning: ``occ_…`` and ``freecad_…``. A
shape never goes from one to the other: each has a copy of Open CASCADE of its own.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any


def is_freecad(thing: Any) -> bool:
    """Whether a thing is a ``Part.Shape`` of FreeCAD."""
    return hasattr(thing, "exportBrepToString")


def is_occ(thing: Any) -> bool:
    """Whether a thing is a ``TopoDS_Shape`` of OCP."""
    return callable(getattr(thing, "TShape", None)) and callable(getattr(thing, "IsNull", None))


def kernel(shape: Any, subject: str = "") -> Any:
    """Find the module of the kernel that a shape is of.

    Parameters
    ----------
    shape : TopoDS_Shape, Part.Shape or None
        None for that in whose process this is: FreeCAD's, or OCP's in any other.
    subject : str
        "" for shapes as a whole; "mesh", "edges", "faces", "original", "solids", "facets", "chosen", "exact", "files".

    Raises
    ------
    MissingHostError
        If the kernel cannot be imported.
    """
    freecad = within_freecad() if shape is None else is_freecad(shape)
    family = "freecad" if freecad else "occ"
    whole = import_module(f".{family}", __package__)  # first: it says what to install
    return import_module(f".{family}_{subject}", __package__) if subject else whole


def within_freecad() -> bool:
    """Whether this is a process of FreeCAD, or of a program that uses it and not OCP."""
    return "FreeCAD" in sys.modules and "OCP" not in sys.modules
