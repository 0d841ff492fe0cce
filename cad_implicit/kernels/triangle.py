"""One triangle and one point: closest point, feature, solid angle.

Triangles are rows of ``corners``: nine numbers, the three corners one after the other.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from .jit import jit, parallel_jit
from .lanes import choose, lanes, larger, smaller
from .partition import LEAF

#: What part of a triangle is closest to a point: the face, the edge that starts at corner 0, 1 or 2, or a corner.
FACE, EDGE, CORNER = 0, 1, 4

#: A triangle lower than this, relative to its longest edge, counts as its three edges: below it rounding decides
#: the direction of its normal.
FLAT = 1e-10

#: Squared height over longest edge below which the determinant that gives the area cancels too much (10 digits left).
_THIN = 1e-6
_NOWHERE = 1e100


@jit
def closest_on_segment(ax, ay, az, bx, by, bz, px, py, pz):
    """Squared distance, closest point and parameter in [0, 1] on the segment from a to b."""
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = px - ax, py - ay, pz - az
    length2 = ux * ux + uy * uy + uz * uz
    t = 0.0
    if length2 > 0.0:
        t = min(max((ux * vx + uy * vy + uz * vz) / length2, 0.0), 1.0)
    x, y, z = ax + t * ux, ay + t * uy, az + t * uz
    if t == 1.0:
        x, y, z = bx, by, bz
    return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2, x, y, z, t


@jit
def closest_on_thin(corners, t, px, py, pz):
    """Do the same as :func:`closest_on_triangle` for a thin or flat triangle: the face, or the nearest edge."""
    ax, ay, az = corners[t, 0], corners[t, 1], corners[t, 2]
    ux, uy, uz = corners[t, 3] - ax, corners[t, 4] - ay, corners[t, 5] - az
    vx, vy, vz = corners[t, 6] - ax, corners[t, 7] - ay, corners[t, 8] - az
    wx, wy, wz = px - ax, py - ay, pz - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    area2 = nx * nx + ny * ny + nz * nz
    longest2 = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    if area2 > FLAT * FLAT * longest2 * longest2:
        s = (nx * (wy * vz - wz * vy) + ny * (wz * vx - wx * vz) + nz * (wx * vy - wy * vx)) / area2
        r = (nx * (uy * wz - uz * wy) + ny * (uz * wx - ux * wz) + nz * (ux * wy - uy * wx)) / area2
        if s > 0.0 and r > 0.0 and s + r < 1.0:
            x, y, z = ax + s * ux + r * vx, ay + s * uy + r * vy, az + s * uz + r * vz
            return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2, x, y, z, FACE
    best, x, y, z, feature = math.inf, px, py, pz, EDGE
    for edge in range(3):
        a, b = 3 * edge, 3 * ((edge + 1) % 3)
        d2, cx, cy, cz, where = closest_on_segment(
            corners[t, a], corners[t, a + 1], corners[t, a + 2], corners[t, b], corners[t, b + 1], corners[t, b + 2],
            px, py, pz,
        )  # fmt: skip
        if d2 < best:
            best, x, y, z, feature = d2, cx, cy, cz, EDGE + edge
            if where == 0.0:
                feature = CORNER + edge
            elif where == 1.0:
                feature = CORNER + (edge + 1) % 3
    return best, x, y, z, feature


@jit
def closest_on_triangle(corners, t, px, py, pz):
    """Squared distance, closest point and feature of triangle t (Voronoi regions, Ericson 2005, section 5.1.5)."""
    ax, ay, az = corners[t, 0], corners[t, 1], corners[t, 2]
    ux, uy, uz = corners[t, 3] - ax, corners[t, 4] - ay, corners[t, 5] - az
    vx, vy, vz = corners[t, 6] - ax, corners[t, 7] - ay, corners[t, 8] - az
    wx, wy, wz = px - ax, py - ay, pz - az
    wu, wv = wx * ux + wy * uy + wz * uz, wx * vx + wy * vy + wz * vz
    if wu <= 0.0 and wv <= 0.0:
        return wx * wx + wy * wy + wz * wz, ax, ay, az, CORNER
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    if wu >= uu and wv - uv <= wu - uu:
        x, y, z = corners[t, 3], corners[t, 4], corners[t, 5]
        return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2, x, y, z, CORNER + 1
    if wv >= vv and wu - uv <= wv - vv:
        x, y, z = corners[t, 6], corners[t, 7], corners[t, 8]
        return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2, x, y, z, CORNER + 2
    area2 = uu * vv - uv * uv
    longest2 = max(uu, vv)
    if not area2 > _THIN * longest2 * longest2:
        return closest_on_thin(corners, t, px, py, pz)
    # barycentric coordinates, times area2
    beta, gamma = wu * vv - wv * uv, wv * uu - wu * uv
    alpha = area2 - beta - gamma
    feature = FACE
    if gamma <= 0.0 and 0.0 <= wu <= uu:
        s, r, feature = wu / uu, 0.0, EDGE
    elif beta <= 0.0 and 0.0 <= wv <= vv:
        s, r, feature = 0.0, wv / vv, EDGE + 2
    else:
        from_b, from_c = (wv - uv) - (wu - uu), (wu - uv) - (wv - vv)
        if alpha <= 0.0 and from_b >= 0.0 and from_c >= 0.0:
            r = from_b / (from_b + from_c)
            s, feature = 1.0 - r, EDGE + 1
        else:
            s, r = beta / area2, gamma / area2
    x, y, z = ax + s * ux + r * vx, ay + s * uy + r * vy, az + s * uz + r * vz
    return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2, x, y, z, feature


def leaf_blocks(corners: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Precompute (L, 21, 4) for :func:`leaf_distances`: by leaf, number and triangle, so that four go through at once.

    Corner a, edges u and v from it, vectors that give the barycentric coordinates of u and v, unit normal, and one
    over the squared lengths of u, v and v - u. Zero where that has no meaning; unused places are far away.
    """
    # NumPy asks for huge pages: threads that share memory of Numba's own wait for each page, ten times as long in all.
    blocks = np.empty((len(first) - 1, 21, LEAF))
    _fill_blocks(corners, first, blocks)
    return blocks


