"""What is measured of a result: against the exact kernel's blend where there is one, else by the rolling ball."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cad_implicit.blend_labels import blend_surfaces
from cad_implicit.cad.edges import part_edges
from cad_implicit.cad.parts import open_part
from cad_implicit.comparison import surface_samples
from cad_implicit.distance import MeshDistance
from cad_implicit.implicit import FloatArray
from cad_implicit.local_blend import LocalBlend
from cad_implicit.mesh import Mesh

from .rolling_ball import nearest_centre

if TYPE_CHECKING:
    from cad_implicit.cad.exact_blends import ExactBlend

    from .exact_surfaces import Surfaces

#: Random samples each way, besides all vertices.
_SAMPLES = 20_000

#: Triangles of the exact solid, which only tell the nearest face, are off by this share of the spacing at most.
_FACETS = 0.01

#: Points nearer than so many spacings to a sharp edge of the exact solid are counted with it.
_EDGE = 0.5

#: A free ball that comes nearer than this share of the radius reaches beyond the exact blend: the two differ by nature.
_BEYOND = 2e-3

#: Samples by which that is found; what lies within so many spacings of one such sample differs, too.
_TESTED = 1500
_AROUND = 2.0

#: Vertices farther than so many spacings from the part are on blends; so many of them go through the self-check.
_OFF = 0.02
_CHECKED = 3000

REGIONS = ("blend", "unchanged", "sharp edges", "differs by nature")


@dataclass(frozen=True, eq=False)
class Measured:
    """Samples with their errors.

    Attributes
    ----------
    against : "exact kernel" or "rolling ball"
    points : (N, 3) float64
        On the result and, where there is one, on the exact solid.
    errors : (N,) float64
        In mm, positive where there is too much material.
    regions : (N,) int64
        Places in :data:`REGIONS`.
    at_vertices : (V,) float64
        Errors of the vertices of the result, for pictures; NaN where not known.
    defect : float or None
        Largest distance in mm of the exact kernel's blends from the surfaces of the balls, for local blends.
    exact : Mesh or None
        Triangles of the exact solid, for pictures.
    """

    against: str
    points: FloatArray
    errors: FloatArray
    regions: NDArray[np.int64]
    at_vertices: FloatArray
    defect: float | None = None
    exact: Mesh | None = None


def against_kernel(
    result: Mesh,
    truth: ExactBlend,
    part: MeshDistance,
    blend: LocalBlend | None,
    radius: float,
    spacing: float,
    sign: float,
) -> Measured:
    """Distances both ways between a result and the exact kernel's solid, by surfaces, not by facets.

    Parameters
    ----------
    result : Mesh
    truth : ExactBlend
        A sound one.
    part : MeshDistance
        Before the blend.
    blend : LocalBlend or None
        The result's, if edges were chosen; then the two are compared everywhere.
    radius, spacing : float
        In mm.
    sign : float
        1 for balls inside the part, -1 outside, 0 for both.
    """
    from .exact_surfaces import Surfaces

    surfaces = Surfaces(truth.shape, _FACETS * spacing)
    is_blend = np.zeros(len(surfaces.shapes), np.bool_)
    is_blend[np.array(truth.blend, np.int64) - 1] = True
    forth = np.concatenate([result.vertices, surface_samples(result, _SAMPLES)[0]])
    error, face = surfaces.signed(forth)
    back = surfaces.samples(np.ones(len(is_blend), np.bool_), _SAMPLES)
    gap = MeshDistance(result, sign="pseudonormal" if result.is_watertight else "winding")(back)
    back_face = surfaces.nearest(back)[1]
    points, errors = np.concatenate([forth, back]), np.concatenate([error, gap])
    faces = np.concatenate([face, back_face])
    regions = np.where(is_blend[faces], 0, 1)
    regions[_near_sharp_edges(points, truth, spacing) & (regions == 1)] = 2
    if blend is None and is_blend.any():
        regions[_differing(points, surfaces, is_blend, part, radius, spacing, sign)] = 3
    defect = None
    if blend is not None and is_blend.any():
        defect = float(_off_balls(surfaces.samples(is_blend, _CHECKED), blend).max())
    return Measured("exact kernel", points, errors, regions, error[: len(result.vertices)], defect, surfaces.mesh)


def by_rolling_ball(
    result: Mesh, part: MeshDistance, blend: LocalBlend | None, radius: float, spacing: float
) -> Measured:
    """Errors of the vertices of blends by the ball alone, where there is no exact solid.

    For a local blend they are distances to the surfaces of its balls, whose centres are at the radius from both faces;
    for a global one what the nearest centre of a free ball is farther or nearer than the radius. Vertices on the part
    are counted as unchanged, with their distance to it.
    """
    value = part(result.vertices)
    on_blend = np.flatnonzero(np.abs(value) > _OFF * spacing)
    errors = np.full(len(result.vertices), np.nan)
    unchanged = np.abs(value) <= _OFF * spacing
    errors[unchanged] = -value[unchanged]
    some = on_blend
    if len(some) > _CHECKED:
        some = np.random.default_rng(0).choice(on_blend, _CHECKED, replace=False)
    points = result.vertices[some]
    if blend is not None:
        errors[some] = _off_balls(points, blend)
    elif len(some):
        normals = _normals(result)[some]
        for own, side in ((value[some] < 0, -1.0), (value[some] > 0, 1.0)):
            if own.any():
                near = nearest_centre(part, points[own], -side * normals[own], radius, side)
                errors[some[own]] = side * (radius - near)
    known = np.flatnonzero(np.isfinite(errors))
    regions = np.where(unchanged[known], 1, 0)
    return Measured("rolling ball", result.vertices[known], errors[known], regions, errors)


def _near_sharp_edges(points: FloatArray, truth: ExactBlend, spacing: float) -> NDArray[np.bool_]:
    lines = [e.points for e in part_edges(open_part(truth.shape)) if e.convexity in ("convex", "concave", "mixed")]
    if not lines:
        return np.zeros(len(points), np.bool_)
    fine = [_finer(line, spacing / 2) for line in lines]
    return np.asarray(cKDTree(np.concatenate(fine)).query(points)[0] < _EDGE * spacing)


def _finer(line: FloatArray, step: float) -> FloatArray:
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    ways = np.linspace(0, length[-1], max(2, int(min(length[-1] / step, 20_000)) + 1))
    return np.stack([np.interp(ways, length, line[:, axis]) for axis in range(3)], axis=1)


def _differing(
    points: FloatArray,
    surfaces: Surfaces,
    is_blend: NDArray[np.bool_],
    part: MeshDistance,
    radius: float,
    spacing: float,
    sign: float,
) -> NDArray[np.bool_]:
    """Points (N,) near places of the exact blends that free balls reach beyond."""
    some = surfaces.samples(is_blend, _TESTED)
    faces = surfaces.nearest(some)[1]
    normals = np.zeros_like(some)
    for index in np.unique(faces).tolist():
        own = faces == index
        normals[own] = -surfaces.face(index).value_and_gradient(some[own])[1]
    beyond = np.zeros(len(some), np.bool_)
    depth = part(some)
    for side in (-1.0, 1.0):
        if sign not in (0.0, side):
            continue
        own = np.flatnonzero(side * depth > 0) if sign == 0.0 else np.arange(len(some))
        near = nearest_centre(part, some[own], -side * normals[own], radius, side)
        beyond[own] = np.abs(near - radius) > _BEYOND * radius
    if not beyond.any():
        return np.zeros(len(points), np.bool_)
    spread = np.sqrt(surfaces.part(is_blend).area / _TESTED)
    away = cKDTree(some).query(points)
    near_far = cKDTree(some[beyond]).query(points)[0]
    return np.asarray((near_far < _AROUND * spacing + spread) | (beyond[away[1]] & (away[0] < 2 * spread)))


def _off_balls(points: FloatArray, blend: LocalBlend) -> FloatArray:
    """Distances (N,) in mm of points to the nearest surface of a blend."""
    best = np.full(len(points), np.inf)
    for outward in blend_surfaces(blend.laid):
        best = np.minimum(best, np.abs(outward.value_and_normal(points)[0]))
    return best


def _normals(mesh: Mesh) -> FloatArray:
    """Average normals of triangles at vertices (V, 3), by area."""
    total = np.zeros((len(mesh.vertices), 3))
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], mesh.face_vectors)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1), 1e-300)[:, None])
