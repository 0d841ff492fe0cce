"""Chosen edges and faces, found again after their shape was recomputed and renumbered, or told to be lost.

Of each chosen element its place, direction, size, kind of curve or surface and the faces beside it are stored, in the
frame of the source. It is found again where exactly one element of the shape

1. is in the same place, or moved with a side of the box or in its proportion (a box that became longer); or
2. lies on the same line, circle, plane or cylinder, as part of it or with it as a part (another feature trimmed it); or
3. has the same number, if all the shape's elements are as before in kind and order, and no other fits better.

Everything else is lost: that is an error, as a wrong edge would be worse.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import FreeCAD as App
import numpy as np

from .errors import BrokenReferenceError

#: Places are the same within this share of the diagonal: shapes are computed to 1e-7 mm, stored to 15 digits.
_SAME = 1e-5

#: Directions are the same within so many degrees; where kind and order of all elements are as before, within more.
_TURN = 1.0
_LOOSE_TURN = 30.0

#: Share of the difference of sizes that counts as a difference of places, where several elements are compared.
_SIZE = 0.1

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Element:
    """What is known of an edge or face.

    Attributes
    ----------
    name : str
        "Edge3" or "Face1".
    kind : str
        Class of its curve or surface, "Line" or "Cylinder".
    closed : bool
        Whether an edge ends where it starts.
    middle : tuple of float
        Point half way along an open edge; centre of mass of a closed one or a face. In mm.
    direction : tuple of float
        There along an edge, of a closed plane one its axis; normal of a plane, axis of a cylinder. Zero if there is
        none.
    size : float
        Length in mm, or area in mm².
    carrier : tuple of float
        Of a circle its centre and radius, of a cylinder its radius and the point of its axis nearest to the origin.
    sides : tuple
        Of the faces beside an edge their kinds, and their outward normals in the middle where those tell something.
    box : tuple of float
        Of the whole shape: lower corner, upper corner.
    order : str
        Fingerprint of the kinds of all edges and faces of the shape, in their order.
    """

    name: str
    kind: str
    closed: bool
    middle: Vector
    direction: Vector
    size: float
    carrier: tuple[float, ...]
    sides: tuple[tuple[str, Vector], ...]
    box: tuple[float, ...]
    order: str

    def to_text(self) -> str:
        """Text for a property."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_text(text: str) -> Element:
        """Element that :meth:`to_text` wrote."""
        data = json.loads(text)
        sides = tuple((kind, tuple(normal)) for kind, normal in data.pop("sides"))
        plain = {name: tuple(value) if isinstance(value, list) else value for name, value in data.items()}
        return Element(**plain, sides=sides)


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
    return [elements.of(name) for name in names]


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


