"""Outlines: the borders of the faces of a result as exact curves, from the patches of its mesh.

Each border between two patches is part of an edge of the part, a curve at which a blend begins, or where two surfaces
cross. Vertices lie where such curves meet.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial import cKDTree

from .blend_labels import Faces, Outward
from .blend_surfaces import Curve, StripSurface
from .distance import MeshDistance
from .implicit import FloatArray
from .mesh import Mesh
from .patches import Numbers, Patches, divide

#: Vertices of the part are found in the mesh within so many spacings.
_SAME = 1e-4

#: A border follows a curve if its vertices are within so many spacings of that, and the curve on the other surface
#: within so many, where both face the same way within this cosine.
_NEAR = 2.5
_ON = 0.05
_TANGENT = 0.9995

#: Borders follow edges of the part within so many spacings.
_EDGE = 0.3

#: Rounds towards where curves and surfaces meet, and the move in spacings that ends them.
_ROUNDS = 60
_STILL = 1e-9

#: Borders whose ends come to lie within so many spacings of each other vanish, if they were no longer than:
_POINT = 2e-3
_TINY = 8.0

#: Fewest and most points by which curves are made at which surfaces cross.
_CROSSING = (9, 65)

#: Gaps between points of these wider than so many spacings are filled, by steps of so many.
_GAP = 1.2
_STEP = 0.3

#: Points on them are looked for within so many spacings of a spline.
_REACH = 0.05

#: Rings are cut at these shares of their way.
_CUTS = (0.21, 0.71)


class EdgeCurve(Curve, Protocol):
    """An edge of the part.

    Attributes
    ----------
    faces : tuple of int
        Labels of the faces beside it.
    ends : tuple of int
        Positions of its vertices in the part's list, by ascending parameter.
    low, high : float
        Its parameters.
    """

    faces: tuple[int, ...]
    ends: tuple[int, int]
    low: float
    high: float


class Original(Protocol):
    """The part's own topology.

    Attributes
    ----------
    vertices : (V, 3) float64
    """

    vertices: FloatArray

    @property
    def edges(self) -> Sequence[EdgeCurve]:
        """Its edges."""

    def seams(self, face: int) -> list[int]:
        """Edges at which a face meets itself."""

    def past_seam(self, face: int, seam: int, points: FloatArray) -> FloatArray:
        """How far (N,) points of a face are past a seam, in turns from -0.5 to 0.5."""


@dataclass(eq=False)
class Border:
    """A border between two faces, from one vertex to another.

    Attributes
    ----------
    start, end : int
        Vertices of the outline.
    place : callable or None
        Points (N, 3) at parameters (N,); None for a whole edge of the part or part of one.
    knots : (N,) float64
        Parameters from start to end; of an edge of the part, those at both ends.
    edge : int
        Edge of the part; -1 for none.
    """

    start: int
    end: int
    place: Callable[[FloatArray], FloatArray] | None
    knots: FloatArray
    edge: int = -1


@dataclass(eq=False)
class Outlined:
    """A face: its label, the patch it came from, and its closed borders, each running forward or not."""

    label: int
    patch: int
    loops: list[list[tuple[int, bool]]]
    seams: list[int] = field(default_factory=list)


@dataclass(eq=False)
class Outline:
    """All vertices, borders and faces of a result.

    Attributes
    ----------
    points : (J, 3) float64
    known : (J,) int64
        Vertices of the part that they are, or -1.
    """

    points: FloatArray
    known: Numbers
    borders: list[Border]
    faces: list[Outlined]


class Outliner:
    """Finds the outline of a mesh whose triangles are labelled."""

    def __init__(
        self,
        mesh: Mesh,
        labels: Numbers,
        count: int,
        faces: Faces,
        surfaces: Sequence[Outward],
        original: Original,
        spacing: float,
    ) -> None:
        self.mesh, self.labels, self.count, self.faces = mesh, labels, count, faces
        self.surfaces, self.original, self.h = list(surfaces), original, spacing
        self._faces: dict[int, Outward] = {}
        away, nearest = cKDTree(original.vertices).query(mesh.vertices)
        self.known = np.where(away < _SAME * spacing, nearest, -1)

    def outline(self) -> Outline:
        """Outline of the mesh."""
        rough = divide(self.mesh, self.labels, np.flatnonzero(self.known >= 0))
        rings = self._rings(rough)
        crossings = self._crossings(rough)
        extra = [vertex for ring in rings for cut in ring[1] for vertex in cut[1:]] + list(crossings)
        junctions = np.unique(np.concatenate([np.flatnonzero(self.known >= 0), np.array(extra, np.int64)]))
        self.patches = divide(self.mesh, self.labels, junctions)
        curves = [self._curve(number) for number in range(len(self.patches.chains))]
        ends = sorted({int(v) for chain in self.patches.chains for v in chain.vertices[[0, -1]]})
        index = {vertex: number for number, vertex in enumerate(ends)}
        points = self._junctions(ends, curves, crossings, rings)
        known = self.known[ends]
        borders = [self._border(number, curves[number], index, points) for number in range(len(curves))]
        faces = [
            Outlined(int(label), patch, [list(loop) for loop in loops])
            for patch, (label, loops) in enumerate(zip(self.patches.labels, self.patches.loops, strict=True))
        ]
        result = Outline(points, known, borders, faces)
        self._cut_rings(result, rings, index)
        self._add_seams(result, index)
        self._collapse(result)
        return result

    def surface(self, label: int) -> Outward:
        """Surface of a label."""
        if label >= self.count:
            return self.surfaces[label - self.count]
        if label not in self._faces:
            self._faces[label] = Outward(self.faces.face(label + 1), -1.0)
        return self._faces[label]

    # --- what is cut

    def _rings(self, patches: Patches) -> list[tuple[int, list[tuple[float, int, int]], StripSurface]]:
        """Patches that go around, and the ways and vertices on both borders at which they are cut."""
        found = []
        for label, loops in zip(patches.labels, patches.loops, strict=True):
            if label < self.count or len(loops) not in (1, 2):
                continue
            surface = self.surfaces[label - self.count].surface
            if not isinstance(surface, StripSurface) or not surface.closed:
                continue
            inner = [
                np.concatenate([patches.chains[number].vertices[1:-1] for number, _ in loop] + [np.zeros(0, np.int64)])
                for loop in loops
            ]
            if min(map(len, inner)) < 2:
                continue
            cuts = []
            for share in _CUTS:
                way = share * surface.length
                both = []
                for vertices in inner:
                    points = self.mesh.vertices[vertices]
                    near = [
                        np.linalg.norm(curve.at(np.array([way]))[0] - points, axis=1) for curve in surface.curves[:2]
                    ]
                    side = int(np.argmin([n.min() for n in near]))
                    both.append(int(vertices[int(near[side].argmin())]))
                cuts.append((way, both[0], both[-1]))
            if len({v for cut in cuts for v in cut[1:]}) == 2 * len(loops):
                found.append((int(label), cuts, surface))
        return found

    def _crossings(self, patches: Patches) -> dict[int, int]:
        """Seams by the vertices at which borders cross them."""
        found: dict[int, int] = {}
        for label, loops in zip(patches.labels.tolist(), patches.loops, strict=True):
            if label >= self.count:
                continue
            for seam in self.original.seams(label):
                for loop in loops:
                    runs = [(patches.chains[n].vertices, forward) for n, forward in loop]
                    vertices = np.concatenate([(run if forward else run[::-1])[:-1] for run, forward in runs])
                    past = self.original.past_seam(label, seam, self.mesh.vertices[vertices])
                    after = np.roll(past, -1)
                    ends = {self.original.edges[seam].ends[0], self.original.edges[seam].ends[1]}
                    at_end = np.isin(self.known[vertices], list(ends))
                    crossing = (past * after <= 0) & (np.abs(past - after) < 0.25)
                    for place in np.flatnonzero(crossing).tolist():
                        following = (place + 1) % len(vertices)
                        if at_end[place] or at_end[following]:
                            continue
                        found[int(vertices[place if abs(past[place]) <= abs(past[following]) else following])] = seam
        return found

    # --- curves

    def _curve(self, number: int) -> Curve | int | None:
        """Curve that a chain follows: an edge of the part by number, a curve of a blend, None where surfaces cross."""
        chain = self.patches.chains[number]
        labels = [int(self.patches.labels[patch]) for patch in (chain.left, chain.right)]
        points = self.mesh.vertices[chain.vertices]
        some = points[np.unique(np.linspace(0, len(points) - 1, 12).astype(int))]
        if len(points) == 2:
            some = np.concatenate([points, points.mean(axis=0)[None]])
        if max(labels) < self.count:
            near = [
                (float(np.linalg.norm(edge.at(edge.way(some)) - some, axis=1).max()), e)
                for e, edge in enumerate(self.original.edges)
                if set(labels) <= set(edge.faces)
            ]
            if near and min(near)[0] < _EDGE * self.h:
                return min(near)[1]
            return None
        best: tuple[float, Curve] | None = None
        for own, other in (labels, labels[::-1]):
            if own < self.count:
                continue
            box = self.surfaces[own - self.count].surface
            for curve in getattr(box, "curves", []):
                feet = curve.at(curve.way(some))
                away = float(np.linalg.norm(feet - some, axis=1).mean())
                if away > _NEAR * self.h or (best is not None and away >= best[0]):
                    continue
                value, normal = self.surface(other).value_and_normal(feet)
                mine = self.surface(own).value_and_normal(feet)[1]
                if np.abs(value).max() < _ON * self.h and (mine * normal).sum(axis=1).min() > _TANGENT:
                    best = (away, curve)
        return None if best is None else best[1]

    def _crossing_points(self, labels: Sequence[int], points: FloatArray, reach: float = np.inf) -> FloatArray:
        """Points (N, 3) where two surfaces cross, near given ones; these themselves if those are farther than a reach.

        Where two surfaces cross at a small angle another branch of their curve may be near.
        """
        x = points.copy()
        a, b = (self.surface(label) for label in labels)
        for _ in range(12):
            (f, n), (g, m) = a.value_and_normal(x), b.value_and_normal(x)
            c = (n * m).sum(axis=1)
            det = np.maximum(1 - c * c, 1e-6)
            move = -((f - c * g) / det)[:, None] * n - ((g - c * f) / det)[:, None] * m
            size = np.linalg.norm(move, axis=1)[:, None]
            x += move * np.minimum(1.0, self.h / np.maximum(size, 1e-300))
            if float(size.max(initial=0.0)) < 1e-11:
                break
        astray = np.linalg.norm(x - points, axis=1) > reach
        x[astray] = points[astray]
        return x

    # --- vertices

    def _junctions(
        self,
        ends: list[int],
        curves: list[Curve | int | None],
        crossings: dict[int, int],
        rings: list[tuple[int, list[tuple[float, int, int]], StripSurface]],
    ) -> FloatArray:
        """Places (J, 3) of vertices."""
        fixed: dict[int, FloatArray] = {}
        for _, cuts, surface in rings:
            for way, *both in cuts:
                for vertex in both:
                    places = [curve.at(np.array([way]))[0] for curve in surface.curves[:2]]
                    away = [float(np.linalg.norm(place - self.mesh.vertices[vertex])) for place in places]
                    fixed[vertex] = places[int(np.argmin(away))]
        around: dict[int, tuple[list[Curve], set[int]]] = {vertex: ([], set()) for vertex in ends}
        for number, chain in enumerate(self.patches.chains):
            curve = curves[number]
            labels = {int(self.patches.labels[patch]) for patch in (chain.left, chain.right)}
            for vertex in {int(chain.vertices[0]), int(chain.vertices[-1])}:
                if curve is None:
                    around[vertex][1].update(labels)
                else:
                    around[vertex][0].append(self.original.edges[curve] if isinstance(curve, int) else curve)
        for vertex, seam in crossings.items():
            if vertex in around:
                around[vertex][0].append(self.original.edges[seam])
        points = self.mesh.vertices[ends].copy()
        for row, vertex in enumerate(ends):
            if self.known[vertex] >= 0:
                points[row] = self.original.vertices[self.known[vertex]]
            elif vertex in fixed:
                points[row] = fixed[vertex]
            else:
                points[row] = self._meeting(points[row], *around[vertex])
        return points

    def _meeting(self, point: FloatArray, curves: list[Curve], labels: set[int]) -> FloatArray:
        """Place where curves and surfaces meet, near a point."""
        x = point[None].copy()
        distinct = list({id(curve): curve for curve in curves}.values())
        for _ in range(_ROUNDS):
            before = x.copy()
            for label in labels:
                value, normal = self.surface(label).value_and_normal(x)
                x = x - value[:, None] * normal
            for curve in distinct:
                x = curve.at(curve.way(x))
            if float(np.abs(x - before).max()) < _STILL * self.h:
                break
        return np.asarray(x[0])

    # --- borders

    def _border(self, number: int, curve: Curve | int | None, index: dict[int, int], points: FloatArray) -> Border:
        chain = self.patches.chains[number]
        start, end = index[int(chain.vertices[0])], index[int(chain.vertices[-1])]
        inner = self.mesh.vertices[chain.vertices[1:-1]]
        if curve is None:
            labels = [int(self.patches.labels[patch]) for patch in (chain.left, chain.right)]
            return self._crossing_border(start, end, labels, inner, points)
        edge = curve if isinstance(curve, int) else -1
        along = self.original.edges[edge] if isinstance(curve, int) else curve
        ways = along.way(np.concatenate([points[[start]], inner, points[[end]]]))
        period = _period(along)
        if period is not None:
            ways = np.unwrap(ways, period=period)
            if start == end and abs(ways[-1] - ways[0]) < period / 2:
                turn = np.sign(np.median(np.diff(ways))) or 1.0
                ways[-1] = ways[0] + turn * period
        low, high = float(ways[0]), float(ways[-1])
        if edge >= 0:
            own = self.original.edges[edge]
            if period is not None:  # from one end of its range to the other, or between
                shift = np.floor((min(low, high) - own.low + 1e-7 * period) / period) * period
                low, high = low - shift, high - shift
            return Border(start, end, None, np.array([low, high]), edge)
        knots = np.linspace(low, high, 17)
        if isinstance(surface := getattr(along, "_surface", None), StripSurface):
            inside = surface.strip.way(surface.spine.at)
            turns = [0.0] if period is None else [-period, 0.0, period]
            extra = np.concatenate([inside + turn for turn in turns])
            extra = extra[(extra > min(low, high)) & (extra < max(low, high))]
            knots = np.unique(np.concatenate([knots, extra]))
            gap = 1e-6 * abs(high - low)
            knots = knots[np.concatenate([[True], np.diff(knots) > gap])]
            knots[[0, -1]] = min(low, high), max(low, high)
            if high < low:
                knots = knots[::-1]
        return Border(start, end, along.at, knots)

    def _crossing_border(
        self, start: int, end: int, labels: list[int], inner: FloatArray, points: FloatArray
    ) -> Border:
        """Border where two surfaces cross, by the length of its polyline."""
        off = np.max([np.abs(self.surface(label).value_and_normal(inner)[0]) for label in labels], axis=0)
        inner = self._crossing_points(labels, inner[off < _ON * self.h])
        rough = self._onward(np.concatenate([points[[start]], inner, points[[end]]]), labels)
        rough = self._filled(rough, labels)
        if _lengths(rough)[-1] < _POINT * self.h:
            return Border(start, end, _straight(rough[0], rough[-1]), np.array([0.0, 1.0]))
        count = int(np.clip(len(rough), _CROSSING[0], _CROSSING[1]))
        for shape in (PchipInterpolator, CubicSpline):  # the first does not swing where points are far apart
            length = _lengths(rough)
            even = shape(length, rough)(np.linspace(0.0, length[-1], count))
            even[1:-1] = self._crossing_points(labels, even[1:-1], _REACH * self.h)
            even[[0, -1]] = rough[[0, -1]]
            rough = even
        length = _lengths(rough)
        spline = CubicSpline(length, rough)

        def place(ways: FloatArray) -> FloatArray:
            x = np.asarray(spline(ways))
            inside = (ways > length[0]) & (ways < length[-1])
            if inside.any():
                x[inside] = self._crossing_points(labels, x[inside], _REACH * self.h)
            return x

        return Border(start, end, place, length[[0, -1]])

    def _onward(self, points: FloatArray, labels: Sequence[int]) -> FloatArray:
        """Leave out points that go back along the curve where two surfaces cross."""
        n, m = (self.surface(label).value_and_normal(points)[1] for label in labels)
        along = np.cross(n, m)
        kept = [0]
        last = len(points) - 1
        for place in range(1, last):
            step = points[place] - points[kept[-1]]
            size = float(np.linalg.norm(step))
            if size < 0.1 * self.h or np.linalg.norm(points[last] - points[place]) < 0.1 * self.h:
                continue
            ahead = along[place] + along[kept[-1]]
            if abs(float(step @ ahead)) < 1e-12 or float(step @ ahead) * self._turn(points, along) > 0:
                kept.append(place)
        return np.asarray(points[[*kept, last]])

    def _filled(self, points: FloatArray, labels: Sequence[int]) -> FloatArray:
        """Fill wide gaps by following the curve where two surfaces cross from where they cross at the wider angle."""
        n, m = (self.surface(label).value_and_normal(points)[1] for label in labels)
        width = np.linalg.norm(np.cross(n, m), axis=1)
        result = [points[:1]]
        for place, gap in enumerate(np.linalg.norm(np.diff(points, axis=0), axis=1).tolist()):
            a, b = points[place], points[place + 1]
            if gap > _GAP * self.h:
                forward = bool(width[place] >= width[place + 1])
                between = self._followed(a if forward else b, b if forward else a, labels)
                result.append(between if forward else between[::-1])
            result.append(b[None])
        return np.concatenate(result)

    def _followed(self, start: FloatArray, end: FloatArray, labels: Sequence[int]) -> FloatArray:
        """Points (N, 3) of a curve from one point on it towards another, without both."""
        step = _STEP * self.h
        x, ahead, found = start[None], end - start, []
        for _ in range(int(4 * np.linalg.norm(ahead) / step) + 1):
            n, m = (self.surface(label).value_and_normal(x)[1][0] for label in labels)
            along = np.cross(n, m)
            size = float(np.linalg.norm(along))
            if size < 1e-9 or float(np.linalg.norm(end - x[0])) < 1.5 * step:
                break
            along *= np.sign(along @ ahead) / size
            x = self._crossing_points(labels, x + step * along)
            ahead = along
            found.append(x[0])
        return np.array(found).reshape(-1, 3)

    @staticmethod
    def _turn(points: FloatArray, along: FloatArray) -> float:
        """Whether a curve runs along its directions, as most of its pieces do."""
        steps = np.diff(points, axis=0)
        return float(np.sign(((along[1:] + along[:-1]) * steps).sum()) or 1.0)

    # --- topology

    def _cut_rings(
        self,
        outline: Outline,
        rings: list[tuple[int, list[tuple[float, int, int]], StripSurface]],
        index: dict[int, int],
    ) -> None:
        for label, cuts, surface in rings:
            face = next((f for f in outline.faces if f.label == label), None)
            if face is None:
                continue
            if len(face.loops) == 1:
                self._cut_cap(outline, face, [index[cut[1]] for cut in cuts], [cut[0] for cut in cuts], surface)
                continue
            one = [(index[cut[1]], index[cut[2]], cut[0]) for cut in cuts]
            first, second = face.loops
            if not any(outline.borders[n].start == one[0][0] for n, _ in first):
                first, second = second, first
            arcs = []
            for a, b, way in one:
                flip = np.linalg.norm(surface.curves[0].at(np.array([way]))[0] - outline.points[a]) > np.linalg.norm(
                    surface.curves[1].at(np.array([way]))[0] - outline.points[a]
                )
                arcs.append(len(outline.borders))
                outline.borders.append(Border(a, b, _section(surface, way, bool(flip)), np.linspace(0.0, 1.0, 9)))
            parts = [_between(outline.borders, first, one[i][0], one[1 - i][0]) for i in (0, 1)]
            other = [_between(outline.borders, second, one[1 - i][1], one[i][1]) for i in (0, 1)]
            outline.faces.remove(face)
            for i in (0, 1):
                loop = [*parts[i], (arcs[1 - i], True), *other[i], (arcs[i], False)]
                outline.faces.append(Outlined(label, face.patch, [loop]))

    def _cut_cap(
        self, outline: Outline, face: Outlined, ends: list[int], ways: list[float], surface: StripSurface
    ) -> None:
        """Cut a cap, whose other rim is a point, by a curve through that."""
        rims = [curve.at(np.array(ways[:1]))[0] for curve in surface.curves[:2]]
        turned = bool(
            np.linalg.norm(rims[0] - outline.points[ends[0]]) > np.linalg.norm(rims[1] - outline.points[ends[0]])
        )
        there, back = (_section(surface, way, turned) for way in ways)

        def place(shares: FloatArray) -> FloatArray:
            x = 2 * np.asarray(shares)
            return np.where((x < 1)[:, None], there(np.minimum(x, 1.0)), back(np.minimum(2 - x, 1.0)))

        number = len(outline.borders)
        outline.borders.append(Border(ends[0], ends[1], place, np.array([0.0, 0.5, 1.0])))
        loop = face.loops[0]
        outline.faces.remove(face)
        for i, forward in ((0, False), (1, True)):
            part = _between(outline.borders, loop, ends[i], ends[1 - i])
            outline.faces.append(Outlined(face.label, face.patch, [[*part, (number, forward)]]))

    def _add_seams(self, outline: Outline, index: dict[int, int]) -> None:
        """Add to faces of the part that meet themselves what is left of their seams."""
        inside: MeshDistance | None = None
        for face in outline.faces:
            if face.label >= self.count:
                continue
            for seam in self.original.seams(face.label):
                edge = self.original.edges[seam]
                inside = inside or MeshDistance(self.mesh, sign="pseudonormal")
                self._add_seam(outline, face, seam, edge, inside)
        del index

    def _add_seam(self, outline: Outline, face: Outlined, seam: int, edge: EdgeCurve, inside: MeshDistance) -> None:
        on_border = {
            v for loop in face.loops for n, _ in loop for v in (outline.borders[n].start, outline.borders[n].end)
        }
        stops: dict[int, float] = {}
        for vertex in on_border:
            way = edge.way(outline.points[[vertex]])
            if np.linalg.norm(edge.at(way)[0] - outline.points[vertex]) < _POINT * self.h:
                stops[vertex] = float(way[0])
        for end, limit in zip(edge.ends, (edge.low, edge.high), strict=True):
            here = [v for v in stops if outline.known[v] == end]
            if here:
                stops[here[0]] = limit
            elif self._within(inside, self.original.vertices[end], face.patch):
                stops[self._vertex(outline, end)] = limit
        order = sorted(stops, key=lambda vertex: stops[vertex])
        for a, b in pairwise(order):
            middle = edge.at(np.array([(stops[a] + stops[b]) / 2]))[0]
            if self._within(inside, middle, face.patch):
                face.seams.append(len(outline.borders))
                outline.borders.append(Border(a, b, None, np.array([stops[a], stops[b]]), seam))

    def _within(self, inside: MeshDistance, point: FloatArray, patch: int) -> bool:
        found = inside.closest(point[None])
        return bool(self.patches.of_triangle[found.triangle[0]] == patch and found.distance[0] < self.h)

    def _vertex(self, outline: Outline, known: int) -> int:
        here = np.flatnonzero(outline.known == known)
        if len(here):
            return int(here[0])
        outline.points = np.concatenate([outline.points, self.original.vertices[[known]]])
        outline.known = np.append(outline.known, known)
        return len(outline.points) - 1

    def _collapse(self, outline: Outline) -> None:
        """Take out borders without length, and faces without area."""
        same = list(range(len(outline.points)))

        def root(vertex: int) -> int:
            while same[vertex] != vertex:
                vertex = same[vertex]
            return vertex

        gone = set()
        for number, chain in enumerate(self.patches.chains):
            border = outline.borders[number]
            path = self.mesh.vertices[chain.vertices]
            length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
            ends = outline.points[border.end] - outline.points[border.start]
            if length < _TINY * self.h and float(np.linalg.norm(ends)) < _POINT * self.h:
                gone.add(number)
                a, b = root(border.start), root(border.end)
                if a != b:
                    a, b = (a, b) if outline.known[a] >= 0 else (b, a)
                    same[b] = a
        for border in outline.borders:
            border.start, border.end = root(border.start), root(border.end)
        for face in outline.faces:
            face.loops = [[one for one in loop if one[0] not in gone] for loop in face.loops]
            face.loops = [loop for loop in face.loops if loop]
        outline.faces = [face for face in outline.faces if face.loops]


def _straight(start: FloatArray, end: FloatArray) -> Callable[[FloatArray], FloatArray]:
    def place(shares: FloatArray) -> FloatArray:
        return start + np.asarray(shares)[:, None] * (end - start)

    return place


def _lengths(points: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _period(curve: Curve) -> float | None:
    """Period of the parameter of a closed curve."""
    if not curve.closed:
        return None
    low, high = getattr(curve, "low", None), getattr(curve, "high", None)
    if low is not None and high is not None:
        return float(high - low)
    return float(curve._surface.length)  # type: ignore[attr-defined]


def _section(surface: StripSurface, way: float, turned: bool) -> Callable[[FloatArray], FloatArray]:
    """Arc across a strip, from its first rim to its second or back."""

    def place(shares: FloatArray) -> FloatArray:
        shares = np.asarray(shares)
        return surface.place(np.full(len(shares), way), 1 - shares if turned else shares)

    return place


def _between(borders: list[Border], loop: list[tuple[int, bool]], start: int, end: int) -> list[tuple[int, bool]]:
    """Part of a loop from one vertex to another."""
    at = next(i for i, (n, forward) in enumerate(loop) if (borders[n].start if forward else borders[n].end) == start)
    turned = loop[at:] + loop[:at]
    found = []
    for n, forward in turned:
        found.append((n, forward))
        if (borders[n].end if forward else borders[n].start) == end:
            break
    return found
