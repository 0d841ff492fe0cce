"""Triangles back to the surface that they came from: planes, cylinders, cones, spheres and tori through vertices.

Tessellations of CAD parts put vertices on the surface, and triangles are chords of it. So a surface is fitted to
vertices (least squares of distances), and the triangles' normals only start it and say where the material is.

Not promised: where few rows of vertices fit several surfaces, it is the simplest that is found, in the order plane,
cylinder, cone, sphere, torus; a polygonal prism whose sides turn by less than the sharp angle is a cylinder.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .faces import AnalyticFace, ConeFace, CylinderFace, PlaneFace, SphereFace, TorusFace
from .implicit import FloatArray
from .mesh import Mesh

#: Vertices miss the surface by less than this share of the extent of what is fitted, or of the part's diagonal: single
#: precision and six printed digits are good to 1e-7 and 5e-7 of the coordinates.
_MISS = 2e-5
_ROUNDING = 5e-7
#: Least cosine between triangle and surface: tessellations turn by up to 25 degrees from one triangle to the next.
_TURN = np.cos(np.radians(15))
#: A start farther than this off some vertex, over the extent, is no start: those of whole faces miss by 4e-4 at most,
#: those of a dozen triangles by more.
_START = 0.1
#: Steps of a fit at most, and its differences.
_STEPS = 20
_DIFFERENCE = 1e-7
#: A fit ends after so many steps in a row that leave more than this share of the squares.
_STALLED, _GAIN = 4, 0.5
#: Vertices that a fit takes part of at most, spread over all.
_SAMPLE = 1_000


class Piece(NamedTuple):
    """Triangles of one face: corners ``(F, 3, 3)``, unit normals ``(F, 3)`` and areas ``(F,)``."""

    corners: FloatArray
    normals: FloatArray
    areas: FloatArray

    @staticmethod
    def of(mesh: Mesh) -> Piece:
        """Triangles of a mesh."""
        areas = np.linalg.norm(mesh.face_vectors, axis=1)
        normals = mesh.face_vectors / np.where(areas > 0, areas, 1.0)[:, None]
        return Piece(mesh.vertices[mesh.faces], normals, areas)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> Piece:
        """Give some of them."""
        return Piece(self.corners[rows], self.normals[rows], self.areas[rows])

    @property
    def extent(self) -> float:
        """Diagonal of the box around them in mm."""
        return float(np.linalg.norm(np.ptp(self.corners.reshape(-1, 3), axis=0)))

    def tolerance(self, diagonal: float) -> float:
        """How far in mm vertices may be off the surface, in a part with some diagonal in mm."""
        return max(_ROUNDING * diagonal, _MISS * min(self.extent, diagonal))


def fitted(piece: Piece, diagonal: float, kinds: tuple[str, ...] | None = None) -> AnalyticFace | None:
    """Simplest surface in closed form that all triangles are chords of, with the material behind them, or None.

    Parameters
    ----------
    piece : Piece
    diagonal : float
        Of the part in mm: its coordinates are good to a share of that.
    kinds : tuple of str, optional
        Which kinds to try, simple ones first; by default all.
    """
    points = np.unique(piece.corners.reshape(-1, 3), axis=0)
    if not (piece.areas > 0).any():
        return None
    middle, size = points.mean(axis=0), max(piece.extent, 1e-300)
    scaled = Piece((piece.corners - middle) / size, piece.normals, piece.areas / size**2)
    sample = ((points - middle) / size)[np.linspace(0, len(points) - 1, min(len(points), _SAMPLE)).astype(np.int64)]
    tolerance = piece.tolerance(diagonal)
    for kind in kinds or tuple(_FITS):
        fewest, fit = _FITS[kind]
        if len(points) < fewest:
            continue
        found = fit(scaled, sample)
        if found is None:
            continue
        face = turned(_moved(found, middle, size), piece)
        if chords(face, piece, tolerance).all():
            return face
    return None


def turned(face: AnalyticFace, piece: Piece) -> AnalyticFace:
    """Give the face with the material behind its triangles."""
    gradient = face.value_and_gradient(piece.corners.mean(axis=1))[1]
    inward = float((piece.areas * (gradient * piece.normals).sum(axis=1)).sum())
    return replace(face, side=-face.side) if inward > 0 else face


def chords(face: AnalyticFace, piece: Piece, tolerance: float) -> NDArray[np.bool_]:
    """Which triangles ``(F,)`` have their corners on a face, and are chords of it there.

    Corners alone do not tell: those of a disc are on the torus that rounds its rim.
    """
    count = len(piece.corners)
    value, gradient = face.value_and_gradient(piece.corners.reshape(-1, 3))
    near = (np.abs(value) <= tolerance).reshape(count, 3).all(axis=1)
    normal = gradient.reshape(count, 3, 3)
    along = np.roll(piece.corners, -1, axis=1) - piece.corners
    tilt = np.maximum(np.abs((normal * along).sum(axis=2)), np.abs((np.roll(normal, -1, axis=1) * along).sum(axis=2)))
    sagitta = np.abs(face((piece.corners + along / 2).reshape(-1, 3))).reshape(count, 3)
    inner = face.value_and_gradient(piece.corners.mean(axis=1))[1]
    facing = (-(inner * piece.normals).sum(axis=1) >= _TURN) | (piece.areas <= 1e-12 * piece.areas.max())
    # on an arc the sagitta is a quarter of the tilt of its end times its length
    return np.asarray(near & facing & (sagitta <= tilt / 2 + 2 * tolerance).all(axis=1))


def _moved(face: AnalyticFace, middle: FloatArray, size: float) -> AnalyticFace:
    """Face of a piece that was moved to the origin and scaled to size 1."""
    if isinstance(face, PlaneFace):
        return replace(face, point=face.point * size + middle)
    if isinstance(face, CylinderFace):
        return replace(face, point=face.point * size + middle, radius=face.radius * size)
    if isinstance(face, ConeFace):
        return replace(face, apex=face.apex * size + middle)
    if isinstance(face, SphereFace):
        return replace(face, centre=face.centre * size + middle, radius=face.radius * size)
    assert isinstance(face, TorusFace)
    return replace(face, centre=face.centre * size + middle, ring=face.ring * size, tube=face.tube * size)


def _plane(piece: Piece, points: FloatArray) -> AnalyticFace | None:
    middle = points.mean(axis=0)
    return PlaneFace(middle, np.linalg.svd(points - middle, full_matrices=False)[2][2])


def _cylinder(piece: Piece, points: FloatArray) -> AnalyticFace | None:
    """Cylinder, from normals of triangles, which are at right angles to its axis."""
    spread, ways = np.linalg.eigh((piece.normals * piece.areas[:, None]).T @ piece.normals)
    if spread[1] < 1e-9 * spread[2]:
        return None
    frame = ways[:, [1, 2, 0]].T
    flat = points @ frame.T
    centre, radius = _circle(flat[:, :2])
    origin = np.array([*centre, flat[:, 2].mean()]) @ frame

    def make(p: FloatArray) -> AnalyticFace:
        return CylinderFace(origin + p[:2] @ frame[:2], _tilted(frame, p[2:4]), float(radius + p[4]))

    return _polished(make, 5, points)


def _cone(piece: Piece, points: FloatArray) -> AnalyticFace | None:
    """Cone, from normals of triangles, which have one angle to its axis, and their planes, which meet at its apex."""
    weight = piece.areas / piece.areas.sum()
    mean = weight @ piece.normals
    spread, ways = np.linalg.eigh(((piece.normals - mean) * weight[:, None]).T @ (piece.normals - mean))
    if spread[1] < 1e-9:
        return None
    axis = ways[:, 0]
    heights = (piece.corners[:, 0] * piece.normals).sum(axis=1)
    root = np.sqrt(weight)
    apex = np.linalg.lstsq(piece.normals * root[:, None], heights * root, rcond=None)[0]
    if not np.linalg.norm(apex) < 1e4:
        return None
    axis = axis if float(points.mean(axis=0) @ axis - apex @ axis) > 0 else -axis
    frame = np.stack([*_across(axis), axis])
    height = (points - apex) @ axis
    away = np.linalg.norm(points - apex - height[:, None] * axis, axis=1)
    half = float(np.arctan2(away.mean(), height.mean()))

    def make(p: FloatArray) -> AnalyticFace:
        return ConeFace(apex + p[:3], _tilted(frame, p[3:5]), float(half + p[5]))

    return _polished(make, 6, points)


def _sphere(piece: Piece, points: FloatArray) -> AnalyticFace | None:
    centre, radius = _circle(points)
    return _polished(lambda p: SphereFace(centre + p[:3], float(radius + p[3])), 4, points)


def _torus(piece: Piece, points: FloatArray) -> AnalyticFace | None:
    """Torus, from normal lines, which meet its axis: linear in the Plücker coordinates of that."""
    middles = _circumcentres(piece.corners)
    lines = np.hstack([np.cross(middles, piece.normals), piece.normals]) * np.sqrt(piece.areas)[:, None]
    best = np.linalg.eigh(lines.T @ lines)[1][:, 0]
    length = float(np.linalg.norm(best[:3]))
    if length < 1e-6:
        return None
    axis, moment = best[:3] / length, best[3:] / length
    origin = np.cross(axis, moment - (moment @ axis) * axis)
    height = (points - origin) @ axis
    away = np.linalg.norm(points - origin - height[:, None] * axis, axis=1)
    (ring, lift), tube = _circle(np.column_stack([away, height]))
    if not (np.isfinite(tube) and tube < 1e4):
        return None
    frame = np.stack([*_across(axis), axis])
    inner = ring < 0
    centre = origin + lift * axis

    def make(p: FloatArray) -> AnalyticFace:
        sheet: Literal["inner", "outer"] = "inner" if inner else "outer"
        radii = abs(float(ring + p[5])), abs(float(tube + p[6]))
        return TorusFace(centre + p[:3], _tilted(frame, p[3:5]), *radii, sheet)

    return _polished(make, 7, points)


def _circle(points: FloatArray) -> tuple[FloatArray, float]:
    """Centre ``(D,)`` and radius of the circle or sphere through points ``(N, D)``, by linear least squares."""
    matrix = np.hstack([2 * points, np.ones((len(points), 1))])
    solution = np.linalg.lstsq(matrix, (points**2).sum(axis=1), rcond=None)[0]
    centre = solution[:-1]
    return centre, float(np.sqrt(max(solution[-1] + centre @ centre, 0.0)))


def _circumcentres(corners: FloatArray) -> FloatArray:
    """Where triangles ``(F, 3, 3)`` have the normals of the surface; of obtuse ones, on the longest side."""
    across = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)
    squares = (across**2).sum(axis=2)
    weight = np.maximum(squares * (squares.sum(axis=1, keepdims=True) - 2 * squares), 0.0)
    whole = weight.sum(axis=1, keepdims=True)
    weight = np.where(whole > 0, weight / np.where(whole > 0, whole, 1.0), 1 / 3)
    return np.asarray((corners * weight[:, :, None]).sum(axis=1))


def _across(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors at right angles to a unit vector and to each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def _tilted(frame: FloatArray, by: FloatArray) -> FloatArray:
    """Last vector of a frame, moved along the two others, of length 1."""
    axis = frame[2] + by @ frame[:2]
    return np.asarray(axis / np.linalg.norm(axis))


def _polished(make: Callable[[FloatArray], AnalyticFace], count: int, points: FloatArray) -> AnalyticFace | None:
    """Face whose distances to the points have the least squares (Levenberg and Marquardt).

    Given up where it does not go down fast: then it matters little how near the points it would get.
    """
    place, damping, stalled = np.zeros(count), 1e-4, 0
    off = make(place)(points)
    if not np.abs(off).max() < _START:
        return None
    for _ in range(_STEPS):
        slope = np.stack([(make(place + step)(points) - off) / _DIFFERENCE for step in _DIFFERENCE * np.eye(count)])
        square = slope @ slope.T
        for _ in range(5):
            lifted = square + damping * np.diag(np.diag(square) + 1e-12)
            further = place - np.linalg.lstsq(lifted, slope @ off, rcond=1e-15)[0]
            there = make(further)(points)
            if there @ there < off @ off:
                break
            damping *= 10
        else:
            break
        stalled = stalled + 1 if there @ there > _GAIN * (off @ off) else 0
        place, off, damping = further, there, damping / 30
        if stalled == _STALLED:
            break
    return make(place)


_FITS: dict[str, tuple[int, Callable[[Piece, FloatArray], AnalyticFace | None]]] = {
    # with the fewest vertices: two more than it takes to define the surface, but for planes
    "plane": (3, _plane),
    "cylinder": (7, _cylinder),
    "cone": (8, _cone),
    "sphere": (8, _sphere),
    "torus": (10, _torus),
}
