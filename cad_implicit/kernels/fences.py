"""Planes around a triangle: which part of a row of nodes can lie within the band of it."""

from __future__ import annotations

import math

from .jit import jit
from .triangle import FACE


@jit
def fences_of(tree, t, band, fences):
    """Half-spaces ``g . x <= c`` (rows g, c) that hold all points within the band of triangle t; their number.

    Above and below the face and beyond each edge; around the longest edge if the triangle is flat.
    """
    corners, n = tree.corners, tree.normals[t, FACE]
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return _fences_of_flat(corners, t, band, fences)
    height = n[0] * corners[t, 0] + n[1] * corners[t, 1] + n[2] * corners[t, 2]
    for d in range(3):
        fences[0, d], fences[1, d] = n[d], -n[d]
    fences[0, 3], fences[1, 3] = height + band, band - height
    for e in range(3):
        a, b = 3 * e, 3 * ((e + 1) % 3)
        ux, uy, uz = (
            corners[t, b] - corners[t, a],
            corners[t, b + 1] - corners[t, a + 1],
            corners[t, b + 2] - corners[t, a + 2],
        )
        length = math.sqrt(ux * ux + uy * uy + uz * uz)
        x, y, z = (uy * n[2] - uz * n[1]) / length, (uz * n[0] - ux * n[2]) / length, (ux * n[1] - uy * n[0]) / length
        fences[2 + e, 0], fences[2 + e, 1], fences[2 + e, 2] = x, y, z
        fences[2 + e, 3] = x * corners[t, a] + y * corners[t, a + 1] + z * corners[t, a + 2] + band
    return 5


@jit
def _fences_of_flat(corners, t, band, fences):
    """Four planes around the longest edge of a triangle without area; none if it is a point."""
    longest, at = 0.0, 0
    for e in range(3):
        length = 0.0
        for d in range(3):
            length += (corners[t, (3 * e + 3 + d) % 9] - corners[t, 3 * e + d]) ** 2
        if length > longest:
            longest, at = length, e
    if not longest > 1e-24:
        return 0
    ux, uy, uz = (
        (corners[t, (3 * at + 3) % 9] - corners[t, 3 * at]) / math.sqrt(longest),
        (corners[t, (3 * at + 4) % 9] - corners[t, 3 * at + 1]) / math.sqrt(longest),
        (corners[t, (3 * at + 5) % 9] - corners[t, 3 * at + 2]) / math.sqrt(longest),
    )
    # two directions across: u × the axis it follows least, and u × that
    if abs(ux) <= abs(uy) and abs(ux) <= abs(uz):
        vx, vy, vz = 0.0, uz, -uy
    elif abs(uy) <= abs(uz):
        vx, vy, vz = -uz, 0.0, ux
    else:
        vx, vy, vz = uy, -ux, 0.0
    length = math.sqrt(vx * vx + vy * vy + vz * vz)
    vx, vy, vz = vx / length, vy / length, vz / length
    for k in range(2):
        height = vx * corners[t, 3 * at] + vy * corners[t, 3 * at + 1] + vz * corners[t, 3 * at + 2]
        fences[2 * k, 0], fences[2 * k, 1], fences[2 * k, 2], fences[2 * k, 3] = vx, vy, vz, height + band * 1.001
        fences[2 * k + 1, 0], fences[2 * k + 1, 1], fences[2 * k + 1, 2] = -vx, -vy, -vz
        fences[2 * k + 1, 3] = band * 1.001 - height
        vx, vy, vz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return 4


@jit
def clip(fences, count, slopes, x, y, z, low, high):
    """Range of steps along the row from (x, y, z) that lie inside all fences."""
    for q in range(count):
        room = fences[q, 3] - fences[q, 0] * x - fences[q, 1] * y - fences[q, 2] * z
        slope = slopes[q]
        if slope > 0.0:
            high = min(high, room / slope)
        elif slope < 0.0:
            low = max(low, room / slope)
        elif room < 0.0:
            return 1.0, 0.0
    return low, high
