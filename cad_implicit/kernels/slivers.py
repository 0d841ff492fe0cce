"""Thin and folded triangles: collapse tiny edges, flip the long edges of flat caps.

Neither changes the topology (link condition), moves a vertex, or shifts the surface by more than a hundredth of
a spacing. Corners of triangles are kept in a linked list for each vertex: corner ``3 t + c`` is corner c of triangle t.
"""

import math

import numpy as np

from .jit import jit

#: Sine of 2 degrees: triangles with a smaller angle are slivers.
_THIN = 0.035

#: Farthest that the surface may shift, in spacings: at smooth vertices and at sharp ones, doubled to mend a fold.
#: Flat faces and straight creases do not shift at all; at curved ones the triangles are off by up to 0.3 h²/r in any
#: case. With a tenth of this, two crossing cylinders of 7 h and 9 h radius kept 129 triangles below 1 degree of 49,000
#: and 254 self-intersecting pairs, instead of 0 and 21.
_SMOOTH_SHIFT = 0.02
_SHARP_SHIFT = 0.03

#: A triangle faces its field normal above this cosine. Folds at a plane rim lie in its plane, where the cosine is
#: rounding noise: with 0 for this and 0.01 for the shift, 18 contours of turned parts kept 116 self-intersecting pairs,
#: with 0.3 and 0.03 they keep 20.
_FACING = 0.3

_ROUNDS = 8

#: Rank of a vertex whose triangles stay as they are.
FIXED = 4


@jit
def _quality(p, a, b, c, facing):
    """Sine of the smallest angle; minus one less the cosine for a triangle that faces the wrong way."""
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area = math.sqrt(x * x + y * y + z * z)
    uu, vv, ww = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    longest = math.sqrt(max(uu * vv, max(vv * ww, ww * uu)))
    if area == 0 or longest == 0:
        return 0.0
    along = x * facing[0] + y * facing[1] + z * facing[2]
    return area / longest if along > _FACING * area else -1.0 + along / area


@jit
def _height(p, point, a, b, c):
    """Distance of vertex ``point`` from the plane of a triangle."""
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area = math.sqrt(x * x + y * y + z * z)
    if area == 0:
        return math.inf
    return abs(x * (p[point, 0] - p[a, 0]) + y * (p[point, 1] - p[a, 1]) + z * (p[point, 2] - p[a, 2])) / area


@jit
def _link(faces, count):
    """First corner (V,) of each vertex; next and previous corner (3 F, 2) of the same vertex, -1 at the ends.

    Where seams run through large faces, thousands of triangles fan out from one vertex: nothing may walk through all of
    them for each triangle.
    """
    head = np.full(count, -1, np.int32)
    following = np.empty((3 * len(faces), 2), np.int32)
    for t in range(len(faces) - 1, -1, -1):
        for c in range(3):
            _put_first(head, following, faces[t, c], 3 * t + c)
    return head, following


@jit
def _put_first(head, following, vertex, corner):
    first = head[vertex]
    following[corner, 0], following[corner, 1] = first, -1
    if first >= 0:
        following[first, 1] = corner
    head[vertex] = corner


@jit
def _unlink(head, following, vertex, corner):
    after, before = following[corner, 0], following[corner, 1]
    if before < 0:
        head[vertex] = after
    else:
        following[before, 0] = after
    if after >= 0:
        following[after, 1] = before


