"""Planes, cylinders, cones, tori and spheres, and how points tell them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .implicit import FloatArray

#: Spines that are straight or circular but for this share of the radius are taken as lines and circles: more than the
#: error of spines (2e-6), and nothing beside what is asked of edges.
ALIKE = 1e-5


@dataclass(frozen=True, eq=False)
class Primitive:
    """A plane, cylinder, cone, torus or sphere.

    Attributes
    ----------
    kind : str
        "plane", "cylinder", "cone", "torus" or "sphere".
    point, axis : (3,) float64
        A point of the plane or axis, or the centre; the unit normal or axis. The apex of a cone.
    radius, ring : float
        Of the cylinder, sphere or tube in mm; of the torus' circle of centres. For a cone half its opening angle.
    """

    kind: Literal["plane", "cylinder", "cone", "torus", "sphere"]
    point: FloatArray
    axis: FloatArray
    radius: float = 0.0
    ring: float = 0.0


def line_through(points: FloatArray, radius: float) -> FloatArray | None:
    """Direction of the line through points, None if they are on none."""
    away = points - points.mean(axis=0)
    direction = np.linalg.svd(away, full_matrices=False)[2][0]
    off = away - (away @ direction)[:, None] * direction
    return direction if float(np.linalg.norm(off, axis=1).max()) < ALIKE * radius else None


def circle_through(points: FloatArray, radius: float) -> tuple[FloatArray, FloatArray, float] | None:
    """Centre, axis and radius of the circle through points, None if they are on none."""
    middle = points.mean(axis=0)
    away = points - middle
    frame = np.linalg.svd(away, full_matrices=False)[2]
    flat = away @ frame[:2].T
    solution = np.linalg.lstsq(np.column_stack([2 * flat, np.ones(len(flat))]), (flat**2).sum(axis=1), rcond=None)[0]
    ring = float(np.sqrt(solution[2] + solution[:2] @ solution[:2]))
    off = np.abs(np.linalg.norm(flat - solution[:2], axis=1) - ring).max()
    if max(float(off), float(np.abs(away @ frame[2]).max())) > ALIKE * radius:
        return None
    return middle + solution[:2] @ frame[:2], frame[2], ring


def plane_between(low: FloatArray, high: FloatArray, size: float) -> Primitive | None:
    """Plane of a chamfer between two rims (N, 3)."""
    points = np.concatenate([low, high])
    frame = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    if float(np.abs((points - points.mean(axis=0)) @ frame[2]).max()) > ALIKE * size:
        return None
    return Primitive("plane", points.mean(axis=0), frame[2])


def cone_between(low: FloatArray, high: FloatArray, size: float) -> Primitive | None:
    """Cone or cylinder of a chamfer between two rims (N, 3) that are circles around one axis."""
    circles = [circle_through(low, size), circle_through(high, size)]
    if circles[0] is None or circles[1] is None:
        return None
    (centre, axis, r0), (other, turned, r1) = circles[0], circles[1]
    along = other - centre
    height = float(np.linalg.norm(along))
    if np.linalg.norm(np.cross(axis, turned)) > ALIKE or np.linalg.norm(np.cross(axis, along)) > ALIKE * size:
        return None
    if height < ALIKE * size:
        return Primitive("plane", centre, axis)
    if abs(r1 - r0) < ALIKE * size:
        return Primitive("cylinder", centre, axis, r0)
    direction = along / height * np.sign(r1 - r0)
    apex = centre - direction * r0 * height / abs(r1 - r0)
    return Primitive("cone", apex, direction, float(np.arctan2(abs(r1 - r0), height)))
