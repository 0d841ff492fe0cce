"""Rails that follow another blend: at a vertex whose three edges are blended, but not alike, one goes first.

The edge of the other convexity goes first, or, if all are alike, that with the largest radius; the two others then go
on smoothly around its blend, as the exact kernel does it: for balls of radius r around one of radius s, on a torus.

Not done: edges of different radii, or more than three, at a vertex; they end there as if alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from .cad.edges import Edge
from .faces import FaceDistance
from .guides import Guide, Support, extended, onto_line
from .implicit import FloatArray
from .joints import Vertex, clusters_beside, vertices
from .rails import End, Rail
from .spines import spine
from .strips import Strip

#: How far the blend that goes first is continued beyond the ends of its edge, in radii of both.
_EXTENT = 3.0

#: Places along half an edge at which it is looked for where a blend ends, and halvings to find it.
_LOOKS = 65
_HALVINGS = 40

#: Most points between two samples of a guide that say which face counts; they are a quarter of the radius apart.
_BETWEEN = 1000

#: Steps around it, in its radii, and the most of them.
_STEP = 0.1
_STEPS = 200

Which = Literal[0, 1]


class BlendedPair(FaceDistance):
    """Signed distance to two faces and the blend between them, as one surface."""

    kind = "pair"

    def __init__(self, strip: Strip, supports: Sequence[Support], sign: float) -> None:
        self.strip, self._supports, self._sign = strip, tuple(supports), sign

    @property
    def radius(self) -> float:
        """Of the blend, in mm."""
        return float(self.strip.spine.radius.max())

    def outside(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points (N, 3) are beside the faces, not beside the blend."""
        return np.asarray(self.strip.from_ball(points)[2].min(axis=1) < 0)

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Signed distances (N,) and gradients (N, 3)."""
        x = np.ascontiguousarray(points, np.float64)
        ball, slope, within = self.strip.from_ball(x)
        value, gradient = -ball, -slope
        first = within[:, 0] < within[:, 1]
        for side, support in enumerate(self._supports):
            which = np.flatnonzero((within.min(axis=1) < 0) & (first == (side == 0)))
            if len(which):
                value[which], gradient[which] = support(x[which])
        return self._sign * value, self._sign * gradient


class Piecewise(FaceDistance):
    """Faces one after the other along a guide; each counts near its own part of it."""

    kind = "piecewise"

    def __init__(
        self, points: FloatArray, labels: NDArray[np.int64], faces: Sequence[FaceDistance], step: float
    ) -> None:
        marks = labels
        # many points between the samples, not the samples: where a chain ends where it begins they are in both
        counts = np.ceil(np.linalg.norm(np.diff(points, axis=0), axis=1) / step).astype(np.int64).clip(1, _BETWEEN)
        piece = np.repeat(np.arange(len(counts)), counts)
        t = (np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[piece]
        self._tree = cKDTree(points[piece] + t[:, None] * (points[piece + 1] - points[piece]))
        self._labels, self._faces = marks[piece + (t > 0.5)], tuple(faces)

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Signed distances (N,) and gradients (N, 3)."""
        x = np.ascontiguousarray(points, np.float64)
        label = self._labels[self._tree.query(x)[1]]
        value, gradient = np.zeros(len(x)), np.zeros_like(x)
        for number, face in enumerate(self._faces):
            own = np.flatnonzero(label == number)
            if len(own):
                value[own], gradient[own] = face.value_and_gradient(x[own])
        return value, gradient


@dataclass(frozen=True, eq=False)
class _Turn:
    """Where one rail goes on as another around a blend: both with their ends there, and on which side the blend is."""

    first: Rail
    one: tuple[int, Which]
    other: tuple[int, Which]
    sides: dict[tuple[int, Which], Which]


