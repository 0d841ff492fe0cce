"""Radius of curvature along the blends of a mesh, and the angle at which they leave the faces.

Across a direction the normals of a ball's surface are linear in the place, n = A x + b, and so are those of the pipe
that it makes. So A and b are fitted to the vertices around a place with the shape's normals there (those of triangles
are off by a tenth): the radius is one over the largest eigenvalue of A, and where a blend meets a face b tells its
normal. On rings both are less exact: 0.5 % and 1.5 degrees around a boss of 2.5 radii.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cad_implicit.distance import MeshDistance
from cad_implicit.implicit import FloatArray, Implicit
from cad_implicit.mesh import Mesh

from .judges import unit

#: Vertices farther than so many spacings from the part are on blends.
_OFF = 2e-4

#: Vertices of blends, and of blends and faces, that are looked at. (With 300 of a rounded box the 95th percentile of
#: the radius was between 2.000 and 2.053 mm by chance, that of all is 2.013.)
_SAMPLES = 10_000
_CONTACTS = 300

#: The neighbourhood in radii.
_AROUND = 0.6

#: Fits on blends take so many neighbours at most, so that few reach from a pipe to the ball at its end, and those at
#: contacts, with blends on one side only, so many. They need as many, and leave normals off by less than this RMS,
#: or there is a crease among them.
_MOST, _MOST_AT_CONTACTS = 40, 400
_FEWEST = 9
_CREASE = 0.05

#: Triangles on the part face as it does within 30 degrees (cosine).
_SAME_WAY = 0.87

#: What bends by so many radii or less is the blend; flat ends of blends lie off the part, too.
_FLAT = 3.0


@dataclass(frozen=True)
class Bending:
    """Figures along the blends.

    Attributes
    ----------
    samples : int
    radius, radius_low, radius_high : float
        Median, 5th and 95th percentile of the radius of curvature in mm; NaN without samples.
    contacts : int
        Vertices at which a blend meets a face.
    tangency, tangency_high : float
        Median and 95th percentile of the angle between blend and face in degrees; NaN without such vertices.
    """

    samples: int
    radius: float
    radius_low: float
    radius_high: float
    contacts: int
    tangency: float
    tangency_high: float

    def as_dict(self) -> dict[str, float | None]:
        """All figures by name, None for NaN."""
        return {name: None if np.isnan(value) else value for name, value in asdict(self).items()}


def bending(mesh: Mesh, shape: Implicit, part: MeshDistance, radius: float, spacing: float) -> Bending:
    """Measure how a result bends where it is not the part.

    Parameters
    ----------
    mesh : Mesh
        The result.
    shape : Implicit
        That it is the contour of.
    part : MeshDistance
        Before the blend.
    radius, spacing : float
        In mm.
    """
    off = np.asarray(np.abs(part(mesh.vertices)) > _OFF * spacing)
    new = np.asarray(off[mesh.faces].any(axis=1))
    new[~new] = ~_faces_as(mesh, np.flatnonzero(~new), part)
    inner = np.flatnonzero(off)
    radii, angles = [], []
    if len(inner) >= _FEWEST:
        tree = cKDTree(mesh.vertices[inner])
        places = mesh.vertices[inner]
        normals = unit(-shape.value_and_gradient(places)[1])
        for vertex in _some(inner, _SAMPLES):
            found = _fit(mesh.vertices[vertex], tree, places, normals, radius, _MOST)
            if found is not None and found[1] <= _FLAT * radius:
                radii.append(found[1])
        for vertex, face in _contacts(mesh, new, off):
            found = _fit(mesh.vertices[vertex], tree, places, normals, radius, _MOST_AT_CONTACTS)
            if found is not None and found[1] <= _FLAT * radius:
                cosine = float(np.clip(unit(found[0][None])[0] @ face, -1, 1))
                angles.append(float(np.degrees(np.arccos(cosine))))
    middle, low, high = _percentiles(radii)
    tangency, _, tangency_high = _percentiles(angles)
    return Bending(len(radii), middle, low, high, len(angles), tangency, tangency_high)


def _faces_as(mesh: Mesh, triangles: NDArray[np.intp], part: MeshDistance) -> NDArray[np.bool_]:
    """Whether triangles face as the part does: those between facets of a hole and the circle around them do not."""
    nearest = part.closest(mesh.vertices[mesh.faces[triangles]].mean(axis=1)).triangle
    cosine = (unit(mesh.face_vectors[triangles]) * unit(part.mesh.face_vectors[nearest])).sum(axis=1)
    return np.asarray(cosine > _SAME_WAY)


def _percentiles(values: list[float]) -> tuple[float, float, float]:
    """Median, 5th and 95th percentile, NaN of nothing."""
    if not values:
        return float("nan"), float("nan"), float("nan")
    middle, low, high = np.percentile(values, [50, 5, 95]).tolist()
    return middle, low, high


def _some(rows: NDArray[np.intp], most: int) -> NDArray[np.intp]:
    return rows if len(rows) <= most else np.random.default_rng(0).choice(rows, most, replace=False)


def _contacts(mesh: Mesh, new: NDArray[np.bool_], off: NDArray[np.bool_]) -> list[tuple[int, FloatArray]]:
    """Vertices of both blends and faces, with the normal of the face: of what bends away from the blend least."""
    beside = np.zeros((2, len(mesh.vertices)), np.bool_)
    beside[0, mesh.faces[new]] = beside[1, mesh.faces[~new]] = True
    normals = unit(mesh.face_vectors)
    found = []
    for vertex in _some(np.flatnonzero(beside.all(axis=0) & ~off), _CONTACTS).tolist():
        around = np.flatnonzero((mesh.faces == vertex).any(axis=1))
        faces, blend = normals[around[~new[around]]], unit(mesh.face_vectors[around[new[around]]].sum(axis=0)[None])[0]
        found.append((vertex, faces[(faces @ blend).argmax()]))
    return found


def _fit(
    place: FloatArray, tree: cKDTree, places: FloatArray, normals: FloatArray, radius: float, most: int
) -> tuple[FloatArray, float] | None:
    """Give the normal (3,) and radius of curvature in mm that normals around a place tell, None if not."""
    distance, near = tree.query(place, min(most, len(places)), distance_upper_bound=_AROUND * radius)
    near = near[np.isfinite(distance)]
    if len(near) < _FEWEST:
        return None
    own = normals[near]
    alike = own @ own[0] > 0.5
    if int(alike.sum()) < _FEWEST:
        return None
    around = np.linalg.svd(own[:1])[2][1:]
    matrix = np.column_stack([np.ones(int(alike.sum())), (places[near][alike] - place) @ around.T / radius])
    slopes = own[alike] @ around.T
    solution, *_ = np.linalg.lstsq(matrix, slopes, rcond=None)
    rest = matrix @ solution - slopes
    if float(np.sqrt((rest * rest).sum(axis=1).mean())) > _CREASE:
        return None
    bend = float(np.abs(np.linalg.eigvalsh((solution[1:] + solution[1:].T) / 2)).max())
    up = np.sqrt(max(1.0 - float(solution[0] @ solution[0]), 0.0))
    return solution[0] @ around + up * own[0], radius / max(bend, 1e-9)
