"""Solids from outlines: faces of the part on their own surfaces, blends as primitives or splines."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepTools import BRepTools
from OCP.Geom import Geom_Plane
from OCP.gp import gp_Dir, gp_Pnt, gp_Vec
from OCP.ShapeAnalysis import ShapeAnalysis_Surface
from OCP.TopAbs import TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire

from cad_implicit.blend_labels import Outward
from cad_implicit.blend_surfaces import StripPiece, StripSurface
from cad_implicit.errors import InvalidMeshError
from cad_implicit.implicit import FloatArray
from cad_implicit.mesh import Mesh
from cad_implicit.outlines import Border, Outline, Outlined
from cad_implicit.patches import Patches

from .occ import Shape, as_edge, as_face, as_vertex, compound, is_valid
from .occ_geometry import Made, away_from, curve_through, flat_curve, primitive_surface, strip_surface, unwrap
from .occ_original import ShapeTopology, places

#: Edges must lie on both of their faces within so many mm, and are taken to do so within at least:
EDGE = 1e-3
_LEAST = 1e-7

#: Points along an edge by which its curves on faces are made; more until these are within so many mm of it.
_POINTS = 12
_MOST = 200
_FINE = 1e-6


class _AstrayError(InvalidMeshError):
    """An edge does not lie on a face."""

    def __init__(self, border: int, away: float) -> None:
        super().__init__(f"an edge is {away:.3g} mm away from its face")
        self.border = border


class Builder:
    """Makes the solid of an outline.

    Attributes
    ----------
    failed : dict of int to str
        Patches that cannot be put on their surfaces, and why.
    facets : list of TopoDS_Face
        Faces that are triangles of the mesh.
    worst : float
        Largest distance in mm of an edge from its faces.
    """

    def __init__(
        self, mesh: Mesh, outline: Outline, patches: Patches, count: int, surfaces: list[Outward], own: ShapeTopology
    ) -> None:
        self.mesh, self.outline, self.patches, self.count = mesh, outline, patches, count
        self.surfaces, self.own = surfaces, own
        self._builder = BRep_Builder()
        self._vertices: dict[int, Shape] = {}
        self._edges: dict[int, Shape] = {}
        self._geometry: dict[int, Made] = {}
        self._first_facet = count + len(surfaces)
        self._shapes: list[tuple[Outlined, Shape]] = []
        self.failed: dict[int, str] = {}
        self.facets: list[Shape] = []
        self.worst = 0.0

    def solid(self) -> Shape | None:
        """Solid of all faces; None if some failed."""
        shells: dict[int, list[Shape]] = {}
        component = self.mesh.component_of_face
        first = np.unique(self.patches.of_triangle, return_index=True)[1]
        for face in self.outline.faces:
            shape = self._tried(face)
            if shape is not None:
                shells.setdefault(int(component[first[face.patch]]), []).append(shape)
                self._shapes.append((face, shape))
        if self.failed:
            return None
        made = {}
        for number, faces in shells.items():
            shell = TopoDS_Shell()
            self._builder.MakeShell(shell)
            for face in faces:
                self._builder.Add(shell, face)
            shell.Closed(True)
            made[number] = shell
        return compound([self._one(made[number]) for number in made])

    def _one(self, shell: Shape) -> Shape:
        solid = TopoDS_Solid()
        self._builder.MakeSolid(solid)
        self._builder.Add(solid, shell)
        return solid

    def find_invalid(self) -> None:
        """Add to the failed patches those whose faces the kernel finds invalid."""
        for face, shape in self._shapes:
            if face.label < self._first_facet and not is_valid(shape):
                self._blame([n for loop in face.loops for n, _ in loop], face, "the kernel finds it invalid")

    def _tried(self, face: Outlined) -> Shape | None:
        try:
            return self._face(face)
        except _AstrayError as error:
            self._blame([error.border], face, str(error))
        except Exception as error:  # the kernel raises its own family of errors, which differs between versions
            self._blame([], face, f"{type(error).__name__}: {error}")
        return None

    def _blame(self, borders: list[int], face: Outlined, why: str) -> None:
        """Mark as failed a face, or the blends beside it at some borders if it is of the part, if there are any."""
        near = [f for f in self.outline.faces if any(n in borders for loop in f.loops for n, _ in loop)]
        blends = [f for f in near if self.count <= f.label < self._first_facet]
        if face.label < self.count and blends:
            guilty = blends
        elif face.label < self._first_facet:
            guilty = [face]
        else:
            guilty = [f for f in near if f.label < self._first_facet]
        if not guilty:
            raise InvalidMeshError(why)
        for one in guilty:
            self.failed.setdefault(one.patch, why)

    # --- faces

    def _face(self, face: Outlined) -> Shape:
        if face.label < self.count and self._untouched(face):
            return self.own.face_shapes[face.label]
        if face.label < self.count:
            original = self.own.face_shapes[face.label]
            forward = original.Orientation() == TopAbs_FORWARD
            made = as_face(as_face(original.Oriented(TopAbs_FORWARD)).EmptyCopied())
            surface = self.own.surface(face.label)
            low_u, high_u, low_v, high_v = _bounds(original)
            centre = np.array([(low_u + high_u) / 2, (low_v + high_v) / 2])
        elif face.label >= self._first_facet:
            made, surface, centre, forward = self._facet(face)
        else:
            made, surface, centre, forward = self._blend(face)
        for loop in self._wires(face):
            wire = TopoDS_Wire()
            self._builder.MakeWire(wire)
            for number, ahead in loop:
                edge = self._edge(number)
                self._on_face(number, edge, made, surface, centre, face)
                direction = ahead == self._runs_forward(number)
                orientation = TopAbs_FORWARD if direction == forward else TopAbs_REVERSED
                self._builder.Add(wire, edge.Oriented(orientation))
            wire.Closed(True)
            self._builder.Add(made, wire)
        return made if forward else made.Oriented(TopAbs_REVERSED)

    def _untouched(self, face: Outlined) -> bool:
        borders = [self.outline.borders[n] for loop in face.loops for n, _ in loop]
        borders += [self.outline.borders[n] for n in face.seams]
        if not all(border.edge >= 0 and self._whole(border) for border in borders):
            return False
        wanted = {e for e, edge in enumerate(self.own.edges) if face.label in edge.faces}
        return wanted == {border.edge for border in borders}

    def _whole(self, border: Border) -> bool:
        edge = self.own.edges[border.edge]
        low, high = sorted(border.knots.tolist())
        slack = 1e-6 * (edge.high - edge.low)
        return bool(abs(low - edge.low) <= slack and abs(high - edge.high) <= slack)

    def _facet(self, face: Outlined) -> tuple[Shape, Any, FloatArray, bool]:
        """Face without borders on the plane of a triangle."""
        a, b, c = self.outline.points[[self._from(one) for one in face.loops[0]]]
        geometry = Geom_Plane(gp_Pnt(*a.tolist()), gp_Dir(*np.cross(b - a, c - a).tolist()))
        made = TopoDS_Face()
        self._builder.MakeFace(made, geometry, TopLoc_Location(), _LEAST)
        self.facets.append(made)
        return made, ShapeAnalysis_Surface(geometry), np.zeros(2), True

    def _blend(self, face: Outlined) -> tuple[Shape, Any, FloatArray, bool]:
        """Face without borders, its surface, a place in the middle of it, and whether its normal points outwards."""
        outward = self.surfaces[face.label - self.count]
        surface: Any = outward.surface
        inside = np.flatnonzero(self.patches.of_triangle == face.patch)
        middles = self.mesh.vertices[self.mesh.faces[inside]].mean(axis=1)
        halved = len(self._of_label(face.label)) > 1 and getattr(surface, "closed", False)
        primitive = surface.primitive()
        if primitive is not None:
            border = np.concatenate([self._made(n).at(self._some(n)) for loop in face.loops for n, _ in loop])
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
        made = TopoDS_Face()
        self._builder.MakeFace(made, geometry, TopLoc_Location(), _LEAST)
        look = ShapeAnalysis_Surface(geometry)
        place = places(look, towards[None])[0]
        point, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
        geometry.D1(float(place[0]), float(place[1]), point, du, dv)
        normal = np.array(du.Crossed(dv).Coord())
        return made, look, place, bool(normal @ outward.value_and_normal(towards[None])[1][0] > 0)

    def _half(self, face: Outlined, surface: StripSurface) -> tuple[float, float, FloatArray]:
        """Ways from which and to which one half of a ring goes, and a point (3,) in its middle."""
        ends = np.concatenate([self.outline.points[list(self._ends(n))] for loop in face.loops for n, _ in loop])
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
            float(np.linalg.norm(np.diff(self._made(n).at(self._some(n)), axis=0), axis=1).sum()) for n in numbers
        ]
        number = numbers[int(np.argmax(lengths))]
        made = self._made(number)
        middle = made.at(np.array([(made.low + made.high) / 2]))
        near = [float(np.linalg.norm(curve.at(curve.way(middle)) - middle)) for curve in surface.curves[:2]]
        return float(surface.curves[int(np.argmin(near))].way(middle)[0])

    def _ends(self, number: int) -> tuple[int, int]:
        border = self.outline.borders[number]
        return border.start, border.end

    def _wires(self, face: Outlined) -> list[list[tuple[int, bool]]]:
        """Give closed borders, joined by seams where there are any."""
        if not face.seams:
            return face.loops
        pieces = [one for loop in face.loops for one in loop]
        pieces += [(n, ahead) for n in face.seams for ahead in (True, False)]
        seams = set(face.seams)
        left = list(pieces)
        wires = []
        while left:
            wire = [left.pop(0)]
            start = self._from(wire[0])
            while self._to(wire[-1]) != start or any(
                self._from(p) == start and (p[0] in seams) != (wire[-1][0] in seams) for p in left
            ):
                here = self._to(wire[-1])
                options = [p for p in left if self._from(p) == here]
                if not options:
                    break
                options.sort(key=lambda p: ((p[0] in seams) == (wire[-1][0] in seams), p[0] == wire[-1][0]))
                wire.append(options[0])
                left.remove(options[0])
            wires.append(wire)
        return wires

    def _from(self, piece: tuple[int, bool]) -> int:
        return self._ends(piece[0])[0 if piece[1] else 1]

    def _to(self, piece: tuple[int, bool]) -> int:
        return self._ends(piece[0])[1 if piece[1] else 0]

    # --- edges

    def _runs_forward(self, number: int) -> bool:
        """Whether the edge of a border runs from its start to its end."""
        border = self.outline.borders[number]
        return border.edge < 0 or bool(border.knots[0] < border.knots[-1])

    def _vertex(self, number: int) -> Shape:
        if number not in self._vertices:
            known = int(self.outline.known[number])
            if known >= 0:
                self._vertices[number] = as_vertex(self.own.vertex_shapes[known].Oriented(TopAbs_FORWARD))
            else:
                vertex = TopoDS_Vertex()
                self._builder.MakeVertex(vertex, gp_Pnt(*self.outline.points[number].tolist()), _LEAST)
                self._vertices[number] = vertex
        return self._vertices[number]

    def _made(self, number: int) -> Made:
        """Curve of a border."""
        if number not in self._geometry:
            border = self.outline.borders[number]
            if border.edge >= 0:
                low, high = sorted(border.knots.tolist())
                self._geometry[number] = Made(self.own.edges[border.edge].geometry, low, high)
            else:
                assert border.place is not None
                turned = border.knots[0] > border.knots[-1]
                place = (lambda ways: border.place(-ways)) if turned else border.place
                self._geometry[number] = curve_through(place, -border.knots if turned else border.knots)
        return self._geometry[number]

    def _some(self, number: int) -> FloatArray:
        made = self._made(number)
        return np.linspace(made.low, made.high, _POINTS)

    def _edge(self, number: int) -> Shape:
        if number in self._edges:
            return self._edges[number]
        border, made = self.outline.borders[number], self._made(number)
        if border.edge >= 0 and self._whole(border):
            edge = self.own.edges[border.edge].shape
        else:
            if border.edge >= 0:
                edge = as_edge(self.own.edges[border.edge].shape.EmptyCopied())
            else:
                edge = TopoDS_Edge()
                self._builder.MakeEdge(edge, made.geometry, _LEAST)
            ends = [border.start, border.end]
            if not self._runs_forward(number):
                ends.reverse()
            for vertex, orientation, at in zip(
                ends, (TopAbs_FORWARD, TopAbs_REVERSED), (made.low, made.high), strict=True
            ):
                shape = self._vertex(vertex)
                away = float(np.linalg.norm(made.at(np.array([at]))[0] - self.outline.points[vertex]))
                self._tolerate(shape, away)
                self._builder.Add(edge, shape.Oriented(orientation))
            self._builder.Range(edge, made.low, made.high)
        self._edges[number] = edge
        return edge

    def _tolerate(self, vertex: Shape, away: float) -> None:
        self.worst = max(self.worst, away)
        if away > BRep_Tool.Tolerance_s(vertex):
            self._builder.UpdateVertex(vertex, 1.01 * away + _LEAST)

    def _on_face(
        self, number: int, edge: Shape, face: Shape, surface: Any, centre: FloatArray, outlined: Outlined
    ) -> None:
        """Put an edge's curve onto a face, unless the face is plane or the edge was there before."""
        border = self.outline.borders[number]
        if border.edge >= 0 and outlined.label in self.own.edges[border.edge].faces:
            return
        made = self._made(number)
        count, away = _POINTS, np.inf
        while True:
            parameters = np.linspace(made.low, made.high, count)
            found = places(surface, made.at(parameters))
            if type(surface.Surface()).__name__ == "Geom_Plane":
                flat, away = None, away_from(made, surface, parameters, found)
                break
            unwrap(found, surface.Surface(), centre)
            flat = flat_curve(parameters, found)
            middle = (parameters[1:] + parameters[:-1]) / 2
            on_face = np.array([flat.Value(float(t)).Coord() for t in middle])
            away = max(away_from(made, surface, parameters, found), away_from(made, surface, middle, on_face))
            if away < _FINE or count >= _MOST:
                break
            count *= 2
        self.worst = max(self.worst, away)
        if away > EDGE:
            raise _AstrayError(number, away)
        if 1.05 * away + _LEAST > BRep_Tool.Tolerance_s(edge):
            self._builder.UpdateEdge(edge, 1.05 * away + _LEAST)
            for vertex in (border.start, border.end):
                self._tolerate(self._vertex(vertex), 1.05 * away + _LEAST)
        if flat is not None:
            self._builder.UpdateEdge(edge, flat, face, _LEAST)


def _bounds(face: Shape) -> tuple[float, float, float, float]:
    return BRepTools.UVBounds_s(face)  # type: ignore[no-any-return]


def _nearest(points: FloatArray, place: FloatArray) -> FloatArray:
    return np.asarray(points[int(np.linalg.norm(points - place, axis=1).argmin())])
