"""The strip between two faces and a ball that rolls along their edge, or a chamfer there, as a function of points.

Samples of the strip, in the order of the edge: an origin on the spine (for chamfers: on the edge), its direction and
how far it has come, the radius and its slope (0 for chamfers); for each face the way from the origin to the contact,
the outward normal there, and the line of the face beyond it as a cubic over the tangent (its length, its end's height,
and its slopes at both ends). Between samples the spine is a cubic piece, the rest changes linearly.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import prange

from .jit import jit, parallel_jit
from .spine_samples import nearest_sample
from .stack import CHUNK, dealt

#: Halvings or Newton steps towards the nearest point of the spine.
_ROUNDS = 24

#: Parameter of a piece of the spine that is found.
_TOLERANCE = 1e-12

#: Points farther than so many times its reach from the spine are outside of the strip by the rest at least.
_NEAR = 1.2


class Strips(NamedTuple):
    """Some strips, one after the other.

    Attributes
    ----------
    first : (S + 1,) int64
        Samples of each strip: ``first[s]:first[s + 1]``, N in all.
    origins, directions : (N, 3) float64
    spans, ways, radius, slope : (N,) float64
        Length of the piece of the spine behind each sample (0 behind the last) and of all before it; of the ball.
    reaches, normals : (N, 2, 3) float64
    lines : (N, 2, 4) float64
    turns : (S, 2) float64
        Which way it is along the faces.
    closed, ball : (S,) bool
    margin, reach : (S,) float64
        How far the strip goes beyond the faces, and from the spine.
    slack : (S, 2) float64
        At the start and the end.
    groups : (S + 1,) int64
    middles, members, points, pieces, gap
        Where to start looking, see :mod:`.spine_samples`; ``gap`` is of each strip.
    """

    first: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    spans: np.ndarray
    ways: np.ndarray
    radius: np.ndarray
    slope: np.ndarray
    reaches: np.ndarray
    normals: np.ndarray
    lines: np.ndarray
    turns: np.ndarray
    closed: np.ndarray
    ball: np.ndarray
    margin: np.ndarray
    reach: np.ndarray
    slack: np.ndarray
    groups: np.ndarray
    middles: np.ndarray
    members: np.ndarray
    points: np.ndarray
    pieces: np.ndarray
    gap: np.ndarray


def joined(tables: list[Strips]) -> Strips:
    """Join strips into one table."""
    first, groups, members = ([getattr(table, name) for table in tables] for name in ("first", "groups", "members"))
    columns = {name: np.concatenate([getattr(table, name) for table in tables]) for name in Strips._fields}
    for name, parts in (("first", first), ("groups", groups), ("members", members)):
        columns[name] = np.concatenate([[0], *(np.diff(part) for part in parts)]).cumsum()
    return Strips(**columns)


@jit
def _start(x, table, s, most):
    """Piece of the spine to start looking from, -1 if none is nearer than ``most``; at least so far away."""
    groups = slice(table.groups[s], table.groups[s + 1])
    far, _, sample = nearest_sample(
        x, table.middles[groups], table.members[table.groups[s] : table.groups[s + 1] + 1], table.points,
        table.gap[s], most,
    )  # fmt: skip
    return (table.pieces[sample] if sample >= 0 else -1), far


@jit
def _place(origins, directions, spans, segment, t, c, d):
    """Point of the spine in ``c`` and its derivative in ``d``."""
    s = 1.0 - t
    length = spans[segment]
    for k in range(3):
        p, q = origins[segment, k], origins[segment + 1, k]
        v, w = length * directions[segment, k], length * directions[segment + 1, k]
        c[k] = s * s * (1 + 2 * t) * p + t * t * (1 + 2 * s) * q + t * s * (s * v - t * w)
        d[k] = 6 * t * s * (q - p) + s * (1 - 3 * t) * v + t * (1 - 3 * s) * w


@jit
def _radius(radius, slope, spans, segment, t):
    """Radius, and its derivative over the piece."""
    s = 1.0 - t
    length = spans[segment]
    p, q = radius[segment], radius[segment + 1]
    v, w = length * slope[segment], length * slope[segment + 1]
    r = s * s * (1 + 2 * t) * p + t * t * (1 + 2 * s) * q + t * s * (s * v - t * w)
    return r, 6 * t * s * (q - p) + s * (1 - 3 * t) * v + t * (1 - 3 * s) * w


@jit
def _ahead(x, origins, directions, spans, radius, slope, segment, t, c, d):
    """Positive if the nearest ball is farther along, negative if it is behind."""
    _place(origins, directions, spans, segment, t, c, d)
    _, growth = _radius(radius, slope, spans, segment, t)
    along = away = 0.0
    for k in range(3):
        v = x[k] - c[k]
        along += v * d[k]
        away += v * v
    return along + math.sqrt(away) * growth


@jit
def _nearest(x, origins, directions, spans, radius, slope, closed, start, c, d):
    """Piece of the spine and parameter there of the ball nearest to a point, from a sample nearby."""
    last = len(spans) - 1
    segment = min(start, last)
    turned = 0
    for _ in range(len(spans) + 2):
        if turned <= 0 and _ahead(x, origins, directions, spans, radius, slope, segment, 0.0, c, d) < 0.0:
            if segment == 0 and not closed:
                return 0, 0.0
            segment = segment - 1 if segment > 0 else last
            turned = -1
        elif turned >= 0 and _ahead(x, origins, directions, spans, radius, slope, segment, 1.0, c, d) > 0.0:
            if segment == last and not closed:
                return last, 1.0
            segment = segment + 1 if segment < last else 0
            turned = 1
        else:
            break
    if turned < 0 and _ahead(x, origins, directions, spans, radius, slope, segment, 1.0, c, d) > 0.0:
        return segment, 1.0
    if turned > 0 and _ahead(x, origins, directions, spans, radius, slope, segment, 0.0, c, d) < 0.0:
        return segment, 0.0
    low, high = 0.0, 1.0
    g_low = _ahead(x, origins, directions, spans, radius, slope, segment, low, c, d)
    g_high = _ahead(x, origins, directions, spans, radius, slope, segment, high, c, d)
    t = 0.5
    for number in range(_ROUNDS):
        # regula falsi, the end that stays weighed half (Illinois)
        t = low + (high - low) * (g_low / (g_low - g_high) if g_low > g_high else 0.5)
        g = _ahead(x, origins, directions, spans, radius, slope, segment, t, c, d)
        if g > 0.0:
            if t - low < _TOLERANCE:
                break
            low, g_low = t, g
            g_high *= 0.5 if number > 0 else 1.0
        elif g < 0.0:
            if high - t < _TOLERANCE:
                break
            high, g_high = t, g
            g_low *= 0.5 if number > 0 else 1.0
        else:
            break
    return segment, t


@jit
def _face_line(a, length, height, start, end):
    """Height of a face's line over its tangent at the contact, and its slope, ``a`` mm from there."""
    if a <= 0.0:
        return start * a, start
    if a >= length:
        return height + end * (a - length), end
    t = a / length
    s = 1.0 - t
    h = t * t * (1 + 2 * s) * height + t * s * length * (s * start - t * end)
    return h, 6 * t * s * height / length + s * (1 - 3 * t) * start + t * (1 - 3 * s) * end


