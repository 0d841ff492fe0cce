"""Tiny edges, slivers and folds along seams: collapse edges, flip the long edges of caps, at loose vertices only.

As in :mod:`slivers`, neither changes the topology or moves a vertex. Other vertices stay, but take loose ones;
triangles without a loose vertex stay as they are.
"""

import math

import numpy as np

from . import slivers
from .jit import jit

#: Sine of 2 degrees: triangles with a smaller angle are slivers.
_THIN = 0.035

#: A collapse may leave triangles of half the quality that they had, or better ones than this.
_WORSE = 0.5

#: Triangles lower than this share of their longest side are lines: a collapse that leaves them so is no worse.
#: (Without, a strip without area beside a wall kept the needle at its end, and so all others.)
_FLAT = 1e-4

#: Along an edge that lies in a shape's face, triangles without area follow each other: one goes in each round. Most end
#: after a few; seams of 800 mm with triangles of 0.05 mm take 2000.
_ROUNDS = 20_000

#: Where faces meet triangles without area may also be turned in circles, of two or three rounds mostly: if rounds are
#: what they were this many before, so many times on end, nothing else is left.
_CIRCLE = 12
_CIRCLES = 24

#: Modulus of the marks by which rounds are told apart.
_PRIME = 2**31 - 1

#: Triangles around a vertex that are looked at again after a change: the latest are the first, and vertices of large
#: faces may have thousands.
_LATEST = 64


@jit
def _length(p, u, v):
    return math.sqrt((p[u, 0] - p[v, 0]) ** 2 + (p[u, 1] - p[v, 1]) ** 2 + (p[u, 2] - p[v, 2]) ** 2)


@jit
def _height_above(p, top, a, b):
    """Height of a triangle above its side a b.

    From what is left of the way to the top beside the side: the difference of squared lengths is off by 2e-7 mm on
    needles of 14 mm.
    """
    side2, along = _length(p, a, b) ** 2, 0.0
    for d in range(3):
        along += (p[top, d] - p[a, d]) * (p[b, d] - p[a, d])
    share, height2 = along / side2 if side2 > 0 else 0.0, 0.0
    for d in range(3):
        height2 += (p[top, d] - p[a, d] - share * (p[b, d] - p[a, d])) ** 2
    return math.sqrt(height2)


@jit
def _is_flat(p, a, b, c):
    """Whether a triangle is as good as a line, whatever way it faces."""
    u, v, w = _length(p, a, b), _length(p, b, c), _length(p, c, a)
    longest = max(u, max(v, w))
    if longest == 0:
        return True
    if u == longest:
        return _height_above(p, c, a, b) <= _FLAT * longest
    if v == longest:
        return _height_above(p, a, b, c) <= _FLAT * longest
    return _height_above(p, b, c, a) <= _FLAT * longest


@jit
def _may_move(p, faces, facing, head, following, u, v, shift):
    """Whether the triangles around u stay good, and the surface where it is, if u moves to v."""
    corner = head[u]
    while corner >= 0:
        t, c = corner // 3, corner % 3
        a, b = faces[t, (c + 1) % 3], faces[t, (c + 2) % 3]
        if a != v and b != v:
            before = slivers._quality(p, u, a, b, facing[t])
            after = slivers._quality(p, v, a, b, facing[t])
            worse = after <= 0 or (after < _THIN and after < _WORSE * before)
            flat = _length(p, u, v) <= shift and _is_flat(p, u, a, b) and _is_flat(p, v, a, b)
            if not flat and (worse or slivers._height(p, u, v, a, b) > shift):
                return False
        corner = following[corner, 0]
    return True


@jit
def _try_merge(p, faces, facing, loose, alive, head, following, u, v, shift, tiny, short, fold):
    """Collapse the edge u v if it is short, in either direction; the looser vertex goes if it may.

    The surface shifts by up to ``fold`` only where the vertex that stays is as loose at least: it knows more surfaces.
    """
    length = _length(p, u, v)
    if length > short:
        return False
    if loose[u] < loose[v]:
        u, v = v, u
    for _ in range(2):
        allowed = max(tiny if length <= tiny else shift, fold if loose[u] <= loose[v] else 0.0)
        if (
            loose[u] > 0
            and _may_move(p, faces, facing, head, following, u, v, allowed)
            and slivers._may_merge(faces, head, following, u, v)
        ):
            slivers._merge(faces, alive, head, following, u, v)
            return True
        u, v = v, u
    return False


