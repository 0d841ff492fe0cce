"""Rails: chains of edges along which one ball rolls, and what happens where they end.

A rail ends at a corner, where all edges of a vertex are blended alike; at the faces that its edge runs into; or, where
the edge goes on smoothly without being chosen, in its normal plane.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .cad.edges import TANGENT_DEGREES, Edge
from .face_groups import PartFaces
from .faces import FaceDistance
from .guides import Guide, Support
from .implicit import FloatArray
from .spines import Law

#: A radius in mm, two for the ends of an edge, or a function of the fraction of its length.
Radius = float | tuple[float, float] | Callable[[float], float]

#: Step of the derivative of a radius that is given as a function, as a fraction of the length.
_LAW_STEP = 1e-5


@dataclass(frozen=True, eq=False)
class Choice:
    """One chosen edge, or a piece of one, with what it is to get.

    Attributes
    ----------
    edge : Edge
        "convex" or "concave".
    radius : Radius
        For chamfers: the length on the face on the left.
    second : float or None
        For chamfers: the length on the right.
    """

    edge: Edge
    radius: Radius
    second: float | None = None

    def like(self, other: Choice) -> bool:
        """Whether one ball can roll along both."""
        return (
            self.edge.convexity == other.edge.convexity and self.radius == other.radius and self.second == other.second
        )


@dataclass(eq=False)
class End:
    """One end of a rail.

    Attributes
    ----------
    vertex : int
        Number of the vertex, 0 if the part has none there.
    sides : tuple of int
        Numbers of the faces of the last edge there, as the rail runs.
    smooth : bool
        Whether the edge goes on smoothly beyond it.
    """

    vertex: int
    sides: tuple[int, int]
    smooth: bool = False


@dataclass(frozen=True, eq=False)
class Rail:
    """A chain of edges along which one ball rolls.

    Attributes
    ----------
    choices : list of Choice
        In order.
    sign : float
        1 for convex edges, -1 for concave ones.
    guide : Guide
        Along the edges.
    supports : two Supports
        The faces on the left and on the right with their tangent neighbours.
    ends : two Ends
        Of no use if it is closed.
    follows : bool
        Whether it goes around another blend.
    """

    choices: list[Choice]
    sign: float
    guide: Guide
    supports: tuple[Support, Support]
    ends: tuple[End, End]
    follows: bool = False

    @property
    def law(self) -> Law:
        """Radius along the guide."""
        return law(self.choices[0].radius, self.guide.length)

    @property
    def numbers(self) -> list[int]:
        """Numbers of its edges."""
        return sorted({choice.edge.number for choice in self.choices})

    @property
    def lengths(self) -> tuple[float, float] | None:
        """Lengths of a chamfer on the left and on the right, if this is one."""
        first, second = self.choices[0].radius, self.choices[0].second
        return None if second is None or not isinstance(first, int | float) else (float(first), second)

    @property
    def constant(self) -> float | None:
        """Radius, if it is the same everywhere and this is no chamfer."""
        radius = self.choices[0].radius
        return None if self.choices[0].second is not None or not isinstance(radius, int | float) else float(radius)


def law(radius: Radius, length: float) -> Law:
    """Radius and its derivative as a function of the position along a guide; constant beyond its ends."""

    def value(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        if isinstance(radius, int | float):
            return np.full(len(at), float(radius)), np.zeros(len(at))
        if isinstance(radius, tuple):
            start, end = radius
            inside = (at >= 0) & (at <= length)
            fraction = np.clip(at / length, 0.0, 1.0)
            return start + fraction * (end - start), np.where(inside, (end - start) / length, 0.0)
        fractions = np.clip(at / length, 0.0, 1.0)
        low, high = np.maximum(fractions - _LAW_STEP, 0.0), np.minimum(fractions + _LAW_STEP, 1.0)
        here, before, after = (np.array([float(radius(f)) for f in fs.tolist()]) for fs in (fractions, low, high))
        slope = (after - before) / ((high - low) * length)
        return here, np.where((at >= 0) & (at <= length), slope, 0.0)

    return value


def rails(choices: Sequence[Choice], faces: PartFaces) -> list[Rail]:
    """Join chosen edges that go on smoothly and are blended alike.

    Parameters
    ----------
    choices : sequence of Choice
    faces : PartFaces
        Of the part.
    """
    following = _links(choices)
    left: set[int] = set(range(len(choices)))
    result = []
    while left:
        chain = _walk(min(left), following)
        left -= {index for index, _ in chain}
        result.append(_rail([(choices[index], turned) for index, turned in chain], following, chain, faces))
    return result


_Links = dict[tuple[int, int], tuple[int, int]]


def _links(choices: Sequence[Choice]) -> _Links:
    """Which end (choice, 0 or 1) goes on smoothly at which other end."""
    at_vertex: dict[int, list[tuple[int, int]]] = {}
    for index, choice in enumerate(choices):
        for end in (0, 1):
            if choice.edge.ends[end]:
                at_vertex.setdefault(choice.edge.ends[end], []).append((index, end))
    links: _Links = {}
    limit = -math.cos(math.radians(max(TANGENT_DEGREES, 1.0)))
    for ends in at_vertex.values():
        straight = sorted(
            (float(_away(choices[a], i) @ _away(choices[b], j)), (a, i), (b, j))
            for n, (a, i) in enumerate(ends)
            for b, j in ends[:n]
            if choices[a].like(choices[b]) and choices[a].edge.chain == choices[b].edge.chain
        )
        for cosine, one, other in straight:
            if cosine < limit and one not in links and other not in links:
                links[one], links[other] = other, one
    return links


def _away(choice: Choice, end: int) -> FloatArray:
    """Direction (3,) from an end of an edge into it."""
    return np.asarray(choice.edge.tangents[0] if end == 0 else -choice.edge.tangents[-1])


def _walk(start: int, links: _Links) -> list[tuple[int, bool]]:
    """Choices of one rail in order, and whether each is turned around."""
    index, end = start, 0
    while (index, end) in links:  # back to the beginning
        index, arrived = links[index, end]
        end = 1 - arrived
        if index == start:
            break
    chain, first, entry = [], index, end
    while True:
        chain.append((index, entry == 1))
        onward = links.get((index, 1 - entry))
        if onward is None or onward[0] == first:
            return chain
        index, entry = onward


def _rail(parts: list[tuple[Choice, bool]], links: _Links, chain: list[tuple[int, bool]], faces: PartFaces) -> Rail:
    points, tangents, sides = [], [], []
    for choice, turned in parts:
        edge = choice.edge
        points.append(edge.points[::-1] if turned else edge.points)
        tangents.append(-edge.tangents[::-1] if turned else edge.tangents)
        sides.append((edge.faces[1], edge.faces[0]) if turned else (edge.faces[0], edge.faces[1]))
    first, last = parts[0], parts[-1]
    turned = min(parts, key=lambda part: part[0].edge.number)[1]
    joined = (chain[0][0], int(chain[0][1])) in links
    closed = first[0].edge.closed if len(parts) == 1 else joined
    kept = [slice(0 if n == 0 else 1, None) for n in range(len(parts))]
    guide = Guide.along(
        np.concatenate([p[k] for p, k in zip(points, kept, strict=True)]),
        np.concatenate([t[k] for t, k in zip(tangents, kept, strict=True)]),
        closed,
    )
    sign = 1.0 if first[0].edge.convexity == "convex" else -1.0
    beside = sides_of([s[0] for s in sides], [s[1] for s in sides], first[0].edge, faces)
    ends = (
        End(first[0].edge.ends[1 if first[1] else 0], sides[0]),
        End(last[0].edge.ends[0 if last[1] else 1], sides[-1]),
    )
    supports = (Support(beside[0], sign), Support(beside[1], sign))
    return Rail([_facing(choice, turned) for choice, _ in parts], sign, guide, supports, ends)


def _facing(choice: Choice, turned: bool) -> Choice:
    """Give a choice as a rail runs that may be turned around: the edge with the lowest number says what is meant."""
    radius, second = choice.radius, choice.second
    if not turned:
        return choice
    if second is not None and isinstance(radius, int | float):
        return Choice(choice.edge, second, float(radius))
    if isinstance(radius, tuple):
        return Choice(choice.edge, (radius[1], radius[0]), second)
    if isinstance(radius, int | float):
        return choice
    function = radius
    return Choice(choice.edge, lambda fraction: function(1 - fraction), second)


def sides_of(
    left: Iterable[int], right: Iterable[int], edge: Edge, faces: PartFaces
) -> tuple[FaceDistance, FaceDistance]:
    """Faces on the left and on the right of a chain of edges, each side with its tangent neighbours as one."""
    one, other = set(left), set(right)
    if one & other:
        return faces.beside(edge)
    return faces.joined(one, other)