@parallel_jit
def _fill_blocks(corners, first, blocks):
    for leaf in numba.prange(len(blocks)):
        _fill_block(corners, first[leaf], first[leaf + 1], blocks[leaf])


@jit
def _fill_block(corners, start, stop, block):
    block[:3], block[3:] = _NOWHERE, 0.0
    for t in range(start, stop):
        b = block[:, t - start]
        for d in range(3):
            b[d] = corners[t, d]
            b[3 + d], b[6 + d] = corners[t, 3 + d] - corners[t, d], corners[t, 6 + d] - corners[t, d]
        ux, uy, uz, vx, vy, vz = b[3], b[4], b[5], b[6], b[7], b[8]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area2 = nx * nx + ny * ny + nz * nz
        uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
        ww = (vx - ux) ** 2 + (vy - uy) ** 2 + (vz - uz) ** 2
        b[18], b[19] = 1 / uu if uu > 0.0 else 0.0, 1 / vv if vv > 0.0 else 0.0
        b[20] = 1 / ww if ww > 0.0 else 0.0
        if area2 > FLAT * FLAT * max(uu, vv) ** 2:
            b[9], b[10], b[11] = (
                (vy * nz - vz * ny) / area2,
                (vz * nx - vx * nz) / area2,
                (vx * ny - vy * nx) / area2,
            )
            b[12], b[13] = (ny * uz - nz * uy) / area2, (nz * ux - nx * uz) / area2
            b[14] = (nx * uy - ny * ux) / area2
            length = math.sqrt(area2)
            b[15], b[16], b[17] = nx / length, ny / length, nz / length


@lanes(LEAF)
def leaf_distances(rows, px, py, pz):
    """Squared distances to the four triangles of a leaf, by a row of :func:`leaf_blocks`."""
    wx, wy, wz = px - rows[0], py - rows[1], pz - rows[2]
    ux, uy, uz = rows[3], rows[4], rows[5]
    vx, vy, vz = rows[6], rows[7], rows[8]
    s = wx * rows[9] + wy * rows[10] + wz * rows[11]
    r = wx * rows[12] + wy * rows[13] + wz * rows[14]
    height = wx * rows[15] + wy * rows[16] + wz * rows[17]
    along_u = _along(wx, wy, wz, ux, uy, uz, rows[18])
    along_v = _along(wx, wy, wz, vx, vy, vz, rows[19])
    wx, wy, wz, vx, vy, vz = wx - ux, wy - uy, wz - uz, vx - ux, vy - uy, vz - uz
    edges = smaller(smaller(along_u, along_v), _along(wx, wy, wz, vx, vy, vz, rows[20]))
    return choose(smaller(smaller(s, r), 1 - s - r) > 0, height * height, edges)


def _along(wx, wy, wz, ux, uy, uz, inverse):
    """Squared distances from the points w to the segments from the origin to u."""
    t = smaller(larger((wx * ux + wy * uy + wz * uz) * inverse, 0), 1)
    x, y, z = wx - t * ux, wy - t * uy, wz - t * uz
    return x * x + y * y + z * z


@jit
def half_solid_angle(corners, t, px, py, pz):
    """Cosine and sine, times a common length, of half the solid angle of triangle t; positive seen from behind.

    Source: van Oosterom and Strackee 1983, DOI 10.1109/TBME.1983.325207.
    """
    ax, ay, az = corners[t, 0] - px, corners[t, 1] - py, corners[t, 2] - pz
    bx, by, bz = corners[t, 3] - px, corners[t, 4] - py, corners[t, 5] - pz
    cx, cy, cz = corners[t, 6] - px, corners[t, 7] - py, corners[t, 8] - pz
    a = math.sqrt(ax * ax + ay * ay + az * az)
    b = math.sqrt(bx * bx + by * by + bz * bz)
    c = math.sqrt(cx * cx + cy * cy + cz * cz)
    ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
    triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return a * b * c + ab * c + bc * a + ca * b, triple