@jit
def _try_flip(p, faces, facing, loose, head, following, t, c, shift, fold):
    """Turn the edge opposite to corner c of triangle t if that helps.

    Both triangles then face as the other one did. One of another face, or without loose vertices, must hardly change.
    """
    other = slivers._across(faces, head, following, t, c)
    if other < 0:
        return False
    s, e = other // 3, other % 3
    top, a, b, bottom = faces[t, c], faces[t, (c + 1) % 3], faces[t, (c + 2) % 3], faces[s, e]
    if top == bottom or slivers._joined(faces, head, following, top, bottom):
        return False
    if slivers._few(head, following, a) or slivers._few(head, following, b):
        return False
    before = min(slivers._quality(p, top, a, b, facing[t]), slivers._quality(p, bottom, b, a, facing[s]))
    after = min(slivers._quality(p, top, a, bottom, facing[s]), slivers._quality(p, top, bottom, b, facing[s]))
    if after <= max(before, 0.0) or slivers._gap(p, a, b, top, bottom) > max(shift, fold):
        return False
    whole = max(loose[bottom], max(loose[a], loose[b])) == 0
    if (whole or facing[t, 3] != facing[s, 3]) and _height_above(p, top, a, b) > shift:
        return False
    slivers._replace(faces, head, following, 3 * t + (c + 2) % 3, bottom)
    slivers._replace(faces, head, following, 3 * s + (e + 2) % 3, top)
    facing[t] = facing[s]
    return True


@jit
def _mend(p, faces, facing, loose, alive, head, following, t, order, shift, tiny, short, fold):
    if slivers._quality(p, faces[t, 0], faces[t, 1], faces[t, 2], facing[t]) > 0:
        fold = 0.0
    slivers._edge_order(p, faces, t, order)
    for q in range(3):
        c = order[q]
        u, v = faces[t, (c + 1) % 3], faces[t, (c + 2) % 3]
        if _try_merge(p, faces, facing, loose, alive, head, following, u, v, shift, tiny, short, fold):
            return True
        if _try_flip(p, faces, facing, loose, head, following, t, order[2 - q], shift, fold):
            return True
    return False


@jit
def _is_bad(p, faces, facing, t, tiny):
    a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
    if slivers._quality(p, a, b, c, facing[t]) < _THIN:
        return True
    return min(_length(p, a, b), min(_length(p, b, c), _length(p, c, a))) < tiny


@jit
def _enter(faces, loose, head, following, vertex, number, seen, queue, count):
    """Enter the triangles with loose vertices around a vertex into the queue of this round; returns its length."""
    corner = head[vertex]
    steps = 0
    while corner >= 0 and steps < _LATEST:
        t = corner // 3
        if seen[t] != number and max(loose[faces[t, 0]], max(loose[faces[t, 1]], loose[faces[t, 2]])) > 0:
            seen[t] = number
            queue[count] = t
            count += 1
        corner = following[corner, 0]
        steps += 1
    return count


@jit
def _mark(t, a, b, c):
    """Whole number that differs between triangles and what they were made of; sums of it, between rounds."""
    mark = np.int64(0)
    for v in (a, b, c):  # in any order
        mixed = (np.int64(v) + 1) * 48271 % _PRIME
        mark += mixed * mixed % _PRIME
    return mark * (np.int64(t) + 1) % _PRIME


@jit
def tidy(position, faces, facing, loose, shift, tiny, short, fold):
    """Mend triangles with loose vertices in place; returns which triangles (F,) are left.

    ``facing`` (F, 4) is the direction that each triangle should face, and a number that triangles of one face share;
    ``loose`` (V,) is above 0 for vertices that may go, those with more first. The surface shifts by ``shift`` mm at
    most, but by ``fold`` mm where triangles face the wrong way: there seams ran over vertices beside them. Edges
    shorter than ``tiny`` mm go, those longer than ``short`` mm stay.
    """
    alive = np.ones(len(faces), np.bool_)
    order = np.empty(3, np.int64)
    head, following = slivers._link(faces, len(position))
    seen = np.zeros(len(faces), np.int32)
    queue, coming = np.empty(len(faces), np.int32), np.empty(len(faces), np.int32)
    count = 0
    for t in range(len(faces)):
        if max(loose[faces[t, 0]], max(loose[faces[t, 1]], loose[faces[t, 2]])) > 0:
            queue[count] = t
            count += 1
    before, alike = np.zeros(_CIRCLE, np.int64), 0
    for number in range(1, _ROUNDS + 1):
        after, done = 0, 0
        for q in range(count):
            t = queue[q]
            a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
            if (
                alive[t]
                and _is_bad(position, faces, facing, t, tiny)
                and _mend(position, faces, facing, loose, alive, head, following, t, order, shift, tiny, short, fold)
            ):
                for v in (a, b, c):
                    after = _enter(faces, loose, head, following, v, number, seen, coming, after)
                done += _mark(t, a, b, c)
        alike = alike + 1 if done == before[number % _CIRCLE] else 0
        before[number % _CIRCLE] = done
        if after == 0 or alike == _CIRCLES:
            break
        coming[:after].sort()
        queue, coming, count = coming, queue, after
    return alive


@jit
def wrong_way(position, faces, facing):
    """Which triangles (F,) do not face their direction."""
    wrong = np.zeros(len(faces), np.bool_)
    for t in range(len(faces)):
        wrong[t] = slivers._quality(position, faces[t, 0], faces[t, 1], faces[t, 2], facing[t]) < 0
    return wrong