def followed(rails: Sequence[Rail], edges: Sequence[Edge]) -> tuple[list[Rail], dict[int, list[Rail]]]:
    """Join rails that go on around another blend.

    Parameters
    ----------
    rails : sequence of Rail
        Of both kinds.
    edges : sequence of Edge
        All of the part's.

    Returns
    -------
    rails : list of Rail
        The joined ones, and the others as they were.
    after : dict of int to list of Rail
        By ``id`` of a rail that goes first, those that go around its blend.
    """
    index = {id(rail): number for number, rail in enumerate(rails)}
    turns = [turn for vertex in vertices(rails, edges).values() if (turn := _turn(vertex, index)) is not None]
    leading = {index[id(turn.first)] for turn in turns}
    turns = [turn for turn in turns if turn.one[0] not in leading and turn.other[0] not in leading]
    leading = {index[id(turn.first)] for turn in turns}
    links: dict[tuple[int, Which], tuple[tuple[int, Which], _Turn]] = {}
    for turn in turns:
        links[turn.one], links[turn.other] = (turn.other, turn), (turn.one, turn)
    pairs = {}
    for number in leading:
        later = max(_constant(rails[turn.one[0]]) for turn in turns if turn.first is rails[number])
        pairs[number] = blended_pair(rails[number], later)
    result = [rails[number] for number in sorted(leading)]
    after: dict[int, list[Rail]] = {}
    left = set(range(len(rails))) - leading
    while left:
        chain, closed = _walk(min(left), links)
        left -= {number for number, _ in chain}
        if len(chain) == 1 and not closed:
            result.append(rails[chain[0][0]])
        else:
            joined = _joined(rails, chain, closed, links, {id(rails[n]): pair for n, pair in pairs.items()})
            result.extend([rails[number] for number, _ in chain] if joined is None else [joined])
            firsts = {id(links[end][1].first) for n, _ in chain for end in _both(n) if end in links}
            for first in firsts if joined is not None else ():
                after.setdefault(first, []).append(joined)  # type: ignore[arg-type]
    return result, after


def _other(number: int, entry: int) -> tuple[int, Which]:
    return number, 0 if entry == 1 else 1


def _both(number: int) -> tuple[tuple[int, Which], tuple[int, Which]]:
    return (number, 0), (number, 1)


def _constant(rail: Rail) -> float:
    radius = rail.constant
    return 0.0 if radius is None else radius


def _turn(vertex: Vertex, index: dict[int, int]) -> _Turn | None:
    """Tell what goes first at a vertex, and what follows; None if nothing does."""
    if len(vertex.ends) != 3 or len(vertex.sharp) != 3:
        return None
    radii = [rail.constant for rail, _ in vertex.ends]
    signs = [rail.sign for rail, _ in vertex.ends]
    if None in radii:
        return None
    if abs(sum(signs)) == 1:
        lead = next(i for i, sign in enumerate(signs) if sign != np.sign(sum(signs)))
    else:
        lead = int(np.argmax(radii))  # type: ignore[arg-type]
    one, other = (i for i in range(3) if i != lead)
    if radii[one] != radii[other] or (abs(sum(signs)) == 3 and not radii[lead] > radii[one]):  # type: ignore[operator]
        return None
    between = set(clusters_beside(vertex, *vertex.ends[lead]))
    sides: dict[tuple[int, Which], Which] = {}
    for i in (one, other):
        own = [side for side, cluster in enumerate(clusters_beside(vertex, *vertex.ends[i])) if cluster in between]
        if len(own) != 1:
            return None
        sides[index[id(vertex.ends[i][0])], vertex.ends[i][1]] = 0 if own[0] == 0 else 1
    a, b = ((index[id(vertex.ends[i][0])], vertex.ends[i][1]) for i in (one, other))
    return None if len(sides) != 2 else _Turn(vertex.ends[lead][0], a, b, sides)


def blended_pair(first: Rail, radius: float) -> BlendedPair:
    """Blend of a rail that goes first, with its faces, for balls of a radius that follow it."""
    by = _EXTENT * (_constant(first) + radius)
    guide = first.guide if first.guide.closed else extended(
        first.guide, first.supports, by, by, 0.25 * _constant(first))  # fmt: skip
    found = spine(guide, first.supports, first.law, guide.at)
    core = np.flatnonzero(found.solved)
    return BlendedPair(Strip(found.part(core), first.supports, 0.0), first.supports, first.sign)


_Chain = list[tuple[int, Which]]


def _walk(start: int, links: dict[tuple[int, Which], tuple[tuple[int, Which], _Turn]]) -> tuple[_Chain, bool]:
    """Rails of one chain in order, each with the end at which it is entered; whether the chain is closed."""
    number, entry = start, 0
    while (number, entry) in links:  # back to the beginning
        (number, arrived), _ = links[number, entry]  # type: ignore[index]
        entry = 1 - arrived
        if number == start:
            break
    chain: _Chain = []
    begin = number
    while True:
        chain.append((number, entry))  # type: ignore[arg-type]
        onward = links.get(_other(number, entry))
        if onward is None:
            return chain, False
        if onward[0][0] == begin:
            return chain, True
        number, entry = onward[0]


