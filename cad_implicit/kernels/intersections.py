"""Which triangles of a closed mesh run through each other, or lie on each other.

Triangles are sorted into the bins of a coarse grid. Where all triangles of a bin face one way there is nothing to
find: between two sheets that cross there, a third one or a fold faces the other way. Elsewhere all pairs in a bin are
tried: two triangles cross if an edge of one runs through the other, as the signs of volumes tell, trusted beyond their
rounding error only.
"""

import math

import numba
import numpy as np

from .jit import jit, parallel_jit

#: Width of the bins in spacings, and the most bins: more would take more memory than the mesh. On 96,000 triangles of a
#: bracket, bins of 1.5 and 2 spacings take 16 and 17 ms on one thread.
_BIN = 1.5
_MOST_BINS = 1 << 22

#: Triangles face one way if none is farther from their mean direction than this cosine (41 degrees).
_CALM = 0.75

#: Rounding errors of volumes and areas relative to the sum of their absolute products: Shewchuk 1997,
#: DOI 10.1007/PL00009321, stage A.
_VOLUME_ERROR = 7.8e-16
_AREA_ERROR = 3.4e-16

#: Neighbours across an edge that enclose less than 0.11 degrees (cosine) lie on each other.
_FOLDED = 1 - 1.8e-6

#: Heights above a plane that count without a look at rounding errors, in spacings: those of normals of slivers of 0.01
#: degrees are 1e-12.
_CLEAR = 1e-6

_CHUNK = 64


