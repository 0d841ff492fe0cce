"""From a labelled mesh to its outline: what curve each border between two patches follows, and where these end.

Each border is part of an edge of the part, a curve at which a blend begins, or where two surfaces cross. Vertices lie
where such curves meet.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from .blend_curves import Curve
from .blend_labels import Faces, Outward
from .crossing_curves import POINT, Crossing, straight
from .implicit import FloatArray
from .junctions import Meeting, pairings
from .mesh import Mesh
from .outlines import Border, Original, Outline, Outlined, Place, joined
from .patches import Chain, Numbers, Patches, divide
from .ring_cuts import Ring, cut_rings, find_rings
from .seam_borders import add_seams, seam_crossings

#: Vertices of the part are found in the mesh within so many spacings.
_SAME = 1e-4

#: Points of a border that tell what it follows.
_SOME = 12

#: A border follows a curve if its vertices are within so many spacings of that, and the curve on the other surface
#: within so many, where both face the same way within this cosine.
_NEAR = 2.5
_ON = 0.05
_TANGENT = 0.9995

#: Borders follow edges of the part within so many spacings.
_EDGE = 0.3

#: Vertices are found where all moves towards what meets there are shorter than so many spacings.
_STILL = 1e-9

#: Corners of triangles that are faces may move by this share of their shortest edge: both its ends do.
_ROOM = 0.4

#: Vertices of the mesh may be two that are no farther from it than so many spacings.
_APART = 1.5

#: Borders whose ends come to lie within POINT spacings of each other vanish, if they were no longer than so many:
_TINY = 8.0

#: Curves are drawn through so many points at least.
_KNOTS = 17

#: What a border follows: an edge of the part by number, a curve of a blend, None where surfaces cross.
Followed = Curve | int | None


@dataclass(frozen=True, eq=False)
class Parted:
    """A vertex of the mesh that is two in truth.

    Attributes
    ----------
    points : (2, 3) float64
    second : set of int
        Chains that end at the second of them.
    patches : (int, int)
        Those beside the border between both.
    """

    points: FloatArray
    second: set[int]
    patches: tuple[int, int]


class Outliner:
    """Finds outlines of meshes whose triangles are labelled; what was found once is told again.

    Parameters
    ----------
    count : int
        Number of faces of the part.
    faces : Faces
    surfaces : sequence of Outward
        Of the blends.
    original : Original
    spacing : float
        In mm.

    Attributes
    ----------
    first_facet : int
        The first label of a triangle that is a face of its own.
    patches : Patches
        Of the last outline.
    """

    mesh: Mesh
    labels: Numbers
    known: Numbers
    patches: Patches

    def __init__(
        self, count: int, faces: Faces, surfaces: Sequence[Outward], original: Original, spacing: float
    ) -> None:
        self.count, self.faces, self.surfaces, self.original, self.h = count, faces, list(surfaces), original, spacing
        self.first_facet = count + len(self.surfaces)
        self._faces: dict[int, Outward] = {}
        self._vertices = cKDTree(original.vertices)
        self._curves: dict[Hashable, Followed] = {}
        self._places: dict[Hashable, tuple[FloatArray, float]] = {}
        self._drawings: dict[Hashable, tuple[Place | None, FloatArray]] = {}
        self._lines: dict[bytes, Place] = {}

    def outline(self, mesh: Mesh, labels: Numbers) -> Outline:
        """Outline of a mesh by the labels (F,) of its triangles.

        Faces of the part from 0, surfaces of blends from ``count``; after those each triangle is a face of its own.
        """
        self.mesh, self.labels = mesh, labels
        away, nearest = self._vertices.query(mesh.vertices)
        self.known = np.where(away < _SAME * self.h, nearest, -1)
        fixed = self.known >= 0
        fixed[self.mesh.faces[self.labels >= self.first_facet]] = True
        own = np.flatnonzero(fixed)
        rough = divide(self.mesh, self.labels, own)
        rings = find_rings(self.mesh, rough, self.surfaces, self.count)
        seams = seam_crossings(self.mesh, rough, self.known, self.original, self.count)
        extra = [vertex for ring in rings for vertex in ring.vertices] + list(seams)
        self.patches = divide(self.mesh, self.labels, np.unique(np.concatenate([own, np.array(extra, np.int64)])))
        chains = self.patches.chains
        curves = [self._curve(chain) for chain in chains]
        ends = sorted({int(v) for chain in chains for v in chain.vertices[[0, -1]]})
        index = {vertex: number for number, vertex in enumerate(ends)}
        points, parted = self._junctions(ends, curves, seams, rings)
        seconds = {vertex: len(ends) + number for number, vertex in enumerate(parted)}
        points[[index[vertex] for vertex in parted]] = [two.points[0] for two in parted.values()] or np.zeros((0, 3))
        points = np.concatenate([points, *(two.points[1:] for two in parted.values())])

        def end(number: int, place: int) -> int:
            vertex = int(chains[number].vertices[place])
            return seconds[vertex] if vertex in parted and number in parted[vertex].second else index[vertex]

        borders = [
            self._border(chain, curve, end(number, 0), end(number, -1), points)
            for number, (chain, curve) in enumerate(zip(chains, curves, strict=True))
        ]
        result = Outline(
            points,
            np.append(self.known[ends], np.full(len(parted), -1)),
            borders,
            [
                Outlined(int(label), patch, [list(loop) for loop in loops])
                for patch, (label, loops) in enumerate(zip(self.patches.labels, self.patches.loops, strict=True))
            ],
        )
        for vertex, two in parted.items():
            self._add_parted(result, two, index[vertex], seconds[vertex])
        cut_rings(result, rings, index)
        add_seams(result, self.mesh, self.patches, self.original, self.count, self.h)
        self._collapse(result)
        return result

    def surface(self, label: int) -> Outward:
        """Surface of a label."""
        if label >= self.count:
            return self.surfaces[label - self.count]
        if label not in self._faces:
            self._faces[label] = Outward(self.faces.face(label + 1), -1.0)
        return self._faces[label]

    def _is_straight(self, chain: Chain) -> bool:
        """Whether a chain is an edge of a triangle that is a face of its own."""
        return max(self._beside(chain)) >= self.first_facet

    def _beside(self, chain: Chain) -> tuple[int, int]:
        """Labels on both sides of a chain."""
        return int(self.patches.labels[chain.left]), int(self.patches.labels[chain.right])

    # --- curves

    def _curve(self, chain: Chain) -> Followed:
        """Tell what a chain follows."""
        if self._is_straight(chain):
            return None
        labels = self._beside(chain)
        points = self.mesh.vertices[chain.vertices]
        some = points[np.unique(np.linspace(0, len(points) - 1, _SOME).astype(int))]
        if len(points) == 2:
            some = np.concatenate([points, points.mean(axis=0)[None]])
        key = (labels, some.tobytes())
        if key not in self._curves:
            find = self._edge_along if max(labels) < self.count else self._blend_curve
            self._curves[key] = find(labels, some)
        return self._curves[key]

    def _edge_along(self, labels: tuple[int, int], points: FloatArray) -> int | None:
        """Edge of the part between two of its faces along points (N, 3)."""
        near = [
            (float(np.linalg.norm(edge.at(edge.way(points)) - points, axis=1).max()), number)
            for number, edge in enumerate(self.original.edges)
            if set(labels) <= set(edge.faces)
        ]
        return min(near)[1] if near and min(near)[0] < _EDGE * self.h else None

    def _blend_curve(self, labels: tuple[int, int], points: FloatArray) -> Curve | None:
        """Curve along points (N, 3) at which one of two surfaces begins, tangent to the other."""
        best, result = np.inf, None
        for own, other in (labels, labels[::-1]):
            if own < self.count:
                continue
            for curve in getattr(self.surfaces[own - self.count].surface, "curves", []):
                feet = curve.at(curve.way(points))
                away = float(np.linalg.norm(feet - points, axis=1).mean())
                if away > _NEAR * self.h or away >= best:
                    continue
                value, normal = self.surface(other).value_and_normal(feet)
                mine = self.surface(own).value_and_normal(feet)[1]
                if np.abs(value).max() < _ON * self.h and (mine * normal).sum(axis=1).min() > _TANGENT:
                    best, result = away, curve
        return result

    # --- vertices

    def _junctions(
        self, ends: list[int], curves: list[Followed], seams: dict[int, int], rings: list[Ring]
    ) -> tuple[FloatArray, dict[int, Parted]]:
        """Places (J, 3) of vertices: ``ends`` of the mesh, some on seams or where rings are cut; and parted ones."""
        fixed = {vertex: place for ring in rings for vertex, place in ring.places(self.mesh).items()}
        around: dict[int, list[int]] = {vertex: [] for vertex in ends}
        for number, chain in enumerate(self.patches.chains):
            for vertex in chain.vertices[[0, -1]].tolist():
                around[vertex].append(number)
        points = self.mesh.vertices[ends].copy()
        room = self._room()
        parted: dict[int, Parted] = {}
        for row, vertex in enumerate(ends):
            if self.known[vertex] >= 0:
                points[row] = self.original.vertices[self.known[vertex]]
            elif vertex in fixed:
                points[row] = fixed[vertex]
            else:
                meeting = self._meeting(around[vertex], curves, seams.get(vertex))
                points[row], off = self._met(meeting, points[row])
                if vertex in room and np.linalg.norm(points[row] - self.mesh.vertices[vertex]) > room[vertex]:
                    points[row] = self.mesh.vertices[vertex]
                elif off > POINT * self.h:
                    two = self._parted(around[vertex], curves, self.mesh.vertices[vertex])
                    if two is not None:
                        parted[vertex] = two
        return points, parted

    def _met(self, meeting: Meeting, near: FloatArray) -> tuple[FloatArray, float]:
        """Place (3,) near a point where curves and surfaces meet, and how far in mm it is from them."""
        key = (frozenset(map(id, meeting.curves)), frozenset(map(id, meeting.surfaces)), near.tobytes())
        if key not in self._places:
            place = meeting.place(near, _STILL * self.h)
            self._places[key] = place, meeting.off(place)
        return self._places[key]

    def _room(self) -> dict[int, float]:
        """How far in mm corners of triangles that are faces may move without turning them over."""
        corners = self.mesh.faces[self.labels >= self.first_facet]
        ends = np.roll(corners, -1, axis=1)
        lengths = np.linalg.norm(self.mesh.vertices[ends] - self.mesh.vertices[corners], axis=2)
        least = np.full(len(self.mesh.vertices), np.inf)
        np.minimum.at(least, corners, lengths)
        np.minimum.at(least, ends, lengths)
        return {int(vertex): _ROOM * float(least[vertex]) for vertex in np.unique(corners)}

    def _meeting(self, numbers: Sequence[int], curves: list[Followed], seam: int | None = None) -> Meeting:
        """Tell what chains follow."""
        found = {id(c): c for n in numbers if (c := self._along(curves[n])) is not None}
        labels = {label for n in numbers if curves[n] is None for label in self._beside(self.patches.chains[n])}
        beside = [self.original.edges[seam]] if seam is not None else []
        surfaces = [self.surface(label) for label in labels if label < self.first_facet]
        return Meeting([*found.values(), *beside], surfaces)

    def _along(self, followed: Followed) -> Curve | None:
        return self.original.edges[followed] if isinstance(followed, int) else followed

    def _parted(self, numbers: list[int], curves: list[Followed], near: FloatArray) -> Parted | None:
        """Two vertices instead of one at which four chains do not meet: the mesh lacks a short border there."""
        chains = [self.patches.chains[n] for n in numbers]
        if any(self._is_straight(chain) for chain in chains) or len(set(numbers)) < len(numbers):
            return None
        for first, second, patches in pairings([(chain.left, chain.right) for chain in chains]):
            both = []
            for group in (first, second):
                meeting = self._meeting([numbers[n] for n in group], curves)
                if len(meeting.curves) + len(meeting.surfaces) < 2:  # both follow the same curve
                    break
                both.append(meeting.place(near, _STILL * self.h))
                if meeting.off(both[-1]) > POINT * self.h or np.linalg.norm(both[-1] - near) > _APART * self.h:
                    break
            else:
                return Parted(np.array(both), {numbers[n] for n in second}, patches)
        return None

    def _add_parted(self, outline: Outline, two: Parted, start: int, end: int) -> None:
        """Add the border between both vertices of a parted one."""
        first, second = (int(self.patches.labels[patch]) for patch in two.patches)
        curve = self._blend_curve((first, second), np.insert(two.points, 1, two.points.mean(axis=0), axis=0))
        number = len(outline.borders)
        outline.borders.append(self._drawn((first, second), curve, start, end, np.zeros((0, 3)), outline.points))
        for face in outline.faces:
            if face.patch in two.patches:
                face.loops = [joined(outline.borders, loop, number) for loop in face.loops]

    # --- borders

    def _border(self, chain: Chain, curve: Followed, start: int, end: int, points: FloatArray) -> Border:
        """Border along a chain between two of the outline's points."""
        if self._is_straight(chain):
            line = self._lines.setdefault(points[[start, end]].tobytes(), straight(points[start], points[end]))
            return Border(start, end, line, np.array([0.0, 1.0]))
        return self._drawn(self._beside(chain), curve, start, end, self.mesh.vertices[chain.vertices[1:-1]], points)

    def _drawn(
        self, labels: tuple[int, int], curve: Followed, start: int, end: int, inner: FloatArray, points: FloatArray
    ) -> Border:
        """Border between two surfaces along a curve, near inner points (N, 3)."""
        path = np.concatenate([points[[start]], inner, points[[end]]])
        edge = curve if isinstance(curve, int) else -1
        key = (labels, id(self._along(curve)), start == end, path.tobytes())
        if key not in self._drawings:
            self._drawings[key] = self._traced(labels, curve, path, start == end)
        return Border(start, end, *self._drawings[key], edge)

    def _traced(
        self, labels: tuple[int, int], curve: Followed, path: FloatArray, closed: bool
    ) -> tuple[Place | None, FloatArray]:
        """Place and knots of a border between two surfaces along a curve, near a path (N, 3)."""
        if curve is None:
            first, second = (self.surface(label) for label in labels)
            return Crossing(first, second, self.h).border(path[0], path[1:-1], path[-1])
        along = self.original.edges[curve] if isinstance(curve, int) else curve
        ways = along.way(path)
        if along.period is not None:
            ways = np.unwrap(ways, period=along.period)
            if closed and abs(ways[-1] - ways[0]) < along.period / 2:
                turn = np.sign(np.median(np.diff(ways))) or 1.0
                ways[-1] = ways[0] + turn * along.period
        low, high = float(ways[0]), float(ways[-1])
        if not isinstance(curve, int):
            return along.at, _knots(along, low, high)
        if along.period is not None:  # from one end of its range to the other, or between
            own = self.original.edges[curve]
            shift = np.floor((min(low, high) - own.low + 1e-7 * along.period) / along.period) * along.period
            low, high = low - shift, high - shift
        return None, np.array([low, high])

    # --- topology

    def _collapse(self, outline: Outline) -> None:
        """Take out borders without length, and faces without area."""
        same = list(range(len(outline.points)))

        def root(vertex: int) -> int:
            while same[vertex] != vertex:
                vertex = same[vertex]
            return vertex

        gone = set()
        for number, chain in enumerate(self.patches.chains):
            if self._is_straight(chain):
                continue
            border = outline.borders[number]
            path = self.mesh.vertices[chain.vertices]
            length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
            ends = outline.points[border.end] - outline.points[border.start]
            if length < _TINY * self.h and float(np.linalg.norm(ends)) < POINT * self.h:
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


def _knots(curve: Curve, low: float, high: float) -> FloatArray:
    """Parameters from one to another at which a curve may bend, and others between."""
    knots = np.linspace(low, high, _KNOTS)
    turns = (0.0,) if curve.period is None else (-curve.period, 0.0, curve.period)
    bends = np.concatenate([curve.bends + turn for turn in turns])
    bends = bends[(bends > min(low, high)) & (bends < max(low, high))]
    if len(bends) == 0:
        return knots
    knots = np.unique(np.concatenate([knots, bends]))
    knots = knots[np.concatenate([[True], np.diff(knots) > 1e-6 * abs(high - low)])]
    knots[[0, -1]] = min(low, high), max(low, high)
    return np.asarray(knots if high > low else knots[::-1])
