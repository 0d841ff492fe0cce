"""Plans of solids: vertices, edges and faces as data, of which each kernel makes its own.

Parts of the original shape go by their positions there, so that the kernel can use them again as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from cad_implicit.implicit import FloatArray
from cad_implicit.outlines import EdgeCurve, Original

from .geometry import Look, Span, Spline, Surface


class PartEdge(EdgeCurve, Protocol):
    """An edge of the part, whose curve gives points and takes them.

    Attributes
    ----------
    tolerance : float
        In mm.
    """

    tolerance: float


class Topology(Original, Protocol):
    """The part's own topology, with its surfaces.

    Attributes
    ----------
    tolerances : (V,) float64
        Of its vertices in mm.
    face_shapes : sequence
        Its faces, as the kernel has them.
    """

    tolerances: FloatArray
    face_shapes: Sequence[Any]

    @property
    def edges(self) -> Sequence[PartEdge]:
        """Its edges."""

    def surface(self, face: int) -> Look:
        """Surface of a face, to look places up on it."""

    def look(self, surface: Surface) -> Look:
        """Look places up on a new surface."""

    def forward(self, face: int) -> bool:
        """Whether the normal of a face's surface points outwards."""

    def middle(self, face: int) -> FloatArray:
        """Parameters (2,) in the middle of a face."""


@dataclass(eq=False)
class PlannedVertex:
    """A vertex: its point (3,), its position in the part or -1, and its tolerance in mm."""

    point: FloatArray
    own: int
    tolerance: float


@dataclass(eq=False)
class PlannedEdge:
    """An edge.

    Attributes
    ----------
    own : int
        Edge of the part that it is or is part of, or -1.
    whole : bool
        Whether it is that very edge.
    span : Span
        Its curve between its ends.
    ends : tuple of int
        Vertices at its lowest and its highest parameter.
    tolerance : float
        In mm.
    on : dict of int to Spline
        Its curves on faces that are not plane and where it was not before, by the positions of these.
    """

    own: int
    whole: bool
    span: Span
    ends: tuple[int, int]
    tolerance: float
    on: dict[int, Spline] = field(default_factory=dict)


@dataclass(eq=False)
class PlannedFace:
    """A face.

    Attributes
    ----------
    own : int
        Face of the part on whose surface it lies, or -1.
    whole : bool
        Whether it is that very face.
    surface : Surface or None
        New surface that it lies on.
    forward : bool
        Whether the surface's normal points outwards.
    wires : list of list of (int, bool)
        Edges, and whether they run forward seen from outside.
    facet : bool
        Whether it stands for a triangle.
    """

    own: int
    whole: bool = False
    surface: Surface | None = None
    forward: bool = True
    wires: list[list[tuple[int, bool]]] = field(default_factory=list)
    facet: bool = False


@dataclass(eq=False)
class Plan:
    """Vertices and edges by number, faces, and the positions of the faces of each solid."""

    vertices: dict[int, PlannedVertex] = field(default_factory=dict)
    edges: dict[int, PlannedEdge] = field(default_factory=dict)
    faces: list[PlannedFace] = field(default_factory=list)
    solids: list[list[int]] = field(default_factory=list)


class Product(Protocol):
    """What a kernel made of a plan.

    Attributes
    ----------
    shape
        One solid, or a compound of several, as the kernel has it.
    faces : sequence
        Its faces, by their positions in the plan.
    """

    shape: Any
    faces: Sequence[Any]

    def crossing(self, position: int) -> list[int]:
        """Numbers of edges of a face that touch each other elsewhere than at their ends; some of them, or none."""
