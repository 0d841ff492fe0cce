"""Which large triangles of a closed mesh run through others: trees of the large ones and of the small ones.

Seams through a large face leave thousands of long thin triangles that fan out from one corner of it. Boxes tell little
about them, so nodes of the trees are also compared with the plane of a triangle and with its edges within it, and
triangles with the planes of nodes. Triangles that share a plane and face one way are not compared: between two that
overlap there, a third one faces the other way.
"""

import math

import numba
import numpy as np

from .jit import jit, parallel_jit
from .meeting import meet
from .partition import STACK, WIDTH, partition

#: Unit normals that agree to this cosine (1.4e-5 radians) are those of one plane: vertices along seams are on a plane
#: to 1e-9 of a radius, and next to the triangles' thinnest sides that is 1e-6 radians.
_ONE_WAY = 1 - 1e-10

#: Triangles that face against each other to this cosine (8 degrees) may be folded onto each other.
_OPPOSITE = -0.99

#: Rounding errors of heights, relative to the size of the mesh.
_ROUNDING = 1e-14

_CHUNK = 16


@jit
def _slabs(position, faces, box, normal, order, ranges):
    """For each child (N, 8, 12): its box (6), a normal (3), heights (2) along it, and whether all triangles have it."""
    slab = np.zeros((len(ranges), WIDTH, 12))
    for node in range(len(ranges)):
        for c in range(WIDTH):
            start, stop = ranges[node, c, 0], ranges[node, c, 1]
            own = slab[node, c]
            own[:3], own[3:6], own[9], own[10], own[11] = math.inf, -math.inf, math.inf, -math.inf, 1.0
            if start == stop:
                continue
            for d in range(3):
                own[6 + d] = normal[order[start], d]
            for q in range(start, stop):
                t = order[q]
                cosine = 0.0
                for d in range(3):
                    own[d], own[3 + d] = min(own[d], box[t, d]), max(own[3 + d], box[t, 3 + d])
                    cosine += own[6 + d] * normal[t, d]
                if not cosine > _ONE_WAY:
                    own[11] = 0.0
                for k in range(3):
                    height = 0.0
                    for d in range(3):
                        height += own[6 + d] * position[faces[t, k], d]
                    own[9], own[10] = min(own[9], height), max(own[10], height)
    return slab


@jit
def _sides(position, face, normal, side):
    """Planes (4, 4) that hold a triangle, with their heights: its own, and those through its edges, outward."""
    for d in range(3):
        side[0, d] = normal[d]
    for k in range(3):
        a, b = face[k], face[(k + 1) % 3]
        x, y, z = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1], position[b, 2] - position[a, 2]
        side[k + 1, 0] = y * normal[2] - z * normal[1]
        side[k + 1, 1] = z * normal[0] - x * normal[2]
        side[k + 1, 2] = x * normal[1] - y * normal[0]
        length = math.sqrt(side[k + 1, 0] ** 2 + side[k + 1, 1] ** 2 + side[k + 1, 2] ** 2)
        for d in range(3):
            side[k + 1, d] /= length if length > 0 else 1.0
    for k in range(4):
        side[k, 3] = -math.inf
        for m in range(3):
            height = 0.0
            for d in range(3):
                height += side[k, d] * position[face[m], d]
            side[k, 3] = max(side[k, 3], height)


@jit
def _apart(position, face, box, normal, side, slab, slack):
    """Whether a triangle is clear of all in a node: of their box, or on one side of their slab, or they of its plane.

    One that only touches the plane of others does not run through them, as where fans in two walls end in one corner.
    """
    for d in range(3):
        if slab[d] > box[3 + d] or box[d] > slab[3 + d]:
            return True
    for k in range(4):
        low = -side[k, 3]
        high = low
        for d in range(3):
            low += min(side[k, d] * slab[d], side[k, d] * slab[3 + d])
            high += max(side[k, d] * slab[d], side[k, d] * slab[3 + d])
        if low > slack or (k == 0 and high < -slack):
            return True
    bottom, top = math.inf, -math.inf
    for m in range(3):
        height = 0.0
        for d in range(3):
            height += slab[6 + d] * position[face[m], d]
        bottom, top = min(bottom, height), max(top, height)
    if bottom > slab[10] + slack or top < slab[9] - slack:
        return True
    cosine = normal[0] * slab[6] + normal[1] * slab[7] + normal[2] * slab[8]
    if slab[11] == 0 or cosine < _OPPOSITE:
        return False
    above = bottom > slab[10] - slack and top > slab[10] + slack
    below = top < slab[9] + slack and bottom < slab[9] - slack
    return above or below or cosine > _ONE_WAY


@jit
def _boxes_meet(one, other):
    return (
        one[0] <= other[3]
        and other[0] <= one[3]
        and one[1] <= other[4]
        and other[1] <= one[4]
        and one[2] <= other[5]
        and other[2] <= one[5]
    )


@jit
def _look_up(p, faces, box, normal, t, side, stack, order, children, ranges, slab, slack, least, bad):
    """Mark a triangle and those of a tree that it meets."""
    _sides(p, faces[t], normal[t], side)
    stack[0] = 0
    waiting = 1
    while waiting > 0:
        waiting -= 1
        node = stack[waiting]
        for c in range(WIDTH):
            start, stop = ranges[node, c, 0], ranges[node, c, 1]
            if start == stop or _apart(p, faces[t], box[t], normal[t], side, slab[node, c], slack):
                continue
            if children[node, c] >= 0:
                stack[waiting] = children[node, c]
                waiting += 1
                continue
            for q in range(start, stop):
                s = order[q]
                if (
                    s != t
                    and not (bad[s] and bad[t])
                    and _boxes_meet(box[s], box[t])
                    and meet(p, faces[t], faces[s], normal[t], normal[s], least)
                ):
                    bad[s] = True
                    bad[t] = True


@parallel_jit
def _search(position, faces, box, normal, large, order, children, ranges, slab, slack, least, bad):
    """Mark what large triangles and those of a tree meet of each other."""
    for chunk in numba.prange((len(large) + _CHUNK - 1) // _CHUNK):
        side, stack = np.empty((4, 4)), np.empty(STACK, np.int32)
        for q in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, len(large))):
            _look_up(
                position, faces, box, normal, large[q], side, stack, order, children, ranges, slab, slack, least, bad
            )


def large_against_all(position, faces, box, normal, large, least, bad):
    """Mark in ``bad`` (F,) what large triangles meet, and themselves.

    ``position`` (V, 3), ``faces`` (F, 3), their boxes ``box`` (F, 6) and unit normals ``normal`` (F, 3); ``large`` (F,)
    tells which ones are; ``least`` is the height in mm above planes that counts without a look at rounding errors.
    """
    which = np.flatnonzero(large)
    slack = _ROUNDING * float(np.abs(box).max())
    for order in (which.astype(np.int32), np.flatnonzero(~large).astype(np.int32)):
        if len(order) and len(which):
            children, ranges, _ = partition(box, order, False)
            slab = _slabs(position, faces, box, normal, order, ranges)
            _search(position, faces, box, normal, which, order, children, ranges, slab, slack, least, bad)
