"""What is measured of a result: against the exact kernel's blend where there is one, else by the rolling ball."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cad_implicit.cad.edges import part_edges
from cad_implicit.cad.parts import open_part
from cad_implicit.comparison import surface_samples
from cad_implicit.distance import MeshDistance
from cad_implicit.implicit import FloatArray
from cad_implicit.local_blend import LocalBlend
from cad_implicit.mesh import Mesh

from .judges import BlendBalls, FreeBall, Judge, explained, off_balls, unit
from .rolling_ball import ball_errors

if TYPE_CHECKING:
    from cad_implicit.cad.exact_blends import ExactBlend

    from .exact_surfaces import Surfaces

#: Random samples each way, besides all vertices.
_SAMPLES = 20_000

#: Triangles of the exact solid, which only tell the nearest face, are off by this share of the spacing at most.
_FACETS = 0.01

#: Points nearer than so many spacings to a sharp edge of the exact solid are counted with it.
_EDGE = 0.5

#: Points farther than so many spacings from the part are on blends; so many of them go through the self-check.
_OFF = 0.02
_CHECKED = 3000

#: So many of the points that are off all balls, the worst, may be where a plane cuts a blend off. Its normal is theirs
#: within 2 degrees (cosine).
_CUT_OFF, _SAME_PLANE = 500, 0.9994

#: Which side of the part the blends of an operation are on: outside it, inside, on both.
SIGNS = {"fillet": -1.0, "round": 1.0, "smooth": 0.0}

REGIONS = ("blend", "unchanged", "sharp edges", "differs by nature", "kernel is off")


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
    judged : (N,) float64
        Errors that count: where the exact kernel's blend differs by nature, or is off itself, those that the balls
        tell, NaN where these were not asked.
    defect : float or None
        Largest distance in mm of the exact kernel's blends from the surfaces of the balls, for local blends.
    surfaces : Surfaces or None
        Of the exact solid.
    """

    against: str
    points: FloatArray
    errors: FloatArray
    regions: NDArray[np.int64]
    at_vertices: FloatArray
    judged: FloatArray
    defect: float | None = None
    surfaces: Surfaces | None = None

    @property
    def exact(self) -> Mesh | None:
        """Triangles of the exact solid, for pictures."""
        return None if self.surfaces is None else self.surfaces.mesh


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
    some, triangles = surface_samples(result, _SAMPLES)
    forth = np.concatenate([result.vertices, some])
    error, face = surfaces.signed(forth)
    back, back_face = surfaces.samples(np.ones(len(is_blend), np.bool_), _SAMPLES)
    distance = MeshDistance(result, sign="pseudonormal" if result.is_watertight else "winding")
    gap = distance(back)
    points, errors = np.concatenate([forth, back]), np.concatenate([error, gap])
    faces = np.concatenate([face, back_face])
    regions = np.where(is_blend[faces], 0, 1)
    unchanged = np.flatnonzero(regions == 1)
    regions[unchanged[_near_sharp_edges(points[unchanged], truth, spacing)]] = 2
    judged = errors.copy()
    defect = None
    if blend is None:
        judge: Judge = FreeBall(part, radius, sign)
    else:
        judge = BlendBalls(blend, radius)
        if is_blend.any():
            defect = float(np.abs(off_balls(surfaces.samples(is_blend, _CHECKED)[0], blend)).max())
    own = np.concatenate([vertex_normals(result), unit(result.face_vectors[triangles])])
    here = slice(0, len(forth)), slice(len(forth), None)
    other, told = explained(judge, forth, own, error, radius, spacing)
    regions[here[0]][other], judged[here[0]] = REGIONS.index(judge.region), np.where(other, told, error)
    other, told = explained(judge, back, surfaces.normals(back, back_face), gap, radius, spacing, distance)
    regions[here[1]][other], judged[here[1]] = REGIONS.index(judge.region), np.where(other, told, gap)
    return Measured(
        "exact kernel", points, errors, regions, error[: len(result.vertices)], judged, defect, surfaces
    )  # fmt: skip


