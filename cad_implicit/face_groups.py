"""Faces with their tangent neighbours: the surface that a ball rolls on beyond the face that it starts on.

A face is continued first by the faces that it meets smoothly, and by those that they meet; only across sharp borders by
its own surface. Without that the end arc of a slot would go on as a full cylinder, which comes back into the slot.

Not promised: far from all faces of a group, where two of them are equally near at sharp borders, the value may jump
from the continuation of the one to that of the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .cad import OpenPart
from .cad.edges import Edge, part_edges
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


class PartFaces:
    """All faces of a B-rep part by number, alone and with their tangent neighbours.

    Parameters
    ----------
    part : OpenPart
        Of a B-rep.
    reach : float
        How far in mm free-form faces are continued.
    found : sequence of Edge, optional
        The part's edges, if they are known.

    Raises
    ------
    ValueError
        If the part came as triangles.
    """

    def __init__(self, part: OpenPart, reach: float, found: Sequence[Edge] | None = None) -> None:
        if part.shape is None:
            raise ValueError("triangles have no faces in closed form; give a B-rep")
        self.edges = part_edges(part) if found is None else tuple(found)
        self._part = part
        self._reach = reach
        self._known: dict[int, FaceDistance] = {}

    def face(self, number: int) -> FaceDistance:
        """Signed distance to one face and its continuation.

        Raises
        ------
        SelectorError
            If there is no such face.
        """
        if number not in self._known:
            from .cad.occ_faces import face_distance

            if not 1 <= number <= len(self._shapes):
                raise SelectorError(f"there is no face {number}; the part has {len(self._shapes)}")
            self._known[number] = face_distance(self._shapes[number - 1], self._reach)
        return self._known[number]

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

    @cached_property
    def _shapes(self) -> list[object]:
        from .cad.occ_faces import all_faces

        return all_faces(self._part.shape)

    @cached_property
    def _mesh(self) -> Mesh:
        return self._part.mesh()


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
