"""Slow NumPy twins of the distance kernels, every point against every triangle, and meshes that are hard on both."""

from __future__ import annotations

import numpy as np
import trimesh

from cad_implicit.mesh import Mesh

ROTATION = trimesh.transformations.rotation_matrix(0.7, [1, 2, 0.5])


def as_mesh(shape, matrix=ROTATION):
    vertices = np.asarray(shape.vertices) @ matrix[:3, :3].T + matrix[:3, 3]
    return Mesh(vertices, shape.faces)


def joined(*shapes):
    """One mesh of several shapes, as they are."""
    start = np.cumsum([0] + [len(s.vertices) for s in shapes])
    faces = [np.asarray(s.faces) + n for s, n in zip(shapes, start, strict=False)]
    return Mesh(np.concatenate([s.vertices for s in shapes]), np.concatenate(faces))


def on_segments(x, a, b):
    """Closest points (N, F, 3) on segments."""
    u = b - a
    length2 = (u**2).sum(axis=1)
    t = ((x[:, None] - a) * u).sum(axis=2) / np.where(length2 > 0, length2, 1)
    return a + np.clip(t, 0, 1)[..., None] * u


def brute_distance(mesh, x):
    """Distances (N, F) of points to triangles: to the edges, and to the plane where the foot is inside."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    best = np.full((len(x), len(a)), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        best = np.minimum(best, np.linalg.norm(x[:, None] - on_segments(x, p, q), axis=2))
    n = np.cross(b - a, c - a)
    area = np.linalg.norm(n, axis=1)
    longest = np.linalg.norm(np.stack([b - a, c - b, a - c]), axis=2).max(axis=0)
    n = n / np.where(area > 0, area, 1)[:, None]
    height = ((x[:, None] - a) * n).sum(axis=2)
    foot = x[:, None] - height[..., None] * n
    inside = np.broadcast_to(area > 1e-10 * longest**2, best.shape).copy()
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (np.cross(q - p, foot - p) * n).sum(axis=2) > 0
    return np.where(inside, np.minimum(best, np.abs(height)), best)


def brute_winding(mesh, x):
    """Winding numbers (N,): solid angles of all triangles."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] - x[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    triple = (a * np.cross(b, c)).sum(axis=2)
    below = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
    return np.arctan2(triple, below).sum(axis=1) / (2 * np.pi)


def soup(seed, count=40):
    """Random triangles of very different size and shape: slivers, needles, points, some of them twice."""
    random = np.random.default_rng(seed)
    corners = random.normal(size=(count, 1, 3)) + random.normal(size=(count, 3, 3)) * 10 ** random.uniform(
        -4, 0.5, (count, 1, 1)
    )
    corners[0, 1] = corners[0, 0]  # an edge
    corners[1, 1:] = corners[1, 0]  # a point
    corners[2, 2] = corners[2, 0] * 0.25 + corners[2, 1] * 0.75  # a flat triangle
    corners[3, 2] = corners[3, 0] + (corners[3, 1] - corners[3, 0]) * 0.3 + random.normal(size=3) * 1e-9
    corners[4, 2] = corners[4, 1] + random.normal(size=3) * 1e-12
    corners[5] = corners[6]
    corners[7] = corners[8][::-1]
    return Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def spiky(seed):
    """A ball whose vertices are pulled out and pushed in at random: needles, and saddles of thin wedges."""
    ball = trimesh.creation.icosphere(subdivisions=2)
    radius = np.random.default_rng(seed).uniform(0.05, 3.0, len(ball.vertices))
    return Mesh(ball.vertices * radius[:, None], ball.faces)


def flat_wedge(thickness):
    """A tetrahedron of two nearly parallel pairs of faces: all edges but two are very acute or very obtuse."""
    vertices = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, thickness], [0, 1, thickness]])
    return Mesh(vertices @ ROTATION[:3, :3].T, [[0, 1, 2], [1, 0, 3], [2, 3, 0], [3, 2, 1]][::1])


def box_with_flat_triangles():
    """A closed box of half sizes 1, 2, 3 with an edge cut in one of its faces only; a flat triangle fills the gap."""
    box = trimesh.creation.box((2, 4, 6))
    vertices, faces = np.asarray(box.vertices), np.asarray(box.faces)
    t = int(np.argmax([1 for _ in faces]))
    a, b, c = faces[t]
    middle = len(vertices)
    vertices = np.concatenate([vertices, [(vertices[a] + vertices[b]) / 2]])
    new = [[a, middle, c], [middle, b, c], [a, b, middle]]
    faces = np.concatenate([np.delete(faces, t, axis=0), new])
    return Mesh(vertices @ ROTATION[:3, :3].T, faces)


def box_distance(x, half):
    """Signed distance to a box about the origin, positive inside."""
    q = np.abs(x) - half
    return -(np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0))


def points_around(mesh, seed, count):
    """Points at all distances: around, close to the surface, and close to edges and vertices."""
    random = np.random.default_rng(seed)
    size = mesh.diagonal
    corners = mesh.vertices[mesh.faces[random.integers(0, len(mesh.faces), count)]]
    weight = random.dirichlet([1, 1, 1], count)
    weight[: count // 3, 0] = 0  # edges
    weight[: count // 6] = [0, 0, 1]  # vertices
    weight /= weight.sum(axis=1)[:, None]
    at = (weight[:, :, None] * corners).sum(axis=1)
    shift = random.normal(size=(count, 3)) * size * 10 ** random.uniform(-7, 0, (count, 1))
    return np.concatenate([at + shift, mesh.bounds.mean(axis=0) + random.normal(size=(count // 4, 3)) * size])
