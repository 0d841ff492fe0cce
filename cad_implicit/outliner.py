"""From a labelled mesh to its outline: what curve each border between two patches follows, and where these end.

Each border is part of an edge of the part, a curve at which a blend begins, or where two surfaces cross. Vertices lie
where such curves meet.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from .blend_curves import Curve
from .blend_labels import Faces, Outward
from .crossing_curves import POINT, Crossing, straight
from .implicit import FloatArray
from .mesh import Mesh
from .outlines import Border, Original, Outline, Outlined
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

#: Rounds towards where curves and surfaces meet, and the move in spacings that ends them.
_ROUNDS = 60
_STILL = 1e-9

#: Borders whose ends come to lie within POINT spacings of each other vanish, if they were no longer than so many:
_TINY = 8.0

#: Curves are drawn through so many points at least.
_KNOTS = 17

#: What a border follows: an edge of the part by number, a curve of a blend, None where surfaces cross.
Followed = Curve | int | None


class Outliner:
    """Finds the outline of a mesh whose triangles are labelled.

    Parameters
    ----------
    mesh : Mesh
    labels : (F,) int64
        Faces of the part from 0, surfaces of blends from ``count``; after those each triangle is a face of its own.
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
        Of the outline; only after that was found.
    """

    patches: Patches

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
        self.first_facet = count + len(self.surfaces)
        self.known = np.where(away < _SAME * spacing, nearest, -1)

    def outline(self) -> Outline:
        """Outline of the mesh."""
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
        points = self._junctions(ends, curves, seams, rings)
        result = Outline(
            points,
            self.known[ends],
            [self._border(chain, curve, index, points) for chain, curve in zip(chains, curves, strict=True)],
            [
                Outlined(int(label), patch, [list(loop) for loop in loops])
                for patch, (label, loops) in enumerate(zip(self.patches.labels, self.patches.loops, strict=True))
            ],
        )
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
        return self._edge_along(labels, some) if max(labels) < self.count else self._blend_curve(labels, some)

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
    ) -> FloatArray:
        """Places (J, 3) of vertices: ``ends`` of the mesh, some on seams or where rings are cut."""
        fixed = {vertex: place for ring in rings for vertex, place in ring.places(self.mesh).items()}
        around: dict[int, tuple[list[Curve], set[int]]] = {vertex: ([], set()) for vertex in ends}
        for chain, curve in zip(self.patches.chains, curves, strict=True):
            for vertex in {int(chain.vertices[0]), int(chain.vertices[-1])}:
                if curve is None:
                    around[vertex][1].update(label for label in self._beside(chain) if label < self.first_facet)
                else:
                    around[vertex][0].append(self.original.edges[curve] if isinstance(curve, int) else curve)
        for vertex, seam in seams.items():
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

    def _border(self, chain: Chain, curve: Followed, index: dict[int, int], points: FloatArray) -> Border:
        start, end = index[int(chain.vertices[0])], index[int(chain.vertices[-1])]
        inner = self.mesh.vertices[chain.vertices[1:-1]]
        if self._is_straight(chain):
            return Border(start, end, straight(points[start], points[end]), np.array([0.0, 1.0]))
        if curve is None:
            first, second = (self.surface(label) for label in self._beside(chain))
            return Border(start, end, *Crossing(first, second, self.h).border(points[start], inner, points[end]))
        edge = curve if isinstance(curve, int) else -1
        along = self.original.edges[edge] if isinstance(curve, int) else curve
        ways = along.way(np.concatenate([points[[start]], inner, points[[end]]]))
        if along.period is not None:
            ways = np.unwrap(ways, period=along.period)
            if start == end and abs(ways[-1] - ways[0]) < along.period / 2:
                turn = np.sign(np.median(np.diff(ways))) or 1.0
                ways[-1] = ways[0] + turn * along.period
        low, high = float(ways[0]), float(ways[-1])
        if edge < 0:
            return Border(start, end, along.at, _knots(along, low, high))
        if along.period is not None:  # from one end of its range to the other, or between
            own = self.original.edges[edge]
            shift = np.floor((min(low, high) - own.low + 1e-7 * along.period) / along.period) * along.period
            low, high = low - shift, high - shift
        return Border(start, end, None, np.array([low, high]), edge)

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
