"""Plans of solids from outlines: faces of the part on their own surfaces, blends as primitives or splines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cad_implicit.blend_labels import Outward
from cad_implicit.blend_surfaces import StripPiece, StripSurface
from cad_implicit.errors import InvalidMeshError
from cad_implicit.implicit import FloatArray
from cad_implicit.mesh import Mesh
from cad_implicit.outlines import Outline, Outlined
from cad_implicit.patches import Patches

from .geometry import (
    Look,
    Span,
    Surface,
    away_from,
    flat_surface,
    primitive_surface,
    strip_surface,
)
from .memory import Laid, Memory
from .plans import Plan, PlannedEdge, PlannedFace, PlannedVertex, Topology

#: Edges must lie on both of their faces within so many mm, and are taken to do so within at least:
EDGE = 1e-3
LEAST = 1e-7

#: Points along an edge by which it is looked at.
_POINTS = 12

#: Curves on a face meet if they are nearer to each other than this share of what all its borders take up.
_MEET = 0.02


class _AstrayError(InvalidMeshError):
    """Some edges do not lie on a face."""

    def __init__(self, away: dict[int, float]) -> None:
        super().__init__(f"an edge is {max(away.values()):.3g} mm away from its face")
        self.borders, self.away = list(away), max(away.values())


class _TipError(InvalidMeshError):
    """A face ends in a point at which its surface has more than one place."""

    def __init__(self, borders: list[tuple[int, bool]]) -> None:
        super().__init__("a face ends in a point")
        self.borders = borders


class Planner:
    """Plans the solid of an outline.

    Parameters
    ----------
    mesh : Mesh
    outline : Outline
        Of the mesh.
    patches : Patches
    count : int
        Number of faces of the part.
    surfaces : list of Outward
        Of the blends.
    own : Topology
        Of the part.
    memory : Memory
        Of plans of the same blend before, and of this one then.

    Attributes
    ----------
    failed : dict of int to set of int or None
        Patches that cannot be put on their surfaces, and at which vertices of the mesh that is; None: anywhere.
    reasons : list of str
        Why, but for edges that are away from their faces.
    astray : float
        How far in mm these are.
    worst : float
        Largest distance in mm of an edge from its faces.
    """

    def __init__(
        self,
        mesh: Mesh,
        outline: Outline,
        patches: Patches,
        count: int,
        surfaces: list[Outward],
        own: Topology,
        memory: Memory,
    ) -> None:
        self.mesh, self.outline, self.patches, self.count = mesh, outline, patches, count
        self.surfaces, self.own, self.memory = surfaces, own, memory
        self._first_facet = count + len(surfaces)
        self._beside: dict[int, list[Outlined]] = {}
        for face in outline.faces:
            for number in (*face.seams, *_borders(face)):
                self._beside.setdefault(number, []).append(face)
        self._position = {id(face): position for position, face in enumerate(outline.faces)}
        self._plan = Plan()
        self.failed: dict[int, set[int] | None] = {}
        self.reasons: list[str] = []
        self.astray = 0.0
        self.worst = 0.0

    def plan(self) -> Plan | None:
        """Plan of all faces; None if some failed."""
        self._plan = Plan()
        shells: dict[int, list[int]] = {}
        component = self.mesh.component_of_face
        first = np.unique(self.patches.of_triangle, return_index=True)[1]
        for position, face in enumerate(self.outline.faces):
            planned = self._tried(face)
            if planned is not None:
                shells.setdefault(int(component[first[face.patch]]), []).append(position)
                self._plan.faces.append(planned)
        self._plan.solids = list(shells.values())
        return None if self.failed else self._plan

    def blame_invalid(self, position: int, crossing: Sequence[int]) -> None:
        """Add to the failed patches that of a face that a kernel finds invalid.

        At the borders that cross, if it tells; else beside triangles, which are what it does not like; else all.
        """
        face, why = self.outline.faces[position], "the kernel finds a face invalid"
        self.reasons.append(why)
        own = _borders(face)
        facets = [n for n in own if any(one.label >= self._first_facet for one in self._beside[n])]
        guilty = [n for n in crossing if n in facets] or crossing or facets
        for number in guilty:
            others = [n for n in crossing if n != number]
            self._blame(face, self._beside[number], self._where(number, others), why)
        if not crossing and not facets:
            self._blame(face, [one for number in own for one in self._beside[number]], None, why)

    def _tried(self, face: Outlined) -> PlannedFace | None:
        try:
            return self._face(face)
        except _AstrayError as error:
            self.astray = max(self.astray, error.away)
            for number in error.borders:
                self._blame(face, self._beside[number], self._along(number), str(error))
        except _TipError as error:
            self.reasons.append(str(error))
            for number, ahead in error.borders:
                along = self._along(number)
                self._blame(face, [face], None if along is None else along[-1:] if ahead else along[:1], str(error))
        except Exception as error:  # the kernel raises its own family of errors, which differs between versions
            self.reasons.append(f"{type(error).__name__}: {error}")
            self._blame(face, [face], None, self.reasons[-1])
        return None

    def _along(self, number: int) -> list[int] | None:
        """Vertices of the mesh along a border."""
        chains = self.patches.chains
        return chains[number].vertices.tolist() if number < len(chains) else None

    def _where(self, number: int, others: Sequence[int]) -> list[int] | None:
        """Vertices of the mesh along a border: those nearest to other borders, which it crosses, or all."""
        along, lines = self._along(number), [line for n in others if (line := self._along(n)) is not None]
        if along is None or not lines:
            return along
        points = self.mesh.vertices[along]
        away = cKDTree(self.mesh.vertices[np.concatenate(lines)]).query(points)[0]
        step = float(np.linalg.norm(np.diff(points, axis=0), axis=1).max())
        return [vertex for vertex, far in zip(along, away.tolist(), strict=True) if far <= away.min() + step]

    def _blame(self, face: Outlined, beside: list[Outlined], near: list[int] | None, why: str) -> None:
        """Mark as failed a face, or the blends beside it if it is of the part and has any; near vertices or all."""
        blends = [one for one in beside if self.count <= one.label < self._first_facet]
        if face.label < self.count and blends:
            guilty = blends
        elif face.label < self._first_facet:
            guilty = [face]
        else:
            guilty = [one for one in beside if one.label < self._first_facet]
        if not guilty:
            raise InvalidMeshError(why)
        for one in guilty:
            known = self.failed.setdefault(one.patch, set())
            self.failed[one.patch] = None if known is None or near is None else known | set(near)

    # --- faces

    def _face(self, face: Outlined) -> PlannedFace:
        if face.label < self.count and self._untouched(face):
            planned = PlannedFace(face.label, whole=True)
            for number in (*face.seams, *_borders(face)):
                self._edge(number)
            return planned
        if face.label < self.count:
            planned = PlannedFace(face.label, forward=self.own.forward(face.label))
            look, centre = self.own.surface(face.label), self.own.middle(face.label)
        elif face.label >= self._first_facet:
            surface = flat_surface(*self.outline.points[[self.outline.start(one) for one in face.loops[0]]])
            planned = PlannedFace(-1, surface=surface, facet=True)
            look, centre = self.own.look(surface), np.zeros(2)
        else:
            planned, look, centre = self._blend(face)
        away: dict[int, float] = {}
        for loop in self.outline.wires(face):
            for number, _ in loop:
                away[number] = self._on_face(number, look, centre, face)
            planned.wires.append([(number, ahead == self._runs_forward(number)) for number, ahead in loop])
        astray = {number: far for number, far in away.items() if far > EDGE}
        if astray:
            raise _AstrayError(astray)
        if planned.own < 0 and not planned.facet:
            self._check_tips(face)
        return planned

    def _check_tips(self, face: Outlined) -> None:
        """Find places where the borders of a blend meet, but their curves on it do not, as at the tip of a cone.

        Raises
        ------
        _TipError
            If there are any.
        """
        position = self._position[id(face)]
        for loop in self.outline.wires(face):
            ends = []
            for number, ahead in loop:
                edge = self._plan.edges[number]
                flat = edge.on.get(position)
                if flat is None:
                    return  # a plane
                both = flat.at(np.array([edge.span.low, edge.span.high]))
                ends.append(both if ahead == self._runs_forward(number) else both[::-1])
            gaps = np.abs(np.roll([first for first, _ in ends], -1, axis=0) - [last for _, last in ends])
            size = np.ptp(np.concatenate(ends), axis=0)
            tips = np.flatnonzero((gaps > _MEET * np.where(size > 0, size, np.inf)).any(axis=1))
            if len(tips):
                raise _TipError([loop[tip] for tip in tips])

    def _untouched(self, face: Outlined) -> bool:
        numbers = [*_borders(face), *face.seams]
        if not all(self._is_own(number) for number in numbers):
            return False
        wanted = {e for e, edge in enumerate(self.own.edges) if face.label in edge.faces}
        return wanted == {self.outline.borders[number].edge for number in numbers}

    def _is_own(self, number: int) -> bool:
        """Whether a border is an edge of the part, whole and between faces of the part."""
        border = self.outline.borders[number]
        if border.edge < 0:
            return False
        edge = self.own.edges[border.edge]
        low, high = sorted(border.knots.tolist())
        slack = 1e-6 * (edge.high - edge.low)
        whole = abs(low - edge.low) <= slack and abs(high - edge.high) <= slack
        return bool(whole and all(face.label in edge.faces for face in self._beside[number]))

    def _blend(self, face: Outlined) -> tuple[PlannedFace, Look, FloatArray]:
        """Face without borders, its surface, and a place in the middle of it."""
        surface: Any = self.surfaces[face.label - self.count].surface
        halved = len(self._of_label(face.label)) > 1 and getattr(surface, "closed", False)
        if halved or surface.primitive() is not None:  # these are turned so that seams and poles are far from borders
            spans = tuple((self._span(number), ahead) for loop in face.loops for number, ahead in loop)
            laid = self.memory.laid((face.label, halved, spans), lambda: self._laid(face, halved))
        else:
            laid = self.memory.laid(face.label, lambda: self._laid(face, halved))
        return PlannedFace(-1, surface=laid.surface, forward=laid.forward), laid.look, laid.place

    def _laid(self, face: Outlined, halved: bool) -> Laid:
        outward = self.surfaces[face.label - self.count]
        surface: Any = outward.surface
        inside = np.flatnonzero(self.patches.of_triangle == face.patch)
        middles = self.mesh.vertices[self.mesh.faces[inside]].mean(axis=1)
        primitive = surface.primitive()
        geometry: Surface
        if primitive is not None:
            border = np.concatenate([self._span(n).at(self._some(n)) for n in _borders(face)])
            towards = _nearest(middles, border.mean(axis=0) if halved else middles.mean(axis=0))
            # chords of a torus whose ring is small may be nearer to its other sheet
            value, normals = outward.value_and_normal(towards[None])
            towards = towards - value[0] * normals[0]
            geometry = primitive_surface(primitive, towards, border)
        else:
            whole = surface.whole if isinstance(surface, StripPiece) else surface
            assert isinstance(whole, StripSurface)
            if halved:
                low, high, towards = self._half(face, whole)
            else:
                low = getattr(surface, "low", 0.0)
                high = low + surface.length
                towards = _nearest(middles, middles.mean(axis=0))
            geometry = strip_surface(*whole.grid(low, high))
        look = self.own.look(geometry)
        place = look.places(towards[None])[0]
        forward = bool(look.normal(place) @ outward.value_and_normal(towards[None])[1][0] > 0)
        return Laid(geometry, forward, look, place)

    def _half(self, face: Outlined, surface: StripSurface) -> tuple[float, float, FloatArray]:
        """Ways from which and to which one half of a ring goes, and a point (3,) in its middle."""
        borders = [self.outline.borders[number] for number in _borders(face)]
        ends = self.outline.points[[end for border in borders for end in (border.start, border.end)]]
        middle = self._middle_way(face, surface)
        turn = surface.length
        unwrapped = middle + (surface.curves[0].way(ends) - middle + turn / 2) % turn - turn / 2
        towards = surface.place(np.array([middle]), np.array([0.5]))[0]
        return float(unwrapped.min()), float(unwrapped.max()), towards

    def _of_label(self, label: int) -> list[Outlined]:
        return [face for face in self.outline.faces if face.label == label]

    def _middle_way(self, face: Outlined, surface: StripSurface) -> float:
        """Way in the middle of one half of a ring: that of its longest border's middle."""
        numbers = [n for n, _ in face.loops[0]]
        lengths = [
            float(np.linalg.norm(np.diff(self._span(n).at(self._some(n)), axis=0), axis=1).sum()) for n in numbers
        ]
        number = numbers[int(np.argmax(lengths))]
        span = self._span(number)
        middle = span.at(np.array([(span.low + span.high) / 2]))
        near = [float(np.linalg.norm(curve.at(curve.way(middle)) - middle)) for curve in surface.curves[:2]]
        return float(surface.curves[int(np.argmin(near))].way(middle)[0])

    # --- edges

    def _runs_forward(self, number: int) -> bool:
        """Whether the edge of a border runs from its start to its end."""
        border = self.outline.borders[number]
        return border.edge < 0 or bool(border.knots[0] < border.knots[-1])

    def _vertex(self, number: int) -> PlannedVertex:
        if number not in self._plan.vertices:
            known = int(self.outline.known[number])
            tolerance = float(self.own.tolerances[known]) if known >= 0 else LEAST
            self._plan.vertices[number] = PlannedVertex(self.outline.points[number], known, tolerance)
        return self._plan.vertices[number]

    def _span(self, number: int) -> Span:
        """Curve of a border."""
        return self.memory.span(self.outline.borders[number], self.own)

    def _some(self, number: int) -> FloatArray:
        span = self._span(number)
        return np.linspace(span.low, span.high, _POINTS)

    def _edge(self, number: int) -> PlannedEdge:
        if number in self._plan.edges:
            return self._plan.edges[number]
        border, span, whole = self.outline.borders[number], self._span(number), self._is_own(number)
        ends = (border.start, border.end) if self._runs_forward(number) else (border.end, border.start)
        tolerance = self.own.edges[border.edge].tolerance if border.edge >= 0 else LEAST
        self._plan.edges[number] = PlannedEdge(border.edge, whole, span, ends, tolerance)
        for vertex, at in zip(ends, (span.low, span.high), strict=True):
            if whole:
                self._vertex(vertex)
            else:
                self._tolerate(vertex, float(np.linalg.norm(span.at(np.array([at]))[0] - self.outline.points[vertex])))
        return self._plan.edges[number]

    def _tolerate(self, number: int, away: float) -> None:
        """Take a vertex as wide as an edge or its curve on a face needs it."""
        self.worst = max(self.worst, away)
        vertex = self._vertex(number)
        if away > vertex.tolerance:
            vertex.tolerance = 1.01 * away + LEAST

    def _on_face(self, number: int, look: Look, centre: FloatArray, outlined: Outlined) -> float:
        """Put an edge's curve onto a face, unless plane or there before, or too far off; tell in mm how far it is."""
        border, edge = self.outline.borders[number], self._edge(number)
        if border.edge >= 0 and outlined.label in self.own.edges[border.edge].faces:
            return 0.0
        span = self._span(number)
        flat, away = None, np.inf
        if look.plane:
            parameters = np.linspace(span.low, span.high, _POINTS)
            away = away_from(span, look, parameters, look.places(span.at(parameters)))
        else:
            flat, away = self.memory.flattened(span, look, centre)
        if away > EDGE:
            return away
        self.worst = max(self.worst, away)
        if 1.05 * away + LEAST > edge.tolerance:
            edge.tolerance = 1.05 * away + LEAST
            for vertex in edge.ends:
                self._tolerate(vertex, edge.tolerance)
        if flat is not None:
            edge.on[self._position[id(outlined)]] = flat
        return away


def _borders(face: Outlined) -> list[int]:
    return [number for loop in face.loops for number, _ in loop]


def _nearest(points: FloatArray, place: FloatArray) -> FloatArray:
    return np.asarray(points[int(np.linalg.norm(points - place, axis=1).argmin())])