class Elements:
    """Edges and faces of a shape, described when they are asked for."""

    def __init__(self, shape: Any) -> None:
        self.shape = shape
        box = shape.BoundBox
        self.box = (box.XMin, box.YMin, box.ZMin, box.XMax, box.YMax, box.ZMax)
        self._known: dict[str, Element] = {}

    @cached_property
    def edges(self) -> list[Any]:
        """Edges in their order."""
        return list(self.shape.Edges)

    @cached_property
    def faces(self) -> list[Any]:
        """Faces in their order."""
        return list(self.shape.Faces)

    @cached_property
    def order(self) -> str:
        """Fingerprint of kinds in their order."""
        kinds = [f"{_kind(e, 'Curve')}{e.isClosed()}" for e in self.edges] + [_kind(f, "Surface") for f in self.faces]
        return hashlib.sha256(";".join(kinds).encode()).hexdigest()[:16]

    @cached_property
    def _beside(self) -> dict[int, list[Any]]:
        """Faces by the hash of their edges; other edges may have the same."""
        beside: dict[int, list[Any]] = {}
        for face in self.faces:
            for edge in face.Edges:
                beside.setdefault(edge.hashCode(), []).append((edge, face))
        return beside

    def has(self, name: str) -> bool:
        """Whether there is such an element."""
        kind, number = split(name)
        return 1 <= number <= len(self.edges if kind == "Edge" else self.faces)

    def of(self, name: str) -> Element:
        """Describe an element."""
        if name not in self._known:
            kind, number = split(name)
            self._known[name] = (
                self._edge(name, self.edges[number - 1]) if kind == "Edge" else self._face(name, self.faces[number - 1])
            )
        return self._known[name]

    def all(self, kind: str) -> list[Element]:
        """Describe all edges, or all faces."""
        return [self.of(f"{kind}{n + 1}") for n in range(len(self.edges if kind == "Edge" else self.faces))]

    def _edge(self, name: str, edge: Any) -> Element:
        kind, closed = _kind(edge, "Curve"), edge.isClosed()
        carrier: tuple[float, ...] = ()
        direction = App.Vector()
        if kind == "none" or edge.Length == 0:
            return self._element(name, kind, closed, edge.CenterOfMass, direction, 0.0)
        parameter = edge.getParameterByLength(edge.Length / 2)
        middle = edge.CenterOfMass if closed else edge.valueAt(parameter)
        if kind == "Circle":
            centre = edge.Curve.Center
            carrier = (centre.x, centre.y, centre.z, edge.Curve.Radius)
        if not closed:
            direction = edge.tangentAt(parameter)
        elif hasattr(edge.Curve, "Axis"):
            direction = edge.Curve.Axis
        sides = []
        for other, face in self._beside.get(edge.hashCode(), ()):
            if other.isSame(edge):
                surface = _kind(face, "Surface")
                known = not closed or surface == "Plane"
                sides.append((surface, _normal(face, edge.valueAt(parameter)) if known else (0.0, 0.0, 0.0)))
        return self._element(name, kind, closed, middle, direction, edge.Length, carrier, tuple(sorted(sides)))

    def _face(self, name: str, face: Any) -> Element:
        kind, middle = _kind(face, "Surface"), face.CenterOfMass
        direction, carrier = App.Vector(), ()
        if kind == "Plane":
            direction = App.Vector(*_normal(face, middle))
        elif kind == "Cylinder":
            direction = face.Surface.Axis
            centre = face.Surface.Center
            foot = centre - direction * centre.dot(direction)
            carrier = (foot.x, foot.y, foot.z, face.Surface.Radius)
        return self._element(name, kind, False, middle, direction, face.Area, carrier)

    def _element(
        self, name: str, kind: str, closed: bool, middle: Any, direction: Any, size: float,
        carrier: tuple[float, ...] = (), sides: tuple[tuple[str, Vector], ...] = (),
    ) -> Element:  # fmt: skip
        return Element(name, kind, closed, tuple(middle), tuple(direction), size, carrier, sides, self.box, self.order)


def split(name: str) -> tuple[str, int]:
    """Kind and number of a name; FreeCAD 1.0 puts a question mark before those that it lost.

    Raises
    ------
    BrokenReferenceError
        If it is neither an edge nor a face.
    """
    plain = name.rsplit(".", 1)[-1].lstrip("?")
    for kind in ("Edge", "Face"):
        if plain.startswith(kind) and plain[4:].isdigit():
            return kind, int(plain[4:])
    raise BrokenReferenceError(f"{name} is neither an edge nor a face; choose again")


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
    own = _away(old, elements.of(old.name))
    nearer = [new for new in like if new.name != old.name and _away(old, new) <= own]
    return None if nearer else old.name


def _alike(old: Element, new: Element, turn: float) -> bool:
    """Whether kinds and directions are the same."""
    if (old.kind, old.closed, len(old.sides)) != (new.kind, new.closed, len(new.sides)):
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


def _kind(shape: Any, geometry: str) -> str:
    """Class of a curve or surface; "none" for edges without, as at the pole of a sphere."""
    try:
        return type(getattr(shape, geometry)).__name__
    except (TypeError, AttributeError):
        return "none"


def _normal(face: Any, point: Any) -> Vector:
    """Outward unit normal of a face at a point; zero where it has none."""
    u, v = face.Surface.parameter(point)
    try:
        return tuple(face.normalAt(u, v))
    except Exception as error:  # the kernel's own class: at the apex of a cone
        if type(error).__name__ not in ("OCCError", "OCCDomainError"):
            raise
        return (0.0, 0.0, 0.0)
