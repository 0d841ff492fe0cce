"""Edges and faces of a shape: what is known of each, by which it can be told from others and found again."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import FreeCAD as App
import numpy as np

from .errors import BrokenReferenceError

#: Faces that turn by less than so many degrees at an edge go on smoothly.
_SMOOTH = 1.0

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
    bend : int
        1 where the faces beside an edge meet convexly, -1 where they meet concavely, else 0.
    box : tuple of float
        Of the whole shape: lower corner, upper corner.
    order : str
        Fingerprint of the kinds of all edges and faces of the shape, in their order.
    twins : tuple of tuple of float
        Middles of the nearest others that are alike in kind and directions.
    """

    name: str
    kind: str
    closed: bool
    middle: Vector
    direction: Vector
    size: float
    carrier: tuple[float, ...]
    sides: tuple[tuple[str, Vector], ...]
    bend: int
    box: tuple[float, ...]
    order: str
    twins: tuple[Vector, ...] = ()

    def to_text(self) -> str:
        """Text for a property."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_text(text: str) -> Element:
        """Element that :meth:`to_text` wrote."""
        data: dict[str, Any] = json.loads(text)
        sides = tuple((kind, tuple(normal)) for kind, normal in data.pop("sides"))
        twins = tuple(tuple(middle) for middle in data.pop("twins"))
        plain: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in data.items()
        }
        return Element(**plain, sides=sides, twins=twins)


class Elements:
    """Edges and faces of a shape, described when they are asked for."""

    def __init__(self, shape: Any) -> None:
        self.shape = shape
        box = shape.BoundBox
        self.box = (box.XMin, box.YMin, box.ZMin, box.XMax, box.YMax, box.ZMax)
        self._known: dict[str, Element] = {}
        self._flat: dict[int, Vector] = {}

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
        """Edges and the places of their faces by the hash of the edge; other edges may have the same."""
        beside: dict[int, list[Any]] = {}
        for place, face in enumerate(self.faces):
            for edge in face.Edges:
                beside.setdefault(edge.hashCode(), []).append((edge, place))
        return beside

    @cached_property
    def _surfaces(self) -> list[str]:
        return [_kind(face, "Surface") for face in self.faces]

    def _normal_of(self, place: int, point: Any) -> Vector:
        if self._surfaces[place] != "Plane":
            return _normal(self.faces[place], point)
        if place not in self._flat:  # asking for a normal takes long where a face has many holes
            self._flat[place] = _normal(self.faces[place], point)
        return self._flat[place]

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
        point = edge.valueAt(parameter)
        beside = [(e, place) for e, place in self._beside.get(edge.hashCode(), ()) if e.isSame(edge)]
        normals = [self._normal_of(place, point) for _, place in beside]
        bend = 0
        if len(beside) == 2:
            along = edge.tangentAt(parameter) * (-1 if beside[0][0].Orientation == "Reversed" else 1)
            bend = _sign(float(np.dot(np.cross(normals[0], normals[1]), tuple(along))))
        sides = []
        for (_, place), normal in zip(beside, normals, strict=True):
            surface = self._surfaces[place]
            sides.append((surface, normal if surface == "Plane" or not closed else (0.0, 0.0, 0.0)))
        return self._element(name, kind, closed, middle, direction, edge.Length, carrier, tuple(sorted(sides)), bend)

    def _face(self, name: str, face: Any) -> Element:
        kind, middle = _kind(face, "Surface"), face.CenterOfMass
        direction = App.Vector()
        carrier: tuple[float, ...] = ()
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
        carrier: tuple[float, ...] = (), sides: tuple[tuple[str, Vector], ...] = (), bend: int = 0,
    ) -> Element:  # fmt: skip
        place, way = tuple(middle), tuple(direction)
        return Element(name, kind, closed, place, way, size, carrier, sides, bend, self.box, self.order)


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


def _sign(sine: float) -> int:
    """Sign of the sine between two normals; 0 where faces go on smoothly."""
    return 0 if abs(sine) < math.sin(math.radians(_SMOOTH)) else (1 if sine > 0 else -1)


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
