"""Whether points lie on blends: the contact test, by Newton's method of its own.

A point of a fillet is at the radius from its foot on the spine, and that centre is at the radius from both faces beside
the edge. Where another blend, or a sharp border, takes a face's place, the distance to its spine or to the border does.
At corners the ball touches three faces. Ends are cut by the faces that the edge runs into, continued.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cad_implicit.cad import OpenPart
from cad_implicit.cad.edges import TANGENT_DEGREES, Edge, chained
from cad_implicit.cad.occ_edges import shape_edges
from cad_implicit.face_groups import PartFaces
from cad_implicit.implicit import FloatArray

#: Polylines of edges are this share of the radius off at most.
_POLYLINE = 1e-5
#: Steps of Newton's method, and how near in radii the result must be to count.
_STEPS, _SOLVED = 25, 1e-6
#: Nearer than this in radii nothing more is gained; determinant of slopes above which their equations are solved.
_DONE, _REGULAR = 1e-11, 1e-4
#: How far in radii, beside what the angle asks for, points are that belong to an edge.
_REACH = 1.5
#: A point whose defect is below this, in radii, is not asked about again.
_PLAIN = 2e-5


class Side(Protocol):
    """What a ball touches: signed distances, positive in the material, and gradients."""

    def value_and_gradient(self, points: FloatArray, /) -> tuple[FloatArray, FloatArray]: ...


class Curve:
    """Distance to a polyline as a side: ``sign * (distance - radius)``."""

    def __init__(self, points: FloatArray, sign: float, radius: float = 0.0) -> None:
        self._points, self._sign, self._radius = points, sign, radius
        self._tree = cKDTree(points)

    def value_and_gradient(self, points: FloatArray, /) -> tuple[FloatArray, FloatArray]:
        nearest = self._tree.query(points)[1]
        best, foot = np.full(len(points), np.inf), np.zeros_like(points)
        for start in (nearest - 1, nearest):
            first = self._points[np.clip(start, 0, len(self._points) - 2)]
            along = self._points[np.clip(start, 0, len(self._points) - 2) + 1] - first
            share = ((points - first) * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-300)
            place = first + np.clip(share, 0, 1)[:, None] * along
            distance = np.linalg.norm(points - place, axis=1)
            better = distance < best
            best, foot = np.where(better, distance, best), np.where(better[:, None], place, foot)
        away = (points - foot) / np.maximum(best, 1e-300)[:, None]
        return self._sign * (best - self._radius), self._sign * away


@dataclass(frozen=True)
class Found:
    """Defects of points.

    Attributes
    ----------
    defect : (N,) float64
        In mm; infinite if no ball is near.
    by : (N,) of str
        What explains the point: "edge", "border", "blend", "corner", "end".
    """

    defect: FloatArray
    by: NDArray[np.str_]


class Contacts:
    """The balls of the blends of some edges of a part.

    Parameters
    ----------
    part : OpenPart
        Of a B-rep.
    radii : dict of int to float
        By number of the edge; tangent neighbours follow.
    """

    def __init__(self, part: OpenPart, radii: Mapping[int, float]) -> None:
        self.smallest = min(radii.values())
        found = chained(shape_edges(part.shape, _POLYLINE * self.smallest), TANGENT_DEGREES)
        self.edges = {edge.number: edge for edge in found}
        chains = {self.edges[n].chain: r for n, r in radii.items()}
        self.radii = {e.number: radii.get(e.number, chains[e.chain]) for e in found if e.chain in chains}
        low, high = part.bounds
        self._faces = PartFaces(part, float(np.linalg.norm(high - low)), found)
        self._spines: dict[int, FloatArray] = {}

    def test(self, points: FloatArray) -> Found:
        """Defects of points ``(N, 3)`` in mm."""
        best, by = np.full(len(points), np.inf), np.full(len(points), "none", "<U8")
        for name, centre, radius in self._corners():
            near = np.flatnonzero(np.linalg.norm(points - centre, axis=1) < 2 * radius)
            self._take(best, by, near, name, np.abs(np.linalg.norm(points[near] - centre, axis=1) - radius))
        for place, radius, numbers in self._ends():
            near = np.flatnonzero(np.linalg.norm(points - place, axis=1) < 4 * radius)
            for number in numbers:
                self._take(best, by, near, "end", np.abs(self._faces.face(number)(points[near])))
        for pairs in (self._plain, self._others):  # most points are explained by the first
            for number, radius in self.radii.items():
                edge = self.edges[number]
                near, foot = self._near(edge, radius, points)
                for name, sides in pairs(edge) if len(near) else ():
                    open_ = best[near] > _PLAIN * radius
                    near, foot = near[open_], foot[open_]
                    if not len(near):
                        break
                    self._take(best, by, near, name, self._rolled(points[near], edge, foot, radius, sides))
        return Found(best, by)

    @staticmethod
    def _take(best: FloatArray, by: NDArray[np.str_], near: NDArray[np.intp], name: str, defect: FloatArray) -> None:
        better = defect < best[near]
        best[near[better]], by[near[better]] = defect[better], name

    def _sign(self, edge: Edge) -> float:
        return 1.0 if edge.convexity == "convex" else -1.0

    def _near(self, edge: Edge, radius: float, points: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Points that may belong to an edge, and the nearest points of its polyline."""
        turn = np.radians(180 - np.abs(180 - edge.angles)).min()
        reach = radius * (1 / max(np.tan(turn / 2), 0.05) + _REACH)
        distance, foot = cKDTree(edge.points).query(points)
        spread = np.linalg.norm(np.diff(edge.points, axis=0), axis=1).max()
        near = np.flatnonzero(distance < reach + spread)
        return near, foot[near]

    def _plain(self, edge: Edge) -> Iterator[tuple[str, tuple[Side, Side]]]:
        """Faces beside an edge."""
        groups = self._faces.groups(edge.faces)
        yield "edge", (groups[edge.faces[0]], groups[edge.faces[1]])

    def _others(self, edge: Edge) -> Iterator[tuple[str, tuple[Side, Side]]]:
        """Pairs of sides that the ball of an edge may touch instead."""
        groups = self._faces.groups(edge.faces)
        sign = self._sign(edge)
        for other in self.edges.values():
            touching = set(other.ends) & set(edge.ends)
            if other.number in self.radii and other.number != edge.number and touching and len(set(other.faces)) == 2:
                for own in edge.faces:
                    if own not in other.faces:
                        canal = Curve(self._spine(other), -self._sign(other), self.radii[other.number])
                        yield "blend", (groups[own], canal)
        for own, across in (edge.faces, edge.faces[::-1]):
            for other in self.edges.values():
                if own in other.faces and other.number != edge.number and other.convexity in ("convex", "concave"):
                    yield "border", (groups[across], Curve(other.points, sign))

    def _start(self, edge: Edge, foot: NDArray[np.intp], radius: float) -> FloatArray:
        normals = edge.normals[foot].sum(axis=1)
        bend = np.maximum((normals * normals).sum(axis=1, keepdims=True) / 2, 0.05)
        return np.asarray(edge.points[foot] - self._sign(edge) * radius * normals / bend)

    def _rolled(
        self, points: FloatArray, edge: Edge, foot: NDArray[np.intp], radius: float, sides: Sequence[Side]
    ) -> FloatArray:
        """Defects by the ball whose spine's normal plane holds the point, found from beside the edge and the point."""
        sign, best = self._sign(edge), np.full(len(points), np.inf)
        inward = np.sum([side.value_and_gradient(points)[1] for side in sides], axis=0)
        inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-12)
        for start in (self._start(edge, foot, radius), points + sign * radius * inward):
            centre, off = newton(start, sides, sign * radius, points)
            defect = np.abs(np.linalg.norm(points - centre, axis=1) - radius)
            best = np.minimum(best, np.where(off < _SOLVED * radius, defect, np.inf))
        return best

    def _spine(self, edge: Edge) -> FloatArray:
        """Centres of an edge's ball, and a straight piece beyond both ends."""
        if edge.number not in self._spines:
            radius = self.radii[edge.number]
            groups = self._faces.groups(edge.faces)
            start = self._start(edge, np.arange(len(edge.points)), radius)
            sides = [groups[n] for n in edge.faces]
            spine, _ = newton(start, sides, self._sign(edge) * radius, None)
            before, after = spine[0] - spine[1], spine[-1] - spine[-2]
            ends = [v / max(float(np.linalg.norm(v)), 1e-300) * 4 * radius for v in (before, after)]
            self._spines[edge.number] = np.concatenate([[spine[0] + ends[0]], spine, [spine[-1] + ends[1]]])
        return self._spines[edge.number]

    def _at_vertices(self) -> dict[int, list[Edge]]:
        at: dict[int, list[Edge]] = {}
        for edge in self.edges.values():
            for end in set(edge.ends):
                at.setdefault(end, []).append(edge)
        return at

    def _corners(self) -> Iterator[tuple[str, FloatArray, float]]:
        """Centres and radii of balls that touch three faces around a vertex."""
        for end, incident in self._at_vertices().items():
            own = [edge for edge in incident if edge.number in self.radii]
            radii = {self.radii[edge.number] for edge in own}
            signs = {self._sign(edge) for edge in own}
            if len(own) < 3 or len(radii) > 1 or len(signs) > 1:
                continue
            (radius,), (sign,) = radii, signs
            numbers = sorted({n for edge in own for n in edge.faces})
            groups = self._faces.groups(numbers)
            edge = own[0]
            at = 0 if edge.ends[0] == end else -1
            place = edge.points[at]
            outward = np.array([e.normals[0 if e.ends[0] == end else -1] for e in own]).reshape(-1, 3).mean(axis=0)
            for three in combinations(numbers, 3):
                start = (place - sign * radius * outward / max(float(outward @ outward), 0.05))[None]
                centre, off = newton(start, [groups[n] for n in three], sign * radius, None)
                if off[0] < _SOLVED * radius:
                    yield "corner", centre[0], radius

    def _ends(self) -> Iterator[tuple[FloatArray, float, set[int]]]:
        """Vertices where blends end, the radius there, and the faces around that are not beside the edge."""
        for end, incident in self._at_vertices().items():
            for edge in incident:
                if edge.number in self.radii:
                    place = edge.points[0 if edge.ends[0] == end else -1]
                    around = {n for other in incident for n in other.faces} - set(edge.faces)
                    yield place, self.radii[edge.number], around


