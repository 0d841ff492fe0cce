"""Chamfers: where they meet the faces beside an edge, and the flats where three of them meet at a corner.

The length of a chamfer is how far it begins from the edge on a face, straight across in the edge's normal plane.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from .guides import Guide, Support
from .implicit import FloatArray
from .spines import Spine
from .strips import Pair, Region

_ROUNDS = 30

#: A point is found if it is this near to the face, and its distance from the edge this exact, as shares of the length.
_SOLVED = 1e-9

#: Largest turn of the legs between two samples, in radians.
_TURN = 0.12
_REFINEMENTS = 8


def legs(guide: Guide, supports: Sequence[Support], lengths: tuple[float, float], at: FloatArray) -> Spine:
    """Edge with the legs of a chamfer, at given positions and as many between as make it smooth.

    Parameters
    ----------
    guide : Guide
    supports : two Supports
        The faces beside it.
    lengths : (float, float)
        On the left and on the right, in mm.
    at : (N,) float64
        Positions in mm, ascending.
    """
    found = _legs(guide, supports, lengths, at)
    for _ in range(_REFINEMENTS):
        direction = found.reaches / np.linalg.norm(found.reaches, axis=2)[:, :, None]
        turn = np.minimum(
            (direction[1:] * direction[:-1]).sum(axis=2).min(axis=1),
            (found.tangents[1:] * found.tangents[:-1]).sum(axis=1),
        )
        rough = np.flatnonzero((turn < np.cos(_TURN)) & (np.diff(found.at) > 1e-9 * guide.length))
        if len(rough) == 0:
            break
        more = (found.at[rough] + found.at[rough + 1]) / 2
        found = _legs(guide, supports, lengths, np.sort(np.concatenate([found.at, more])))
    return found


def _legs(guide: Guide, supports: Sequence[Support], lengths: tuple[float, float], at: FloatArray) -> Spine:
    edge, along = guide.place(at)
    slopes = [support(edge)[1] for support in supports]
    reaches, normals = np.zeros((len(at), 2, 3)), np.zeros((len(at), 2, 3))
    solved = np.ones(len(at), np.bool_)
    for side, length in enumerate(lengths):
        own, other = slopes[side], slopes[1 - side]
        into = other - (other * own).sum(axis=1)[:, None] * own
        into -= (into * along).sum(axis=1)[:, None] * along
        size = np.linalg.norm(into, axis=1)
        start = edge + length * into / np.where(size > 0, size, 1.0)[:, None]
        point, good = _on_face(start, edge, along, supports[side], length)
        solved &= good & (size > 0)
        reaches[:, side] = point - edge
        normals[:, side] = -supports[side](point)[1]
    radius = np.full(len(at), max(lengths))
    return Spine(
        at, edge, edge, along, radius, np.zeros(len(at)), normals, solved, guide.closed, reaches=reaches, ball=False
    )


def _on_face(
    start: FloatArray, edge: FloatArray, along: FloatArray, support: Support, length: float
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Points (N, 3) of a face at a distance from points of an edge, in its normal planes; which (N,) are found."""
    x = start.copy()
    good = np.zeros(len(x), np.bool_)
    for _ in range(_ROUNDS):
        f, slope = support(x)
        away = x - edge
        far = np.linalg.norm(away, axis=1)
        miss = np.stack([-f, length - far, -(away * along).sum(axis=1)], axis=1)
        good = np.abs(miss).max(axis=1) <= _SOLVED * length
        rows = np.stack([slope, away / np.where(far > 0, far, 1.0)[:, None], along], axis=1)
        moving = np.flatnonzero(~good & (np.abs(np.linalg.det(rows)) > 1e-6))
        if len(moving) == 0:
            break
        move = np.linalg.solve(rows[moving], miss[moving][:, :, None])[:, :, 0]
        size = np.linalg.norm(move, axis=1)
        x[moving] += move * np.minimum(1.0, 0.5 * length / np.where(size > 0, size, 1.0))[:, None]
    return x, good


class Flat(Region):
    """What a plane cuts off at a corner: that through the points where three chamfers meet on the faces.

    Parameters
    ----------
    points : (3, 3) float64
        In mm.
    tip : (3,) float64
        Where the faces meet.
    supports : sequence of Support
        The faces.
    margin : float
        How far in mm it goes beyond them.
    """

    def __init__(self, points: FloatArray, tip: FloatArray, supports: Sequence[Support], margin: float) -> None:
        self.point, self._supports, self.margin, self.radius = points[0], tuple(supports), margin, math.inf
        normal = np.cross(points[1] - points[0], points[2] - points[0])
        normal *= np.sign(normal @ (tip - points[0]))
        self.normal = normal / np.linalg.norm(normal)
        far = 1.1 * float(np.linalg.norm(points - tip, axis=1).max()) + 2 * margin
        self._tip, self._far = tip, far
        self.box = np.stack([tip - far, tip + far])

    def value_and_gradient(self, points: FloatArray) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        value, gradient = (points - self.point) @ self.normal, np.tile(self.normal, (len(points), 1))
        for support in self._supports:
            f, slope = support(points)
            less = f + self.margin < value
            value, gradient = np.where(less, f + self.margin, value), np.where(less[:, None], slope, gradient)
        away = points - self._tip
        length = np.linalg.norm(away, axis=1)
        less = self._far - length < value
        outward = away / np.where(length > 0, length, 1.0)[:, None]
        return np.where(less, self._far - length, value), np.where(less[:, None], -outward, gradient)


def meeting_points(strips: Sequence[tuple[Spine, tuple[int, int]]], tip: FloatArray) -> FloatArray | None:
    """Points (K, 3) where the chamfers of a corner meet, one on each face that two of them share; None if they do not.

    Parameters
    ----------
    strips : sequence of (Spine, (int, int))
        The edges with their legs, and the faces on the left and on the right of each.
    tip : (3,) float64
        The corner.
    """
    points = []
    for (one, own), (other, theirs) in combinations(strips, 2):
        shared = set(own) & set(theirs)
        if len(shared) != 1:
            return None
        face = shared.pop()
        lines = [_border(spine, faces.index(face), tip) for spine, faces in ((one, own), (other, theirs))]
        (p, u), (q, v) = lines
        rows = np.stack([u, -v], axis=1)
        solution, _, rank, _ = np.linalg.lstsq(rows, q - p, rcond=None)
        if rank < 2:
            return None
        points.append(p + solution[0] * u)
    return np.array(points)


def _border(spine: Spine, side: int, tip: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Point and direction (3,) of the border of a chamfer on one face, nearest to a corner."""
    touching = spine.touching()[:, side]
    near = int(np.linalg.norm(touching - tip, axis=1).argmin())
    other = near + 1 if near + 1 < len(touching) else near - 1
    return touching[near], touching[other] - touching[near]
