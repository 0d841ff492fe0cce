"""From rails to regions: the strips of all rails, and what is put between them where they meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from .blend_regions import Cleared, Corner, Mitre
from .cad.edges import Edge
from .chamfers import Flat, meeting_points
from .errors import RadiusError
from .face_groups import PartFaces
from .guides import Support
from .implicit import FloatArray, Implicit
from .joints import Ball, Vertex, find_corners, vertices
from .layers import Layer, Laying, Which
from .rails import Rail
from .spines import Spine
from .strips import Region, Strip, Trimmed

#: Blends run into each other if one touches a face this deep within the other, in radii, that with a margin of …
_CROSSING = 1e-3
_NARROW = 0.01

#: A corner comes out of the part behind a face if it does by this share of its margin; then that is so many radii.
_COMES_OUT = 0.5
_SKIN = 1e-3

#: A ball is free of the part if it cuts in by no more than this share of its radius.
_FREE = 1e-3


@dataclass(frozen=True, eq=False)
class Laid:
    """The regions of all rails of one kind, and the spines of their balls.

    Attributes
    ----------
    strips : dict of int to Region
        By ``id`` of their rails.
    others : list of Region
        Mitres and corners.
    plain : list of Strip
        The strips of all rails, without cuts.
    spines : list of (Spine, (Support, Support))
        Of the strips; the supports are the faces that their balls touch.
    corners : list of Ball
    """

    strips: dict[int, Region]
    others: list[Region]
    plain: list[Strip]
    spines: list[tuple[Spine, tuple[Support, Support]]]
    corners: list[Ball]


def lay(
    rails: Sequence[Rail],
    faces: PartFaces,
    edges: Sequence[Edge],
    margin: float,
    part: Implicit | None = None,
    *,
    strict: bool = False,
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
    strict : bool
        Whether a blend may not be wider than a face, rolling on its border.

    Raises
    ------
    RadiusError
        If a ball does not fit, or blends run into each other; names the edges.
    """
    at = vertices(rails, edges)
    for vertex in at.values():
        find_corners(vertex, faces)
    made = [Layer(rail, faces, edges, at, margin, part, strict).lay() for rail in rails]
    layings = {id(laying.rail): laying for laying in made if laying is not None}
    _check_apart(list(layings.values()))
    laid = Laid({}, [], [], [], [])
    for key, laying in layings.items():
        laid.strips[key] = Trimmed(laying.strip, [cut for ending in laying.endings for cut in ending.cuts.values()])
        laid.plain.append(laying.strip)
        laid.spines.append((laying.strip.spine, laying.rail.supports))
    for vertex in at.values():
        here = [(layings[id(rail)], which) for rail, which in vertex.ends if id(rail) in layings]
        least = min((laying.strip.margin for laying, _ in here), default=margin)
        laid.others.extend(_mitres(here, least))
        laid.others.extend(_flats(vertex, here, faces, least))
        for ball in vertex.corners:
            margins = _margins(ball, vertex.ends[0][0].sign, part, least)
            corner = Corner(ball.centre, ball.radius, ball.contacts, vertex.place, margins)
            own = {id(rail) for rail, _ in vertex.ends}
            others = [laying for key, laying in layings.items() if key not in own]
            beside = _free_balls(ball, others, part) if part is not None and margins.min() < least else []
            laid.others.append(Cleared(corner, beside) if beside else corner)
            laid.corners.append(ball)
    return laid


def _free_balls(ball: Ball, others: Sequence[Laying], part: Implicit) -> list[Strip]:
    """Give strips of the free balls that roll past the end of a face, and meet a ball that touches it there."""
    result = []
    for laying in others:
        found, length = laying.strip.spine, laying.rail.guide.length
        near = np.linalg.norm(found.centres - ball.centre, axis=1) < found.radius + ball.radius
        free = laying.rail.sign * part(found.centres) > (1 - _FREE) * found.radius
        rows = np.flatnonzero(near & free & (found.at >= 0) & (found.at <= length))
        if found.ball and not found.closed and len(rows) > 1 and rows[-1] - rows[0] == len(rows) - 1:
            result.append(Strip(found.part(rows), laying.rail.supports, laying.strip.margin))
    return result