@jit
def _replace(faces, head, following, corner, vertex):
    """Give a corner another vertex."""
    _unlink(head, following, faces[corner // 3, corner % 3], corner)
    faces[corner // 3, corner % 3] = vertex
    _put_first(head, following, vertex, corner)


@jit
def _few(head, following, vertex):
    """Whether a vertex has less than four triangles."""
    n = 0
    corner = head[vertex]
    while corner >= 0 and n < 4:
        n += 1
        corner = following[corner, 0]
    return n < 4


@jit
def _joined(faces, head, following, u, v):
    """Whether an edge joins two vertices; looks through the triangles of both in step."""
    one, other = head[u], head[v]
    while one >= 0 and other >= 0:
        t = one // 3
        if faces[t, 0] == v or faces[t, 1] == v or faces[t, 2] == v:
            return True
        t = other // 3
        if faces[t, 0] == u or faces[t, 1] == u or faces[t, 2] == u:
            return True
        one, other = following[one, 0], following[other, 0]
    return False


@jit
def _may_merge(faces, head, following, u, v):
    """Link condition: u and v have exactly the two opposite vertices in common, none of them of valence three."""
    common = 0
    corner = head[u]
    while corner >= 0:
        t, c = corner // 3, corner % 3
        # Around a closed vertex each neighbour follows the vertex in exactly one triangle.
        w = faces[t, (c + 1) % 3]
        if w != v and _joined(faces, head, following, v, w):
            common += 1
            if common > 2 or _few(head, following, w):
                return False
        corner = following[corner, 0]
    return common == 2


@jit
def _merge_gain(p, faces, facing, rank, head, following, u, v, spacing):
    """By how much the worst triangle around u improves if u moves to v; negative if it must not."""
    if rank[u] > rank[v] or rank[v] >= FIXED:
        return -1.0
    before, after = 2.0, 2.0
    corner = head[u]
    while corner >= 0:
        t, c = corner // 3, corner % 3
        before = min(before, _quality(p, faces[t, 0], faces[t, 1], faces[t, 2], facing[t]))
        corner = following[corner, 0]
    allowed = spacing * (_SHARP_SHIFT if rank[u] > 1 else _SMOOTH_SHIFT) * (2 if before < 0 else 1)
    corner = head[u]
    while corner >= 0:
        t, c = corner // 3, corner % 3
        a, b = faces[t, (c + 1) % 3], faces[t, (c + 2) % 3]
        if a != v and b != v:
            after = min(after, _quality(p, v, a, b, facing[t]))
            if after <= before or _height(p, u, v, a, b) > allowed:
                return -1.0
        corner = following[corner, 0]
    return after - before


@jit
def _merge(faces, alive, head, following, u, v):
    """Move u to v, deleting the two triangles between."""
    corner = head[u]
    while corner >= 0:
        after = following[corner, 0]
        t, c = corner // 3, corner % 3
        if faces[t, (c + 1) % 3] == v or faces[t, (c + 2) % 3] == v:
            alive[t] = False
            for d in range(3):
                if d != c:
                    _unlink(head, following, faces[t, d], 3 * t + d)
        else:
            faces[t, c] = v
            _put_first(head, following, v, corner)
        corner = after
    head[u] = -1


@jit
def _across(faces, head, following, t, c):
    """Corner opposite to corner c of triangle t in the triangle on the other side of the edge, or -1."""
    a, b = faces[t, (c + 1) % 3], faces[t, (c + 2) % 3]
    one, other = head[a], head[b]
    while one >= 0 and other >= 0:
        s, e = one // 3, one % 3
        if faces[s, (e + 2) % 3] == b:
            return 3 * s + (e + 1) % 3
        s, e = other // 3, other % 3
        if faces[s, (e + 1) % 3] == a:
            return 3 * s + (e + 2) % 3
        one, other = following[one, 0], following[other, 0]
    return -1


@jit
def _gap(p, a, b, c, d):
    """Distance between the lines a b and c d."""
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[d, 0] - p[c, 0], p[d, 1] - p[c, 1], p[d, 2] - p[c, 2]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0:
        return math.inf
    return abs(x * (p[c, 0] - p[a, 0]) + y * (p[c, 1] - p[a, 1]) + z * (p[c, 2] - p[a, 2])) / length


@jit
def _try_flip(p, faces, facing, rank, head, following, t, c, spacing):
    """Turn the edge opposite to corner c of triangle t if that helps."""
    other = _across(faces, head, following, t, c)
    if other < 0:
        return False
    s, e = other // 3, other % 3
    top, a, b, bottom = faces[t, c], faces[t, (c + 1) % 3], faces[t, (c + 2) % 3], faces[s, e]
    if max(max(rank[top], rank[bottom]), max(rank[a], rank[b])) >= FIXED:
        return False
    if top == bottom or _joined(faces, head, following, top, bottom):
        return False
    if _few(head, following, a) or _few(head, following, b):
        return False
    before, after = 2.0, 2.0
    corners = ((top, a, b, t), (bottom, b, a, s), (top, a, bottom, s), (top, bottom, b, s))
    for row in range(4):
        x, y, z, side = corners[row]
        quality = _quality(p, x, y, z, facing[side])
        if row < 2:
            before = min(before, quality)
        else:
            after = min(after, quality)
    allowed = spacing * (_SHARP_SHIFT if rank[a] > 1 and rank[b] > 1 else _SMOOTH_SHIFT) * (2 if before < 0 else 1)
    if after <= before or _gap(p, a, b, top, bottom) > allowed:
        return False
    _replace(faces, head, following, 3 * t + (c + 2) % 3, bottom)
    _replace(faces, head, following, 3 * s + (e + 2) % 3, top)
    for d in range(3):
        facing[t, d] = facing[s, d]
    return True


@jit
def _try_merge(p, faces, facing, rank, alive, head, following, u, v, spacing):
    """Collapse the edge u v, in the better direction, if that helps."""
    best = 0.0
    gone, kept = u, v
    for _ in range(2):
        gain = _merge_gain(p, faces, facing, rank, head, following, u, v, spacing)
        if gain > best:
            best = gain
            gone, kept = u, v
        u, v = v, u
    if best <= 0 or not _may_merge(faces, head, following, gone, kept):
        return False
    _merge(faces, alive, head, following, gone, kept)
    return True


@jit
def _edge_order(p, faces, t, order):
    """Corners of triangle t by the length of the opposite edge, shortest first."""
    lengths = np.empty(3)
    for c in range(3):
        a, b = faces[t, (c + 1) % 3], faces[t, (c + 2) % 3]
        lengths[c] = (p[a, 0] - p[b, 0]) ** 2 + (p[a, 1] - p[b, 1]) ** 2 + (p[a, 2] - p[b, 2]) ** 2
        order[c] = c
    for c in range(1, 3):
        at = c
        while at > 0 and lengths[order[at]] < lengths[order[at - 1]]:
            order[at], order[at - 1] = order[at - 1], order[at]
            at -= 1


@jit
def _mend(p, faces, facing, rank, alive, head, following, t, order, spacing):
    _edge_order(p, faces, t, order)
    for q in range(3):
        c = order[q]
        u, v = faces[t, (c + 1) % 3], faces[t, (c + 2) % 3]
        if _try_merge(p, faces, facing, rank, alive, head, following, u, v, spacing):
            return True
        if _try_flip(p, faces, facing, rank, head, following, t, order[2 - q], spacing):
            return True
    return False


@jit
def remove_slivers(position, faces, facing, rank, spacing):
    """Mend thin and folded triangles in place; returns which triangles (F,) are left.

    ``facing`` (F, 3) is the direction that each triangle should face; ``rank`` (V,) is above 1 for sharp vertices,
    and ``FIXED`` for those whose triangles stay.
    """
    count = len(faces)
    alive = np.ones(count, np.bool_)
    bad = np.empty(count, np.int64)
    n = 0
    for t in range(count):
        if _quality(position, faces[t, 0], faces[t, 1], faces[t, 2], facing[t]) < _THIN:
            bad[n] = t
            n += 1
    if n == 0:
        return alive
    head, following = _link(faces, len(position))
    order = np.empty(3, np.int64)
    for _ in range(_ROUNDS):
        left = 0
        mended = False
        for q in range(n):
            t = bad[q]
            if not alive[t]:
                continue
            if _quality(position, faces[t, 0], faces[t, 1], faces[t, 2], facing[t]) >= _THIN:
                continue
            if _mend(position, faces, facing, rank, alive, head, following, t, order, spacing):
                mended = True
            if alive[t]:
                bad[left] = t
                left += 1
        n = left
        if n == 0 or not mended:
            break
    return alive


@jit
def compact(position, faces):
    """Keep the used vertices (V, 3) in their order, the faces (F, 3) with new numbers; tell the old ones (V,)."""
    number = np.full(len(position), -1, np.int32)
    for t in range(len(faces)):
        for c in range(3):
            number[faces[t, c]] = 0
    n = 0
    for v in range(len(position)):
        if number[v] == 0:
            number[v] = n
            n += 1
    vertices = np.empty((n, 3))
    kept = np.empty(n, np.int32)
    out = np.empty((len(faces), 3), np.int32)
    for v in range(len(position)):
        if number[v] >= 0:
            kept[number[v]] = v
            for d in range(3):
                vertices[number[v], d] = position[v, d]
    for t in range(len(faces)):
        for c in range(3):
            out[t, c] = number[faces[t, c]]
    return vertices, out, kept
