"""Sheets of triangles over rectangles of parameters, off the axes, with the faces that they are on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from cad_implicit import Mesh
from cad_implicit.faces import AnalyticFace, ConeFace, CylinderFace, PlaneFace, SphereFace, TorusFace
from cad_implicit.implicit import FloatArray

TURN = Rotation.from_euler("xyz", (23, 37, 11), degrees=True).as_matrix()
SHIFT = np.array([1.3, -4.7, 2.9])
AXIS = TURN[:, 2]
Map = Callable[[FloatArray, FloatArray], tuple[FloatArray, ...]]


def placed(points: FloatArray) -> FloatArray:
    return points @ TURN.T + SHIFT


def at(surface: Map, u: FloatArray, v: FloatArray) -> FloatArray:
    """Points (N, 3) of a surface, in place."""
    return placed(np.stack(np.broadcast_arrays(*surface(u, v)), axis=-1))


def sheet(surface: Map, u: FloatArray, v: FloatArray) -> Mesh:
    """Two triangles for each cell; their normal is that of du x dv."""
    grid = at(surface, *np.meshgrid(u, v, indexing="ij"))
    index = np.arange(len(u) * len(v)).reshape(len(u), len(v))
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(grid.reshape(-1, 3), faces)


def torus(ring: float, tube: float) -> Map:
    return lambda u, v: (
        (ring + tube * np.cos(v)) * np.cos(u),
        (ring + tube * np.cos(v)) * np.sin(u),
        tube * np.sin(v),
    )


def cone(slope: float, start: float = 0.0) -> Map:
    return lambda u, v: ((start + slope * v) * np.cos(u), (start + slope * v) * np.sin(u), v)


def ball(radius: float) -> Map:
    return lambda u, v: (radius * np.cos(u) * np.cos(v), radius * np.sin(u) * np.cos(v), radius * np.sin(v))


#: Surface, parameters of the vertices in both directions, and the face; normals du x dv are away from the axis.
SHEETS: dict[str, tuple[Map, FloatArray, FloatArray, AnalyticFace]] = {
    "plane": (lambda u, v: (u, v, 0 * u), np.linspace(0, 3, 4), np.linspace(0, 2, 3), PlaneFace(SHIFT, AXIS)),
    "cylinder": (cone(0, 2.5), np.linspace(0, 2, 12), np.linspace(0, 4, 4), CylinderFace(SHIFT, AXIS, 2.5)),
    "flat cylinder": (cone(0, 9), np.linspace(0, 6.2, 36), np.array([0.0, 1.0]), CylinderFace(SHIFT, AXIS, 9)),
    "cone": (cone(0.4), np.linspace(0, 2, 12), np.linspace(1, 4, 5), ConeFace(SHIFT, AXIS, np.arctan(0.4))),
    "cone tip": (cone(0.4), np.linspace(0, 6.2, 30), np.array([0.0, 4.0]), ConeFace(SHIFT, AXIS, np.arctan(0.4))),
    "draft": (
        cone(0.01, 5),
        np.linspace(0, 6.2, 40),
        np.array([0.0, 4.0]),
        ConeFace(SHIFT - 500 * AXIS, AXIS, np.arctan(0.01)),
    ),
    "sphere": (ball(3.3), np.linspace(0, 1.5, 9), np.linspace(0, 1.2, 8), SphereFace(SHIFT, 3.3)),
    "torus": (torus(6, 2), np.linspace(0, 1.5, 10), np.linspace(1.5, 3.1, 9), TorusFace(SHIFT, AXIS, 6, 2)),
    "rim": (torus(6, 0.5), np.linspace(0, 6.2, 40), np.linspace(3.2, 4.7, 6), TorusFace(SHIFT, AXIS, 6, 0.5)),
    "lemon": (torus(-3, 5), np.linspace(0, 6.2, 36), np.linspace(-0.5, 0.5, 11), TorusFace(SHIFT, AXIS, 3, 5, "inner")),
}


def wave(u: FloatArray, v: FloatArray) -> tuple[FloatArray, ...]:
    """A surface that is none of the above."""
    return u, v, 0.3 * np.sin(1.3 * u) * np.cos(0.9 * v) + 0.05 * u * v
