"""Faces of parts, continued beyond their borders: exact signed distances, positive on the side of the material.

The ball of a fillet rolls on the two faces beside an edge, and near the ends of the edge on what would be their
continuation. Planes, cylinders, cones (one nappe), spheres and tori go on as what they are, in closed form here;
free-form faces are in :mod:`cad_implicit.spline_faces` and :mod:`cad_implicit.mesh_patches`, groups of faces in
:mod:`cad_implicit.face_groups`.

Where a gradient does not exist (axes, centres, apexes) one of its limits is given.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .implicit import FloatArray

_Sided = TypeVar("_Sided", bound="AnalyticFace")

#: Points nearer to an axis than this share of their height are on it: what is left of them is rounding.
_ON_AXIS = 1e-15


class FaceDistance(ABC):
    """Signed distance to a face and its continuation.

    Attributes
    ----------
    kind : str
        "plane", "cylinder", "cone", "sphere", "torus", "spline", "mesh" or "group".
    """

    kind: str

    @abstractmethod
    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Signed distances ``(N,)`` in mm and unit gradients ``(N, 3)`` at points ``(N, 3)`` in mm.

        Positive on the side of the material; the gradient points into it.
        """

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]


@dataclass(frozen=True, eq=False)
class AnalyticFace(FaceDistance):
    """A face in closed form.

    Attributes
    ----------
    side : float
        1 if the material is inside (behind a plane's normal, within a cylinder …), -1 if it is outside.
    """

    side: float = field(default=1.0, kw_only=True)

    def facing(self: _Sided, point: ArrayLike, outward: ArrayLike) -> _Sided:
        """Give the face with the material behind the outward normal ``(3,)`` at one of its points ``(3,)``."""
        gradient = self.value_and_gradient(np.asarray(point, np.float64)[None])[1][0]
        return replace(self, side=-self.side) if float(gradient @ np.asarray(outward)) > 0 else self


@dataclass(frozen=True, eq=False)
class PlaneFace(AnalyticFace):
    """Plane through a point ``(3,)`` with a unit normal ``(3,)``, which is outward for ``side`` 1."""

    point: FloatArray
    normal: FloatArray
    kind = "plane"

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        x = np.asarray(points, np.float64)
        value = self.side * ((self.point - x) @ self.normal)
        return value, np.tile(-self.side * self.normal, (len(x), 1))


@dataclass(frozen=True, eq=False)
class CylinderFace(AnalyticFace):
    """Cylinder around an axis through a point, with a unit direction, both ``(3,)``, and a radius in mm."""

    point: FloatArray
    axis: FloatArray
    radius: float
    kind = "cylinder"

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        _, rho, radial = _around(points, self.point, self.axis)
        return self.side * (self.radius - rho), -self.side * radial


@dataclass(frozen=True, eq=False)
class ConeFace(AnalyticFace):
    """One nappe of a cone: from an apex ``(3,)`` along a unit axis ``(3,)``; half its opening angle in radians.

    Points behind the apex are nearest to the apex.
    """

    apex: FloatArray
    axis: FloatArray
    half_angle: float
    kind = "cone"

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        z, rho, radial = _around(points, self.apex, self.axis)
        sine, cosine = np.sin(self.half_angle), np.cos(self.half_angle)
        behind = z * cosine + rho * sine < 0
        from_apex, length = _unit(z[:, None] * self.axis + rho[:, None] * radial, self.axis)
        value = np.where(behind, -length, z * sine - rho * cosine)
        gradient = np.where(behind[:, None], -from_apex, sine * self.axis - cosine * radial)
        return self.side * value, self.side * gradient


@dataclass(frozen=True, eq=False)
class SphereFace(AnalyticFace):
    """Sphere around a centre ``(3,)`` with a radius in mm."""

    centre: FloatArray
    radius: float
    kind = "sphere"

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        away, length = _unit(np.asarray(points, np.float64) - self.centre, np.array([0.0, 0.0, 1.0]))
        return self.side * (self.radius - length), -self.side * away


@dataclass(frozen=True, eq=False)
class TorusFace(AnalyticFace):
    """Torus around a unit axis ``(3,)`` through a centre ``(3,)``: ``ring`` and ``tube`` are its radii in mm.

    A tube thicker than its ring (a spindle torus) crosses itself on the axis. ``sheet`` says which part is the face:
    "outer", the apple, or "inner", the lemon within.
    """

    centre: FloatArray
    axis: FloatArray
    ring: float
    tube: float
    sheet: Literal["outer", "inner"] = "outer"
    kind = "torus"

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        z, rho, radial = _around(points, self.centre, self.axis)
        ring = self.ring if self.sheet == "outer" else -self.ring
        away, length = _unit(np.stack([rho - ring, z], axis=1), np.array([1.0, 0.0]))
        value, gradient = self.tube - length, -away
        beyond = ring + self.tube * away[:, 0] < 0  # the foot on the circle is across the axis
        if self.tube > self.ring and beyond.any():
            tip = np.copysign(np.sqrt(self.tube**2 - self.ring**2), z)
            from_tip, far = _unit(np.stack([rho, z - tip], axis=1), np.array([1.0, 0.0]))
            inside = np.where(length < self.tube, 1.0, -1.0)
            value = np.where(beyond, inside * far, value)
            gradient = np.where(beyond[:, None], inside[:, None] * from_tip, gradient)
        return self.side * value, self.side * (gradient[:, :1] * radial + gradient[:, 1:] * self.axis)


def _around(points: ArrayLike, origin: FloatArray, axis: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Heights ``(N,)`` along an axis, distances ``(N,)`` from it, and unit directions ``(N, 3)`` away from it."""
    offset = np.asarray(points, np.float64) - origin
    z = offset @ axis
    other = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    away = offset - z[:, None] * axis
    away[np.abs(away).max(axis=1) <= _ON_AXIS * np.abs(z)] = 0.0
    radial, rho = _unit(away, other / np.linalg.norm(other))
    return z, rho, radial


def _unit(vectors: FloatArray, otherwise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give unit vectors ``(N, D)`` and lengths ``(N,)``; another vector where the length is 0."""
    length = np.linalg.norm(vectors, axis=1)
    safe = np.where(length > 0, length, 1.0)[:, None]
    return np.where(length[:, None] > 0, vectors / safe, otherwise), length
