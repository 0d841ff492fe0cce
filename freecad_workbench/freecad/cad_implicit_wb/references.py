"""Chosen edges and faces, found again after their shape was recomputed and renumbered, or told to be lost.

Of each chosen element its place, direction, size, kind of curve or surface and the faces beside it are stored, in the
frame of the source. It is found again where exactly one element of the shape

1. is in the same place, or moved with a side of the box or in its proportion (a box that became longer); or
2. lies on the same line, circle, plane or cylinder, as part of it or with it as a part (another feature trimmed it); or
3. has the same number, if all the shape's elements are as before in kind and order, it is not where another one was,
   and no other fits better; one that is both elsewhere and of another size only if there is no other like it.

Everything else is lost: that is an error, as a wrong edge would be worse. Not promised: a feature that is deleted while
another just like it is added cannot be told from one that was moved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .errors import BrokenReferenceError
from .shape_elements import Element, Elements, Vector, split

__all__ = ["Element", "describe", "found", "split"]

#: Places are the same within this share of the diagonal: shapes are computed to 1e-7 mm, stored to 15 digits.
_SAME = 1e-5

#: Directions are the same within so many degrees; where kind and order of all elements are as before, within more.
_TURN = 1.0
_LOOSE_TURN = 30.0

#: So many others that are alike are remembered.
_TWINS = 32

#: Share of the difference of sizes that counts as a difference of places, where several elements are compared.
_SIZE = 0.1


def describe(shape: Any, names: Sequence[str]) -> list[Element]:
    """Describe edges and faces of a shape, in its frame.

    Raises
    ------
    BrokenReferenceError
        If one is not there.
    """
    elements = Elements(shape)
    missing = [name for name in names if not elements.has(name)]
    if missing:
        raise BrokenReferenceError(f"there is no {missing[0]}; choose again")
    return [_with_twins(elements.of(name), elements) for name in names]


def found(references: Sequence[Element], shape: Any, label: str = "the source") -> list[str]:
    """Names that the elements have now.

    Raises
    ------
    BrokenReferenceError
        If some are lost; names them.
    """
    elements = Elements(shape)
    now = [_found(reference, elements) for reference in references]
    lost = [r.name for r, name in zip(references, now, strict=True) if name is None or now.count(name) > 1]
    if lost:
        what = f"{', '.join(lost)} of {label}"
        raise BrokenReferenceError(
            f"{what} cannot be told any more since {label} changed: choose {'it' if len(lost) == 1 else 'them'} again"
        )
    return [name for name in now if name is not None]


def _with_twins(own: Element, elements: Elements) -> Element:
    rest = [e for e in elements.all(split(own.name)[0]) if e.name != own.name and _alike(own, e, _TURN)]
    rest.sort(key=lambda e: math.dist(e.middle, own.middle))
    return replace(own, twins=tuple(e.middle for e in rest[:_TWINS]))


def _found(old: Element, elements: Elements) -> str | None:
    """Give the name that an element has now; None if that cannot be told."""
    if elements.has(old.name) and _in_place(old, elements.of(old.name)):
        return old.name
    kind = split(old.name)[0]
    like = [new for new in elements.all(kind) if _alike(old, new, _TURN)]
    same = old.order == elements.order and elements.has(old.name)
    for rule in (_in_place, _moved, _trimmed):
        fit = [new for new in like if rule(old, new)]
        if fit:
            # an element that has the number, too, and another that has the place: nobody knows
            doubtful = same and _alike(old, elements.of(old.name), _TURN) and fit[0].name != old.name
            return fit[0].name if len(fit) == 1 and not doubtful else None
    if not same or not _alike(old, elements.of(old.name), _LOOSE_TURN):
        return None
    own = elements.of(old.name)
    if any(math.dist(own.middle, twin) <= _SAME * _diagonal(own) for twin in old.twins):
        return None  # where another one was
    rest = [new for new in like if new.name != old.name]
    if _moved_and_resized(old, own):
        return None if rest else old.name
    return None if any(_away(old, new) <= _away(old, own) for new in rest) else old.name


def _alike(old: Element, new: Element, turn: float) -> bool:
    """Whether kinds and directions are the same."""
    if (old.kind, old.closed, old.bend, len(old.sides)) != (new.kind, new.closed, new.bend, len(new.sides)):
        return False
    if [kind for kind, _ in old.sides] != [kind for kind, _ in new.sides]:
        return False
    signed = old.kind == "Plane"
    return _parallel(old.direction, new.direction, turn, signed) and _same_sides(old, new, turn)


def _same_sides(old: Element, new: Element, turn: float) -> bool:
    """Whether normals of the faces beside are the same, in one order or the other if their kinds are the same."""
    orders = [new.sides]
    if len(new.sides) == 2 and new.sides[0][0] == new.sides[1][0]:
        orders.append(new.sides[::-1])
    return any(
        all(_parallel(a[1], b[1], turn, True) for a, b in zip(old.sides, sides, strict=True)) for sides in orders
    )


def _parallel(a: Vector, b: Vector, turn: float, signed: bool) -> bool:
    if not (any(a) and any(b)):
        return any(a) == any(b)
    cosine = float(np.dot(a, b)) / math.sqrt(float(np.dot(a, a)) * float(np.dot(b, b)))
    return (cosine if signed else abs(cosine)) >= math.cos(math.radians(turn))


def _in_place(old: Element, new: Element) -> bool:
    """Whether place and size are the same."""
    scale = _diagonal(new)
    away = math.dist(old.middle, new.middle)
    size = scale if split(old.name)[0] == "Edge" else scale**2
    return _alike(old, new, _TURN) and away <= _SAME * scale and abs(old.size - new.size) <= _SAME * size


def _moved(old: Element, new: Element) -> bool:
    """Whether it moved as sides of the box did, or in its proportion."""
    return max(_ways(old, new)) <= _SAME * _diagonal(new)


def _trimmed(old: Element, new: Element) -> bool:
    """Whether one is a part of the other."""
    limit = _SAME * _diagonal(new)
    way = np.subtract(new.middle, old.middle)
    along = np.asarray(old.direction)
    if old.kind == "Line":
        reach = abs(float(way @ along))
        return float(np.linalg.norm(np.cross(way, along))) <= limit and reach < (old.size + new.size) / 2
    if old.kind == "Plane":
        return abs(float(way @ along)) <= limit
    if old.kind in ("Circle", "Cylinder") and not old.closed:
        return bool(np.abs(np.subtract(old.carrier, new.carrier)).max() <= limit)
    return False


def _moved_and_resized(old: Element, new: Element) -> bool:
    """Whether it is somewhere else and of another size: as another one would be."""
    scale = _SAME * _diagonal(new)
    return max(_ways(old, new)) > scale and abs(old.size - new.size) > scale


def _ways(old: Element, new: Element) -> list[float]:
    """How far it is in x, y and z in mm from where it may have moved to with the box."""
    ways = []
    for axis in range(3):
        low, high = old.box[axis], old.box[axis + 3]
        new_low, new_high = new.box[axis], new.box[axis + 3]
        place, now = old.middle[axis], new.middle[axis]
        share = (place - low) / (high - low) if high > low else 0.0
        targets = (place, new_low + place - low, new_high + place - high, new_low + share * (new_high - new_low))
        ways.append(min(abs(now - target) for target in targets))
    return ways


def _away(old: Element, new: Element) -> float:
    """How far it is in mm from where it may have moved to, and how different in size."""
    size = abs(old.size - new.size) if split(old.name)[0] == "Edge" else abs(old.size**0.5 - new.size**0.5)
    return float(np.linalg.norm(_ways(old, new))) + _SIZE * size


def _diagonal(element: Element) -> float:
    return math.dist(element.box[:3], element.box[3:])
