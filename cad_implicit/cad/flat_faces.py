"""Flat faces of a mesh: triangles in one plane as one polygon, with its holes; arrays in, arrays out.

Regions grow from the largest triangles over their neighbours, as long as all corners lie in one plane. Their outlines
run through the corners at which more than two faces meet or the outline bends, the same ones for both faces beside it,
so that the polygons fit together without gaps.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cad_implicit.mesh import FloatArray, Mesh

Ints = NDArray[np.int64]

#: Regions of at least so many triangles are fitted again while they grow: the plane of their first triangle alone
#: would be carried too far. Fitting costs 50 µs, so that it does not pay for the pairs of triangles of a fine mesh.
_REFIT = 16


@dataclass(frozen=True, eq=False)
class FlatFaces:
    """Polygons that close a mesh.

    Attributes
    ----------
    label : (F,) int64
        Face of each triangle.
    normals, centres : (N, 3) float64
        Unit normal and a point of each face's plane.
    deviations : (N,) float64
        Largest distance in mm of a face's corners from its plane.
    areas : (N,) float64
        Of each face's triangles in mm².
    loops : list of list of list of int
        Vertices of each face's outlines, counter-clockwise seen from outside; the outer one first, then holes.
    """

    label: Ints
    normals: FloatArray
    centres: FloatArray
    deviations: FloatArray
    areas: FloatArray
    loops: list[list[list[int]]]

    def corners(self) -> tuple[Ints, Ints, Ints]:
        """Vertex ``(C,)`` of each corner of each outline, the number of the corner after it, and its face."""
        flat = [(number, loop) for number, loops in enumerate(self.loops) for loop in loops]
        sizes = np.array([len(loop) for _, loop in flat])
        vertex = np.array([v for _, loop in flat for v in loop], np.int64)
        after = np.arange(1, len(vertex) + 1)
        last = np.cumsum(sizes) - 1
        after[last] = last - sizes + 1
        return vertex, after, np.repeat(np.array([number for number, _ in flat], np.int64), sizes)


def flat_faces(mesh: Mesh, tolerance: float, apart: NDArray[np.bool_] | None = None) -> FlatFaces:
    """Join triangles of a closed mesh that lie in one plane.

    Parameters
    ----------
    mesh : Mesh
        Closed.
    tolerance : float
        Largest distance in mm of a vertex from the plane of its face, and from an outline that leaves it out.
    apart : (F,) bool, optional
        Triangles that stay faces of their own.
    """
    twin = twins(mesh)
    label = _regions(mesh, twin, tolerance, np.zeros(len(mesh.faces), np.bool_) if apart is None else apart)
    while True:
        found = _outlined(mesh, twin, label, tolerance)
        bad = [n for n, loops in enumerate(found.loops) if not loops]
        bad += np.flatnonzero(found.deviations > 2 * tolerance).tolist()
        split = np.isin(found.label, np.unique(np.array(bad, np.int64)))
        if not split.any():
            return found
        label = np.where(split, found.label.max() + 1 + np.arange(len(split)), found.label)


def twins(mesh: Mesh) -> Ints:
    """Half-edge ``(3 F,)`` opposite to each one; half-edge ``3 f + k`` leads from corner k of triangle f on."""
    start = mesh.faces.ravel().astype(np.int64)
    end = np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    count = len(mesh.vertices)
    forward = start * count + end
    order = np.argsort(forward)
    return np.asarray(order[np.searchsorted(forward, end * count + start, sorter=order)], np.int64)


def _regions(mesh: Mesh, twin: Ints, tolerance: float, apart: NDArray[np.bool_]) -> Ints:
    """Region of each triangle, numbered in no order."""
    area = np.linalg.norm(mesh.face_vectors, axis=1)
    corners = mesh.vertices[mesh.faces]
    longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
    proper = (2 * area > tolerance * longest) & ~apart  # the others have no plane of their own
    normal = mesh.face_vectors / np.where(area > 0, area, 1.0)[:, None]
    height = (corners[:, 0] * normal).sum(axis=1)
    beside = twin // 3
    apex = mesh.vertices[mesh.faces[beside, (twin + 2) % 3]].reshape(-1, 3, 3)
    near = np.abs((apex * normal[:, None]).sum(axis=2) - height[:, None]) <= tolerance
    near &= (proper[:, None]) & ~apart[beside].reshape(-1, 3)
    grower = _Grower(mesh, twin, tolerance, longest, apart)
    seeds = np.flatnonzero(near.any(axis=1))
    for seed in seeds[np.argsort(-area[seeds])].tolist():
        if grower.label[seed] < 0:
            grower.grow(seed, normal[seed], height[seed])
    label = np.array(grower.label, np.int64)
    return np.where(label < 0, len(label) + np.arange(len(label)), label)


class _Grower:
    """Regions, one after the other."""

    def __init__(self, mesh: Mesh, twin: Ints, tolerance: float, longest: FloatArray, apart: NDArray[np.bool_]) -> None:
        self.label = [-1] * len(mesh.faces)
        self._mesh, self._tolerance = mesh, tolerance
        self._points = mesh.vertices.tolist()
        self._twin = twin.tolist()
        self._corner = mesh.faces.ravel().tolist()
        self._vectors = mesh.face_vectors.tolist()
        self._least = (-0.5 * tolerance * longest).tolist()
        self._apart = apart.tolist()

    def grow(self, seed: int, normal: FloatArray, height: float) -> None:
        """Give the seed's number to all triangles connected with it in its plane."""
        self.label[seed] = seed
        members, plane = [seed], (*normal.tolist(), float(height))
        while self._spread(members, plane) and len(members) >= _REFIT:
            better = self._fitted(members)
            if better is None:
                return
            plane = better

    def _spread(self, members: list[int], plane: tuple[float, ...]) -> bool:
        label, twin, corner, points = self.label, self._twin, self._corner, self._points
        nx, ny, nz, height = plane
        before, own, tolerance = len(members), label[members[0]], self._tolerance
        for face in members:  # grows meanwhile
            for half in (3 * face, 3 * face + 1, 3 * face + 2):
                other = twin[half]
                beside = other // 3
                if label[beside] >= 0 or self._apart[beside]:
                    continue
                x, y, z = points[corner[3 * beside + (other + 2) % 3]]
                if abs(nx * x + ny * y + nz * z - height) > tolerance:
                    continue
                ax, ay, az = self._vectors[beside]
                if nx * ax + ny * ay + nz * az >= self._least[beside]:
                    label[beside] = own
                    members.append(beside)
        return len(members) > before

    def _fitted(self, members: list[int]) -> tuple[float, ...] | None:
        normal = self._mesh.face_vectors[members].sum(axis=0)
        normal = normal / np.linalg.norm(normal)
        heights = self._mesh.vertices[self._mesh.faces[members].ravel()] @ normal
        middle = (heights.min() + heights.max()) / 2
        if heights.max() - middle > self._tolerance:
            return None
        return (*normal.tolist(), float(middle))


