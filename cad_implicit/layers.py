"""The strip of one rail: how far it goes, where it is cut, how far it sticks out of the part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .cad.edges import Edge
from .chamfers import legs
from .cliffs import cliff
from .errors import RadiusError
from .face_groups import FaceGroup, PartFaces
from .guides import Guide, Support, extended
from .implicit import FloatArray, Implicit
from .joints import Around, Ball, Vertex, around
from .rails import Rail
from .spines import Law, Spine, spine
from .strips import Cut, Strip

#: How far strips go beyond the ends of their edges at most, in radii.
_EXTENT = 6.0

#: Steps there, in radii.
_STEP = 0.25

#: How far strips go on beyond the faces at which they end where others end too, in widths.
_MITRE = 2.5

#: Strips that begin this share of the radius behind their end have no length.
_NOTHING = 1e-6

#: Corners are looked for within this share of an edge from its end.
_HALF = 0.7

#: A ball that moves by less than this share of the way along the edge stands still; then it is made smaller by:
_STILL = 1e-5
_LESS = 1e-4

#: So it is where it rolls along the border of a face, within this share of its distance from the edge: a strip whose
#: side lies in the face beyond the border cannot be told from it. (A wall as high as the radius: 17 crossings.)
_FLUSH = 2e-5

#: Regions have at least this margin, in radii; and they may come out behind walls by this share of it: that is
#: more than tessellation, which is a thousandth of it, and nothing beside the error allowed.
_LEAST = 0.05
_CLEAR = 0.005

#: A strip may end without a cut where it is narrower than this, in radii; halvings to come near to where it vanishes.
_VANISHING = 0.1
_CLOSER = 14

#: A strip that has come back towards the face at which it ends by this share of the radius stops: what two that go
#: around a post in a corner have in common there.
_BACK = 0.01

#: What is left of it before the face may be narrow: then its margin, and with it the cells, are that many times as wide
#: at most. (A post in a corner, 0.15 spacings: without, or with 6, contours were up to 0.08 off.)
_NARROW = 4.0

#: Borders are looked for at places so far apart along an edge, in radii, and at so many at most.
_LOOK = 0.25
_MOST = 1000
#: Cosine of the turn between two samples of what is straight.
_STRAIGHT = 1 - 1e-12

#: Cuts matter up to where all of a strip is before the face by this share of the radius.
_CLEARLY = 0.05

#: Borders of strips along acute edges are shifted along the edge's bisector by the margin over half of this at most.
_BLUNT = 0.2

Which = Literal[0, 1]
ENDS: tuple[Which, Which] = (0, 1)


@dataclass(frozen=True, eq=False)
class Ending:
    """One end of a strip.

    Attributes
    ----------
    cuts : dict of int to Cut
        By the cluster of faces, around the vertex, that the edge runs into.
    around : Around or None
        The faces there, if it ends at faces.
    """

    cuts: dict[int, Cut]
    around: Around | None = None


@dataclass(frozen=True, eq=False)
class Laying:
    """A rail with its strip and the ends of that."""

    rail: Rail
    strip: Strip
    endings: tuple[Ending, Ending]


class Layer:
    """Lays the strip of one rail."""

    def __init__(
        self,
        rail: Rail,
        faces: PartFaces,
        edges: Sequence[Edge],
        at: dict[int, Vertex],
        margin: float,
        part: Implicit | None,
        strict: bool,
    ) -> None:
        self.rail, self.faces, self.edges, self.margin, self.part = rail, faces, edges, margin, part
        self.strict = strict
        self.supports, self.law = rail.supports, rail.law
        self.at = [None if rail.guide.closed else at.get(end.vertex) for end in rail.ends]
        self.radius = max(rail.lengths or rail.law(np.linspace(0, rail.guide.length, 33))[0].tolist())

    def lay(self) -> Laying | None:
        """Strip and its ends; None if nothing is left of it between two corners."""
        rail, guide = self.rail, self.rail.guide
        if guide.closed:
            found = self._opened(self._spine(guide, guide.at))
            self._check(found)
            return Laying(rail, self._strip(found, (False, False), []), (Ending({}), Ending({})))
        balls = [self._ball(which) for which in ENDS]
        free = [balls[e] is None and not rail.ends[e].smooth and self.at[e] is not None for e in ENDS]
        room = [_EXTENT * self.radius if free[e] or balls[e] is not None else 0.0 for e in ENDS]
        guide = extended(guide, rail.supports, room[0], room[1], _STEP * self.radius)
        limits = [0.0, rail.guide.length]
        for e in ENDS:
            if (ball := balls[e]) is not None:
                limits[e] = self._position(guide, ball, e)
        if all(ball is not None for ball in balls):
            short = limits[0] - limits[1]
            if short > _NOTHING * self.radius:
                raise self._error(f"a ball of radius {self.radius:g} mm does not fit between its ends")
            if short > -_NOTHING * self.radius:
                return None
        rough = self._spine(guide, guide.at) if any(free) else None
        endings = [Ending({}), Ending({})]
        for e in ENDS:
            if free[e] and rough is not None:
                limits[e], endings[e] = self._free(e, rough)
        inner = guide.at[(guide.at > limits[0]) & (guide.at < limits[1])]
        found = self._spine(guide, np.unique(np.concatenate([[limits[0]], inner, [limits[1]]])))
        self._check(found)
        for e in ENDS:
            if (ball := balls[e]) is not None:
                found.centres[-e] = ball.centre
        cuts = [cut for ending in endings for cut in ending.cuts.values()]
        strip = self._strip(found, (balls[0] is not None, balls[1] is not None), cuts)
        first, second = (self._placed(ending, strip) for ending in endings)
        return Laying(rail, strip, (first, second))

    @staticmethod
    def _placed(ending: Ending, strip: Strip) -> Ending:
        """Give an ending whose cuts begin at ways along a spine, not at positions along a guide."""
        cuts = {
            cluster: replace(cut, way=float(strip.way(cut.way)), margin=min(cut.margin, strip.margin))
            for cluster, cut in ending.cuts.items()
        }
        return Ending(cuts, ending.around)

    def _ball(self, which: Which) -> Ball | None:
        """Ball of the corner at which one end stops, if there is one."""
        vertex = self.at[which]
        if vertex is None or not vertex.corners:
            return None
        left, right = self.rail.ends[which].sides
        own = {vertex.cluster(left), vertex.cluster(right)}
        fitting = [ball for ball in vertex.corners if own <= set(ball.clusters)]
        guide, radius = self.rail.guide, self.radius
        far = extended(guide, self.rail.supports, _EXTENT * radius, _EXTENT * radius, _STEP * radius)
        places = [self._position(far, ball, which) for ball in fitting]
        return fitting[int(np.argmax(places) if which == 0 else np.argmin(places))]

    def _position(self, guide: Guide, ball: Ball, which: Which) -> float:
        """Position along a guide of a ball at one end of it."""
        length = self.rail.guide.length
        within = (-np.inf, _HALF * length) if which == 0 else ((1 - _HALF) * length, np.inf)
        return float(guide.position(ball.centre[None], *within)[0])

    def _spine(self, guide: Guide, at: FloatArray) -> Spine:
        """Spine of the rail; of a ball a little smaller, if it stands still somewhere, as in a hole of its radius."""
        lengths = self.rail.lengths
        if lengths is not None:
            return legs(guide, self.rail.supports, lengths, at)
        found = spine(guide, self.supports, self.law, at)
        if self.supports is self.rail.supports and self._falls(found):
            if self.strict:
                raise self._error(f"{self._what()} consumes a face")
            found = spine(guide, self.supports, self.law, self._denser(at))
        way, along = np.linalg.norm(np.diff(found.centres, axis=0), axis=1), np.diff(found.at)
        if self.rail.constant is None or (bool((way > _STILL * along).all()) and bool(found.solved.all())):
            return found
        less = spine(guide, self.supports, _scaled(self.law, 1 - _LESS), at)
        return less if bool(less.solved.all()) else found

    def _opened(self, found: Spine) -> Spine:
        """Leave out the one gap of a closed spine where the strip has no width, as where its edge touches a wall."""
        guide = self.rail.guide
        for _ in range(_CLOSER):
            edges = np.flatnonzero(found.solved[1:] != found.solved[:-1])
            if len(edges) == 0 or len(edges) > 2:
                break
            between = (found.at[edges] + found.at[edges + 1]) / 2
            found = spine(guide, self.supports, self.law, np.unique(np.concatenate([found.at, between])))
        if found.solved.all() or not found.solved.any() or self.rail.lengths is not None:
            return found
        last = int(np.flatnonzero(~found.solved)[-1]) + 1
        order = [*range(last, len(found.at) - 1), *range(last)] if found.solved[-1] else list(range(len(found.at)))
        kept = np.array([index for index in order if found.solved[index]])
        whole = bool((np.diff(kept) == 1).sum() >= len(kept) - 2)
        width = np.linalg.norm(np.diff(found.touching(), axis=1)[kept[[0, -1]], 0], axis=1).max()
        if not whole or width > _VANISHING * self.radius:
            return found
        ways = np.where(kept < kept[0], found.at[kept] + guide.length, found.at[kept])
        return replace(found.part(kept), at=ways, closed=False)

    def _falls(self, found: Spine) -> bool:
        """Whether the ball leaves a face over a border along the edge; then that is where the face ends from now on.

        Where it rolls along a border just so, it is made a little smaller.
        """
        rail, law = self.rail, self.law
        ends = {end.vertex for end in rail.ends if end.vertex and not rail.guide.closed}
        barred = {edge.number for edge in self.edges if ends & set(edge.ends)} | set(rail.numbers)
        inside = found.solved & (found.at >= 0) & (found.at <= rail.guide.length)
        supports = list(rail.supports)
        for side, support in enumerate(rail.supports):
            if not isinstance(support.face, FaceGroup) or not inside.any():
                continue
            end = cliff(support.face, support.face.members, rail.guide, self.edges, barred, self.radius)
            if end is None:
                continue
            feet, edge = self._between(found, inside, found.touching()[:, side], found.edge)
            border, beyond = end.border(feet)
            flush = np.linalg.norm(feet - border, axis=1) < _FLUSH * np.linalg.norm(feet - edge, axis=1)
            if bool((flush[1:] & flush[:-1]).any()):
                self.law = _scaled(rail.law, 1 - _LESS)
            elif bool(beyond.any()):
                supports[side] = Support(end, support.sign)
        self.supports = (supports[0], supports[1])
        changed = any(one is not other for one, other in zip(supports, rail.supports, strict=True))
        return changed or self.law is not law

    def _denser(self, at: FloatArray) -> FloatArray:
        """Positions (N,) with others between: where a face ends is seen only where one looks."""
        count = int(np.clip(np.ceil((at[-1] - at[0]) / (_LOOK * self.radius)), 1, _MOST))
        return np.unique(np.concatenate([at, np.linspace(at[0], at[-1], count + 1)]))

    def _between(self, found: Spine, which: NDArray[np.bool_], *lines: FloatArray) -> list[FloatArray]:
        """Give some of the samples of lines (N, 3) along a spine, and points between where it is straight."""
        at, along = found.at[which], found.tangents[which]
        dense = self._denser(at)
        piece = np.clip(np.searchsorted(at, dense, side="right") - 1, 0, max(len(at) - 2, 0))
        straight = (along[piece] * along[np.minimum(piece + 1, len(at) - 1)]).sum(axis=1) > _STRAIGHT
        dense = dense[straight | np.isin(dense, at)]
        return [np.stack([np.interp(dense, at, line[which][:, k]) for k in range(3)], axis=1) for line in lines]

    def _strip(self, found: Spine, corners: tuple[bool, bool], cuts: Sequence[Cut]) -> Strip:
        """Strip whose margin is less where there is more of the part behind a thin wall or gap."""
        strip = Strip(found, self.rail.supports, self.margin, corners)
        while self.part is not None and not self.rail.follows and strip.margin > _LEAST * self.radius:
            skin = np.concatenate(self._between(found, np.ones(len(found.at), np.bool_), *strip.skin()))
            for cut in cuts:
                skin = skin[cut.side * cut.support(skin)[0] > 0]
            if len(skin) == 0 or float((self.rail.sign * self.part(skin)).max()) < _CLEAR * self.margin:
                break
            strip = Strip(found, self.rail.supports, strip.margin / 2, corners)
        self.margin = strip.margin
        return strip

    def _free(self, which: Which, rough: Spine) -> tuple[float, Ending]:
        """Position at which a strip that ends at faces may stop, and that end; the ways of its cuts are positions."""
        vertex = self.at[which]
        assert vertex is not None
        faces = around(vertex, self.rail, which, self.faces, self.radius)
        at = rough.at
        outward = np.flatnonzero(at <= 0.0)[::-1] if which == 0 else np.flatnonzero(at >= self.rail.guide.length)
        inward = np.flatnonzero(at >= 0.0) if which == 0 else np.flatnonzero(at <= self.rail.guide.length)[::-1]
        bad = outward[~rough.solved[outward]]
        if len(bad):
            outward = outward[: int(np.flatnonzero(outward == bad[0])[0])]
        if len(outward) == 0:
            raise self._error(f"{self._what()} does not reach both faces at its end")
        if not faces.cuts:
            return (0.0 if which == 0 else self.rail.guide.length), Ending({}, faces)
        held = np.concatenate([rough.touching(), rough.edge[:, None]], axis=1)
        stop = len(outward) - 1
        skin = held + self.margin * _out(rough.contacts)
        # mitres need the strips beyond the faces at which they are cut
        size = np.linalg.norm(held[inward[0], :2] - held[inward[0], 2:], axis=1).max()
        further = _MITRE * float(size) if len(vertex.ends) > 1 else 0.0
        past = np.abs(at[outward] - at[outward[0]])
        cuts = {}
        for cluster, (support, side) in faces.cuts.items():
            inside = side * support(held.reshape(-1, 3))[0].reshape(-1, 3)
            margin = self.margin if side > 0 else 0.0
            beyond = np.flatnonzero((inside[outward] < -margin).all(axis=1))
            if len(beyond):
                stop = min(stop, int(np.searchsorted(past, past[beyond[0]] + further)))
            else:
                stop = min(stop, self._back(inside[outward]))
                narrow = float(inside[outward].max(axis=1).min())
                self.margin = min(self.margin, max(_NARROW * narrow, _LEAST * self.radius))
            outer = side * support(skin.reshape(-1, 3))[0].reshape(-1, 3)
            clear = np.minimum(inside, outer)[inward] > _CLEARLY * self.radius
            before = np.flatnonzero(clear.all(axis=1))
            zone = inward[int(before[0])] if len(before) else inward[-1]
            cuts[cluster] = Cut(support, side, which, float(at[zone]), margin)
        return float(at[outward[stop]]), Ending(cuts, faces)

    def _back(self, inside: FloatArray) -> int:
        """Where a strip comes back that has never been beyond a face; what is there belongs to other edges.

        Parameters
        ----------
        inside : (N, 3) float64
            How far before the face, on the way from the end, it touches both faces, and the edge goes on.
        """
        most = inside.max(axis=1)
        back = (inside[:, 2] < 0) & (most > np.minimum.accumulate(most) + _BACK * self.radius)
        return int(np.argmax(back)) if back.any() else len(inside) - 1

    def _check(self, found: Spine) -> None:
        if not found.solved.all():
            x, y, z = found.edge[int(np.flatnonzero(~found.solved)[0])]
            place = f"({x:.4g}, {y:.4g}, {z:.4g}) mm"
            raise self._error(f"{self._what()} does not reach both faces at {place}; use a smaller radius")

    def _error(self, what: str) -> RadiusError:
        return RadiusError(f"{self._names()}: {what}", self.rail.numbers)

    def _what(self) -> str:
        if self.rail.lengths is None:
            return f"a ball of radius {self.radius:g} mm"
        return f"a chamfer of {self.radius:g} mm"

    def _names(self) -> str:
        numbers = self.rail.numbers
        return f"edge {numbers[0]}" if len(numbers) == 1 else f"edges {', '.join(map(str, numbers))}"


def _out(normals: FloatArray) -> FloatArray:
    """How the border of a strip is shifted (N, 3, 3) where it touches both faces, and between, by a margin of 1.

    Parameters
    ----------
    normals : (N, 2, 3) float64
        Of the faces.
    """
    between = normals.sum(axis=1) / np.maximum(1 + (normals[:, 0] * normals[:, 1]).sum(axis=1), _BLUNT)[:, None]
    return np.concatenate([normals, between[:, None]], axis=1)


def _scaled(law: Law, factor: float) -> Law:
    def scaled(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        radius, slope = law(at)
        return factor * radius, factor * slope

    return scaled
