"""Who is right where a result and the exact kernel's blend disagree: the balls tell.

A global blend is what no free ball reaches into, and differs by nature from the exact kernel's at open ends and in
narrow places. A local one is made of surfaces of balls that touch two faces; there the kernel's B-splines are off
themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cad_implicit.blend_labels import blend_surfaces
from cad_implicit.distance import MeshDistance
from cad_implicit.implicit import FloatArray
from cad_implicit.local_blend import LocalBlend

from .rolling_ball import ball_errors

#: Where result and exact kernel differ by more than this share of the radius the balls are asked, and they are right
#: where what they tell is less by as much.
_SUSPECT = 2e-3

#: At so many points each way; the others go with the nearest of them, but the largest errors left are asked themselves,
#: as often as this.
_TESTED = 1500
_ROUNDS = 3

#: All within so many spacings of such a place are like it: where a closing fades out at an open end, 0.1 radii long, it
#: turns within a cell.
_AROUND = 1.0

#: The balls of a local blend may be asked if their distances to the faces are the radius within this share of it.
_CENTRED = 1e-3


class Judge(Protocol):
    """Somebody who knows the true surface."""

    @property
    def region(self) -> str:
        """Name of the region where it is right and the exact kernel is not."""

    def errors(self, points: FloatArray, normals: FloatArray, rough: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far (N,) points (N, 3) are outside of the true surface in mm; free balls' centres (N, 3), or NaN.

        Parameters
        ----------
        points, normals : (N, 3) float64
            Normals point out of the material.
        rough : (N,) float64
            What the exact kernel's solid tells.
        """


@dataclass(frozen=True, eq=False)
class FreeBall:
    """The ball that rolls on a whole part: inside if ``sign`` is 1, outside if -1, both if 0."""

    part: MeshDistance
    radius: float
    sign: float
    region: str = "differs by nature"

    def errors(self, points: FloatArray, normals: FloatArray, rough: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far (N,) points (N, 3) are outside of the true surface in mm, and the balls' centres (N, 3)."""
        sides = np.full(len(points), self.sign)
        if self.sign == 0.0:
            value = self.part(points)
            sides = np.where(np.abs(value) < _SUSPECT * self.radius, -np.sign(rough), np.sign(value))
        return ball_errors(self.part, points, normals, self.radius, sides)


@dataclass(frozen=True, eq=False)
class BlendBalls:
    """The balls of a local blend; they know nothing if their own distances to the faces are not the radius."""

    blend: LocalBlend
    radius: float
    region: str = "kernel is off"

    @cached_property
    def centred(self) -> bool:
        """Whether all balls touch both faces, or their borders, with the radius that was asked for."""
        limit = _CENTRED * self.radius
        for laid in self.blend.laid.values():
            if any(abs(ball.radius - self.radius) > limit for ball in laid.corners):
                return False
            for spine, supports in laid.spines:
                for side, support in enumerate(supports):
                    off = np.abs(np.abs(support(spine.centres)[0]) - self.radius)
                    reach = np.abs(np.linalg.norm(spine.reaches[:, side], axis=1) - self.radius)
                    if float(np.minimum(off, reach).max()) > limit:
                        return False
        return True

    def errors(self, points: FloatArray, normals: FloatArray, rough: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far (N,) points (N, 3) are outside of the true surface in mm; infinite if the balls know nothing."""
        known = off_balls(points, self.blend) if self.centred else np.full(len(points), np.inf)
        return known, np.full_like(points, np.nan)


def explained(
    judge: Judge,
    points: FloatArray,
    normals: FloatArray,
    errors: FloatArray,
    radius: float,
    spacing: float,
    result: MeshDistance | None = None,
) -> tuple[NDArray[np.bool_], FloatArray]:
    """Whether the balls explain errors (N,) of points (N, 3), and what they tell instead, NaN if they do not know.

    Points of the result are explained by balls that are nearer to them. Points of the exact solid are if they are off
    the balls themselves, or in a free ball, and the points of the result that are nearest to them are not, or less so
    than it seemed.

    Parameters
    ----------
    judge : Judge
    points, normals : (N, 3) float64
        Of the result or of the exact solid; normals point out of the material.
    errors : (N,) float64
        In mm, as the exact kernel's solid tells them.
    radius, spacing : float
        In mm.
    result : MeshDistance or None
        Given if the points are the exact solid's.
    """
    other, told = np.zeros(len(points), np.bool_), np.full(len(points), np.nan)
    suspects = np.flatnonzero(np.abs(errors) > _SUSPECT * radius)
    if len(suspects) == 0:
        return other, told
    known, own = np.zeros(0, np.int64), np.zeros(0, np.bool_)
    random = np.random.default_rng(0)
    asked = random.choice(suspects, min(_TESTED, len(suspects)), replace=False)
    for _ in range(_ROUNDS):
        better, new = _asked(judge, points[asked], normals[asked], errors[asked], radius, result)
        told[asked] = np.where(better, new, np.nan)
        known, own = np.concatenate([known, asked]), np.concatenate([own, better])
        other[suspects] = own[cKDTree(points[known]).query(points[suspects])[1]]
        if own.any():
            near = cKDTree(points[known[own]]).query(points[suspects], distance_upper_bound=_AROUND * spacing)[0]
            other[suspects] |= np.isfinite(near)
        left = np.setdiff1d(suspects[~other[suspects]], known)
        asked = left[np.argsort(-np.abs(errors[left]))[:_TESTED]]
        if len(asked) == 0:
            break
    return other, told


def _asked(
    judge: Judge,
    points: FloatArray,
    normals: FloatArray,
    errors: FloatArray,
    radius: float,
    result: MeshDistance | None,
) -> tuple[NDArray[np.bool_], FloatArray]:
    """Whether the balls are right about points, all of them asked, and what they tell; see :func:`explained`."""
    told, _ = judge.errors(points, normals, errors)
    better = np.ones(len(points), np.bool_)
    if result is not None:
        better = np.abs(told) > _SUSPECT * radius
        found = result.closest(points)
        told, centres = judge.errors(found.point, unit(found.normal), errors)
        better |= np.linalg.norm(points - centres, axis=1) < (1 - _SUSPECT) * radius
    return better & (np.abs(told) < np.abs(errors) - _SUSPECT * radius), told


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors (N, 3) of length 1, or 0."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None])


def off_balls(points: FloatArray, blend: LocalBlend) -> FloatArray:
    """Distances (N,) in mm of points to the nearest surface of a blend, positive outside of the material."""
    best = np.full(len(points), np.inf)
    for outward in blend_surfaces(blend.laid):
        value = outward.value_and_normal(points)[0]
        best = np.where(np.abs(value) < np.abs(best), value, best)
    return best