def _outlined(mesh: Mesh, twin: Ints, label: Ints, tolerance: float) -> FlatFaces:
    """Faces of given regions; a region that is no single polygon gets no outlines."""
    label = np.unique(label, return_inverse=True)[1].astype(np.int64)
    count = int(label.max()) + 1
    vectors = np.stack([np.bincount(label, mesh.face_vectors[:, i], count) for i in range(3)], axis=1)
    size = np.linalg.norm(vectors, axis=1)
    normals = vectors / np.where(size > 0, size, 1.0)[:, None]
    corners = mesh.vertices[mesh.faces]
    sums = np.stack([np.bincount(label, corners[:, :, i].sum(axis=1), count) for i in range(3)], axis=1)
    centres: FloatArray = sums / (3.0 * np.bincount(label, minlength=count))[:, None]
    off = np.abs(((corners - centres[label][:, None]) * normals[label][:, None]).sum(axis=2)).max(axis=1)
    deviations = np.zeros(count)
    np.maximum.at(deviations, label, off)
    areas: FloatArray = np.bincount(label, np.linalg.norm(mesh.face_vectors, axis=1), count).astype(np.float64)
    loops = _loops(mesh, twin, label, tolerance)
    for face in np.flatnonzero([len(own) != 1 for own in loops]).tolist():
        loops[face] = _nested(mesh.vertices, loops[face], normals[face])
    return FlatFaces(label, normals, centres, deviations, areas, loops)