def newton(
    start: FloatArray, sides: Sequence[Side], value: float, points: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Centres ``(N, 3)`` at which all sides have a value, and how far off they are still.

    With two sides and ``points``, in the plane through the point that is normal to the spine; without points as near
    to the start as may be.
    """
    x = start.copy()
    off = np.full(len(x), np.inf)
    left = np.arange(len(x))
    for _ in range(_STEPS):
        pairs = [side.value_and_gradient(x[left]) for side in sides]
        residual = np.stack([value - d for d, _ in pairs], axis=1)
        rows = np.stack([gradient for _, gradient in pairs], axis=1)
        if points is not None:
            along = np.cross(rows[:, 0], rows[:, 1])
            along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
            away = ((points[left] - x[left]) * along).sum(axis=1, keepdims=True)
            residual, rows = np.concatenate([residual, away], axis=1), np.concatenate([rows, along[:, None]], axis=1)
        off[left] = np.abs(residual).max(axis=1)
        more = off[left] > _DONE * abs(value)
        if not more.any():
            break
        left, step = left[more], _step(rows[more], residual[more])
        length = np.linalg.norm(step, axis=1, keepdims=True)
        x[left] += step * np.minimum(1.0, abs(value) / np.maximum(length, 1e-300))
    return x, off


def _step(rows: FloatArray, residual: FloatArray) -> FloatArray:
    """Shortest steps ``(N, 3)`` that make up for residuals ``(N, K)``, by slopes ``(N, K, 3)``."""
    step = np.empty((len(rows), 3))
    regular = np.zeros(len(rows), np.bool_) if rows.shape[1] != 3 else np.abs(np.linalg.det(rows)) > _REGULAR
    step[regular] = np.linalg.solve(rows[regular], residual[regular][:, :, None])[:, :, 0] if regular.any() else 0.0
    step[~regular] = np.einsum("nij,nj->ni", np.linalg.pinv(rows[~regular], rcond=1e-6), residual[~regular])
    return step
