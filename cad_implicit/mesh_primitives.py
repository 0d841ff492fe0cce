"""Tangent surfaces in one piece of a mesh, told apart: the walls of a slot and its end arcs, a plane and its fillets.

Grown from a few neighbouring triangles at a time (Besl and Jain 1988, DOI 10.1109/34.3881): what fits a cylinder, cone,
sphere or torus takes in all connected triangles that are chords of it. What is flat and tangent to those is a plane.

Not promised: arcs of fewer than four facets are left free-form.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from .cad.weld import groups
from .faces import AnalyticFace, TorusFace
from .fitted_faces import Piece, chords, fitted, turned
from .implicit import FloatArray
from .mesh import Mesh

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

#: Neighbouring triangles are in one plane if they turn by less than this (radians), or the corners of the one are as
#: near to the plane of the other as coordinates are good, relative to the diagonal.
_FLAT = 1e-4
_ROUNDING = 5e-7
#: Least turn at a crease in degrees, and how many times more than beside it.
_CREASE = 3.0
_SHARPER = 3.0
#: Starts in a row that lead nowhere before the rest is given up as free-form.
_FAILURES = 24
#: Fewest flat facets in a row that tell a curved surface: an arc of 90 degrees has at least as many. Angles on an arc
#: that differ by less than this (radians) are of one row.
_ROWS = 4
_SAME = 1e-3
#: Beyond its border a surface in closed form ends at once: the corners of the next triangles are off it by more than
#: this many tolerances. A free-form one that happens to fit leaves it gradually, by 2 to 5.
_JUMP = 10.0
#: A plane is tangent to its neighbours within this (radians), and if those are free-form, this many times as wide.
_TANGENT = 0.02
_WIDER = 4.0
#: It is a larger share than this of what is left, or beside a curved surface.
_LARGE = 0.003


class Primitives(NamedTuple):
    """Surfaces of a piece: which of them ``(F,)`` each triangle is on, and what they are, None where free-form."""

    label: Ints
    faces: list[AnalyticFace | None]


def primitives(mesh: Mesh, pairs: Ints, diagonal: float) -> Primitives:
    """Tell the surfaces apart that a piece of a mesh consists of.

    Parameters
    ----------
    mesh : Mesh
        The piece.
    pairs : (P, 2) int64
        Its triangles that meet smoothly.
    diagonal : float
        Of the whole part in mm.
    """
    grower = _Grower(mesh, pairs, diagonal)
    grower.wholes()
    if (grower.label < 0).any():
        grower.curved()
        grower.planes()
        grower.rest()
    return Primitives(grower.label, grower.faces)


class _Grower:
    """Triangles of a piece, and what is known of them so far."""

    def __init__(self, mesh: Mesh, pairs: Ints, diagonal: float) -> None:
        self.mesh = mesh
        self.piece = Piece.of(mesh)
        self.pairs = pairs
        self.diagonal = diagonal
        self.label = np.full(len(mesh.faces), -1, np.int64)
        self.faces: list[AnalyticFace | None] = []

    @cached_property
    def flat(self) -> Ints:
        """Flat facet ``(F,)`` that each triangle is in."""
        return _flats(self.mesh, self.piece, self.pairs, self.diagonal)

    def wholes(self) -> None:
        """Take what is connected for one surface where it is."""
        joined = groups(len(self.label), self.pairs)[0]
        for number in range(int(joined.max()) + 1):
            own = joined == number
            face = fitted(self.piece.take(own), self.diagonal)
            if face is not None:
                self._keep(own, face)

    def curved(self) -> None:
        """Grow curved surfaces from flat facets that are spread over the piece."""
        count = int(self.flat.max()) + 1
        corners = csr_matrix(
            (np.ones(self.mesh.faces.size, np.int8), (np.repeat(self.flat, 3), self.mesh.faces.ravel())),
            (count, len(self.mesh.vertices)),
            dtype=np.int32,
        )
        beside = (corners @ corners.T).tocsr()
        failures = 0
        for seed in np.random.default_rng(0).permutation(count).tolist():
            if failures >= _FAILURES:
                break
            own = self.flat == seed
            if self.label[own][0] < 0:
                start = np.isin(self.flat, beside.indices[beside.indptr[seed] : beside.indptr[seed + 1]])
                failures = 0 if self._grow(start & (self.label < 0), own) else failures + 1

    def _grow(self, start: Mask, seed: Mask) -> bool:
        """Take in all that is on the surface of some triangles, if they are on one."""
        if len(np.unique(self.flat[start])) < 3:
            return False
        face = fitted(self.piece.take(start), self.diagonal, ("cylinder", "cone", "sphere", "torus"))
        own = start
        for _ in range(4):
            if face is None:
                return False
            before, own = own, self._on(face, own, seed)
            if not own[seed].all():
                return False
            if (own == before).all():
                break
            better = fitted(self.piece.take(own), self.diagonal, (face.kind,))
            face = face if better is None else better
        if face is None or not self._enough(face, own) or not self._ends(face, own):
            return False
        self._keep(own, face)
        return True

    def _on(self, face: AnalyticFace, own: Mask, seed: Mask) -> Mask:
        """Triangles connected with a seed that are chords of a face."""
        free = np.flatnonzero(self.label < 0)
        tolerance = self.piece.take(own).tolerance(self.diagonal)
        on = np.zeros(len(self.label), np.bool_)
        on[free] = chords(face, self.piece.take(free), tolerance)
        joined = groups(len(on), self.pairs[on[self.pairs].all(axis=1)])[0]
        return np.asarray(on & (joined == joined[np.flatnonzero(seed)[0]]))

    def _enough(self, face: AnalyticFace, own: Mask) -> bool:
        """Whether there are more rows than fit by themselves: four lines of a symmetric arc are on a cylinder."""
        if not isinstance(face, TorusFace):
            return len(np.unique(self.flat[own])) >= _ROWS
        corners = self.piece.corners[own].reshape(-1, 3) - face.centre
        height = corners @ face.axis
        away = np.linalg.norm(corners - height[:, None] * face.axis, axis=1)
        ring = face.ring if face.sheet == "outer" else -face.ring
        angle = np.sort(np.arctan2(height, away - ring))
        return int((np.diff(angle) > _SAME).sum()) >= _ROWS

    def _ends(self, face: AnalyticFace, own: Mask) -> bool:
        """Whether a face leaves the surface at once where it ends."""
        across = self.pairs[own[self.pairs].sum(axis=1) == 1]
        outer = across[~own[across]]
        outer = np.unique(outer[self.label[outer] < 0])
        if not len(outer):
            return True
        off = np.abs(face(self.piece.corners[outer].reshape(-1, 3))).reshape(-1, 3).max(axis=1)
        return float(np.median(off)) > _JUMP * self.piece.take(own).tolerance(self.diagonal)

    def _keep(self, own: Mask, face: AnalyticFace | None) -> None:
        self.label[own] = len(self.faces)
        self.faces.append(None if face is None else turned(face, self.piece.take(own)))

    def planes(self) -> None:
        """Take flat facets that are left for planes where they are tangent to what is beside them."""
        free = self.label < 0
        area = np.bincount(self.flat[free], self.piece.areas[free], int(self.flat.max()) + 1)
        beside = np.unique(self.flat[self.pairs[~free[self.pairs].all(axis=1)]])
        large = np.union1d(np.flatnonzero(area > _LARGE * area.sum()), beside[area[beside] > 0])
        for flat in large[np.argsort(-area[large])].tolist():
            own = (self.flat == flat) & (self.label < 0)
            if own.any():
                face = fitted(self.piece.take(own), self.diagonal, ("plane",))
                if face is not None and self._tangent(own, face):
                    self._keep(own, face)

    def _tangent(self, own: Mask, plane: AnalyticFace) -> bool:
        """Whether a plane is tangent to all surfaces beside it, and wider than free-form facets."""
        across = self.pairs[own[self.pairs].sum(axis=1) == 1]
        inner = np.where(own[across[:, 0]], across[:, 0], across[:, 1])
        outer = across.sum(axis=1) - inner
        if not len(outer):
            return True
        normal = -plane.value_and_gradient(self.piece.corners[inner[0]])[1][0]
        for label in np.unique(self.label[outer]).tolist():
            here = self.label[outer] == label
            face = self.faces[label] if label >= 0 else None
            if face is None:
                if self._width(own) <= _WIDER * max(
                    self._width(self.flat == flat) for flat in np.unique(self.flat[outer[here]]).tolist()
                ):
                    return False
            else:
                middles = self._middles(inner[here], outer[here])
                turned_by = np.linalg.norm(face.value_and_gradient(middles)[1] + normal, axis=1)
                if float(np.median(turned_by)) > _TANGENT:
                    return False
        return True

    def _width(self, own: Mask) -> float:
        """Area over half the extent."""
        piece = self.piece.take(own)
        return float(2 * piece.areas.sum() / max(piece.extent, 1e-300))

    def _middles(self, one: Ints, other: Ints) -> FloatArray:
        """Points ``(N, 3)`` in the middle of what pairs of triangles share."""
        first, second = self.mesh.faces[one], self.mesh.faces[other]
        shared = (first[:, :, None] == second[:, None, :]).any(axis=2)
        weight = shared / shared.sum(axis=1, keepdims=True)
        return np.asarray((self.piece.corners[one] * weight[:, :, None]).sum(axis=1))

    def rest(self) -> None:
        """Leave what is connected of the rest as free-form faces."""
        free = self.label < 0
        joined = groups(len(free), self.pairs[free[self.pairs].all(axis=1)])[0]
        for number in np.unique(joined[free]).tolist():
            self._keep(joined == number, None)


def without_creases(mesh: Mesh, pairs: Ints, diagonal: float) -> Ints:
    """Pairs of triangles ``(P, 2)`` but for those that meet sharply: they turn much more than what is beside them.

    An arc turns from each of its facets to the next by about the same angle; two planes meet in one place only.
    """
    piece = Piece.of(mesh)
    flat = _flats(mesh, piece, pairs, diagonal)
    between = flat[pairs]
    cosine = (piece.normals[pairs[:, 0]] * piece.normals[pairs[:, 1]]).sum(axis=1)
    turn = np.where(between[:, 0] != between[:, 1], np.degrees(np.arccos(np.clip(cosine, -1, 1))), 0.0)
    both = np.concatenate([between, between[:, ::-1]])
    twice = np.concatenate([turn, turn])
    # of each facet, its largest turn, to which other, and the largest to any third
    largest = np.zeros(int(flat.max()) + 1)
    np.maximum.at(largest, both[:, 0], twice)
    towards = np.full(len(largest), -1)
    at_most = twice == largest[both[:, 0]]
    towards[both[at_most, 0]] = both[at_most, 1]
    second = np.zeros(len(largest))
    third = both[:, 1] != towards[both[:, 0]]
    np.maximum.at(second, both[third, 0], twice[third])
    besides = np.where(towards[between] == between[:, ::-1], second[between], largest[between]).max(axis=1)
    return np.asarray(pairs[~((turn > _CREASE) & (turn > _SHARPER * besides))])


def _flats(mesh: Mesh, piece: Piece, pairs: Ints, diagonal: float) -> Ints:
    """Give the number ``(F,)`` of the flat facet that each triangle is in."""
    first, second = pairs.T
    turn = np.linalg.norm(piece.normals[first] - piece.normals[second], axis=1)
    offset = piece.corners[second] - piece.corners[first][:, :1]
    off = np.abs(np.einsum("pij,pj->pi", offset, piece.normals[first])).max(axis=1)
    back = piece.corners[first] - piece.corners[second][:, :1]
    off = np.maximum(off, np.abs(np.einsum("pij,pj->pi", back, piece.normals[second])).max(axis=1))
    flat = groups(len(mesh.faces), pairs[(turn < _FLAT) | (off < _ROUNDING * diagonal)])[0].astype(np.int64)
    # fine triangles of a curved surface are flat one by one, but not together
    order = np.argsort(flat, kind="stable")
    counts = np.bincount(flat)
    largest = np.zeros((len(counts), 3))
    np.add.at(largest, flat, piece.normals * piece.areas[:, None])
    mean = largest / np.maximum(np.linalg.norm(largest, axis=1), 1e-300)[:, None]
    height = np.einsum("fij,fj->fi", piece.corners, mean[flat])
    low = np.minimum.reduceat(height.min(axis=1)[order], np.cumsum(counts) - counts)
    high = np.maximum.reduceat(height.max(axis=1)[order], np.cumsum(counts) - counts)
    curved = (high - low > 4 * _ROUNDING * diagonal)[flat]
    split = np.where(curved, len(counts) + np.arange(len(flat)), flat)
    return np.asarray(np.unique(split, return_inverse=True)[1].ravel(), np.int64)