@parallel_jit
def _boxes(position, faces):
    """Bounding boxes (F, 6) and unit normals (F, 3) of triangles, zero without area."""
    box = np.empty((len(faces), 6))
    normal = np.zeros((len(faces), 3))
    for t in numba.prange(len(faces)):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        for d in range(3):
            x, y, z = position[a, d], position[b, d], position[c, d]
            box[t, d], box[t, 3 + d] = min(x, min(y, z)), max(x, max(y, z))
        ux, uy, uz = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1], position[b, 2] - position[a, 2]
        vx, vy, vz = position[c, 0] - position[a, 0], position[c, 1] - position[a, 1], position[c, 2] - position[a, 2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = math.sqrt(x * x + y * y + z * z)
        if area > 0:
            normal[t, 0], normal[t, 1], normal[t, 2] = x / area, y / area, z / area
    return box, normal


@jit
def _bins(box, spacing):
    """Sort triangles into bins: the first entry (N + 1,) of each bin, and the triangles (M,) of all entries."""
    low, high, count = np.full(3, math.inf), np.full(3, -math.inf), np.zeros(3, np.int64)
    for t in range(len(box)):
        for d in range(3):
            low[d], high[d] = min(low[d], box[t, d]), max(high[d], box[t, 3 + d])
    width = _BIN * spacing
    total = 0
    while total == 0 or total > _MOST_BINS:
        total = 1
        for d in range(3):
            count[d] = int(min((high[d] - low[d]) / width, 1e6)) + 1
            total *= count[d]
        if total > _MOST_BINS:
            width *= 1.25
    start = np.zeros(total + 2, np.int32)
    entries = np.empty(0, np.int32)
    at = np.empty(6, np.int64)
    # Count, then fill: ``start`` is one ahead, and moves back as the bins fill.
    for fill in range(2):
        for t in range(len(box)):
            for d in range(6):
                at[d] = min(int((box[t, d] - low[d % 3]) / width), count[d % 3] - 1)
            for i in range(at[0], at[3] + 1):
                for j in range(at[1], at[4] + 1):
                    for k in range(at[2], at[5] + 1):
                        b = (i * count[1] + j) * count[2] + k
                        if fill == 0:
                            start[b + 2] += 1
                        else:
                            entries[start[b + 1]] = t
                            start[b + 1] += 1
        if fill == 0:
            for b in range(total):
                start[b + 2] += start[b + 1]
            entries = np.empty(start[total + 1], np.int32)
    return start[: total + 1], entries


@jit
def _calm(normal, entries):
    """Whether all triangles face one way."""
    x, y, z = 0.0, 0.0, 0.0
    for e in range(len(entries)):
        t = entries[e]
        x, y, z = x + normal[t, 0], y + normal[t, 1], z + normal[t, 2]
    least = _CALM * math.sqrt(x * x + y * y + z * z)
    if least == 0:
        return False
    for e in range(len(entries)):
        t = entries[e]
        if x * normal[t, 0] + y * normal[t, 1] + z * normal[t, 2] < least:
            return False
    return True


@jit
def _volume_sign(p, a, b, c, d):
    """Sign of the volume of a tetrahedron of vertices; 0 within rounding error."""
    ax, ay, az = p[a, 0] - p[d, 0], p[a, 1] - p[d, 1], p[a, 2] - p[d, 2]
    bx, by, bz = p[b, 0] - p[d, 0], p[b, 1] - p[d, 1], p[b, 2] - p[d, 2]
    cx, cy, cz = p[c, 0] - p[d, 0], p[c, 1] - p[d, 1], p[c, 2] - p[d, 2]
    value = az * (bx * cy - cx * by) + bz * (cx * ay - ax * cy) + cz * (ax * by - bx * ay)
    size = (
        abs(az) * (abs(bx * cy) + abs(cx * by))
        + abs(bz) * (abs(cx * ay) + abs(ax * cy))
        + abs(cz) * (abs(ax * by) + abs(bx * ay))
    )
    if abs(value) <= _VOLUME_ERROR * size:
        return 0
    return 1 if value > 0 else -1


@jit
def _area_sign(p, a, b, c, u, v):
    """Sign of the area of a triangle of vertices seen along one axis, by the axes ``u`` and ``v``."""
    left = (p[a, u] - p[c, u]) * (p[b, v] - p[c, v])
    right = (p[a, v] - p[c, v]) * (p[b, u] - p[c, u])
    if abs(left - right) <= _AREA_ERROR * (abs(left) + abs(right)):
        return 0
    return 1 if left > right else -1


@jit
def _pierced(p, f, g):
    """Whether triangle ``g`` has an edge that runs through ``f`` (1), or lies in its plane (2); else 0."""
    s0, s1, s2 = (
        _volume_sign(p, f[0], f[1], f[2], g[0]),
        _volume_sign(p, f[0], f[1], f[2], g[1]),
        _volume_sign(p, f[0], f[1], f[2], g[2]),
    )
    if s0 == 0 and s1 == 0 and s2 == 0:
        return 2
    for k in range(3):
        a, b = (s0, s1) if k == 0 else ((s1, s2) if k == 1 else (s2, s0))
        if a * b < 0:
            u, v = g[k], g[(k + 1) % 3]
            first = _volume_sign(p, u, v, f[0], f[1])
            if first != 0 and first == _volume_sign(p, u, v, f[1], f[2]) == _volume_sign(p, u, v, f[2], f[0]):
                return 1
    return 0


@jit
def _beyond(p, f, g, turn, u, v):
    """Whether an edge of triangle ``f`` has all of ``g`` beyond it, in their common plane."""
    for k in range(3):
        a, b = f[k], f[(k + 1) % 3]
        apart = True
        for m in range(3):
            if _area_sign(p, a, b, g[m], u, v) * turn > 0:
                apart = False
        if apart:
            return True
    return False


@jit
def _overlap(p, f, g, normal):
    """Whether two triangles in one plane share area."""
    x, y, z = abs(normal[0]), abs(normal[1]), abs(normal[2])
    u, v = 0, 1
    if x >= y and x >= z:
        u, v = 1, 2
    elif y >= z:
        u, v = 2, 0
    one, other = _area_sign(p, f[0], f[1], f[2], u, v), _area_sign(p, g[0], g[1], g[2], u, v)
    if one == 0 or other == 0:
        return False
    return not (_beyond(p, f, g, one, u, v) or _beyond(p, g, f, other, u, v))


@jit
def _folded(p, f, g):
    """Whether two triangles with a common edge enclose next to no angle."""
    i, j = 0, 0
    for k in range(3):
        if f[k] != g[0] and f[k] != g[1] and f[k] != g[2]:
            i = k
        if g[k] != f[0] and g[k] != f[1] and g[k] != f[2]:
            j = k
    s, e, a, b = f[(i + 1) % 3], f[(i + 2) % 3], f[i], g[j]
    length2, along_a, along_b = 0.0, 0.0, 0.0
    for d in range(3):
        edge = p[e, d] - p[s, d]
        length2 += edge * edge
        along_a += edge * (p[a, d] - p[s, d])
        along_b += edge * (p[b, d] - p[s, d])
    if length2 == 0:
        return False
    aa, bb, ab = 0.0, 0.0, 0.0
    for d in range(3):
        edge = p[e, d] - p[s, d]
        across_a = p[a, d] - p[s, d] - edge * along_a / length2
        across_b = p[b, d] - p[s, d] - edge * along_b / length2
        aa += across_a * across_a
        bb += across_b * across_b
        ab += across_a * across_b
    return ab > 0 and ab > _FOLDED * math.sqrt(aa * bb)


@jit
def _one_side(p, f, g, normal, least):
    """Whether the corners of triangle ``g`` that are not corners of ``f`` are clearly on one side of its plane."""
    below, above = 0, 0
    for k in range(3):
        v = g[k]
        if v != f[0] and v != f[1] and v != f[2]:
            height = 0.0
            for d in range(3):
                height += normal[d] * (p[v, d] - p[f[0], d])
            below += not height > least
            above += not height < -least
    return below == 0 or above == 0


@jit
def _beside(p, v, a, b, c, d, normal, least):
    """Whether triangle ``v c d`` is clearly beyond an edge at ``v`` of triangle ``v a b``, seen along its normal."""
    x, y, z = normal[0], normal[1], normal[2]
    px, py, pz = p[c, 0] - p[v, 0], p[c, 1] - p[v, 1], p[c, 2] - p[v, 2]
    qx, qy, qz = p[d, 0] - p[v, 0], p[d, 1] - p[v, 1], p[d, 2] - p[v, 2]
    for side in range(2):
        end = a if side == 0 else b
        ex, ey, ez = p[end, 0] - p[v, 0], p[end, 1] - p[v, 1], p[end, 2] - p[v, 2]
        ix, iy, iz = y * ez - z * ey, z * ex - x * ez, x * ey - y * ex
        one, other = ix * px + iy * py + iz * pz, ix * qx + iy * qy + iz * qz
        limit = least * (abs(ex) + abs(ey) + abs(ez))
        if (one < -limit and other < -limit) if side == 0 else (one > limit and other > limit):
            return True
    return False


@jit
def _meet(p, f, g, normal, other, least):
    """Whether two triangles with their unit normals share points that they should not share."""
    common, i, j = 0, 0, 0
    for k in range(3):
        for m in range(3):
            if f[k] == g[m]:
                common, i, j = common + 1, k, m
    if common == 3:
        return True
    if common == 2:
        cosine = normal[0] * other[0] + normal[1] * other[1] + normal[2] * other[2]
        return cosine < 0 and _folded(p, f, g)
    if common == 1:
        v, a, b, c, d = f[i], f[(i + 1) % 3], f[(i + 2) % 3], g[(j + 1) % 3], g[(j + 2) % 3]
        if _beside(p, v, a, b, c, d, normal, least) or _beside(p, v, c, d, a, b, other, least):
            return False
    if _one_side(p, f, g, normal, least) or _one_side(p, g, f, other, least):
        return False
    there = _pierced(p, f, g)
    if there == 2:
        return _overlap(p, f, g, normal)
    return there == 1 or _pierced(p, g, f) == 1


@jit
def _try_pairs(p, faces, box, normal, entries, least, bad):
    """Mark the triangles of a bin that meet others of it."""
    for m in range(len(entries)):
        s = entries[m]
        for n in range(m):
            t = entries[n]
            if (
                box[s, 0] <= box[t, 3]
                and box[t, 0] <= box[s, 3]
                and box[s, 1] <= box[t, 4]
                and box[t, 1] <= box[s, 4]
                and box[s, 2] <= box[t, 5]
                and box[t, 2] <= box[s, 5]
                and not (bad[s] and bad[t])
                and _meet(p, faces[s], faces[t], normal[s], normal[t], least)
            ):
                bad[s] = True
                bad[t] = True


@parallel_jit
def _search(position, faces, box, normal, start, entries, least, bad):
    """Mark the triangles that meet others, bin by bin."""
    bins = len(start) - 1
    for chunk in numba.prange((bins + _CHUNK - 1) // _CHUNK):
        for b in range(chunk * _CHUNK, min((chunk + 1) * _CHUNK, bins)):
            inside = entries[start[b] : start[b + 1]]
            if len(inside) > 1 and not _calm(normal, inside):
                _try_pairs(position, faces, box, normal, inside, least, bad)


def intersecting(position: np.ndarray, faces: np.ndarray, spacing: float) -> np.ndarray:
    """Which triangles (F,) run through others or lie on others.

    ``position`` (V, 3) and ``spacing``, about the size of the triangles, are in mm, ``faces`` (F, 3) int32. Call it
    inside :func:`cad_implicit.parallel.threads`.
    """
    bad = np.zeros(len(faces), np.bool_)
    if len(faces):
        box, normal = _boxes(position, faces)
        start, entries = _bins(box, spacing)
        _search(position, faces, box, normal, start, entries, _CLEAR * spacing, bad)
    return bad