@jit
def _strip_at(x, table, s, start, c, d, e, m, gradient):
    """Value and gradient of a strip at a point, and how far along the spine that is.

    The value is the least of: how far outside the ball, or beyond the chamfer; how far within the two contacts; how
    far below the faces, ``margin`` mm above them; how far before each end. An end with ``slack`` is at a corner, whose
    value goes on from there: it limits only what is past it by more than that.
    """
    own = slice(table.first[s], table.first[s + 1])
    origins, directions, radius, slope = table.origins[own], table.directions[own], table.radius[own], table.slope[own]
    spans, ways = table.spans[own][:-1], table.ways[own]
    reaches, normals, lines = table.reaches[own], table.normals[own], table.lines[own]
    closed, ball, margin, turns, slack = table.closed[s], table.ball[s], table.margin[s], table.turns[s], table.slack[s]
    i, t = _nearest(x, origins, directions, spans, radius, slope, closed, start, c, d)
    _place(origins, directions, spans, i, t, c, d)
    r, _ = _radius(radius, slope, spans, i, t)
    speed = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    away = 0.0
    for k in range(3):
        d[k] = d[k] / speed if speed > 0.0 else directions[i, k]
        away += (x[k] - c[k]) ** 2
    away = math.sqrt(away)
    way = ways[i] + t * spans[i]
    best = math.inf
    if ball:
        best = away - r
        for k in range(3):
            gradient[k] = (x[k] - c[k]) / away if away > 0.0 else 0.0
    for side in range(2):
        size = length = 0.0
        for k in range(3):
            e[side, k] = (1 - t) * reaches[i, side, k] + t * reaches[i + 1, side, k]
            m[k] = (1 - t) * normals[i, side, k] + t * normals[i + 1, side, k]
            size += e[side, k] ** 2
            length += m[k] ** 2
        # as long as it should be: chords are shorter
        wanted = 0.0
        for j in range(2):
            far = 0.0
            for k in range(3):
                far += reaches[i + j, side, k] ** 2
            wanted += (t if j == 1 else 1 - t) * math.sqrt(far)
        if ball:
            wanted = r
        scale = wanted / math.sqrt(size)
        length = math.sqrt(length)
        for k in range(3):
            e[side, k] *= scale
            m[k] /= length
        # along the face, across the edge
        f0 = turns[side] * (d[1] * m[2] - d[2] * m[1])
        f1 = turns[side] * (d[2] * m[0] - d[0] * m[2])
        f2 = turns[side] * (d[0] * m[1] - d[1] * m[0])
        f = math.sqrt(f0 * f0 + f1 * f1 + f2 * f2)
        f0, f1, f2 = f0 / f, f1 / f, f2 / f
        p0, p1, p2 = x[0] - c[0] - e[side, 0], x[1] - c[1] - e[side, 1], x[2] - c[2] - e[side, 2]
        a = p0 * f0 + p1 * f1 + p2 * f2
        if ball and a < best:
            best = a
            gradient[0], gradient[1], gradient[2] = f0, f1, f2
        l0 = (1 - t) * lines[i, side, 0] + t * lines[i + 1, side, 0]
        l1 = (1 - t) * lines[i, side, 1] + t * lines[i + 1, side, 1]
        l2 = (1 - t) * lines[i, side, 2] + t * lines[i + 1, side, 2]
        l3 = (1 - t) * lines[i, side, 3] + t * lines[i + 1, side, 3]
        h, bend = _face_line(a, l0, l1, l2, l3)
        below = h + margin - (p0 * m[0] + p1 * m[1] + p2 * m[2])
        if below < best:
            best = below
            gradient[0] = bend * f0 - m[0]
            gradient[1] = bend * f1 - m[1]
            gradient[2] = bend * f2 - m[2]
    if not ball:
        # normal of the chamfer, towards the edge: the origin is there
        g0 = d[1] * (e[1, 2] - e[0, 2]) - d[2] * (e[1, 1] - e[0, 1])
        g1 = d[2] * (e[1, 0] - e[0, 0]) - d[0] * (e[1, 2] - e[0, 2])
        g2 = d[0] * (e[1, 1] - e[0, 1]) - d[1] * (e[1, 0] - e[0, 0])
        g = math.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
        if g0 * e[0, 0] + g1 * e[0, 1] + g2 * e[0, 2] > 0.0:
            g = -g
        g0, g1, g2 = g0 / g, g1 / g, g2 / g
        beyond = (
            (x[0] - c[0] - e[0, 0]) * g0 + (x[1] - c[1] - e[0, 1]) * g1 + (x[2] - c[2] - e[0, 2]) * g2
        )  # fmt: skip
        if beyond < best:
            best = beyond
            gradient[0], gradient[1], gradient[2] = g0, g1, g2
    if not closed:
        past_start = past_end = 0.0
        if i == 0 and t == 0.0:
            past_start = _along(x, c, d)
        if i == len(spans) - 1 and t == 1.0:
            past_end = _along(x, c, d)
        before = way + past_start
        after = ways[len(spans)] - way - past_end
        way += past_start + past_end
        if before < best and (before < -slack[0] or slack[0] == 0.0):
            best = before
            gradient[0], gradient[1], gradient[2] = d[0], d[1], d[2]
        if after < best and (after < -slack[1] or slack[1] == 0.0):
            best = after
            gradient[0], gradient[1], gradient[2] = -d[0], -d[1], -d[2]
    return best, way


