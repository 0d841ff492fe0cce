"""Where material or gaps are too thin for a ball: the condition of section 4.1 of the paper, looked at in advance.

An opening by a ball of radius r keeps material that is at least 2 r thick, a closing keeps gaps that are at least
2 r wide. Balls that touch the surface at a sample and fit beside it are found by shrinking (Ma, Bae and Choi 2012,
DOI 10.1007/s00371-011-0594-7). A ball counts if it touches two faces that oppose each other: a smallest ball of a
wall or a slot always does, while balls that sit in an edge, sharp, chamfered or rounded, touch on one side.

Not promised: spots between the samples may be missed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .comparison import surface_samples
from .errors import RadiusError
from .implicit import FloatArray
from .kernels.bvh import Tree, build_tree
from .kernels.closest import closest_points
from .kernels.jit import frozen
from .kernels.pseudonormal import smooth_normals
from .kernels.triangle import FACE
from .mesh import Mesh
from .parallel import Progress, no_progress

_SEED = 2012
#: A ball fits if nothing is nearer to its centre than this share of its radius.
_FITS = 1 - 1e-6
#: Shrinking stops when it gains less than this: the facets of a curved face would go on gnawing at the ball.
_GAIN = 1e-3
#: Contacts closer together than this, seen from the centre, are neighbouring facets of one face.
_SAME_FACE = math.cos(math.radians(45))
#: Contacts oppose each other from here on. Wedges of less than 30 degrees do so too; they are told by their edge.
_OPPOSED = math.cos(math.radians(149))
#: An edge is sharp if its faces' normals differ by more than this.
_SHARP = math.cos(math.radians(30))
#: A ball sits in a wedge if the planes through its contacts meet near a sharp edge (relative to their distance from
#: the centre; faces may be curved) whose normals are nearly those of the contacts.
_NEAR_EDGE = 0.5
_SAME_NORMAL = math.cos(math.radians(20))
_MAX_STEPS = 30


@dataclass(frozen=True)
class ThinSpot:
    """The thinnest wall, or the narrowest gap, that a ball does not fit.

    Attributes
    ----------
    place : tuple of 3 float
        A point of the surface there, in mm.
    thickness : float
        Diameter in mm of the largest ball that fits there.
    safe_radius : float
        Radius in mm of that ball, the largest that keeps the wall or gap.
    """

    place: tuple[float, float, float]
    thickness: float
    safe_radius: float


def thin_spots(
    mesh: Mesh,
    radius: float,
    side: Literal["inside", "outside"] = "inside",
    *,
    samples: int = 5000,
    tree: Tree | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> ThinSpot | None:
    """Find the spot where a ball fits worst, or None if it fits everywhere but in edges.

    Parameters
    ----------
    mesh : Mesh
    radius : float
        Radius of the ball in mm.
    side : "inside" or "outside"
        Whether to look at walls (for rounding) or at gaps (for filleting).
    samples : int
        Number of points of the surface to look at.
    tree : Tree, optional
        Of the mesh's triangles, if there is one already.
    threads : int, optional
        Number of threads; all cores by default.
    progress : callable
        Called as ``progress("thickness", fraction)``; may raise to cancel.

    Raises
    ------
    RadiusError
        If the radius is not positive and finite.
    """
    if not (math.isfinite(radius) and radius > 0):
        raise RadiusError(f"the radius must be positive and finite, not {radius}")
    if side not in ("inside", "outside"):
        raise ValueError(f'side must be "inside" or "outside", not {side!r}')
    progress("thickness", 0.0)
    outward = 1.0 if side == "inside" else -1.0
    points, normals = _samples(mesh, samples, outward)
    if tree is None:
        with parallel.threads(threads, len(mesh.faces)):
            tree = build_tree(mesh.vertices, mesh.faces, signed=False)
    length = np.linalg.norm(mesh.face_vectors, axis=1)
    faces = outward * mesh.face_vectors / np.where(length > 0, length, 1.0)[:, None]
    reach, contacts, directions = _shrink(tree, points, outward * normals, faces, radius, threads, progress)
    found = np.flatnonzero(reach < radius * _FITS)
    points, reach = points[found], reach[found]
    counts = ~_in_wedge(mesh, points, outward * normals[found], contacts[found], directions[found], outward, threads)
    progress("thickness", 1.0)
    if not counts.any():
        return None
    worst = int(np.where(counts, reach, np.inf).argmin())
    x, y, z = points[worst].tolist()
    return ThinSpot((x, y, z), 2 * float(reach[worst]), float(reach[worst]))


def _samples(mesh: Mesh, count: int, outward: float) -> tuple[FloatArray, FloatArray]:
    """Points of the surface and outward normals: triangle centres, B-rep faces in turn, points by area, and on edges.

    Edges are those that reach into the ball's side, where a wall or a gap may be narrowest.
    """
    good = np.flatnonzero(np.linalg.norm(mesh.face_vectors, axis=1) > 0)
    if len(good) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    edge_points, edge_normals = _edge_samples(mesh, max(count // 5, 1), outward)
    if len(good) > count // 2:
        good = _in_turn(good, None if mesh.face_ids is None else mesh.face_ids[good])[: count // 2]
    centres = mesh.vertices[mesh.faces[good]].mean(axis=1)
    spread, triangle = surface_samples(mesh, max(count - len(good) - len(edge_points), 1))
    points, triangles = np.concatenate([centres, spread]), np.concatenate([good, triangle])
    normals = smooth_normals(mesh.vertices, mesh.faces, triangles, points, _SHARP)
    usable = (normals**2).sum(axis=1) > 0.5
    return np.concatenate([points[usable], edge_points]), np.concatenate([normals[usable], edge_normals])


def _edge_samples(mesh: Mesh, count: int, outward: float) -> tuple[FloatArray, FloatArray]:
    """At most ``count`` points, evenly along sharp edges that reach into the ball's side, and their mean normals."""
    ends, normals = _sharp_edges(mesh, -outward)
    if len(ends) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    total = np.cumsum(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))
    along = (np.arange(count) + 0.5) / count * total[-1]
    edge = np.minimum(np.searchsorted(total, along, side="right"), len(total) - 1)
    length = np.diff(total, prepend=0.0)[edge]
    share = ((total[edge] - along) / np.where(length > 0, length, 1.0))[:, None]
    mean = normals[edge].sum(axis=1)
    points = share * ends[edge, 0] + (1 - share) * ends[edge, 1]
    return points, mean / np.maximum(np.linalg.norm(mean, axis=1), 1e-12)[:, None]


