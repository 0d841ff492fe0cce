"""Whether two triangles of a mesh run through each other, or lie on each other.

They cross if an edge of one runs through the other, as the signs of volumes tell, trusted beyond their rounding error
only. Neighbours must not be folded onto each other.
"""

import math

from .jit import jit

#: Rounding errors of volumes and areas relative to the sum of their absolute products: Shewchuk 1997,
#: DOI 10.1007/PL00009321, stage A.
_VOLUME_ERROR = 7.8e-16
_AREA_ERROR = 3.4e-16

#: Neighbours across an edge that enclose less than 0.11 degrees (cosine) lie on each other.
_FOLDED = 1 - 1.8e-6


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
def meet(p, f, g, normal, other, least):
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
