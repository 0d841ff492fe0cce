"""Which surface each triangle of a local blend lies on: a face of the part, or a surface of the blend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .blend_surfaces import BlendSurface, CornerSurface, FlatSurface, StripPiece, StripSurface
from .chamfers import Flat
from .implicit import FloatArray
from .layout import Laid
from .mesh import Mesh
from .patches import Numbers, connected, opposite

#: A triangle is on a surface if its vertices are within this many spacings of it, and its normal within this cosine:
#: vertices are put onto surfaces to 0.02 spacings, triangles of a hundredth of that are as good as none.
_ON = 0.1
_FACING = 0.7

#: Triangles that reach across a crease go to the surface that is nearest, within so many spacings, if no other fits.
_ACROSS = 1.0
_LAST = 10.0

#: Weights of the normal, and of how far the middle is beyond the surface's borders, against the distance in spacings.
_TURN = 0.2
_BEYOND = 1.0

#: Patches smaller than this many squared spacings are joined to a neighbour, on whose surface they are, too.
_SMALL = 1.0
_ROUNDS = 6


class Face(Protocol):
    """Signed distance to a face, positive in the material."""

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (N,) and gradients (N, 3)."""


class Faces(Protocol):
    """Faces of a part by number from 1."""

    def face(self, number: int) -> Face:
        """Signed distance to one face and its continuation."""