def _margins(ball: Ball, sign: float, part: Implicit | None, margin: float) -> FloatArray:
    """Margins (K,) of a corner beyond its faces: next to none where its ball touches one beyond the face's end."""
    if part is None:
        return np.full(len(ball.contacts), margin)
    skin = ball.centre + (ball.radius + margin) * ball.contacts
    return np.where(sign * part(skin) < _COMES_OUT * margin, margin, _SKIN * ball.radius)


def _check_apart(laid: Sequence[Laying]) -> None:
    """Raise RadiusError if blends run into each other that have no vertex in common."""
    ends = [{end for choice in laying.rail.choices for end in choice.edge.ends} - {0} for laying in laid]
    for (one, own), (other, theirs) in combinations(zip(laid, ends, strict=True), 2):
        if own & theirs:
            continue
        for mine, against in ((one, other), (other, one)):
            spine, box = mine.strip.spine, against.strip.box
            inside = (spine.at >= 0) & (spine.at <= mine.rail.guide.length)
            touching = spine.touching()[inside].reshape(-1, 3)
            touching = touching[((touching >= box[0]) & (touching <= box[1])).all(axis=1)]
            if len(touching) == 0:
                continue
            radius = float(against.strip.spine.radius.max())
            narrow = Strip(against.strip.spine, against.rail.supports, _NARROW * radius)
            cuts = [cut for ending in against.endings for cut in ending.cuts.values()]
            deep = Trimmed(narrow, cuts).value_and_gradient(touching)[0]
            if against.strip.spine.ball:  # it is deep by its square only
                deep = np.where(deep > 0, narrow.from_ball(touching)[2].min(axis=1), deep)
            if float(deep.max()) > _CROSSING * radius:
                x, y, z = touching[int(deep.argmax())]
                numbers = sorted({*one.rail.numbers, *other.rail.numbers})
                both, place = ", ".join(map(str, numbers)), f"({x:.4g}, {y:.4g}, {z:.4g}) mm"
                raise RadiusError(f"edges {both}: their blends run into each other at {place}", numbers)


def _flats(vertex: Vertex, here: Sequence[tuple[Laying, Which]], faces: PartFaces, margin: float) -> list[Flat]:
    """Find what three chamfers of one length leave of a corner of three faces."""
    lengths = {length for rail, _ in vertex.ends for length in rail.lengths or (0.0, 1.0)}
    if len(here) != 3 or len(vertex.sharp) != 3 or len(lengths) != 1:
        return []
    endings = [laying.endings[which] for laying, which in here]
    parts = [
        (laying.strip.spine, ending.around.own)
        for (laying, _), ending in zip(here, endings, strict=True)
        if ending.around is not None
    ]
    points = meeting_points(parts, vertex.place) if len(parts) == 3 else None
    if points is None:
        return []
    groups = faces.groups([own[0] for own in vertex.clusters])
    supports = [Support(group, here[0][0].rail.sign) for group in groups.values()]
    return [Flat(points, vertex.place, supports, margin)]


def _mitres(here: Sequence[tuple[Laying, Which]], margin: float) -> list[Mitre]:
    """Find what strips have in common beyond the faces at which they end, for those that share a face."""
    result = []
    for (one, which), (other, whose) in combinations(here, 2):
        mine, theirs = one.endings[which], other.endings[whose]
        if mine.around is None or theirs.around is None:
            continue
        shared = set(mine.around.own) & set(theirs.around.own)
        if len(shared) != 1:
            continue
        (own,), (away,) = set(mine.around.own) - shared, set(theirs.around.own) - shared
        if away not in mine.cuts or own not in theirs.cuts:
            continue
        first, second = mine.cuts[away], theirs.cuts[own]
        if first.side > 0 or second.side > 0:
            continue
        uncut = [_uncut(one, which, away), _uncut(other, whose, own)]
        result.append(Mitre(uncut, [cut.support.raised(margin) for cut in (first, second)]))
    return result


def _uncut(laying: Laying, which: Which, cluster: int) -> Region:
    """Strip that goes on at one face at one of its ends."""
    cuts = list(laying.endings[1 - which].cuts.values())
    cuts += [cut for number, cut in laying.endings[which].cuts.items() if number != cluster]
    return Trimmed(laying.strip, cuts)
