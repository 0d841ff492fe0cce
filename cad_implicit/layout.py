"""From rails to regions: how far each strip goes, where it is cut, what is put between strips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .cad.edges import Edge
from .chamfers import Flat, legs, meeting_points
from .errors import RadiusError
from .cliffs import cliff
from .face_groups import FaceGroup, PartFaces
from .implicit import FloatArray, Implicit
from .joints import Around, Ball, Vertex, around, find_corners, vertices
from .rails import Rail
from .spines import Guide, Law, Spine, Support, extended, spine
from .strips import Corner, Cut, Mitre, Region, Strip, Trimmed

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

#: A ball that moves by less than this share of the way along the edge stands still; then it is made smaller by this share.
_STILL = 1e-5
_LESS = 1e-4

#: Regions have at least this margin, in radii; and they may come out behind walls by this share of it: so much, and more
#: than tessellation, which is a thousandth of it, is nothing beside the error allowed.
_LEAST = 0.05
_CLEAR = 0.005

_ENDS: tuple[Literal[0, 1], Literal[0, 1]] = (0, 1)


@dataclass(frozen=True, eq=False)
class Laid:
    """The regions of all rails of one kind, and the spines of their balls.

    Attributes
    ----------
    strips : dict of int to Region
        By ``id`` of their rails.
    others : list of Region
        Mitres and corners.
    spines : list of (Spine, (Support, Support))
        Of the strips; the supports are the faces that their balls touch.
    balls : list of (Ball, list of Support)
        Of the corners.
    """

    strips: dict[int, Region]
    others: list[Region]
    spines: list[tuple[Spine, tuple[Support, Support]]]
    corners: list[Ball]


def lay(
    rails: Sequence[Rail], faces: PartFaces, edges: Sequence[Edge], margin: float, part: Implicit | None = None
) -> Laid:
    """Regions that the blends of some rails take off or fill in.

    Parameters
    ----------
    rails : sequence of Rail
        All convex or all concave.
    faces : PartFaces
        Of the part.
    edges : sequence of Edge
        All of the part's.
    margin : float
        How far in mm the regions go beyond the part's faces.
    part : Implicit, optional
        Distance to the part: regions stay out of what is behind thin walls and narrow gaps.

    Raises
    ------
    RadiusError
        If a ball does not fit; names the edge.
    """
    at = vertices(rails, edges)
    for vertex in at.values():
        find_corners(vertex, faces)
    laid = Laid({}, [], [], [])
    strips: dict[tuple[int, int], _Ending] = {}
    margin_here: dict[int, float] = {}
    for index, rail in enumerate(rails):
        made = _Layer(rail, faces, edges, at, margin, part).lay()
        if made is None:
            continue
        strip, endings = made
        margin_here[id(rail)] = strip.margin
        trimmed = Trimmed(strip, [cut for ending in endings for cut in ending.cuts.values()])
        laid.strips[id(rail)] = trimmed
        laid.spines.append((strip.spine, rail.supports))
        for which, ending in zip(_ENDS, endings, strict=True):
            ending.strip, ending.other = strip, endings[1 - which]
            strips[index, which] = ending
    for vertex in at.values():
        endings = [
            strips[i, e] for i, rail in enumerate(rails) for e in _ENDS if (rail, e) in vertex.ends and (i, e) in strips
        ]
        least = min((margin_here[id(rail)] for rail, _ in vertex.ends if id(rail) in margin_here), default=margin)
        laid.others.extend(_mitres(endings, least))
        flat = _flat(vertex, endings, faces, least)
        laid.others.extend([] if flat is None else [flat])
        for ball in vertex.corners:
            corner = Corner(ball.centre, ball.radius, ball.contacts, vertex.place, least)
            laid.others.append(corner)
            laid.corners.append(ball)
    return laid


@dataclass(eq=False)
class _Ending:
    """One end of a strip."""

    cuts: dict[int, Cut]
    around: Around | None = None
    strip: Strip | None = None
    other: _Ending | None = None


class _Layer:
    """Lays the strip of one rail."""

    def __init__(
        self,
        rail: Rail,
        faces: PartFaces,
        edges: Sequence[Edge],
        at: dict[int, Vertex],
        margin: float,
        part: Implicit | None,
    ) -> None:
        self.rail, self.faces, self.edges, self.margin, self.part = rail, faces, edges, margin, part
        self.supports = rail.supports
        self.at = [None if rail.guide.closed else at.get(end.vertex) for end in rail.ends]
        self.radius = max(rail.lengths or rail.law(np.linspace(0, rail.guide.length, 33))[0].tolist())

    def lay(self) -> tuple[Strip, tuple[_Ending, _Ending]] | None:
        """Strip and its ends; None if nothing is left of it between two corners."""
        rail, guide = self.rail, self.rail.guide
        if guide.closed:
            found = self._spine(guide, guide.at)
            self._check(found)
            return self._strip(found, (False, False), []), (_Ending({}), _Ending({}))
        balls = [self._ball(which) for which in _ENDS]
        free = [balls[e] is None and not rail.ends[e].smooth and self.at[e] is not None for e in _ENDS]
        room = [_EXTENT * self.radius if free[e] or balls[e] is not None else 0.0 for e in _ENDS]
        guide = extended(guide, rail.supports, *room, _STEP * self.radius)
        limits = [0.0, rail.guide.length]
        for e in _ENDS:
            if (ball := balls[e]) is not None:
                limits[e] = self._position(guide, ball, e)
        if all(ball is not None for ball in balls):
            short = limits[0] - limits[1]
            if short > _NOTHING * self.radius:
                raise RadiusError(f"{self._names()}: a ball of radius {self.radius:g} mm does not fit between its ends")
            if short > -_NOTHING * self.radius:
                return None
        rough = self._spine(guide, guide.at) if any(free) else None
        endings = []
        for e in _ENDS:
            ending = _Ending({})
            if free[e] and rough is not None:
                limits[e] = self._free(e, rough, ending)
            endings.append(ending)
        inner = guide.at[(guide.at > limits[0]) & (guide.at < limits[1])]
        found = self._spine(guide, np.unique(np.concatenate([[limits[0]], inner, [limits[1]]])))
        self._check(found)
        for e in _ENDS:
            if (ball := balls[e]) is not None:
                found.centres[-e] = ball.centre
        cuts = [cut for ending in endings for cut in ending.cuts.values()]
        strip = self._strip(found, (balls[0] is not None, balls[1] is not None), cuts)
        for ending in endings:
            ending.cuts = {
                cluster: Cut(cut.support, cut.side, cut.end, float(strip.way(cut.way)), cut.margin)
                for cluster, cut in ending.cuts.items()
            }
        return strip, (endings[0], endings[1])

    def _ball(self, which: Literal[0, 1]) -> Ball | None:
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

    def _position(self, guide: Guide, ball: Ball, which: Literal[0, 1]) -> float:
        """Position along a guide of a ball at one end of it."""
        length = self.rail.guide.length
        within = (-np.inf, _HALF * length) if which == 0 else ((1 - _HALF) * length, np.inf)
        return float(guide.position(ball.centre[None], *within)[0])

    def _spine(self, guide: Guide, at: FloatArray) -> Spine:
        """Spine of the rail; if the ball stands still somewhere, as in a hole of its radius, of a ball a little smaller."""
        lengths = self.rail.lengths
        if lengths is not None:
            return legs(guide, self.rail.supports, lengths, at)
        found = spine(guide, self.supports, self.rail.law, at)
        if self.supports is self.rail.supports and self._falls(found):
            found = spine(guide, self.supports, self.rail.law, at)
        way, along = np.linalg.norm(np.diff(found.centres, axis=0), axis=1), np.diff(found.at)
        if self.rail.constant is None or bool((way > _STILL * along).all()) and bool(found.solved.all()):
            return found
        less = spine(guide, self.supports, _scaled(self.rail.law, 1 - _LESS), at)
        return less if bool(less.solved.all()) else found

    def _falls(self, found: Spine) -> bool:
        """Whether the ball leaves a face over a border along the edge; then that is where the face ends from now on."""
        rail = self.rail
        ends = {end.vertex for end in rail.ends if end.vertex and not rail.guide.closed}
        barred = {edge.number for edge in self.edges if ends & set(edge.ends)} | set(rail.numbers)
        inside = found.solved & (found.at >= 0) & (found.at <= rail.guide.length)
        supports = list(rail.supports)
        for side, support in enumerate(rail.supports):
            if not isinstance(support.face, FaceGroup) or not inside.any():
                continue
            end = cliff(support.face, support.face.members, rail.guide, self.edges, barred, self.radius)
            if end is not None and bool(end.border(found.touching()[inside, side])[1].any()):
                supports[side] = Support(end, support.sign)
        self.supports = (supports[0], supports[1])
        return any(one is not other for one, other in zip(supports, rail.supports, strict=True))

    def _strip(self, found: Spine, corners: tuple[bool, bool], cuts: Sequence[Cut]) -> Strip:
        """Strip whose margin is less where there is more of the part behind a thin wall or gap."""
        strip = Strip(found, self.rail.supports, self.margin, corners)
        while self.part is not None and not self.rail.follows and strip.margin > _LEAST * self.radius:
            skin = strip.skin()
            for cut in cuts:
                skin = skin[cut.side * cut.support(skin)[0] > 0]
            if len(skin) == 0 or float((self.rail.sign * self.part(skin)).max()) < _CLEAR * self.margin:
                break
            strip = Strip(found, self.rail.supports, strip.margin / 2, corners)
        self.margin = strip.margin
        return strip

    def _free(self, which: Literal[0, 1], rough: Spine, ending: _Ending) -> float:
        """Position at which a strip that ends at faces may stop; fills in the cuts, their ways still positions."""
        vertex = self.at[which]
        assert vertex is not None
        ending.around = around(vertex, self.rail, which, self.faces, self.radius)
        at = rough.at
        outward = np.flatnonzero(at <= 0.0)[::-1] if which == 0 else np.flatnonzero(at >= self.rail.guide.length)
        inward = np.flatnonzero(at >= 0.0) if which == 0 else np.flatnonzero(at <= self.rail.guide.length)[::-1]
        bad = outward[~rough.solved[outward]]
        if len(bad):
            outward = outward[: int(np.flatnonzero(outward == bad[0])[0])]
        if len(outward) == 0:
            raise RadiusError(f"{self._names()}: {self._what()} does not reach both faces at its end")
        if not ending.around.cuts:
            return float(0.0 if which == 0 else self.rail.guide.length)
        held = np.concatenate([rough.touching(), rough.edge[:, None]], axis=1)
        stop = len(outward) - 1
        # mitres need the strips beyond the faces at which they are cut
        size = np.linalg.norm(held[inward[0], :2] - held[inward[0], 2:], axis=1).max()
        further = _MITRE * float(size) if len(vertex.ends) > 1 else 0.0
        for cluster, (support, side) in ending.around.cuts.items():
            inside = side * support(held.reshape(-1, 3))[0].reshape(-1, 3)
            margin = self.margin if side > 0 else 0.0
            beyond = np.flatnonzero((inside[outward] < -margin).all(axis=1))
            if len(beyond):
                stop = min(
                    stop,
                    int(
                        np.searchsorted(
                            np.abs(at[outward] - at[outward[0]]), further + abs(at[outward[beyond[0]]] - at[outward[0]])
                        )
                    ),
                )
            before = np.flatnonzero((inside[inward] > 0.05 * self.radius).all(axis=1))
            zone = inward[int(before[0])] if len(before) else inward[-1]
            ending.cuts[cluster] = Cut(support, side, which, float(at[zone]), margin)
        return float(at[outward[stop]])

    def _check(self, found: Spine) -> None:
        if not found.solved.all():
            x, y, z = found.edge[int(np.flatnonzero(~found.solved)[0])]
            raise RadiusError(
                f"{self._names()}: {self._what()} does not reach both faces at "
                f"({x:.4g}, {y:.4g}, {z:.4g}) mm; use a smaller radius"
            )

    def _what(self) -> str:
        if self.rail.lengths is None:
            return f"a ball of radius {self.radius:g} mm"
        return f"a chamfer of {self.radius:g} mm"

    def _names(self) -> str:
        numbers = self.rail.numbers
        return f"edge {numbers[0]}" if len(numbers) == 1 else f"edges {', '.join(map(str, numbers))}"


def _flat(vertex: Vertex, endings: Sequence[_Ending], faces: PartFaces, margin: float) -> Flat | None:
    """What three chamfers of one length leave of a corner of three faces."""
    rails = [rail for rail, _ in vertex.ends]
    if len(endings) != 3 or len(vertex.sharp) != 3 or len({x for rail in rails for x in rail.lengths or (0, 1)}) != 1:
        return None
    parts = [(e.strip.spine, e.around.own) for e in endings if e.strip is not None and e.around is not None]
    points = meeting_points(parts, vertex.place) if len(parts) == 3 else None
    if points is None:
        return None
    groups = faces.groups([own[0] for own in vertex.clusters])
    return Flat(points, vertex.place, [Support(group, rails[0].sign) for group in groups.values()], margin)


def _scaled(law: Law, factor: float) -> Law:
    def scaled(at: FloatArray) -> tuple[FloatArray, FloatArray]:
        radius, slope = law(at)
        return factor * radius, factor * slope

    return scaled


def _mitres(endings: Sequence[_Ending], margin: float) -> list[Mitre]:
    """What strips have in common beyond the faces at which they end, for those that share a face."""
    result = []
    for index, one in enumerate(endings):
        for other in endings[:index]:
            if one.around is None or other.around is None or one.strip is None or other.strip is None:
                continue
            shared = set(one.around.own) & set(other.around.own)
            (mine,), (theirs,) = (
                (set(e.around.own) - shared for e in (one, other)) if len(shared) == 1 else ((-1,), (-1,))
            )
            if mine not in other.cuts or theirs not in one.cuts:
                continue
            if one.cuts[theirs].side > 0 or other.cuts[mine].side > 0:
                continue
            uncut: list[Region] = []
            for ending, away in ((one, theirs), (other, mine)):
                cuts = [cut for cluster, cut in ending.cuts.items() if cluster != away]
                uncut.append(Trimmed(ending.strip, [*cuts, *ending.other.cuts.values()]))
            faces = (one.cuts[theirs].support, other.cuts[mine].support)
            result.append(Mitre(uncut, [_Near(face, margin) for face in faces]))
    return result


class _Near:
    """A face, and a margin before it."""

    def __init__(self, support: Support, margin: float) -> None:
        self._support, self._margin = support, margin

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        value, gradient = self._support(points)
        return value + self._margin, gradient