@parallel_jit
def strips(points, which, strip, table, value, gradient, way):
    """Value and gradient of strips at some of the points, and how far along their spines they are.

    Far off the values are upper bounds, and the rest is zero.
    """
    chunks = (len(which) + CHUNK - 1) // CHUNK
    for number in prange(chunks):
        c, d, e, m, chunk = np.empty(3), np.empty(3), np.empty((2, 3)), np.empty(3), dealt(np.int64(number), chunks)
        for n in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(which))):
            x, s = points[which[n]], strip[n]
            reach = table.reach[s]
            start, far = _start(x, table, s, _NEAR * reach)
            value[n] = reach - max(far, _NEAR * reach)
            if start >= 0:
                value[n], way[n] = _strip_at(x, table, s, start, c, d, e, m, gradient[n])


@parallel_jit
def sectors(points, table, value, gradient, within):
    """How far points are outside the ball of a strip, the gradient of that, how far beyond the contacts with faces."""
    origins, directions, spans, radius, slope = (
        table.origins, table.directions, table.spans[:-1], table.radius, table.slope,
    )  # fmt: skip
    normals, turns, closed = table.normals, table.turns[0], table.closed[0]
    for n in prange(len(points)):
        x = points[n]
        c, d, m = np.empty(3), np.empty(3), np.empty(3)
        start, _ = _start(x, table, 0, math.inf)
        i, t = _nearest(x, origins, directions, spans, radius, slope, closed, start, c, d)
        _place(origins, directions, spans, i, t, c, d)
        r, _ = _radius(radius, slope, spans, i, t)
        away = math.sqrt((x[0] - c[0]) ** 2 + (x[1] - c[1]) ** 2 + (x[2] - c[2]) ** 2)
        value[n] = away - r
        for k in range(3):
            gradient[n, k] = (x[k] - c[k]) / away if away > 0.0 else 0.0
        for side in range(2):
            for k in range(3):
                m[k] = turns[side] * ((1 - t) * normals[i, side, k] + t * normals[i + 1, side, k])
            f0, f1, f2 = d[1] * m[2] - d[2] * m[1], d[2] * m[0] - d[0] * m[2], d[0] * m[1] - d[1] * m[0]
            f = math.sqrt(f0 * f0 + f1 * f1 + f2 * f2)
            within[n, side] = ((x[0] - c[0]) * f0 + (x[1] - c[1]) * f1 + (x[2] - c[2]) * f2) / f


@jit
def unite(which, value, gradient, best, best_gradient):
    """Replace values and gradients of points by larger ones."""
    for n in range(len(which)):
        p = which[n]
        if value[n] > best[p]:
            best[p] = value[n]
            for k in range(3):
                best_gradient[p, k] = gradient[n, k]


@jit
def _along(x, c, d):
    return (x[0] - c[0]) * d[0] + (x[1] - c[1]) * d[1] + (x[2] - c[2]) * d[2]
