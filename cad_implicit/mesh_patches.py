"""Free-form faces of meshes: signed distance to triangles, bent by their vertex normals and continued along tangents.

Normals at vertices come from quadrics through their neighbours (jets: Cazals and Pouget 2005,
DOI 10.1016/j.cagd.2004.09.004), which are as good at borders as within. Each triangle is bent by them as quadrics are:
half of the way to its corners' tangent planes (Boubekeur and Alexa 2008, DOI 10.1145/1409060.1409094). Beyond a border
the surface goes on as straight lines at right angles to it in the tangent planes, so that it has one tangent there.

Not promised: where a border is curved inward these lines stop before they meet, and the surface goes on as the tangent
plane at the nearest of their ends.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix

from .cad.weld import groups
from .distance import MeshDistance
from .faces import FaceDistance
from .implicit import FloatArray
from .mesh import Mesh

Ints = NDArray[np.int64]

#: Steps along the normal at most; each leaves a share of the error, that of the distance in the radius of curvature.
_STEPS = 12
#: The last step is shorter than this share of the diagonal.
_LAST = 1e-10
#: Least cosine between a triangle and the surface at its corners: neighbours turn by up to 25 degrees.
_TURNED = np.cos(np.radians(20))
#: Lines beyond a border that is curved inward end at this share of the way to where they meet.
_MEETING = 0.9
#: Longest corner of the continuation at a sharp corner of the border, over its width.
_MITRE = 2.0
#: Fewest neighbours through which a quadric is fitted.
_NEIGHBOURS = 5


class MeshPatch(FaceDistance):
    """Signed distance to a smooth surface through the vertices of a piece of a mesh, and its continuation.

    Parameters
    ----------
    mesh : Mesh
        The piece, its triangles counter-clockwise seen from outside.
    pairs : (P, 2) int
        Triangles that meet smoothly; between others that share an edge is a crease.
    reach : float
        How far in mm it is continued; beyond that by the tangent plane at the nearest end.
    """

    kind = "mesh"

    def __init__(self, mesh: Mesh, pairs: NDArray[np.integer], reach: float) -> None:
        self._open = _opened(mesh, pairs)
        self._border = _border(mesh)
        self._reach = reach

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        x = np.ascontiguousarray(points, np.float64)
        value, normal, rim = self._at(x, x)
        gone_on = np.flatnonzero(~rim)
        last = _LAST * self._open.diagonal
        before = np.full(len(gone_on), np.inf)
        for _ in range(_STEPS):
            if not len(gone_on):
                break
            foot = x[gone_on] + value[gone_on, None] * normal[gone_on]
            further, way, outside = self._at(x[gone_on], foot)
            step = np.abs(further - value[gone_on])
            nearer = step < before
            value[gone_on[nearer]], normal[gone_on[nearer]] = further[nearer], way[nearer]
            left = nearer & (step > last) & ~outside
            gone_on, before = gone_on[left], step[left]
        return value, -normal

    def _at(self, x: FloatArray, near: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Heights below the tangent planes at the places closest to some points, normals, and whether at the rim."""
        mesh, normals, outer, bend = self._continued
        closest = self._distance.closest(near)
        corners = mesh.faces[closest.triangle]
        places, ways = mesh.vertices[corners], normals[corners]
        weight = _weights(places, closest.point)
        normal = (weight[:, :, None] * ways).sum(axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        lift = (weight * np.roll(weight, -1, axis=1) * bend[closest.triangle]).sum(axis=1)
        surface = closest.point + lift[:, None] * normal
        rim = (weight * ~outer[corners]).sum(axis=1) < 1e-9
        return ((surface - x) * normal).sum(axis=1), normal, rim

    @cached_property
    def _distance(self) -> MeshDistance:
        return MeshDistance(self._continued.mesh, sign="pseudonormal")

    @cached_property
    def _continued(self) -> _Continued:
        mesh = self._open
        normals = vertex_normals(mesh)
        starts = mesh.faces.ravel()[self._border].astype(np.int64)
        ends = np.roll(mesh.faces, -1, axis=1).ravel()[self._border].astype(np.int64)
        if not len(starts):
            return _Continued(mesh, normals, np.zeros(len(mesh.vertices), np.bool_), _bends(mesh, normals))
        ways, lengths = _outward_lines(mesh.vertices, normals, starts, ends, self._reach)
        rim = np.unique(starts)
        number = np.zeros(len(mesh.vertices), np.int64)
        number[rim] = len(mesh.vertices) + np.arange(len(rim))
        vertices = np.concatenate([mesh.vertices, mesh.vertices[rim] + lengths[rim, None] * ways[rim]])
        a, b, far_a, far_b = starts, ends, number[starts], number[ends]
        strips = np.concatenate([np.stack([b, a, far_a], axis=1), np.stack([b, far_a, far_b], axis=1)])
        outer = np.arange(len(vertices)) >= len(mesh.vertices)
        whole = Mesh(vertices, np.concatenate([mesh.faces, strips]))
        normals = np.concatenate([normals, normals[rim]])
        return _Continued(whole, normals, outer, _bends(whole, normals))


class _Continued(NamedTuple):
    """Triangles of a patch and its continuation, and what is known of them.

    Normals ``(V, 3)``, which vertices ``(V,)`` are at the rim, and how far sides ``(F, 3)`` are bent: four times the
    height in mm of the surface over their middles.
    """

    mesh: Mesh
    normals: FloatArray
    outer: NDArray[np.bool_]
    bend: FloatArray


def vertex_normals(mesh: Mesh) -> FloatArray:
    """Outward unit normals ``(V, 3)`` at vertices, by a quadric through the neighbours of each, two edges around."""
    count = len(mesh.vertices)
    rough = np.zeros((count, 3))
    for corner in range(3):
        np.add.at(rough, mesh.faces[:, corner], mesh.face_vectors)
    size = np.linalg.norm(rough, axis=1, keepdims=True)
    rough = np.where(size > 0, rough / np.where(size > 0, size, 1.0), [0.0, 0.0, 1.0])
    a, b = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    ones = np.ones(2 * len(a) + count, np.int32)
    whole = np.concatenate([a, b, np.arange(count)]), np.concatenate([b, a, np.arange(count)])
    one = csr_matrix((ones, whole), (count, count))
    near = (one @ one).tocsr()
    fitted = np.array([_normal(mesh.vertices, rough, near, vertex) for vertex in range(count)])
    facing = np.ones(count)
    area = np.linalg.norm(mesh.face_vectors, axis=1)
    plain = area > 1e-9 * area.max()
    for corner in range(3):
        own = mesh.faces[plain, corner]
        np.minimum.at(facing, own, (fitted[own] * mesh.face_vectors[plain]).sum(axis=1) / area[plain])
    return np.asarray(np.where(facing[:, None] >= _TURNED, fitted, rough))


def _normal(vertices: FloatArray, rough: FloatArray, near: csr_matrix, vertex: int) -> FloatArray:
    """Give the normal at a vertex of a quadric over its rough tangent plane."""
    own = rough[vertex]
    others = near.indices[near.indptr[vertex] : near.indptr[vertex + 1]]
    others = others[(others != vertex) & (rough[others] @ own > 0.5)]
    if len(others) < _NEIGHBOURS:
        return np.asarray(own)
    first = np.cross(own, np.eye(3)[np.argmin(np.abs(own))])
    first /= np.linalg.norm(first)
    frame = np.stack([first, np.cross(own, first), own])
    u, v, w = frame @ (vertices[others] - vertices[vertex]).T
    scale = float(np.sqrt((u * u + v * v).mean()))
    if scale <= 0:
        return np.asarray(own)
    u, v, w = u / scale, v / scale, w / scale
    away = np.maximum(u * u + v * v, 1e-12)
    weight = 1 / away
    matrix = np.column_stack([u, v, u * u, u * v, v * v]) * weight[:, None]
    columns = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    slope = (np.linalg.lstsq(matrix / columns, w * weight, rcond=1e-6)[0] / columns)[:2]
    normal = np.array([-slope[0], -slope[1], 1.0]) @ frame
    return np.asarray(normal / np.linalg.norm(normal))


def _opened(mesh: Mesh, pairs: NDArray[np.integer]) -> Mesh:
    """Mesh whose triangles share vertices only where they meet smoothly."""
    one, other = mesh.faces[pairs[:, 0]], mesh.faces[pairs[:, 1]]
    which, i, j = np.nonzero(one[:, :, None] == other[:, None, :])
    joined = np.stack([3 * pairs[which, 0] + i, 3 * pairs[which, 1] + j], axis=1)
    label, first = groups(3 * len(mesh.faces), joined)
    return Mesh(mesh.vertices[mesh.faces.ravel()[first]], label.reshape(-1, 3))


def _border(mesh: Mesh) -> NDArray[np.bool_]:
    """Which sides ``(3 F,)`` of the triangles have no other one beyond."""
    count = len(mesh.vertices)
    start = mesh.faces.ravel().astype(np.int64)
    end = np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    return np.asarray(~np.isin(start * count + end, end * count + start))


def _outward_lines(
    vertices: FloatArray, normals: FloatArray, starts: Ints, ends: Ints, reach: float
) -> tuple[FloatArray, FloatArray]:
    """Directions ``(V, 3)`` away from the border in the tangent planes, longer at corners, and lengths ``(V,)``."""
    along = vertices[ends] - vertices[starts]
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
    total, single = np.zeros_like(vertices), np.zeros_like(vertices)
    for border in (starts, ends):
        away = np.cross(along, normals[border])
        away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
        np.add.at(total, border, away)
        single[border] = away
    # the sum of two unit vectors, over 1 + their cosine, is 1 away from both sides of a corner
    square = (total**2).sum(axis=1, keepdims=True)
    ways = np.where(square > 4 / _MITRE**2, 2 * total / np.maximum(square, 1e-300), single)
    closing = -((ways[ends] - ways[starts]) * along).sum(axis=1) / length
    limit = np.where(closing > 1e-12, _MEETING * length / np.maximum(closing, 1e-300), np.inf)
    lengths = np.full(len(vertices), reach, np.float64)
    for border in (starts, ends):
        np.minimum.at(lengths, border, limit)
    return ways, lengths


def _bends(mesh: Mesh, normals: FloatArray) -> FloatArray:
    """How far sides are bent, as :class:`_Continued` says: the mean of what its ends say, twice the lesser at most."""
    places, ways = mesh.vertices[mesh.faces], normals[mesh.faces]
    along = np.roll(places, -1, axis=1) - places
    first = -(along * ways).sum(axis=2)
    second = (along * np.roll(ways, -1, axis=1)).sum(axis=2)
    mean, lesser = (first + second) / 2, np.minimum(np.abs(first), np.abs(second))
    facing = (ways * mesh.face_vectors[:, None]).sum(axis=2).min(axis=1) >= _TURNED * np.linalg.norm(
        mesh.face_vectors, axis=1
    )
    bent = np.where(first * second > 0, np.clip(mean, -2 * lesser, 2 * lesser), 0.0)
    return np.asarray(np.where(facing[:, None], bent, 0.0))


def _weights(places: FloatArray, points: FloatArray) -> FloatArray:
    """Barycentric weights ``(N, 3)`` of points ``(N, 3)`` of triangles ``(N, 3, 3)``."""
    a, b, c = np.moveaxis(places, 1, 0)
    along, across, way = b - a, c - a, points - a
    aa, ab, bb = (along**2).sum(1), (along * across).sum(1), (across**2).sum(1)
    wa, wb = (way * along).sum(1), (way * across).sum(1)
    determinant = aa * bb - ab**2
    good = determinant > 1e-14 * aa * bb
    safe = np.where(good, determinant, 1.0)
    second = np.clip(np.where(good, (bb * wa - ab * wb) / safe, 0.0), 0, 1)
    third = np.clip(np.where(good, (aa * wb - ab * wa) / safe, 0.0), 0, 1 - second)
    return np.stack([1 - second - third, second, third], axis=1)
