"""Distances to the surface of a B-rep by its surfaces, not by facets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cad_implicit.cad.kernel import kernel
from cad_implicit.comparison import surface_samples
from cad_implicit.distance import MeshDistance
from cad_implicit.faces import FaceDistance
from cad_implicit.implicit import FloatArray
from cad_implicit.mesh import Mesh

Mask = NDArray[np.bool_]


class Surfaces:
    """Faces of a solid: the nearest one by fine triangles, the distance by its surface.

    Parameters
    ----------
    shape : TopoDS_Shape or Part.Shape
    tolerance : float
        Of the triangles, in mm: surfaces are believed as far as the triangles bear them out, for beyond borders of a
        face its spline goes where it likes (into the bore beside it; a bore cut at a slant gave 862 m).
    """

    def __init__(self, shape: Any, tolerance: float) -> None:
        self.shape, self.tolerance = shape, tolerance
        self.mesh: Mesh = kernel(shape, "mesh").tessellate([shape], tolerance, 0.1)[0]
        self._faces = kernel(shape, "faces")
        self.shapes = self._faces.all_faces(shape)
        self.names = np.array([self._faces.surface_name(face) for face in self.shapes])
        self._near = MeshDistance(self.mesh, sign="pseudonormal")
        low, high = self.mesh.bounds
        self._reach = float(np.linalg.norm(high - low))
        self._known: dict[int, FaceDistance] = {}

    def face(self, index: int) -> FaceDistance:
        """Signed distance to a face, numbered from 0, and its continuation."""
        if index not in self._known:
            self._known[index] = self._faces.face_distance(self.shapes[index], self._reach)
        return self._known[index]

    def nearest(self, points: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
        """Distances ``(N,)`` to the surface in mm, and the faces ``(N,)`` that are nearest, from 0."""
        found = self._near.closest(points)
        faces = self._face_of(found.triangle)
        return np.abs(self._by_surface(points, faces, found.distance)), faces

    def signed(self, points: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
        """Distances ``(N,)`` in mm, positive outside the material, and the nearest faces ``(N,)``, from 0."""
        distance, faces = self.nearest(points)
        side = np.zeros(len(points))
        for index in np.unique(faces).tolist():
            own = faces == index
            side[own] = np.where(self.face(index)(points[own]) > 0, -1.0, 1.0)
        return side * distance, faces

    def normals(self, points: FloatArray, faces: NDArray[np.int64]) -> FloatArray:
        """Give normals ``(N, 3)`` of faces ``(N,)`` near points, out of the material."""
        normals = np.zeros_like(points)
        for index in np.unique(faces).tolist():
            own = faces == index
            normals[own] = -self.face(index).value_and_gradient(points[own])[1]
        return normals

    def _face_of(self, triangles: NDArray[np.int32]) -> NDArray[np.int64]:
        assert self.mesh.face_ids is not None
        return np.asarray(self.mesh.face_ids[triangles], np.int64)

    def _by_surface(self, points: FloatArray, faces: NDArray[np.int64], rough: FloatArray) -> FloatArray:
        value = np.zeros(len(points))
        for index in np.unique(faces).tolist():
            own = faces == index
            value[own] = np.abs(self.face(index)(points[own]))
        return np.clip(value, rough - self.tolerance, rough + self.tolerance)

    def part(self, faces: Mask) -> Mesh:
        """Triangles of some faces."""
        assert self.mesh.face_ids is not None
        own = faces[self.mesh.face_ids]
        return Mesh(self.mesh.vertices, self.mesh.faces[own], self.mesh.face_ids[own])

    def samples(self, faces: Mask, count: int) -> tuple[FloatArray, NDArray[np.int64]]:
        """Points ``(count, 3)`` of some faces, moved from the triangles onto the surfaces, and their faces, from 0."""
        mesh = self.part(faces)
        assert mesh.face_ids is not None
        points, triangles = surface_samples(mesh, count)
        ids = mesh.face_ids[triangles]
        for index in np.unique(ids).tolist():
            own = ids == index
            value, gradient = self.face(index).value_and_gradient(points[own])
            near = np.abs(value) <= 2 * self.tolerance
            points[own] -= np.where(near, value, 0.0)[:, None] * gradient
        return points, ids.astype(np.int64)

    def bend(self, faces: Mask) -> float:
        """Sum over curved faces of the area over the smallest radius of curvature, in mm."""
        mesh = self.part(faces)
        assert mesh.face_ids is not None
        area = np.linalg.norm(mesh.face_vectors, axis=1) / 2
        total = 0.0
        for index in np.unique(mesh.face_ids).tolist():
            total += float(area[mesh.face_ids == index].sum()) * self._curvature(index)
        return total

    def _curvature(self, index: int) -> float:
        face = self.face(index)
        for name in ("tube", "radius"):
            if hasattr(face, name):
                return 1.0 / float(getattr(face, name))
        return 0.0
