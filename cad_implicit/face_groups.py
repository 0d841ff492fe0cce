"""Faces with their tangent neighbours: the surface that a ball rolls on beyond the face that it starts on.

A face is continued first by the faces that it meets smoothly, and by those that they meet; only across sharp borders by
its own surface. Without that the end arc of a slot would go on as a full cylinder, which comes back into the slot.

Not promised: far from all faces of a group, where two of them are equally near at sharp borders, the value may jump
from the continuation of the one to that of the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .cad import OpenPart
from .cad.edges import SHARP_DEGREES, Edge, part_edges
from .cad.kernel import kernel
from .distance import MeshDistance
from .errors import SelectorError
from .faces import FaceDistance
from .implicit import FloatArray
from .mesh import Mesh

Numbers = NDArray[np.int64]


class FaceGroup(FaceDistance):
    """Signed distance to several faces as one surface: that to the nearest of them, and its continuation.

    Parameters
    ----------
    members : dict of int to FaceDistance
        Faces by number, from 1.
    mesh : Mesh or None
        Triangles of these faces and maybe others; ``face_ids`` are the numbers less 1. Not needed for one face.
    beside : dict of int to set of int
        Which faces meet which smoothly.
    """

    kind = "group"

    def __init__(self, members: Mapping[int, FaceDistance], mesh: Mesh | None, beside: Mapping[int, set[int]]) -> None:
        self.members = dict(members)
        self._mesh = mesh
        self._pairs = {(a, b) for a in members for b in beside.get(a, set()) if b in members}

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        x = np.ascontiguousarray(points, np.float64)
        if len(self.members) == 1:
            return next(iter(self.members.values())).value_and_gradient(x)
        value, gradient = np.zeros(len(x)), np.zeros_like(x)
        nearest = self._nearest(x)
        self._evaluate(x, nearest, np.ones(len(x), np.bool_), value, gradient)
        # near a smooth border the triangles may name the wrong face; that of the foot is the right one
        other = self._nearest(x - value[:, None] * gradient)
        changed = np.asarray(nearest != other)
        pairs = zip(nearest[changed].tolist(), other[changed].tolist(), strict=True)
        changed[changed] = [pair in self._pairs for pair in pairs]
        self._evaluate(x, other, changed, value, gradient)
        return value, gradient

    def _evaluate(
        self, x: FloatArray, faces: Numbers, chosen: NDArray[np.bool_], value: FloatArray, gradient: FloatArray
    ) -> None:
        """Fill in values and gradients of the chosen points, each from its face."""
        for number, face in self.members.items():
            own = chosen & (faces == number)
            if own.any():
                value[own], gradient[own] = face.value_and_gradient(x[own])

    def _nearest(self, points: FloatArray) -> Numbers:
        """Give the number ``(N,)`` of the face that is nearest to each point, by the triangles."""
        mesh, distance = self._own
        assert mesh.face_ids is not None
        return np.asarray(mesh.face_ids[distance.closest(points).triangle] + 1, np.int64)

    @cached_property
    def _own(self) -> tuple[Mesh, MeshDistance]:
        ids = None if self._mesh is None else self._mesh.face_ids
        if self._mesh is None or ids is None:
            raise ValueError("a group of faces needs a mesh whose triangles know their faces")
        own = np.isin(ids + 1, list(self.members))
        mesh = Mesh(self._mesh.vertices, self._mesh.faces[own], ids[own])
        return mesh, MeshDistance(mesh, sign="pseudonormal")


class _Faces(Protocol):
    """Faces of a B-rep or of a mesh."""

    count: int

    def face(self, number: int) -> FaceDistance:
        """One face, by its number from 1."""

    def halves(self, number: int, edge: Edge) -> tuple[FaceDistance, FaceDistance]:
        """Parts of a face on the left and on the right of an edge within it."""


class PartFaces:
    """All faces of a part by number, alone and with their tangent neighbours.

    Parameters
    ----------
    part : OpenPart
        If it came as triangles, its faces are the pieces between sharp edges.
    reach : float
        How far in mm free-form faces are continued.
    found : sequence of Edge, optional
        The part's edges, if they are known.
    sharp : float
        For triangles: those that turn by more than this many degrees are of different faces; as the edges were found.
    """

    def __init__(
        self,
        part: OpenPart,
        reach: float,
        found: Sequence[Edge] | None = None,
        sharp: float = SHARP_DEGREES,
    ) -> None:
        self.edges = part_edges(part, sharp) if found is None else tuple(found)
        self._part = part
        self._reach = reach
        self._sharp = sharp
        self._known: dict[int, FaceDistance] = {}

    def face(self, number: int) -> FaceDistance:
        """Signed distance to one face and its continuation.

        Raises
        ------
        SelectorError
            If there is no such face.
        """
        if number not in self._known:
            if not 1 <= number <= self._faces.count:
                raise SelectorError(f"there is no face {number}; the part has {self._faces.count}")
            self._known[number] = self._faces.face(number)
        return self._known[number]

    def beside(self, edge: Edge) -> tuple[FaceDistance, FaceDistance]:
        """Signed distances to the faces on the left and on the right of an edge, each with its tangent neighbours.

        A free-form face that meets itself at a sharp edge is cut in the middle; each half goes on along its tangents.

        Raises
        ------
        ValueError
            If the edge has not two faces.
        """
        if len(edge.faces) != 2:
            raise ValueError(f"edge {edge.number} is {edge.convexity}: it is not between two faces")
        left, right = edge.faces
        if left == right:
            self.face(left)
            return self._faces.halves(left, edge)
        groups = self.groups(edge.faces)
        return groups[left], groups[right]

    def groups(self, seeds: Iterable[int]) -> dict[int, FaceGroup]:
        """Each of some faces with the tangent neighbours that are nearer to it than to the others.

        Parameters
        ----------
        seeds : iterable of int
            Numbers of faces, from 1: those beside an edge, or around a corner.

        Returns
        -------
        dict of int to FaceGroup
            By seed. No face is in two of them.
        """
        beside = smooth_neighbours(self.edges)
        parts = tangent_neighbours(beside, list(seeds))
        mesh = self._mesh if any(len(own) > 1 for own in parts.values()) else None
        return {seed: FaceGroup({n: self.face(n) for n in own}, mesh, beside) for seed, own in parts.items()}

    def joined(self, left: Iterable[int], right: Iterable[int]) -> tuple[FaceGroup, FaceGroup]:
        """Faces on the left and on the right of a chain of edges, each side with its tangent neighbours as one surface.

        Parameters
        ----------
        left, right : iterable of int
            Numbers of faces, none in both.
        """
        one, other = set(left), set(right)
        beside = smooth_neighbours(self.edges)
        parts = tangent_neighbours(beside, sorted(one | other))
        members = [sorted({n for seed in seeds for n in parts[seed]}) for seeds in (one, other)]
        mesh = self._mesh if any(len(own) > 1 for own in members) else None
        first, second = (FaceGroup({n: self.face(n) for n in own}, mesh, beside) for own in members)
        return first, second

    @cached_property
    def _faces(self) -> _Faces:
        if self._part.triangles is not None:
            from .mesh_surfaces import MeshFaces

            return MeshFaces(self._part.triangles, self._reach, self._sharp)
        faces: _Faces = kernel(self._part.shape, "faces").ShapeFaces(self._part.shape, self._reach)
        return faces

    @cached_property
    def _mesh(self) -> Mesh:
        if self._part.triangles is None:
            return self._part.mesh()
        from .cad.mesh_edges import segment

        mesh = self._part.triangles
        return Mesh(mesh.vertices, mesh.faces, segment(mesh, self._sharp) - 1)


def smooth_neighbours(edges: Sequence[Edge]) -> dict[int, set[int]]:
    """Give the faces, by number, that each face meets at smooth edges."""
    beside: dict[int, set[int]] = {}
    for edge in edges:
        if edge.convexity == "smooth":
            first, second = edge.faces
            beside.setdefault(first, set()).add(second)
            beside.setdefault(second, set()).add(first)
    return beside


def tangent_neighbours(beside: Mapping[int, set[int]], seeds: Sequence[int]) -> dict[int, list[int]]:
    """Faces that are reached from each seed over smooth edges, over fewer of them than from any other seed.

    Parameters
    ----------
    beside : dict of int to set of int
        Which faces meet which smoothly.
    seeds : sequence of int
        Numbers of faces.

    Returns
    -------
    dict of int to list of int
        By seed, the seed first. Faces as near to two seeds belong to neither, nor do those behind them.
    """
    owner: dict[int, int | None] = {seed: seed for seed in seeds}
    front = list(owner)
    while front:
        claims: dict[int, set[int]] = {}
        for face in front:
            mine = owner[face]
            for other in beside.get(face, set()) - set(owner) if mine is not None else ():
                claims.setdefault(other, set()).add(mine)  # type: ignore[arg-type]
        for face, claimants in claims.items():
            owner[face] = next(iter(claimants)) if len(claimants) == 1 else None
        front = sorted(claims)
    result: dict[int, list[int]] = {seed: [] for seed in seeds}
    for face, seed in owner.items():
        if seed is not None:
            result[seed].append(face)
    return result
