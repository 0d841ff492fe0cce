"""Edges that triangles share, where they are bent, and volumes of shells, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit import Mesh, box, contour, sphere
from cad_implicit.kernels.edges import bent_sides, cone_volumes, paired_sides


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    """Two boxes and a sphere, turned, with triangles in any order, some of them gone."""
    parts = [contour(box((4, 3, 2)), 0.5), contour(sphere(2.0), 0.4), contour(box((1, 1, 1)), 0.3)]
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    vertices, faces = [], []
    for number, part in enumerate(parts):
        faces.append(part.faces + sum(map(len, vertices)))
        vertices.append((part.vertices + 7 * number) @ (turn * np.sign(np.linalg.det(turn))))
    order = np.random.default_rng(2).permutation(sum(map(len, faces)))
    return Mesh(np.concatenate(vertices), np.concatenate(faces)[order[:-20]])


def sorted_sides(mesh: Mesh) -> np.ndarray:
    ends = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    order = np.lexsort([ends[:, 1], ends[:, 0]])
    alike = np.flatnonzero((ends[order[1:]] == ends[order[:-1]]).all(axis=1))
    return np.stack([order[alike], order[alike + 1]], axis=1)


def test_sides_of_shared_edges_come_in_the_order_of_their_vertices(mesh: Mesh) -> None:
    expected = sorted_sides(mesh)
    assert 2 * len(expected) < 3 * len(mesh.faces)  # some edges are open
    np.testing.assert_array_equal(paired_sides(len(mesh.vertices), mesh.faces), expected)


def test_an_edge_of_three_triangles_is_there_twice() -> None:
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], np.int32)
    np.testing.assert_array_equal(paired_sides(5, faces), [[0, 3], [3, 6]])


def test_bent_edges(mesh: Mesh) -> None:
    sides = sorted_sides(mesh)
    normal = mesh.face_vectors / np.linalg.norm(mesh.face_vectors, axis=1, keepdims=True)
    cosine = (normal[sides // 3][:, 0] * normal[sides // 3][:, 1]).sum(axis=1)
    flat = 0.99
    assert np.abs(cosine - flat).min() > 1e-9
    assert 0 < (cosine < flat).sum() < len(sides)
    np.testing.assert_array_equal(bent_sides(mesh.vertices, mesh.faces, flat), sides[cosine < flat])


def test_edges_of_triangles_without_area_are_bent() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], float)
    faces = np.array([[0, 1, 2], [1, 0, 3]], np.int32)
    np.testing.assert_array_equal(bent_sides(vertices, faces, 0.99), [[0, 3]])


def test_volumes_by_shell(mesh: Mesh) -> None:
    corners = mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0)
    cones = np.linalg.det(corners) / 6
    expected = np.bincount(mesh.component_of_face, cones)
    volumes = cone_volumes(mesh.vertices, mesh.faces, mesh.vertices.mean(axis=0), mesh.component_of_face, len(expected))
    np.testing.assert_allclose(volumes, expected, rtol=0, atol=1e-10)
    assert mesh.volume == pytest.approx(expected.sum(), abs=1e-10)
