"""Vertices, edges and seams of a B-rep of FreeCAD, as outlines of results need them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cad_implicit.errors import InvalidMeshError
from cad_implicit.implicit import FloatArray

from .brep_text import Brep, Child, Location, parsed, times, turned
from .freecad import Shape
from .freecad_geometry import CurveLook, SurfaceLook, surface_of
from .geometry import Surface, past_seam

_Key = tuple[int, Location]


class Use(NamedTuple):
    """An edge, from 0, in the boundary of a face, from 0; the orientations that both have there."""

    face: int
    edge: int
    face_orientation: str
    orientation: str


class Numbers:
    """Records of a shape's faces, edges and vertices, numbered from 0 as ``TopExp::MapShapes`` does.

    Attributes
    ----------
    brep : Brep
    faces, edges, vertices : list of Child
        As the shape holds them first, in place.
    uses : list of Use
    """

    def __init__(self, shape: Shape) -> None:
        self.brep: Brep = parsed(shape.exportBrepToString())
        self._found: dict[str, dict[_Key, int]] = {"Fa": {}, "Ed": {}, "Ve": {}}
        self._first: dict[str, list[Child]] = {"Fa": [], "Ed": [], "Ve": []}
        self.uses: list[Use] = []
        self._visit(self.brep.root, None)
        self.faces, self.edges, self.vertices = (self._first[kind] for kind in ("Fa", "Ed", "Ve"))
        counts = (len(self.faces), len(self.edges), len(self.vertices))
        if counts != (len(shape.Faces), len(shape.Edges), len(shape.Vertexes)):
            raise InvalidMeshError("the kernel's text of the part has other faces, edges or vertices than the part")

    def _visit(self, child: Child, face: tuple[int, str] | None) -> None:
        record = self.brep.records[child.record]
        if record.kind in self._found:
            key = (child.record, child.location)
            number = self._found[record.kind].setdefault(key, len(self._found[record.kind]))
            if number == len(self._first[record.kind]):
                self._first[record.kind].append(child)
            if record.kind == "Fa":
                face = (number, child.orientation)
            elif record.kind == "Ed" and face is not None:
                self.uses.append(Use(face[0], number, face[1], child.orientation))
        for own in record.children:
            orientation = turned(own.orientation, child.orientation)
            self._visit(Child(orientation, own.record, times(child.location, own.location)), face)

    def ends(self, edge: int) -> tuple[int, int]:
        """Vertices at the start and the end of an edge's curve; -1 where it has none."""
        child = self.edges[edge]
        ends = {"+": -1, "-": -1}
        for own in self.brep.records[child.record].children:
            place = (own.record, times(child.location, own.location))
            ends.setdefault(own.orientation, 0)
            if ends[own.orientation] < 0:
                ends[own.orientation] = self._found["Ve"][place]
        return ends["+"], ends["-"]


class ShapeEdge(CurveLook):
    """An edge of a shape, by the parameter of its curve."""

    def __init__(self, edge: Shape, faces: tuple[int, ...], ends: tuple[int, int]) -> None:
        super().__init__(edge.Curve, *edge.ParameterRange)
        self.faces, self.ends = faces, ends
        self.period = self.high - self.low if ends[0] == ends[1] else None
        self.bends = np.zeros(0)
        self.tolerance = float(edge.Tolerance)


class ShapeTopology:
    """What outlines need to know of a shape.

    Attributes
    ----------
    face_shapes : list of Part.Face
    edges : list of ShapeEdge
        All that are not degenerate.
    edge_numbers : list of int
        Their numbers, from 0.
    numbers : Numbers
    vertices : (V, 3) float64
    tolerances : (V,) float64
        Of the vertices in mm.
    """

    def __init__(self, shape: Shape) -> None:
        self.numbers = Numbers(shape)
        self.face_shapes = list(shape.Faces)
        vertices = shape.Vertexes
        self.vertices = np.array([tuple(vertex.Point) for vertex in vertices])
        self.tolerances = np.array([vertex.Tolerance for vertex in vertices])
        beside: dict[int, list[int]] = {}
        for use in self.numbers.uses:
            beside.setdefault(use.edge, []).append(use.face)
        self._seams: dict[int, list[int]] = {}
        self.edges: list[ShapeEdge] = []
        self.edge_numbers: list[int] = []
        for number, edge in enumerate(shape.Edges):
            if edge.Degenerated:
                continue
            own = beside.get(number, [])
            if len(own) == 2 and own[0] == own[1]:
                self._seams.setdefault(own[0], []).append(len(self.edges))
            self.edges.append(ShapeEdge(edge, tuple(own), self.numbers.ends(number)))
            self.edge_numbers.append(number)
        self._surfaces: dict[int, SurfaceLook] = {}

    def seams(self, face: int) -> list[int]:
        """Edges at which a face meets itself."""
        return self._seams.get(face, [])

    def surface(self, face: int) -> SurfaceLook:
        """Surface of a face, to look places up on it."""
        if face not in self._surfaces:
            shape = self.face_shapes[face]
            self._surfaces[face] = SurfaceLook(shape.Surface, np.array(shape.ParameterRange).reshape(2, 2))
        return self._surfaces[face]

    def look(self, surface: Surface) -> SurfaceLook:
        """Look places up on a new surface."""
        made = surface_of(surface)
        return SurfaceLook(made, np.array(made.bounds()).reshape(2, 2))

    def forward(self, face: int) -> bool:
        """Whether the normal of a face's surface points outwards."""
        return self.numbers.faces[face].orientation == "+"

    def middle(self, face: int) -> FloatArray:
        """Parameters (2,) in the middle of a face."""
        return np.asarray(np.array(self.face_shapes[face].ParameterRange).reshape(2, 2).mean(axis=1))

    def past_seam(self, face: int, seam: int, points: FloatArray) -> FloatArray:
        """How far (N,) points of a face are past a seam, in turns from -0.5 to 0.5."""
        return past_seam(self.surface(face), self.edges[seam], points)