def _in_turn(triangles: NDArray[np.int64], face_ids: NDArray[np.int32] | None) -> NDArray[np.int64]:
    """Triangles in random order; one of each B-rep face, then a second of each, and so on."""
    shuffled = np.random.default_rng(_SEED).permutation(len(triangles))
    if face_ids is None:
        return triangles[shuffled]
    ids = face_ids[shuffled]
    by_face = np.argsort(ids, kind="stable")
    first = np.searchsorted(ids[by_face], ids[by_face])
    turn = np.arange(len(ids)) - first
    return triangles[shuffled[by_face[np.argsort(turn, kind="stable")]]]


def _shrink(
    tree: Tree,
    points: FloatArray,
    normals: FloatArray,
    faces: FloatArray,
    radius: float,
    count: int | None,
    progress: Progress,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Radii of balls that touch the points from behind and an opposed face, the other contact and its normal.

    A ball shrinks until it fits. The last contact that opposes the point counts: it is the wall's or the gap's other
    side, even if the ball shrinks further into an edge. Where there is none the radius is infinite.
    """
    rho = np.full(len(points), float(radius))
    opposed, contacts, directions = np.full(len(points), np.inf), points.copy(), normals.copy()
    active = np.arange(len(points))
    for step in range(_MAX_STEPS):
        if len(active) == 0:
            break
        progress("thickness", step / _MAX_STEPS)
        x, n, old = points[active], normals[active], rho[active]
        centres = x - old[:, None] * n
        with parallel.threads(count):
            distance, q, triangle, _, feature = closest_points(tree, frozen(centres))
        behind = ((x - q) * n).sum(axis=1)
        tight = (distance < old * _FITS) & (behind > 0)
        new = np.where(tight, ((q - x) ** 2).sum(axis=1) / np.where(tight, 2 * behind, 1.0), old)
        # cosine of the angle between the contacts, seen from the new centre
        better = tight & (1 - behind / np.where(new > 0, new, 1.0) < _SAME_FACE)
        rho[active[better]] = new[better]
        direction = _contact_normals(centres, q, faces[triangle], feature == FACE)
        found = better & ((direction * n).sum(axis=1) < _OPPOSED)
        at = active[found]
        opposed[at], contacts[at], directions[at] = new[found], q[found], direction[found]
        active = active[better & (new < old * (1 - _GAIN))]
    return opposed, contacts, directions


def _contact_normals(
    centres: FloatArray, contacts: FloatArray, faces: FloatArray, on_face: NDArray[np.bool_]
) -> FloatArray:
    """Find the normals at contacts: of the face, or along the ball's radius at an edge or a vertex."""
    along = contacts - centres
    along *= np.where((along * faces).sum(axis=1) < 0, -1.0, 1.0)[:, None]  # the centre may lie beyond the contact
    length = np.linalg.norm(along, axis=1)
    along /= np.where(length > 0, length, 1.0)[:, None]
    return np.where(on_face[:, None], faces, along)


def _in_wedge(
    mesh: Mesh,
    points: FloatArray,
    normals: FloatArray,
    contacts: FloatArray,
    directions: FloatArray,
    outward: float,
    count: int | None,
) -> NDArray[np.bool_]:
    """Whether points and contacts lie on the two faces of a wedge: their planes meet near a sharp edge like that."""
    ends, edge_normals = _sharp_edges(mesh, outward)
    if len(ends) == 0 or len(points) == 0:
        return np.zeros(len(points), np.bool_)
    middle, cosine = (points + contacts) / 2, (normals * directions).sum(axis=1)
    # middle + a n + b m lies in both planes
    right = ((points - middle) * normals).sum(axis=1), ((contacts - middle) * directions).sum(axis=1)
    determinant = np.maximum(1 - cosine**2, 1e-12)
    a, b = (right[0] - cosine * right[1]) / determinant, (right[1] - cosine * right[0]) / determinant
    step = a[:, None] * normals + b[:, None] * directions
    segments = np.arange(2 * len(ends)).reshape(-1, 2)[:, [0, 1, 1]]
    with parallel.threads(count):
        tree = build_tree(ends.reshape(-1, 3), segments, signed=False)
        distance, _, edge, *_ = closest_points(tree, frozen(middle + step))
    near = distance < _NEAR_EDGE * np.linalg.norm(step, axis=1)
    first, second = outward * edge_normals[edge, 0], outward * edge_normals[edge, 1]
    same = np.zeros(len(points), np.bool_)
    for one, other in ((first, second), (second, first)):
        same |= ((one * normals).sum(axis=1) > _SAME_NORMAL) & ((other * directions).sum(axis=1) > _SAME_NORMAL)
    return np.asarray(same & near)


def _sharp_edges(mesh: Mesh, outward: float) -> tuple[FloatArray, FloatArray]:
    """Find ends ``(E, 2, 3)`` and face normals ``(E, 2, 3)`` of sharp edges: convex for outward 1, concave for -1."""
    start, end = mesh.faces.ravel().astype(np.int64), np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    apex = np.roll(mesh.faces, -2, axis=1).ravel()
    key = np.minimum(start, end) * len(mesh.vertices) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    paired = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[paired], order[paired + 1]
    length = np.linalg.norm(mesh.face_vectors, axis=1)
    unit = mesh.face_vectors / np.where(length > 0, length, 1.0)[:, None]
    normals = np.stack([unit[one // 3], unit[two // 3]], axis=1)
    bend = (normals[:, 0] * (mesh.vertices[apex[two]] - mesh.vertices[start[one]])).sum(axis=1)
    sharp = (normals[:, 0] * normals[:, 1]).sum(axis=1) < _SHARP
    sharp &= (length[one // 3] > 0) & (length[two // 3] > 0) & (outward * bend < 0)
    ends = np.stack([mesh.vertices[start[one]], mesh.vertices[end[one]]], axis=1)
    return ends[sharp], normals[sharp]