@dataclass(frozen=True, eq=False)
class Outward:
    """A surface with the sign that makes its gradient point out of the result."""

    surface: BlendSurface | Face
    sign: float

    def value_and_normal(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances (N,) and outward normals (N, 3)."""
        value, gradient = self.surface.value_and_gradient(points)
        return self.sign * value, self.sign * gradient


def blend_surfaces(laid: dict[str, Laid]) -> list[Outward]:
    """Surfaces of all blends."""
    found = []
    for kind, sign in (("convex", 1.0), ("concave", -1.0)):
        if kind not in laid:
            continue
        own: list[BlendSurface] = [piece for strip in laid[kind].plain for piece in StripSurface(strip).pieces()]
        for ball in laid[kind].corners:
            box = np.stack([ball.centre - 1.01 * ball.radius, ball.centre + 1.01 * ball.radius])
            own.append(CornerSurface(ball.centre, ball.radius, ball.contacts, box))
        own += [FlatSurface(flat.point, flat.normal, flat.box) for flat in laid[kind].others if isinstance(flat, Flat)]
        found += [Outward(surface, sign) for surface in own]
    return found


def label(mesh: Mesh, count: int, faces: Faces, surfaces: list[Outward], spacing: float) -> Numbers:
    """Label (F,) each triangle: faces of the part from 0, surfaces from ``count``, -1 where none fits.

    Parameters
    ----------
    mesh : Mesh
        With ``face_ids``: -1 for triangles that are not the part's.
    count : int
        Number of faces of the part.
    faces : Faces
    surfaces : list of Outward
        Of the blends.
    spacing : float
        In mm.
    """
    assert mesh.face_ids is not None
    labels = mesh.face_ids.astype(np.int64)
    new = np.flatnonzero(labels < 0)
    if len(new) == 0:
        return labels
    best = np.full(len(new), np.inf)
    near = _faces_beside(mesh, labels)
    candidates = [(number, Outward(faces.face(number + 1), -1.0)) for number in near]
    for number, surface in [*candidates, *enumerate(surfaces, count)]:
        cost = _cost(mesh, new, surface, spacing)
        better = cost < best
        best[better] = cost[better]
        labels[new[better]] = number
    return _without_crumbs(mesh, labels, count, faces, surfaces, spacing)


def _faces_beside(mesh: Mesh, labels: Numbers) -> list[int]:
    """Faces of the part that share vertices with new triangles."""
    fresh = np.zeros(len(mesh.vertices), np.bool_)
    fresh[mesh.faces[labels < 0]] = True
    beside = labels[fresh[mesh.faces].any(axis=1)]
    return [int(number) for number in np.unique(beside) if number >= 0]


def _cost(mesh: Mesh, triangles: NDArray[np.intp], surface: Outward, spacing: float) -> FloatArray:
    """How badly triangles (N,) lie on a surface; infinite where they do not."""
    cost = np.full(len(triangles), np.inf)
    box = getattr(surface.surface, "box", None)
    corners = mesh.faces[triangles]
    if box is not None:
        inside = ((mesh.vertices >= box[0] - spacing) & (mesh.vertices <= box[1] + spacing)).all(axis=1)
        some = np.flatnonzero(inside[corners].all(axis=1))
    else:
        some = np.arange(len(triangles))
    if len(some) == 0:
        return cost
    used, place = np.unique(corners[some], return_inverse=True)
    place = place.reshape(-1, 3)
    value, normal = surface.value_and_normal(mesh.vertices[used])
    off = np.abs(value)[place].max(axis=1) / spacing
    vectors = mesh.face_vectors[triangles[some]]
    size = np.linalg.norm(vectors, axis=1)
    facing = (vectors * normal[place].mean(axis=1)).sum(axis=1) / np.where(size > 0, size, 1.0)
    tiny = size < (0.01 * spacing) ** 2
    facing = np.where(tiny, 1.0, facing)
    good = (off < _ON) & (facing > _FACING)
    across = ~good & (off < _ACROSS)
    own = np.full(len(some), np.inf)
    own[across] = _LAST + off[across] + _TURN * (1 - facing[across])
    own[good] = off[good] + _TURN * (1 - facing[good])
    fit = np.flatnonzero(good | across)
    own[fit] += _BEYOND * _beyond(surface, mesh.vertices[corners[some[fit]]].mean(axis=1)) / spacing
    cost[some] = own
    return cost


def _beyond(surface: Outward, points: FloatArray) -> FloatArray:
    """How far (N,) points (N, 3) are beyond the borders of a surface in mm, 0 within."""
    if not isinstance(surface.surface, StripSurface | StripPiece | CornerSurface | FlatSurface) or len(points) == 0:
        return np.zeros(len(points))
    return np.maximum(surface.surface.beyond(points), 0.0)


def _without_crumbs(
    mesh: Mesh, labels: Numbers, count: int, faces: Faces, surfaces: list[Outward], h: float
) -> Numbers:
    """Join small patches of new triangles to neighbours on whose surface they lie, too."""
    start = mesh.faces.ravel().astype(np.int64)
    end = np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    other = opposite(start, end, len(mesh.vertices)) // 3
    length = np.linalg.norm(mesh.vertices[end] - mesh.vertices[start], axis=1)
    area = np.linalg.norm(mesh.face_vectors, axis=1)
    for _ in range(_ROUNDS):
        own, patch = connected(mesh.faces, labels)
        size = np.bincount(patch, area)
        small = np.flatnonzero(size < _SMALL * h * h)
        largest = {int(one): float(size[own == one].max()) for one in np.unique(own)}
        changed = False
        for one in small.tolist():
            inside = np.flatnonzero(patch == one)
            if own[one] >= 0 and size[one] == largest[int(own[one])] and size[one] > 1e-3 * h * h:
                continue  # all there is of its surface
            edges = (3 * inside[:, None] + np.arange(3)).ravel()
            outer = edges[patch[other[edges]] != one]
            beside = np.bincount(labels[other[outer]] + 1, length[outer])
            for target in (np.argsort(-beside) - 1).tolist():
                if beside[target + 1] == 0 or target < 0 or target == own[one]:
                    continue
                face = Outward(faces.face(target + 1), -1.0) if target < count else surfaces[target - count]
                points = mesh.vertices[np.unique(mesh.faces[inside])]
                value = face.value_and_normal(points)[0]
                if float(np.abs(value).max()) < _ON * h and float(_beyond(face, points).min()) < h:
                    labels[inside] = target
                    changed = True
                    break
        if not changed:
            break
    return labels