def _joined(
    rails: Sequence[Rail],
    chain: _Chain,
    closed: bool,
    links: dict[tuple[int, Which], tuple[tuple[int, Which], _Turn]],
    pairs: dict[int, BlendedPair],
) -> Rail | None:
    """One rail for a chain, going around the blends between; None if it cannot be made."""
    count = len(chain)
    turned = [_turned(rails[number]) if entry == 1 else rails[number] for number, entry in chain]
    arcs: list[BlendedPair | None] = []
    for number, entry in chain:
        link = links.get(_other(number, entry))
        arcs.append(None if link is None else pairs[id(link[1].first)])
    if not closed:
        arcs[-1] = None
    before = [arcs[i - 1] if i or closed else None for i in range(count)]
    number, entry = chain[0]
    end: tuple[int, Which] = (number, 0 if entry == 1 else 1)
    around = links[end][1].sides[end]
    if entry == 1:
        around = 0 if around == 1 else 1
    guides = [_between(rail.guide, before[i], arcs[i]) for i, rail in enumerate(turned)]
    points, tangents, labels = [], [], []
    faces: list[list[FaceDistance]] = [[], []]

    def add(place: FloatArray, along: FloatArray, rail: Rail, pair: BlendedPair | None) -> None:
        points.append(place)
        tangents.append(along)
        labels.append(np.full(len(place), len(faces[0])))
        faces[around].append(rail.supports[around].face if pair is None else pair)
        faces[1 - around].append(rail.supports[1 - around].face)

    for i, rail in enumerate(turned):
        place, along = guides[i]
        half = len(place) // 2
        add(place[:half], along[:half], rail, before[i])
        add(place[half:], along[half:], rail, arcs[i])
        pair = arcs[i]
        if pair is not None:
            arc = _arc(place[-1], along[-1], guides[(i + 1) % count][0][0], rail, around, pair)
            if arc is None:
                return None
            add(*arc, rail, pair)
    line, along = np.concatenate(points), np.concatenate(tangents)
    marks = np.concatenate(labels)
    if closed:
        line, along = np.concatenate([line, line[:1]]), np.concatenate([along, along[:1]])
        marks = np.concatenate([marks, marks[:1]])
    supports = [Support(Piecewise(line, marks, own, 0.25 * _constant(turned[0])), turned[0].sign) for own in faces]
    return Rail(
        [choice for rail in turned for choice in rail.choices], turned[0].sign, Guide.along(line, along, closed),
        (supports[0], supports[1]), (turned[0].ends[0], turned[-1].ends[1]), follows=True,
    )  # fmt: skip


def _between(guide: Guide, before: BlendedPair | None, after: BlendedPair | None) -> tuple[FloatArray, FloatArray]:
    """Points and directions (N, 3) of a guide from where one blend ends to where another begins."""
    limits = [0.0, guide.length]
    for end, pair in enumerate((before, after)):
        if pair is None:
            continue
        at = np.linspace(limits[end], guide.length / 2, _LOOKS)
        clear = pair.outside(guide.place(at)[0])
        if clear[0]:
            continue
        if not clear.any():  # blends that meet in its middle leave nothing of it
            limits[end] = guide.length / 2
            continue
        low, high = at[int(np.argmax(clear)) - 1], at[int(np.argmax(clear))]
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            if pair.outside(guide.place(np.array([middle]))[0])[0]:
                high = middle
            else:
                low = middle
        limits[end] = high
    inner = guide.at[(guide.at > limits[0]) & (guide.at < limits[1])]
    return guide.place(np.unique(np.concatenate([[limits[0]], inner, [np.mean(limits)], [limits[1]]])))


def _arc(
    point: FloatArray, ahead: FloatArray, goal: FloatArray, rail: Rail, around: Which, pair: BlendedPair
) -> tuple[FloatArray, FloatArray] | None:
    """Points and directions (N, 3) of the line where a face meets a blend, between two points of it; None if lost."""
    supports = [Support(pair, rail.sign), Support(rail.supports[1 - around].face, rail.sign)]
    step = _STEP * pair.radius
    points: list[FloatArray] = []
    directions: list[FloatArray] = []
    for _ in range(_STEPS):
        found, turned = onto_line(point + step * ahead, ahead, supports, 4 * step)
        if found is None or turned is None:
            return None
        if float((goal - found) @ turned) < 0.2 * step and float(np.linalg.norm(goal - found)) < 2 * step:
            return np.array(points).reshape(-1, 3), np.array(directions).reshape(-1, 3)
        points.append(found)
        directions.append(turned)
        point, ahead = found, turned
    return None


def _turned(rail: Rail) -> Rail:
    """Give the same rail in the other direction."""
    guide = rail.guide
    back = Guide(guide.length - guide.at[::-1], guide.points[::-1], -guide.tangents[::-1], guide.length, guide.closed)
    ends = (
        End(rail.ends[1].vertex, rail.ends[1].sides[::-1], rail.ends[1].smooth),
        End(rail.ends[0].vertex, rail.ends[0].sides[::-1], rail.ends[0].smooth),
    )
    return replace(rail, guide=back, supports=rail.supports[::-1], ends=ends)
