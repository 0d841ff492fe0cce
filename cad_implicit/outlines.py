"""Outlines: the borders of the faces of a result as exact curves, and the vertices where these meet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from .blend_curves import Curve
from .implicit import FloatArray
from .patches import Numbers

#: Points along curves by which they are drawn.
Place = Callable[[FloatArray], FloatArray]


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
    place: Place | None
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

    def start(self, piece: tuple[int, bool]) -> int:
        """Vertex from which a border runs, forward or not."""
        border = self.borders[piece[0]]
        return border.start if piece[1] else border.end

    def end(self, piece: tuple[int, bool]) -> int:
        """Vertex to which a border runs, forward or not."""
        return self.start((piece[0], not piece[1]))

    def wires(self, face: Outlined) -> list[list[tuple[int, bool]]]:
        """Give the closed borders of a face, joined by seams where there are any."""
        if not face.seams:
            return face.loops
        left = [one for loop in face.loops for one in loop]
        left += [(n, ahead) for n in face.seams for ahead in (True, False)]
        seams = set(face.seams)
        wires = []
        while left:
            wire = [left.pop(0)]
            start = self.start(wire[0])
            while self.end(wire[-1]) != start or any(
                self.start(p) == start and (p[0] in seams) != (wire[-1][0] in seams) for p in left
            ):
                here = self.end(wire[-1])
                options = [p for p in left if self.start(p) == here]
                if not options:
                    break
                options.sort(key=lambda p: ((p[0] in seams) == (wire[-1][0] in seams), p[0] == wire[-1][0]))
                wire.append(options[0])
                left.remove(options[0])
            wires.append(wire)
        return wires


def joined(borders: list[Border], loop: list[tuple[int, bool]], number: int) -> list[tuple[int, bool]]:
    """Loop with a border put in where it has a gap that this fills."""
    result = []
    for (n, forward), (m, ahead) in zip(loop, loop[1:] + loop[:1], strict=True):
        result.append((n, forward))
        gap = (borders[n].end if forward else borders[n].start, borders[m].start if ahead else borders[m].end)
        for way in (True, False):
            ends = (borders[number].start, borders[number].end)
            if gap[0] != gap[1] and gap == (ends if way else ends[::-1]):
                result.append((number, way))
    return result
