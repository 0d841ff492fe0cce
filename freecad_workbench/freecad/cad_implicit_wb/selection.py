"""What is selected, and whether an operation can begin with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import FreeCADGui as Gui


@dataclass(frozen=True)
class Chosen:
    """A selected object with its selected edges, faces and vertices (``Edge3``, ``Face1`` …)."""

    object: Any
    names: tuple[str, ...] = ()


def chosen() -> list[Chosen]:
    """Return what is selected, in the order in which it was."""
    return [Chosen(whole(s.Object), tuple(s.SubElementNames)) for s in Gui.Selection.getSelectionEx()]


def whole(obj: Any) -> Any:
    """Return the body whose tip an object is: the tip has the same edges, but the body is what others see."""
    parent = obj.getParentGeoFeatureGroup()
    if parent is not None and parent.isDerivedFrom("PartDesign::Body") and parent.Tip is obj:
        return parent
    return obj


def is_mesh(obj: Any) -> bool:
    """Whether an object is a mesh."""
    return bool(obj.getLinkedObject(True).isDerivedFrom("Mesh::Feature"))


def is_part(obj: Any) -> bool:
    """Whether an object has a shape with a solid in it."""
    shape = getattr(obj.getLinkedObject(True), "Shape", None)
    return bool(getattr(shape, "Solids", ()))


def one(kinds: tuple[str, ...], *, meshes: bool = True) -> Chosen | None:
    """Return the only selected part or mesh, if its selected elements are all of such kinds ("Edge", "Face")."""
    found = chosen()
    if len(found) != 1 or not (is_part(found[0].object) or (meshes and is_mesh(found[0].object))):
        return None
    return found[0] if all(name.startswith(kinds) for name in found[0].names) else None


def two() -> tuple[Chosen, Chosen] | None:
    """Return the two selected parts or meshes."""
    found = chosen()
    if len(found) != 2 or not all(is_part(c.object) or is_mesh(c.object) for c in found):
        return None
    return found[0], found[1]
