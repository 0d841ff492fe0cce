"""Exact distances with gradients for the contouring tests, and measurements of meshes that share no code with it."""

from __future__ import annotations

from collections.abc import Callable

import manifold3d
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from cad_implicit.implicit import Implicit
from cad_implicit.mesh import Mesh

FloatArray = NDArray[np.float64]
Distance = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

TURN = Rotation.from_euler("xyz", [23, 37, 11], degrees=True).as_matrix()
SHIFT = np.array([0.1234, -0.3771, 0.2917])


class Placed(Implicit):
    """A distance in its own frame, turned off the axes and moved; counts the points that it is asked for."""

    lipschitz = 1.0

    def __init__(
        self, distance: Distance, half_size: ArrayLike, turn: FloatArray = TURN, shift: FloatArray = SHIFT
    ) -> None:
        self.distance, self.turn, self.shift = distance, turn, shift
        corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), -1).reshape(-1, 3) * np.asarray(half_size)
        placed = self.place(corners)
        self.bounds = np.stack([placed.min(axis=0), placed.max(axis=0)])
        self.evaluations = 0

    def place(self, points: ArrayLike) -> FloatArray:
        return np.asarray(points, float) @ self.turn.T + self.shift

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        self.evaluations += len(np.asarray(points))
        value, gradient = self.distance((np.asarray(points, float) - self.shift) @ self.turn)
        return value, gradient @ self.turn.T


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)


def ball(radius: float) -> Distance:
    return lambda p: (radius - np.linalg.norm(p, axis=1), -_unit(p))


