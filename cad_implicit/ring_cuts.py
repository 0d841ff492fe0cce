"""Rings: blends that go around, cut in two so that each half is a face with one border."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .blend_labels import Outward
from .blend_surfaces import StripSurface
from .implicit import FloatArray
from .mesh import Mesh
from .outlines import Border, Outline, Outlined
from .patches import Numbers, Patches

#: Rings are cut at these shares of their way.
_CUTS = (0.21, 0.71)

Loop = list[tuple[int, bool]]


@dataclass(frozen=True, eq=False)
class Cut:
    """Where a ring is cut: the way along its spine in mm, and the vertices of the mesh on its borders.

    Both are the same where it has only one border.
    """

    way: float
    first: int
    last: int


@dataclass(frozen=True)
class Section:
    """Arc across a ring by its share from 0 to 1, from the first rim to the second or back."""

    surface: StripSurface
    way: float
    turned: bool

    def __call__(self, shares: FloatArray) -> FloatArray:
        shares = np.asarray(shares)
        return self.surface.place(np.full(len(shares), self.way), 1 - shares if self.turned else shares)


@dataclass(frozen=True, eq=False)
class Ring:
    """A patch that goes around, and the two cuts across it."""

    label: int
    surface: StripSurface
    cuts: tuple[Cut, Cut]

    @property
    def vertices(self) -> list[int]:
        """Vertices of the mesh at which it is cut."""
        return [vertex for cut in self.cuts for vertex in (cut.first, cut.last)]

    def places(self, mesh: Mesh) -> dict[int, FloatArray]:
        """Exact places (3,) of these vertices, on the rims."""
        found = {}
        for cut in self.cuts:
            for vertex in (cut.first, cut.last):
                place = mesh.vertices[vertex]
                found[vertex] = self.rims(cut.way)[int(self.is_second(cut.way, place))]
        return found

    def rims(self, way: float) -> FloatArray:
        """Points (2, 3) of both rims."""
        return self.surface.place(np.array([way, way]), np.array([0.0, 1.0]))

    def is_second(self, way: float, point: FloatArray) -> bool:
        """Whether a point (3,) is nearer to the second rim than to the first."""
        away = np.linalg.norm(self.rims(way) - point, axis=1)
        return bool(away[1] < away[0])

    def section(self, way: float, turned: bool) -> Section:
        """Arc across, from the first rim to the second or back."""
        return Section(self.surface, way, turned)


def find_rings(mesh: Mesh, patches: Patches, surfaces: Sequence[Outward], count: int) -> list[Ring]:
    """Patches that go around: those of ``surfaces``, whose labels start from ``count``."""
    found = []
    for label, loops in zip(patches.labels.tolist(), patches.loops, strict=True):
        if not count <= label < count + len(surfaces) or len(loops) not in (1, 2):
            continue
        surface = surfaces[label - count].surface
        if not isinstance(surface, StripSurface) or not surface.closed:
            continue
        none = np.zeros(0, np.int64)
        inner = [np.concatenate([none, *(patches.chains[n].vertices[1:-1] for n, _ in loop)]) for loop in loops]
        if min(map(len, inner)) < 2:
            continue
        first, second = (_cut(mesh, share * surface.length, inner, surface) for share in _CUTS)
        ring = Ring(label, surface, (first, second))
        if len(set(ring.vertices)) == 2 * len(loops):
            found.append(ring)
    return found


def _cut(mesh: Mesh, way: float, borders: list[Numbers], surface: StripSurface) -> Cut:
    """Cut a ring at a way: at the vertices nearest to its rims there."""
    both = []
    for vertices in borders:
        points = mesh.vertices[vertices]
        near = [np.linalg.norm(curve.at(np.array([way]))[0] - points, axis=1) for curve in surface.curves[:2]]
        side = int(np.argmin([n.min() for n in near]))
        both.append(int(vertices[int(near[side].argmin())]))
    return Cut(way, both[0], both[-1])


def cut_rings(outline: Outline, rings: Sequence[Ring], index: dict[int, int]) -> None:
    """Cut the rings of an outline, by the places of the mesh's vertices in its list of points."""
    for ring in rings:
        face = next((f for f in outline.faces if f.label == ring.label), None)
        if face is None:
            continue
        outline.faces.remove(face)
        loops = _halves(outline, face, ring, index) if len(face.loops) == 2 else _caps(outline, face, ring, index)
        outline.faces += [Outlined(face.label, face.patch, [loop]) for loop in loops]


def _halves(outline: Outline, face: Outlined, ring: Ring, index: dict[int, int]) -> list[Loop]:
    """Borders of both halves of a ring between two borders."""
    ends = [(index[cut.first], index[cut.last]) for cut in ring.cuts]
    first, second = face.loops
    if not any(outline.borders[n].start == ends[0][0] for n, _ in first):
        first, second = second, first
    arcs = []
    for cut, (a, b) in zip(ring.cuts, ends, strict=True):
        place = ring.section(cut.way, ring.is_second(cut.way, outline.points[a]))
        arcs.append(len(outline.borders))
        outline.borders.append(Border(a, b, place, np.linspace(0.0, 1.0, 9)))
    loops = []
    for i in (0, 1):
        there = _between(outline.borders, first, ends[i][0], ends[1 - i][0])
        back = _between(outline.borders, second, ends[1 - i][1], ends[i][1])
        loops.append([*there, (arcs[1 - i], True), *back, (arcs[i], False)])
    return loops


def _caps(outline: Outline, face: Outlined, ring: Ring, index: dict[int, int]) -> list[Loop]:
    """Borders of both halves of a cap, whose other rim is a point: it is cut through that."""
    ends = [index[cut.first] for cut in ring.cuts]
    turned = ring.is_second(ring.cuts[0].way, outline.points[ends[0]])
    there, back = (ring.section(cut.way, turned) for cut in ring.cuts)

    def place(shares: FloatArray) -> FloatArray:
        x = 2 * np.asarray(shares)
        return np.where((x < 1)[:, None], there(np.minimum(x, 1.0)), back(np.minimum(2 - x, 1.0)))

    number = len(outline.borders)
    outline.borders.append(Border(ends[0], ends[1], place, np.array([0.0, 0.5, 1.0])))
    return [
        [*_between(outline.borders, face.loops[0], ends[i], ends[1 - i]), (number, forward)]
        for i, forward in ((0, False), (1, True))
    ]


def _between(borders: list[Border], loop: Loop, start: int, end: int) -> Loop:
    """Part of a loop from one vertex to another."""
    at = next(i for i, (n, forward) in enumerate(loop) if (borders[n].start if forward else borders[n].end) == start)
    turned = loop[at:] + loop[:at]
    found = []
    for n, forward in turned:
        found.append((n, forward))
        if (borders[n].end if forward else borders[n].start) == end:
            break
    return found