def _nested(points: FloatArray, loops: list[list[int]], normal: FloatArray) -> list[list[int]]:
    """Outlines with the outer one first; none if there is not just one."""
    signed = [float(_vector_area(points[loop]) @ normal) for loop in loops]
    order = sorted(range(len(loops)), key=lambda n: -signed[n])
    return [loops[n] for n in order] if sum(area > 0 for area in signed) == 1 else []


def _vector_area(points: FloatArray) -> FloatArray:
    local = points - points[0]
    return np.asarray(np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0) / 2)


def _loops(mesh: Mesh, twin: Ints, label: Ints, tolerance: float) -> list[list[list[int]]]:
    """Outlines of each region, without the vertices at which they only go straight on."""
    face = np.repeat(label, 3)
    border = face != face[twin]
    after = 3 * (np.arange(len(twin)) // 3) + (np.arange(len(twin)) + 1) % 3
    while (inner := np.flatnonzero(border & ~border[after])).size:  # round the vertex, to the region's next border
        turned = twin[after[inner]]
        after[inner] = 3 * (turned // 3) + (turned + 1) % 3
    start = mesh.faces.ravel().astype(np.int64)
    rings = _rings(border, after, start)
    kept = _bends(mesh.vertices, rings, start, border, tolerance)
    loops: list[list[list[int]]] = [[] for _ in range(int(label.max()) + 1)]
    thin = [ring for ring in rings if np.count_nonzero(kept[start[ring]]) < 3]
    for ring in thin:
        kept[start[ring]] = True
    for ring in rings:
        vertices = start[ring]
        loops[face[ring[0]]].append(vertices[kept[vertices]].tolist())
    return loops


def _rings(border: NDArray[np.bool_], after: Ints, start: Ints) -> list[list[int]]:
    """Half-edges of each closed outline; one that comes twice through a vertex is cut there."""
    follows, vertex = after.tolist(), start.tolist()
    left = border.tolist()
    rings = []
    for first in np.flatnonzero(border).tolist():
        if not left[first]:
            continue
        ring: list[int] = []
        place: dict[int, int] = {}
        half = first
        while left[half]:
            left[half] = False
            at = place.get(vertex[half])
            if at is not None:
                rings.append(ring[at:])
                for old in ring[at:]:
                    del place[vertex[old]]
                del ring[at:]
            place[vertex[half]] = len(ring)
            ring.append(half)
            half = follows[half]
        rings.append(ring)
    return rings


def _bends(
    points: FloatArray, rings: list[list[int]], start: Ints, border: NDArray[np.bool_], tolerance: float
) -> NDArray[np.bool_]:
    """Mark the vertices that outlines need: where faces meet, and where the line between two faces bends."""
    degree = np.bincount(start[border], minlength=len(points))
    kept = degree > 2
    seen = degree != 2
    for ring in rings:
        vertices = start[ring]
        if seen[vertices].all():
            continue
        knots = np.flatnonzero(kept[vertices])
        if not len(knots):  # a line that closes without meeting another
            far = int(np.argmax(((points[vertices] - points[vertices[0]]) ** 2).sum(axis=1)))
            knots = np.array([0, far])
            kept[vertices[knots]] = True
        vertices = np.append(np.roll(vertices, -knots[0]), vertices[knots[0]])
        ends = np.append(knots - knots[0], len(vertices) - 1)
        for low, high in pairwise(ends.tolist()):
            chain = vertices[low : high + 1]
            if len(chain) > 2 and not seen[chain[1]]:
                seen[chain] = True
                kept[chain[_straightened(points[chain], tolerance)]] = True
    return kept


def _straightened(points: FloatArray, tolerance: float) -> NDArray[np.bool_]:
    """Mark the points of a line that it needs to stay within a tolerance (Douglas and Peucker 1973)."""
    keep = np.zeros(len(points), np.bool_)
    keep[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        low, high = spans.pop()
        if high - low < 2:
            continue
        chord = points[high] - points[low]
        length = np.linalg.norm(chord)
        between = points[low + 1 : high] - points[low]
        offset = np.cross(between, chord / length) if length > 0 else between
        away = np.linalg.norm(offset, axis=1)
        worst = int(np.argmax(away))
        if away[worst] > tolerance:
            keep[low + 1 + worst] = True
            spans += [(low, low + 1 + worst), (low + 1 + worst, high)]
    return keep