def by_rolling_ball(
    result: Mesh, part: MeshDistance, blend: LocalBlend | None, radius: float, spacing: float, sign: float
) -> Measured:
    """Errors of the result by the ball alone, where there is no exact solid.

    On local blends they are distances to the surfaces of its balls, whose centres are at the radius from both faces, to
    the part where these are farther than a radius, or to the plane of a face that goes on over a notch which they fill;
    on global ones how much farther or nearer than the radius the nearest centre of a free ball is. Points on the part
    are counted as unchanged, with their distance to it; so are those on the side of it where no blend of this kind is,
    as chords of curved faces are.

    Parameters are those of :func:`against_kernel`.
    """
    some, triangles = surface_samples(result, _SAMPLES)
    points = np.concatenate([result.vertices, some])
    value = part(points)
    unchanged = np.abs(value) <= _OFF * spacing
    if blend is None:
        unchanged |= sign * value < 0
    errors = np.where(unchanged, -value, np.nan)
    asked = np.flatnonzero(~unchanged)
    if len(asked) > _CHECKED:
        asked = np.random.default_rng(0).choice(asked, _CHECKED, replace=False)
    normals = np.concatenate([vertex_normals(result), unit(result.face_vectors[triangles])])
    if blend is not None:
        away = off_balls(points[asked], blend)
        # thin triangles at the tip of a blend reach far onto the part, where there is no ball
        errors[asked] = np.where(np.abs(away) > radius, -value[asked], away)
        off = asked[np.abs(errors[asked]) > _OFF * spacing]
        off = off[np.argsort(-np.abs(errors[off]))[:_CUT_OFF]]
        errors[off] = np.where(
            _on_planes(points[off], normals[off], part.mesh, radius, _OFF * spacing), 0.0, errors[off]
        )
    else:
        errors[asked], _ = ball_errors(part, points[asked], normals[asked], radius, np.sign(value[asked]))
    known = np.flatnonzero(np.isfinite(errors))
    regions = np.where(unchanged[known], 1, 0)
    at_vertices = errors[: len(result.vertices)]
    return Measured("rolling ball", points[known], errors[known], regions, at_vertices, errors[known])


def _on_planes(
    points: FloatArray, normals: FloatArray, part: Mesh, radius: float, tolerance: float
) -> NDArray[np.bool_]:
    """Whether points (N, 3) are where a blend is cut off by a plane that goes on from a face of the part beside it.

    So ends a blend that fills a notch too narrow for its ball: in the plane of the face that the notch opens in.
    """
    facing = unit(part.face_vectors)
    corners = part.vertices[part.faces]
    middle = corners.mean(axis=1)
    size = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    found = np.zeros(len(points), np.bool_)
    for row, (point, normal) in enumerate(zip(points, normals, strict=True)):
        same = facing @ normal > _SAME_PLANE
        to = point - middle[same]
        beside = np.linalg.norm(to, axis=1) < size[same] + 2 * radius
        found[row] = (np.abs((to * facing[same]).sum(axis=1)) < tolerance)[beside].any()
    return found


def _near_sharp_edges(points: FloatArray, truth: ExactBlend, spacing: float) -> NDArray[np.bool_]:
    lines = [e.points for e in part_edges(open_part(truth.shape)) if e.convexity in ("convex", "concave", "mixed")]
    if not lines:
        return np.zeros(len(points), np.bool_)
    fine = [_finer(line, spacing / 2) for line in lines]
    limit = _EDGE * spacing
    return np.asarray(np.isfinite(cKDTree(np.concatenate(fine)).query(points, distance_upper_bound=limit)[0]))


def _finer(line: FloatArray, step: float) -> FloatArray:
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    ways = np.linspace(0, length[-1], max(2, int(min(length[-1] / step, 20_000)) + 1))
    return np.stack([np.interp(ways, length, line[:, axis]) for axis in range(3)], axis=1)


def vertex_normals(mesh: Mesh) -> FloatArray:
    """Average normals of triangles at vertices (V, 3), by area."""
    total = np.zeros((len(mesh.vertices), 3))
    for corner in range(3):
        np.add.at(total, mesh.faces[:, corner], mesh.face_vectors)
    return unit(total)
