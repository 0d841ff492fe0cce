"""Parts, and regions that blends take off or fill in, by their formulas."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from cad_implicit import Mesh
from cad_implicit.implicit import FloatArray, Implicit

Part = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

#: Local frame of all parts, off the axes.
TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
TURN = TURN * np.sign(np.linalg.det(TURN))
X, Y, Z = TURN.T
ORIGIN = np.array([3.3, -2.0, 5.1])


def at(*local: float) -> FloatArray:
    """Point with these coordinates in the local frame."""
    return TURN @ np.array(local) + ORIGIN


def local(points: FloatArray) -> FloatArray:
    return (points - ORIGIN) @ TURN


class Region(Implicit):
    """What some functions have inside in common."""

    lipschitz = 1.0

    def __init__(self, parts: Sequence[Part], low: ArrayLike, high: ArrayLike) -> None:
        self.parts, self.bounds = tuple(parts), np.array([low, high], np.float64)

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def gradient(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        x = np.asarray(points, np.float64)
        values, gradients = zip(*(part(x) for part in self.parts), strict=True)
        least = np.argmin(values, axis=0)
        rows = np.arange(len(x))
        return np.array(values)[least, rows], np.array(gradients)[least, rows]


def half(normal: FloatArray, point: FloatArray) -> Part:
    """Half space that a normal points into."""
    return lambda x: ((x - point) @ normal, np.broadcast_to(normal, x.shape))


def outside_cylinder(point: FloatArray, axis: FloatArray, radius: float) -> Part:
    def function(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        away = (x - point) - np.outer((x - point) @ axis, axis)
        length = np.linalg.norm(away, axis=1)
        return length - radius, away / np.maximum(length, 1e-300)[:, None]

    return function


def inside_cylinder(point: FloatArray, axis: FloatArray, radius: float) -> Part:
    outside = outside_cylinder(point, axis, radius)
    return lambda x: tuple(-part for part in outside(x))  # type: ignore[return-value]


def outside_torus(centre: FloatArray, axis: FloatArray, major: float, minor: float) -> Part:
    def function(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        flat = (x - centre) - np.outer((x - centre) @ axis, axis)
        ring = centre + major * flat / np.maximum(np.linalg.norm(flat, axis=1), 1e-300)[:, None]
        length = np.linalg.norm(x - ring, axis=1)
        return length - minor, (x - ring) / np.maximum(length, 1e-300)[:, None]

    return function


def edge_region(
    start: FloatArray,
    end: FloatArray,
    normals: tuple[FloatArray, FloatArray],
    radius: float,
    margin: float,
    *,
    convex: bool,
    cuts: tuple[float, float],
) -> Region:
    """Region beside a straight edge between planes at a right angle; the ends go so far beyond those of the edge."""
    side = -1.0 if convex else 1.0
    centre = start + side * radius * (normals[0] + normals[1])
    along = (end - start) / np.linalg.norm(end - start)
    parts = [outside_cylinder(centre, along, radius)]
    for normal in normals:
        parts += [half(-side * normal, centre), half(side * normal, centre - side * (radius + margin) * normal)]
    parts += [half(along, start - cuts[0] * along), half(-along, end + cuts[1] * along)]
    pad = 2 * (radius + margin + max(cuts))
    return Region(parts, np.minimum(start, end) - pad, np.maximum(start, end) + pad)


def box(size: tuple[float, float, float], cuts: int = 0) -> Mesh:
    """Box around the origin of the local frame; each edge halved so many times."""
    mesh = trimesh.creation.box(size)
    for _ in range(cuts):
        mesh = mesh.subdivide()
    normals = mesh.face_normals
    ids = 3 * (normals.sum(axis=1) > 0) + np.abs(normals).argmax(axis=1)
    return Mesh(mesh.vertices @ TURN.T + ORIGIN, mesh.faces, ids)


def angle_profile(cuts: int = 0) -> Mesh:
    """L of legs 30 x 8 and 10 x 25 in local x and z, 36 long in y."""
    corners = np.array([(0, 0), (30, 0), (30, 8), (10, 8), (10, 25), (0, 25)], float)
    ends = [(0, 1, 3), (1, 2, 3), (0, 3, 4), (0, 4, 5)]
    faces = ends + [(a + 6, c + 6, b + 6) for a, b, c in ends]
    for i in range(6):
        j = (i + 1) % 6
        faces += [(i, i + 6, j), (j, i + 6, j + 6)]
    points = np.concatenate([np.insert(corners, 1, y, axis=1) for y in (0.0, 36.0)])
    mesh = trimesh.Trimesh(points, faces, process=False)
    for _ in range(cuts):
        mesh = mesh.subdivide()
    return Mesh(mesh.vertices @ TURN.T + ORIGIN, mesh.faces)


def boss(radius: float, sides: int) -> Mesh:
    """Plate 40 x 40 x 8 below local z = 0, with a round boss 12 high."""
    import manifold3d

    solids = []
    for mesh, z in ((trimesh.creation.box((40, 40, 8)), -4.0), (trimesh.creation.cylinder(radius, 13, sides), 5.5)):
        raw = manifold3d.Mesh64(mesh.vertices + [0, 0, z], np.array(mesh.faces, np.uint64))
        solids.append(manifold3d.Manifold(raw))
    joined = (solids[0] + solids[1]).to_mesh64()
    return Mesh(joined.vert_properties[:, :3] @ TURN.T + ORIGIN, joined.tri_verts.astype(np.int32))