def torus(ring: float, tube: float) -> Distance:
    def distance(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        centre = np.zeros_like(p)
        centre[:, :2] = ring * _unit(p[:, :2])
        return tube - np.linalg.norm(p - centre, axis=1), -_unit(p - centre)

    return distance


def disc(radius: float) -> Distance:
    return ball(radius)


def polygon(corners: list[tuple[float, float]]) -> Distance:
    """Distance in the plane to a counter-clockwise polygon."""
    start = np.array(corners, float)
    side = np.roll(start, -1, axis=0) - start
    inward = _unit(np.stack([-side[:, 1], side[:, 0]], axis=1))

    def distance(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        away = p[:, None] - start
        along = np.clip((away * side).sum(2) / (side**2).sum(1), 0, 1)
        away = away - along[..., None] * side
        squared = (away**2).sum(2)
        nearest = squared.argmin(axis=1)
        rows = np.arange(len(p))
        length = np.sqrt(squared[rows, nearest])
        above = p[:, 1:] >= start[:, 1]
        below = p[:, 1:] < np.roll(start[:, 1], -1)
        left = side[:, 0] * (p[:, 1:] - start[:, 1]) > side[:, 1] * (p[:, :1] - start[:, 0])
        crossed = (above & below & left) | ~(above | below | left)
        sign = np.where(crossed.sum(axis=1) % 2, 1.0, -1.0)
        gradient = sign[:, None] * _unit(away[rows, nearest])
        return sign * length, np.where(length[:, None] < 1e-12, inward[nearest], gradient)

    return distance


def extrusion(plane: Distance, half_height: float) -> Distance:
    """Exact distance to a plane figure extruded along the third axis."""

    def distance(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        d, g = plane(p[:, :2])
        above = np.abs(p[:, 2]) - half_height
        up = np.where(p[:, 2] < 0, -1.0, 1.0)
        outside = np.maximum(np.stack([-d, above], axis=1), 0)
        length = np.linalg.norm(outside, axis=1)
        inside = np.maximum(-d, above)
        weight = np.where(
            inside[:, None] > 0, _unit(outside), np.stack([-d > above, -d <= above], axis=1).astype(float)
        )
        gradient = np.concatenate([g * weight[:, :1], -(up * weight[:, 1])[:, None]], axis=1)
        return np.where(inside > 0, -length, -inside), gradient

    return distance


def box(x: float, y: float, z: float) -> Distance:
    return extrusion(polygon([(-x, -y), (x, -y), (x, y), (-x, y)]), z)


def minus(part: Distance, tool: Distance) -> Distance:
    def distance(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        (a, ga), (b, gb) = part(p), tool(p)
        return np.minimum(a, -b), np.where((a < -b)[:, None], ga, -gb)

    return distance


def moved(part: Distance, shift: ArrayLike) -> Distance:
    return lambda p: part(p - np.asarray(shift))


def segment(a: ArrayLike, b: ArrayLike, count: int = 500) -> FloatArray:
    t = np.linspace(0, 1, count)[:, None]
    return (1 - t) * np.asarray(a, float) + t * np.asarray(b, float)


def circle(radius: float, z: float, count: int = 1500) -> FloatArray:
    t = np.linspace(0, 2 * np.pi, count)
    return np.stack([radius * np.cos(t), radius * np.sin(t), np.full(count, z)], axis=1)


def prism_edges(corners: list[tuple[float, float]], z: float) -> FloatArray:
    following = [*corners[1:], corners[0]]
    edges = [segment((*a, z), (*b, z)) for a, b in zip(corners, following, strict=True)]
    edges += [segment((*a, -z), (*b, -z)) for a, b in zip(corners, following, strict=True)]
    return np.concatenate([*edges, *(segment((*a, -z), (*a, z)) for a in corners)])


ELL = [(-1.0, -1.0), (1.0, -1.0), (1.0, -0.2), (-0.1, -0.2), (-0.1, 1.0), (-1.0, 1.0)]
WEDGE = [(-0.9, -0.5), (0.9, -0.5), (0.0, 1.0)]
BOX = [(-1.0, -0.8), (1.0, -0.8), (1.0, 0.8), (-1.0, 0.8)]
NOTCH = np.concatenate([segment((x, 0.8, -0.6), (x, 0.8, 0.6)) for x in (-0.45, 0.45)])

#: Name: distance, half size, sharp edges, genus.
PARTS: dict[str, tuple[Distance, list[float], FloatArray | None, int]] = {
    "sphere": (ball(1.0), [1, 1, 1], None, 0),
    "torus": (torus(1.0, 0.4), [1.4, 1.4, 0.4], None, 1),
    "box": (box(1, 0.8, 0.6), [1, 0.8, 0.6], prism_edges(BOX, 0.6), 0),
    "cylinder": (extrusion(disc(0.7), 0.9), [0.7, 0.7, 0.9], np.concatenate([circle(0.7, 0.9), circle(0.7, -0.9)]), 0),
    "wedge": (extrusion(polygon(WEDGE), 0.5), [1, 1, 0.5], prism_edges(WEDGE, 0.5), 0),
    "ell": (extrusion(polygon(ELL), 0.7), [1, 1, 0.7], prism_edges(ELL, 0.7), 0),
    "hole": (
        minus(box(1, 0.8, 0.6), extrusion(disc(0.45), 2)),
        [1, 0.8, 0.6],
        np.concatenate([prism_edges(BOX, 0.6), circle(0.45, 0.6), circle(0.45, -0.6)]),
        1,
    ),
    "small hole": (
        minus(box(1, 0.8, 0.6), extrusion(disc(0.2), 2)),
        [1, 0.8, 0.6],
        np.concatenate([prism_edges(BOX, 0.6), circle(0.2, 0.6), circle(0.2, -0.6)]),
        1,
    ),
    "notch": (minus(box(1, 0.8, 0.6), moved(extrusion(disc(0.45), 2), [0, 0.8, 0])), [1, 0.8, 0.6], NOTCH, 0),
}


def status(mesh: Mesh) -> str:
    raw = manifold3d.Mesh64(np.array(mesh.vertices), mesh.faces.astype(np.uint64))
    return str(manifold3d.Manifold(raw).status()).rsplit(".", maxsplit=1)[-1]


def broken_edges(mesh: Mesh) -> int:
    """Edges that do not have exactly two triangles, in opposite directions, plus vertices with more than one fan."""
    f = mesh.faces.astype(np.int64)
    directed = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    key = directed[:, 0] * len(mesh.vertices) + directed[:, 1]
    back = directed[:, 1] * len(mesh.vertices) + directed[:, 0]
    wrong = len(key) - len(np.unique(key)) + int((~np.isin(key, back)).sum())
    return wrong + (_extra_fans(f) if wrong == 0 else 0)


def _extra_fans(faces: NDArray[np.int64]) -> int:
    """Fans around all vertices beyond one each: corners are joined across the edges that leave their vertex."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = faces.max() + 1
    number = np.arange(faces.size).reshape(faces.shape)
    leaving = (faces * count + np.roll(faces, -1, axis=1)).ravel()
    arriving = (np.roll(faces, 1, axis=1) * count + faces).ravel()
    order = np.argsort(leaving)
    # The edge that arrives at a corner leaves from the neighbouring triangle in the opposite direction.
    opposite = arriving % count * count + arriving // count
    partner = order[np.searchsorted(leaving[order], opposite)]
    graph = coo_matrix((np.ones(faces.size), (number.ravel(), partner)), (faces.size, faces.size))
    fans = connected_components(graph, directed=False)[0]
    return int(fans - len(np.unique(faces)))


def smallest_angles(mesh: Mesh) -> FloatArray:
    """Smallest angle of each triangle in degrees."""
    p = mesh.vertices[mesh.faces]
    edges = np.sort(np.linalg.norm(p - np.roll(p, -1, axis=1), axis=2), axis=1)
    sine = 2 * np.linalg.norm(mesh.face_vectors, axis=1) / np.maximum(edges[:, 1] * edges[:, 2], 1e-300)
    return np.degrees(np.arcsin(np.minimum(sine, 1)))


def distance_to_mesh(mesh: Mesh, points: FloatArray, candidates: int = 32) -> FloatArray:
    """Distance (N,) to the triangles with the nearest centroids: never less than the true distance."""
    triangles = mesh.vertices[mesh.faces]
    near = cKDTree(triangles.mean(axis=1)).query(points, min(candidates, len(triangles)))[1]
    a, b, c = (triangles[near][:, :, i] for i in range(3))
    p = points[:, None]
    normal = np.cross(b - a, c - a)
    squared = (normal**2).sum(-1)
    best = np.full(near.shape, np.inf)
    over = squared > 0
    for u, v in ((a, b), (b, c), (c, a)):
        along = np.clip(((p - u) * (v - u)).sum(-1) / np.maximum(((v - u) ** 2).sum(-1), 1e-300), 0, 1)
        best = np.minimum(best, ((p - u - along[..., None] * (v - u)) ** 2).sum(-1))
        over &= (np.cross(v - u, p - u) * normal).sum(-1) >= 0
    plane = ((p - a) * normal).sum(-1) ** 2 / np.maximum(squared, 1e-300)
    return np.sqrt(np.where(over, np.minimum(best, plane), best).min(axis=1))


def self_intersections(mesh: Mesh) -> int:
    """Pairs of triangles without a common vertex of which an edge of one pierces the other."""
    t = mesh.vertices[mesh.faces]
    centre = t.mean(axis=1)
    reach = np.linalg.norm(t - centre[:, None], axis=2).max(axis=1)
    i, j = cKDTree(centre).query_pairs(2 * reach.max(), output_type="ndarray").T
    low, high = t.min(axis=1), t.max(axis=1)
    near = ((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=1)
    i, j = i[near], j[near]
    apart = ~(mesh.faces[i][:, :, None] == mesh.faces[j][:, None]).any(axis=(1, 2))
    i, j = i[apart], j[apart]
    pierced = np.zeros(len(i), bool)
    for one, other in ((i, j), (j, i)):
        for side in range(3):
            pierced |= _pierces(t[one][:, side], t[one][:, (side + 1) % 3], t[other])
    return int(pierced.sum())


def _pierces(start: FloatArray, end: FloatArray, triangle: FloatArray, slack: float = 1e-9) -> NDArray[np.bool_]:
    normal = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    size = np.linalg.norm(normal, axis=1)
    below = ((start - triangle[:, 0]) * normal).sum(axis=1)
    above = ((end - triangle[:, 0]) * normal).sum(axis=1)
    hit = (below * above < 0) & (np.minimum(abs(below), abs(above)) > slack * size**1.5) & (size > 0)
    fraction = below / np.where(below == above, 1, below - above)
    point = start + fraction[:, None] * (end - start)
    for u in range(3):
        side = triangle[:, (u + 1) % 3] - triangle[:, u]
        hit &= (np.cross(side, point - triangle[:, u]) * normal).sum(axis=1) > slack * size**2
    return hit
