"""Rails that roll over another blend: where a ball leaves a face over a border that is blended, too.

A boss tangent to a plate's side, all rounded: the fillet at its foot touches the round of the plate's border, not the
plate that is gone there. The round goes first, and the face beside the fillet goes on as the round.

Not done: borders that the edge does not touch (a boss near one), chamfers, radii that vary, and rails that go around
blends at their ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from .face_groups import FaceGroup
from .faces import FaceDistance
from .following import BlendedPair, blended_pair
from .guides import Guide, Support, onto_line
from .implicit import FloatArray
from .rails import End, Rail
from .spines import spine

#: Rails nearer to each other than so many times both radii together are looked at.
_NEAR = 1.5

#: A ball touches another blend's place if that is so by this share of the radius: contacts may meet just so.
_INSIDE = 1e-4

#: Points along the line where a face meets a blend are so far apart, in radii of the ball, and the most of them.
_STEP = 0.1
_MOST = 2000


class _Within(FaceDistance):
    """Signed distance to what several surfaces have in common, or to all they hold together."""

    kind = "within"

    def __init__(self, pairs: Sequence[BlendedPair], sign: float) -> None:
        self._pairs, self._sign = tuple(pairs), sign

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Signed distances (N,) and gradients (N, 3)."""
        value, gradient = self._pairs[0].value_and_gradient(points)
        for pair in self._pairs[1:]:
            other, slope = pair.value_and_gradient(points)
            less = self._sign * other < self._sign * value
            value, gradient = np.where(less, other, value), np.where(less[:, None], slope, gradient)
        return value, gradient


def rolled(rails: Sequence[Rail], after: dict[int, list[Rail]]) -> tuple[list[Rail], dict[int, list[Rail]]]:
    """Rails whose faces go on over the blends of other rails that they reach.

    Parameters
    ----------
    rails : sequence of Rail
        Of both kinds.
    after : dict of int to list of Rail
        By ``id`` of a rail that goes first, those that come after it.

    Returns
    -------
    rails : list of Rail
        Some of them replaced.
    after : dict of int to list of Rail
        With these.
    """
    order = {key: list(own) for key, own in after.items()}
    result = list(rails)
    for sign in (-1.0, 1.0):  # those that fill in come last
        for number, rail in enumerate(result):
            if rail.sign != sign or rail.follows or rail.constant is None or id(rail) in order:
                continue
            over = _reached(rail, [other for other in result if other.sign != sign and not other.follows])
            renewed = _over(rail, over) if any(over) else None
            if renewed is None:
                continue
            result[number] = renewed
            for first in {id(other) for own in over for other in own}:
                order.setdefault(first, []).append(renewed)
    return result, order


def _reached(rail: Rail, others: Sequence[Rail]) -> tuple[list[Rail], list[Rail]]:
    """Rails over whose blends a ball rolls, on the left and on the right."""
    radius = rail.constant
    assert radius is not None
    near: list[tuple[int, Rail]] = []
    tree = cKDTree(_line(rail.guide, radius))
    for other in others:
        if other.constant is None or not _ends(rail) & _ends(other):
            continue
        reach = _NEAR * (radius + other.constant)
        if float(tree.query(_line(other.guide, radius), distance_upper_bound=reach)[0].min()) < reach:
            near += [(side, other) for side in (0, 1) if _shared(rail.supports[side], other)]
    found: tuple[list[Rail], list[Rail]] = ([], [])
    if not near:
        return found
    rolling = spine(rail.guide, rail.supports, rail.law, rail.guide.at)
    touching = rolling.touching()[rolling.solved & (rolling.at >= 0) & (rolling.at <= rail.guide.length)]
    for side, other in near:
        if len(touching) and _touches(touching[:, side], other):
            found[side].append(other)
    return found


def _shared(support: Support, other: Rail) -> bool:
    """Whether a face is one of those beside a rail."""
    groups = [one.face for one in (support, *other.supports)]
    members = [set(group.members) if isinstance(group, FaceGroup) else set() for group in groups]
    return bool(members[0] & (members[1] | members[2]))


def _touches(points: FloatArray, other: Rail) -> bool:
    """Whether points (N, 3) of a face are where a blend takes it off, or fills it in."""
    assert other.constant is not None
    at = other.guide.position(points)
    beside = points[(at >= 0) & (at <= other.guide.length)] if not other.guide.closed else points
    if len(beside) == 0:
        return False
    away, _, within = blended_pair(other, 0.0).strip.from_ball(beside)
    least = _INSIDE * other.constant
    return bool(((away > least**2 / other.constant) & (within.min(axis=1) > least)).any())


def _ends(rail: Rail) -> set[int]:
    """Numbers of the vertices at which edges of a rail end."""
    return {end for choice in rail.choices for end in choice.edge.ends} - {0}


def _over(rail: Rail, over: Sequence[Sequence[Rail]]) -> Rail | None:
    """Rail whose faces go on over blends; None if they meet in no clear line."""
    radius = rail.constant
    assert radius is not None
    supports = [
        Support(_Within([blended_pair(other, radius) for other in own], -rail.sign), rail.sign) if own else support
        for support, own in zip(rail.supports, over, strict=True)
    ]
    guide = _line_of_both(rail.guide, supports, radius)
    if guide is None:
        return None
    ends = rail.ends if guide.closed == rail.guide.closed else (End(0, rail.ends[0].sides), End(0, rail.ends[1].sides))
    return replace(rail, guide=guide, supports=(supports[0], supports[1]), ends=ends, follows=True)


def _line_of_both(guide: Guide, supports: Sequence[Support], radius: float) -> Guide | None:
    """Line along a guide where two surfaces meet; of a closed one open where they are tangent."""
    at = np.linspace(0, guide.length, _count(guide, radius))
    points, tangents = guide.place(at)
    found = [onto_line(x, t, supports, 2 * radius) for x, t in zip(points, tangents, strict=True)]
    clear = np.array([point is not None for point, _ in found])
    rows = np.flatnonzero(clear)
    gaps = int((clear[1:] < clear[:-1]).sum())
    if guide.closed and not clear.all() and gaps <= 1:
        first = int(np.flatnonzero(~clear)[-1]) + 1 if clear[0] == clear[-1] else 0
        rows = np.array([row for row in [*range(first, len(at) - 1), *range(first)] if clear[row]])
    elif not clear.all():
        return None
    if len(rows) < 2:
        return None
    line, along = (np.array([found[row][k] for row in rows]) for k in (0, 1))
    return Guide.along(line, along, guide.closed and bool(clear.all()))


def _line(guide: Guide, radius: float) -> FloatArray:
    """Points (N, 3) along a guide."""
    return guide.place(np.linspace(0, guide.length, _count(guide, radius)))[0]


def _count(guide: Guide, radius: float) -> int:
    return int(np.clip(np.ceil(guide.length / (_STEP * radius)), 8, _MOST)) + 1
