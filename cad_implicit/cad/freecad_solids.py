"""Solids of plans: what is left of the part is the part's own faces and edges, all else is made new.

FreeCAD has no way to make edges and faces one by one, with their curves on surfaces and tolerances; but it reads them
from text.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from .brep_text import Child, Location, curve_text, inverse, spline_text, surface_text, times
from .freecad import Shape, compound, vector
from .freecad_geometry import read
from .freecad_original import ShapeTopology
from .planner import LEAST
from .plans import Plan, PlannedEdge, PlannedFace, PlannedVertex

_HERE: Location = ()

#: Edges that touch within so many mm of an end that both have touch in that.
_APART = 1e-4


def made(plan: Plan, own: ShapeTopology) -> Made:
    """Solid of a plan; the part itself stays as it is."""
    return Made(plan, own)


class Made:
    """What the kernel made of a plan; see :class:`cad_implicit.cad.plans.Product`."""

    def __init__(self, plan: Plan, own: ShapeTopology) -> None:
        self._plan, self._own = plan, own
        self._brep = own.numbers.brep.copy()
        self._on: dict[int, str] = {}
        self._vertices = {number: self._vertex(vertex) for number, vertex in plan.vertices.items()}
        self._edges = {number: self._edge(edge) for number, edge in plan.edges.items()}
        faces = [self._face(position, face) for position, face in enumerate(plan.faces)]
        solids = [self._solid([faces[n] for n in numbers]) for numbers in plan.solids]
        if len(solids) > 1:
            solids = [Child("+", self._brep.record("Co", [], solids), _HERE)]
        self._brep.root = solids[0]
        whole = read(self._brep.text())
        self.shape = compound(whole.Solids)
        found = self.shape.Faces
        order = [position for numbers in plan.solids for position in numbers]
        self.faces = [found[place] for place in np.argsort(order).tolist()]

    def crossing(self, position: int) -> list[int]:
        """Numbers of edges of a face that touch each other elsewhere than at their ends, as the kernel tells them."""
        numbers = list(dict.fromkeys(number for loop in self._plan.faces[position].wires for number, _ in loop))
        edges = dict(zip(numbers, self.faces[position].Edges, strict=True))
        boxes = {number: edge.BoundBox for number, edge in edges.items()}
        found: set[int] = set()
        for one, other in combinations(numbers, 2):
            if boxes[one].intersect(boxes[other]) and self._touch(one, other, edges):
                found |= {one, other}
        return [number for number in numbers if number in found]

    def _touch(self, one: int, other: int, edges: dict[int, Shape]) -> bool:
        """Whether two edges touch elsewhere than at vertices that both have."""
        distance, touching, _ = edges[one].distToShape(edges[other])
        if distance > self._plan.edges[one].tolerance + self._plan.edges[other].tolerance:
            return False
        shared = [self._plan.vertices[n] for n in {*self._plan.edges[one].ends} & {*self._plan.edges[other].ends}]
        ends = [(vector(vertex.point), _APART + 2 * vertex.tolerance) for vertex in shared]
        return any(all(place[0].distanceToPoint(end) > away for end, away in ends) for place in touching)

    def _vertex(self, planned: PlannedVertex) -> Child:
        if planned.own < 0:
            point = " ".join(map(repr, planned.point.tolist()))
            return Child("+", self._brep.record("Ve", [repr(planned.tolerance), point, "0 0"]), _HERE)
        known = self._own.numbers.vertices[planned.own]
        if planned.tolerance > self._own.tolerances[planned.own]:
            self._brep.records[known.record].lines[0] = repr(planned.tolerance)
        return Child("+", known.record, known.location)

    def _edge(self, planned: PlannedEdge) -> Child:
        span = planned.span
        if planned.own >= 0:
            known = self._own.numbers.edges[self._own.edge_numbers[planned.own]]
            if planned.whole:
                return Child("+", known.record, known.location)
            lines = _ranged(self._brep.records[known.record].lines, span.low, span.high)
            lines[0] = " ".join([repr(planned.tolerance), *lines[0].split()[1:]])
            place = known.location
        else:
            number = self._brep.add("Curves", curve_text(span.curve))  # type: ignore[arg-type]
            lines = [f" {planned.tolerance!r} 1 1 0", f"1  {number} 0 {span.low!r} {span.high!r}", "0"]
            place = _HERE
        ends = [self._vertices[number] for number in planned.ends]
        children = [
            Child(orientation, end.record, times(inverse(place), end.location))
            for orientation, end in zip("+-", ends, strict=True)
        ]
        return Child("+", self._brep.record("Ed", lines, children), place)

    def _face(self, position: int, planned: PlannedFace) -> Child:
        if planned.own >= 0:
            known = self._own.numbers.faces[planned.own]
            if planned.whole:
                return known
            line, place = self._brep.records[known.record].lines[0], known.location
        else:
            assert planned.surface is not None
            number = self._brep.add("Surfaces", surface_text(planned.surface))
            line, place = f"0  {LEAST!r} {number} 0", _HERE
        surface, within = line.split()[2:4]
        wires = []
        for loop in planned.wires:
            edges = []
            for number, ahead in loop:
                edge = self._edges[number]
                flat = self._plan.edges[number].on.get(position)
                if flat is not None:
                    self._put(number, spline_text(flat), surface, int(within), place)
                orientation = "+" if ahead == planned.forward else "-"
                edges.append(Child(orientation, edge.record, times(inverse(place), edge.location)))
            wires.append(Child("+", self._brep.record("Wi", [], edges), _HERE))
        record = self._brep.record("Fa", [line], wires)
        return Child("+" if planned.forward else "-", record, place)

    def _put(self, number: int, text: str, surface: str, within: int, place: Location) -> None:
        """Put an edge's curve onto a surface."""
        edge, span = self._edges[number], self._plan.edges[number].span
        flat = self._brep.add("Curve2ds", text)
        location = times(inverse(edge.location), times(place, self._brep.placed[within]))
        lines = self._brep.records[edge.record].lines
        lines.insert(len(lines) - 1, f"2  {flat} {surface} {self._brep.number(location)} {span.low!r} {span.high!r}")

    def _solid(self, faces: list[Child]) -> Child:
        shell = Child("+", self._brep.record("Sh", [], faces), _HERE)
        return Child("+", self._brep.record("So", [], [shell]), _HERE)


def _ranged(lines: list[str], low: float, high: float) -> list[str]:
    """Lines of an edge's record with its curves between other parameters."""
    result = []
    for line in lines:
        tokens = line.split()
        curve = len(tokens) > 4 and line[0] in "123" and line is not lines[0]
        result.append(" ".join([*tokens[:-2], repr(low), repr(high)]) if curve else line)
    return result
