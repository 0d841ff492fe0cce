"""Properties of the features, by operation: what FreeCAD shows in its property editor and stores in the file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

#: Bits of FreeCAD's property attributes: read-only, hidden, and "a change of it needs no recompute".
_READ_ONLY, _HIDDEN, _OUTPUT = 1, 4, 8


@dataclass(frozen=True)
class Property:
    """One property: type, name, what it is for, its first value (choices for an enumeration, the first is taken)."""

    type: str
    name: str
    tip: str
    value: Any = None
    group: str = "Implicit"
    attributes: int = 0


def _length(name: str, tip: str, value: float) -> Property:
    return Property("App::PropertyLength", name, tip, value)


RADIUS = _length("Radius", "Radius", 1.0)

BASE = Property("App::PropertyLinkSub", "Base", "The source, and its edges or faces")

_ACCURACY = (
    Property("App::PropertyLength", "Tolerance", "Largest accepted error; 0: automatic", 0.0, "Accuracy"),
    Property("App::PropertyLength", "Spacing", "Spacing of the grid; 0: automatic", 0.0, "Accuracy"),
)

ENGINE = Property(
    "App::PropertyEnumeration",
    "Engine",
    "How distances are computed: exactly, or on a regular grid; chosen edges always exactly",
    ("exact", "reinit"),
    "Accuracy",
)

EXACT_FIRST = Property(
    "App::PropertyBool", "ExactFirst", "Ask FreeCAD's own kernel first, and take its result if it is sound", False
)

_FORCE = Property("App::PropertyBool", "Force", "Go past refusals, as where most of the part would be lost", False)

TANGENT = Property("App::PropertyBool", "Tangent", "Go on along edges that continue the chosen ones smoothly", True)

_RESULT = (
    Property("App::PropertyDistance", "ErrorBound", "Largest expected error; -1: not known", -1.0, "Result", 9),
    Property("App::PropertyFloat", "ExactShare", "Share of the area on exact surfaces, from 0 to 1", 0.0, "Result", 9),
    Property("App::PropertyString", "EngineUsed", "Who made it", "", "Result", 9),
    Property("App::PropertyFloat", "Seconds", "What it took", 0.0, "Result", 9),
    Property("App::PropertyStringList", "Warnings", "What may differ from what you expect", (), "Result", 9),
    Property("App::PropertyBool", "Stale", "Whether something changed since it was computed", True, "Result", 9),
)

_STORED = (
    Property("App::PropertyInteger", "SchemaVersion", "Version of these properties", 1, "Result", 13),
    Property("App::PropertyString", "Fingerprint", "Of what the result was computed from", "", "Result", 13),
    Property("App::PropertyFloatList", "OwnRadii", "Radius of each chosen edge; 0: Radius", (), "Implicit", _HIDDEN),
    Property("App::PropertyStringList", "References", "Where chosen edges and faces are", (), "Implicit", 12),
)

RESULT = Property("App::PropertyEnumeration", "Result", "What it gives", ("Solid", "Mesh"), "Implicit", _READ_ONLY)

#: Properties of each operation, its amount first.
OPERATIONS: dict[str, tuple[Property, ...]] = {
    "fillet": (RADIUS, TANGENT, EXACT_FIRST, ENGINE),
    "round": (RADIUS, TANGENT, EXACT_FIRST, ENGINE),
    "smooth": (RADIUS, TANGENT, EXACT_FIRST, ENGINE),
    "chamfer": (
        _length("Length", "Length on the face on the left of an edge, seen from outside", 1.0),
        _length("Length2", "Length on the face on its right; 0: the same", 0.0),
        TANGENT,
        EXACT_FIRST,
    ),
    "offset": (Property("App::PropertyDistance", "Distance", "Positive grows, negative shrinks", 1.0), ENGINE),
    "shell": (
        _length("Thickness", "Thickness of the wall", 1.0),
        Property("App::PropertyEnumeration", "Direction", "Where the wall is", ("inward", "outward", "both")),
        ENGINE,
    ),
    "infill": (
        _length("Wall", "Thickness of the lattice's walls or struts", 0.6),
        _length("Cell", "Period of the lattice", 6.0),
        Property(
            "App::PropertyEnumeration",
            "Kind",
            "The lattice",
            ("gyroid", "schwarz_p", "diamond", "iwp", "cubic", "bcc", "fcc", "octet", "rods", "cells"),
        ),
        _length("Skin", "Thickness of the skin; 0: none", 1.0),
        ENGINE,
    ),
    "boolean": (
        _length("Radius", "Radius of fillets along the joint; 0: sharp", 0.0),
        Property("App::PropertyEnumeration", "Kind", "What is done", ("union", "difference", "intersection")),
        Property("App::PropertyLink", "Tool", "The second object"),
        EXACT_FIRST,
    ),
}


def all_of(operation: str) -> tuple[Property, ...]:
    """Give all properties of an operation."""
    return (BASE, *OPERATIONS[operation], *_ACCURACY, _FORCE, RESULT, *_RESULT, *_STORED)


def inputs_of(operation: str) -> frozenset[str]:
    """Names of the properties on which the result depends."""
    return frozenset(p.name for p in (BASE, *OPERATIONS[operation], *_ACCURACY, _FORCE, RESULT)) | {"OwnRadii"}


def add(obj: Any, operation: str) -> None:
    """Give an object the properties of an operation that it does not have, with their first values."""
    for p in all_of(operation):
        if p.name in obj.PropertiesList:
            continue
        obj.addProperty(p.type, p.name, p.group, p.tip, p.attributes)
        if p.type == "App::PropertyEnumeration":
            setattr(obj, p.name, list(p.value))
        elif p.value is not None:
            setattr(obj, p.name, list(p.value) if isinstance(p.value, tuple) else p.value)
