"""Faces of a mesh as distances: pieces between sharp edges, in closed form where they can be told, else free-form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from .cad.edges import Edge, aside
from .cad.mesh_edges import segment_and_join
from .distance import MeshDistance
from .face_groups import FaceGroup
from .faces import FaceDistance
from .mesh import Mesh
from .mesh_patches import MeshPatch
from .mesh_primitives import Primitives, primitives, without_creases

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

#: The faces beside an edge are looked for this share of its segments away from it.
_ASIDE = 1e-3


class _Piece(NamedTuple):
    """Triangles between sharp edges, pairs ``(P, 2)`` of them, those that meet smoothly, and their surfaces."""

    mesh: Mesh
    pairs: Ints
    smooth: Ints
    surfaces: Primitives


class MeshFaces:
    """Faces of a mesh by number, as :mod:`cad_implicit.cad.mesh_edges` numbers them.

    Parameters
    ----------
    mesh : Mesh
    reach : float
        How far in mm free-form faces are continued.
    sharp : float
        Triangles that turn by more than this many degrees are of different faces.

    Attributes
    ----------
    mesh : Mesh
        The same triangles; ``face_ids`` are the numbers of the faces less 1.
    count : int
        Number of faces.
    """

    def __init__(self, mesh: Mesh, reach: float, sharp: float) -> None:
        self._numbers, self._pairs = segment_and_join(mesh, sharp)
        self.mesh = Mesh(mesh.vertices, mesh.faces, self._numbers - 1, mesh.source)
        self.count = int(self._numbers.max())
        self._reach = reach
        self._known: dict[int, _Piece] = {}

    def face(self, number: int) -> FaceDistance:
        """Signed distance to one face and its continuation."""
        piece = self._piece(number)
        return self._distance(piece, np.ones(len(piece.mesh.faces), np.bool_))

    def halves(self, number: int, edge: Edge) -> tuple[FaceDistance, FaceDistance]:
        """Signed distances to what of a face is nearer, along it, to the left of an edge in it, and to the right."""
        piece = self._piece(number)
        mesh, pairs = piece.mesh, piece.pairs
        middles = mesh.vertices[mesh.faces].mean(axis=1)
        step = np.linalg.norm(middles[pairs[:, 0]] - middles[pairs[:, 1]], axis=1)
        graph = csr_matrix((np.maximum(step, 1e-300), (pairs[:, 0], pairs[:, 1])), (len(middles), len(middles)))
        distance = MeshDistance(mesh, sign="pseudonormal")
        left, right = (
            dijkstra(graph, directed=False, indices=np.unique(distance.closest(places).triangle), min_only=True)
            for places in aside(edge, _ASIDE * edge.length / len(edge.points))
        )
        return self._distance(piece, left <= right), self._distance(piece, left > right)

    def _piece(self, number: int) -> _Piece:
        if number not in self._known:
            mesh, pairs = _part(self.mesh, self._pairs, self._numbers == number)
            smooth = without_creases(mesh, pairs, self.mesh.diagonal)
            self._known[number] = _Piece(mesh, pairs, smooth, primitives(mesh, smooth, self.mesh.diagonal))
        return self._known[number]

    def _distance(self, piece: _Piece, chosen: Mask) -> FaceDistance:
        """Signed distance to some triangles of a piece."""
        label, faces = piece.surfaces
        members: dict[int, FaceDistance] = {}
        for number in np.unique(label[chosen]).tolist():
            face = faces[number]
            if face is None:
                face = MeshPatch(*_part(piece.mesh, piece.smooth, chosen & (label == number)), self._reach)
            members[number + 1] = face
        if len(members) == 1:
            return next(iter(members.values()))
        beside: dict[int, set[int]] = {}
        for one, other in np.unique(label[piece.smooth] + 1, axis=0).tolist():
            if one != other:
                beside.setdefault(one, set()).add(other)
                beside.setdefault(other, set()).add(one)
        mesh = Mesh(piece.mesh.vertices, piece.mesh.faces[chosen], label[chosen])
        return FaceGroup(members, mesh, beside)


def _part(mesh: Mesh, pairs: Ints, own: Mask) -> tuple[Mesh, Ints]:
    """Give some triangles as a mesh, and the pairs of them."""
    number = np.cumsum(own) - 1
    used, corners = np.unique(mesh.faces[own], return_inverse=True)
    return Mesh(mesh.vertices[used], corners.reshape(-1, 3)), number[pairs[own[pairs].all(axis=1)]]
