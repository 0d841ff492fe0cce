"""Angle-weighted pseudonormals of faces, edges and corners: they tell on which side of a closed mesh a point lies.

Source: Bærentzen and Aanæs 2005, DOI 10.1109/TVCG.2005.49. Triangles without area have no normal; edges and
corners that touch one are marked doubtful, since the sum over the others need not tell the side.
"""

from __future__ import annotations

import math

import numpy as np

from .jit import jit
from .triangle import CORNER, EDGE, FACE, FLAT

#: Triangles lower than this, relative to the whole mesh, have no reliable normal: rounding moves their corners.
_ROUNDING = 1e-14


def pseudonormals(corners: np.ndarray, faces: np.ndarray, vertex_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Compute unit pseudonormals ``(F, 7, 3)`` by feature, and bits ``(F,)`` of those that do not tell the side."""
    normals = np.zeros((len(faces), 7, 3))
    doubtful = np.zeros(len(faces), np.uint8)
    flat = _face_normals(corners, normals)
    first, around = _faces_of_vertices(faces, vertex_count)
    _edge_normals(faces, first, around, flat, normals, doubtful)
    _corner_normals(corners, faces, flat, first, around, normals, doubtful)
    return normals, doubtful


@jit
def _face_normals(corners, normals):
    """Fill in the normals of faces; return which have none."""
    flat = np.zeros(len(corners), np.bool_)
    for t in range(len(corners)):
        ux, uy, uz = corners[t, 3] - corners[t, 0], corners[t, 4] - corners[t, 1], corners[t, 5] - corners[t, 2]
        vx, vy, vz = corners[t, 6] - corners[t, 0], corners[t, 7] - corners[t, 1], corners[t, 8] - corners[t, 2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = math.sqrt(x * x + y * y + z * z)
        edge2 = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
        edge2 = max(edge2, (vx - ux) ** 2 + (vy - uy) ** 2 + (vz - uz) ** 2)
        if not length > max(2 * FLAT * edge2, _ROUNDING * math.sqrt(edge2)):
            flat[t] = True
            continue
        normals[t, FACE, 0], normals[t, FACE, 1], normals[t, FACE, 2] = x / length, y / length, z / length
    return flat


@jit
def _faces_of_vertices(faces, vertex_count):
    """Triangles around each vertex v: ``around[first[v]:first[v + 1]]``."""
    first = np.zeros(vertex_count + 1, np.int64)
    for t in range(len(faces)):
        for c in range(3):
            first[faces[t, c] + 1] += 1
    for v in range(vertex_count):
        first[v + 1] += first[v]
    around = np.zeros(3 * len(faces), np.int32)
    cursor = first[:-1].copy()
    for t in range(len(faces)):
        for c in range(3):
            around[cursor[faces[t, c]]] = t
            cursor[faces[t, c]] += 1
    return first, around


@jit
def _store_unit(normals, t, feature, x, y, z):
    length = math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        normals[t, feature, 0], normals[t, feature, 1] = x / length, y / length
        normals[t, feature, 2] = z / length


@jit
def _edge_normals(faces, first, around, flat, normals, doubtful):
    """Sum of the normals of all triangles that hold the edge."""
    for t in range(len(faces)):
        for c in range(3):
            a, b = faces[t, c], faces[t, (c + 1) % 3]
            if first[b + 1] - first[b] < first[a + 1] - first[a]:
                a, b = b, a
            x, y, z = 0.0, 0.0, 0.0
            for q in range(first[a], first[a + 1]):
                other = around[q]
                if faces[other, 0] == b or faces[other, 1] == b or faces[other, 2] == b:
                    x += normals[other, FACE, 0]
                    y += normals[other, FACE, 1]
                    z += normals[other, FACE, 2]
                    if flat[other]:
                        doubtful[t] |= np.uint8(1 << (EDGE + c))
            _store_unit(normals, t, EDGE + c, x, y, z)


@jit
def _angle(corners, t, c):
    """Angle of triangle t at corner c."""
    a, b, d = 3 * c, 3 * ((c + 1) % 3), 3 * ((c + 2) % 3)
    ux, uy, uz = (
        corners[t, b] - corners[t, a],
        corners[t, b + 1] - corners[t, a + 1],
        corners[t, b + 2] - corners[t, a + 2],
    )
    vx, vy, vz = (
        corners[t, d] - corners[t, a],
        corners[t, d + 1] - corners[t, a + 1],
        corners[t, d + 2] - corners[t, a + 2],
    )
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return math.atan2(math.sqrt(x * x + y * y + z * z), ux * vx + uy * vy + uz * vz)


@jit
def _corner_normals(corners, faces, flat, first, around, normals, doubtful):
    """Sum of the normals around the vertex, each weighted by its triangle's angle there."""
    for v in range(len(first) - 1):
        x, y, z = 0.0, 0.0, 0.0
        unsure = False
        for q in range(first[v], first[v + 1]):
            t = around[q]
            unsure = unsure or flat[t]
            for c in range(3):
                if faces[t, c] == v:
                    angle = _angle(corners, t, c)
                    x += angle * normals[t, FACE, 0]
                    y += angle * normals[t, FACE, 1]
                    z += angle * normals[t, FACE, 2]
        for q in range(first[v], first[v + 1]):
            t = around[q]
            for c in range(3):
                if faces[t, c] == v:
                    _store_unit(normals, t, CORNER + c, x, y, z)
                    if unsure:
                        doubtful[t] |= np.uint8(1 << (CORNER + c))


@jit
def smooth_normals(vertices, faces, triangles, points, crease):
    """Outward unit normals at points of triangles, interpolated between corners as on a curved face.

    At a corner the normals of all triangles around it are averaged that differ from the point's triangle by less
    than the angle of cosine ``crease``. Zero where the triangle has no area.
    """
    first, around = _faces_of_vertices(faces, len(vertices))
    corners, face = np.zeros((len(faces), 9)), np.zeros((len(faces), 1, 3))
    for t in range(len(faces)):
        for e in range(9):
            corners[t, e] = vertices[faces[t, e // 3], e % 3]
    _face_normals(corners, face)
    out = np.zeros((len(points), 3))
    for q in range(len(points)):
        t = triangles[q]
        n = face[t, 0]
        weight = _barycentric(corners[t], n, points[q])
        for c in range(3):
            x, y, z = 0.0, 0.0, 0.0
            v = faces[t, c]
            for other in around[first[v] : first[v + 1]]:
                m = face[other, 0]
                if n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > crease:
                    for d in range(3):
                        if faces[other, d] == v:
                            angle = _angle(corners, other, d)
                            x += angle * m[0]
                            y += angle * m[1]
                            z += angle * m[2]
            length = math.sqrt(x * x + y * y + z * z)
            if length > 0.0:
                out[q, 0] += weight[c] * x / length
                out[q, 1] += weight[c] * y / length
                out[q, 2] += weight[c] * z / length
        length = math.sqrt(out[q, 0] ** 2 + out[q, 1] ** 2 + out[q, 2] ** 2)
        if length > 0.0:
            for d in range(3):
                out[q, d] /= length
    return out


@jit
def _barycentric(corner, n, point):
    """Barycentric coordinates (3,) of a point of a triangle with unit normal n."""
    weight = np.zeros(3)
    total = 0.0
    for c in range(3):
        b, d = 3 * ((c + 1) % 3), 3 * ((c + 2) % 3)
        ux, uy, uz = corner[b] - point[0], corner[b + 1] - point[1], corner[b + 2] - point[2]
        vx, vy, vz = corner[d] - point[0], corner[d + 1] - point[1], corner[d + 2] - point[2]
        weight[c] = (uy * vz - uz * vy) * n[0] + (uz * vx - ux * vz) * n[1] + (ux * vy - uy * vx) * n[2]
        total += weight[c]
    if total != 0.0:
        for c in range(3):
            weight[c] /= total
    return weight
