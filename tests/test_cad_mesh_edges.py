"""Edges of meshes: found by angle, in lines between corners."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import cad_implicit as ci
from cad_implicit.cad.mesh_edges import segment

TURN = Rotation.from_euler("xyz", (23, 37, 11), degrees=True).as_matrix()


def turned(mesh: trimesh.Trimesh) -> ci.Mesh:
    return ci.Mesh(mesh.vertices @ TURN.T + (1.3, -4.7, 2.9), mesh.faces)


def test_box() -> None:
    found = ci.edges(turned(trimesh.creation.box((2, 3, 5)).subdivide()))
    assert [edge.number for edge in found] == list(range(1, 13))
    assert sorted(edge.length for edge in found) == pytest.approx([2] * 4 + [3] * 4 + [5] * 4)
    assert len({frozenset(edge.faces) for edge in found}) == 12
    assert set(np.concatenate([edge.faces for edge in found])) == set(range(1, 7))
    assert set(Counter(np.concatenate([edge.ends for edge in found]).tolist()).values()) == {3}
    for edge in found:
        assert edge.convexity == "convex"
        assert edge.curve == "line"
        assert edge.angles == pytest.approx(90)
        assert len(edge.points) == 3
        assert np.allclose(edge.direction, edge.tangents)
        assert np.allclose(edge.centre, edge.points.mean(axis=0))


def test_rims_of_a_tube() -> None:
    mesh = turned(trimesh.creation.annulus(3, 5, 4, sections=48))
    found = ci.edges(mesh)
    assert [edge.closed for edge in found] == [True] * 4
    assert {edge.curve for edge in found} == {"polyline"}
    assert {edge.convexity for edge in found} == {"convex"}
    assert sorted(round(edge.length) for edge in found) == [19, 19, 31, 31]
    for edge in found:
        assert edge.angles == pytest.approx(90)
        assert len(edge.points) == 49
        assert edge.direction is None
    assert segment(mesh, 25.0).max() == 4
    assert len(ci.edges(mesh, sharp=5.0)) == 4 * 48 + 2 * 48


def test_left_and_right() -> None:
    """In a dent the edges at its floor are concave; the left face is on the left."""
    outer, inner = trimesh.creation.box((6, 6, 6)), trimesh.creation.box((2, 2, 4))
    inner.apply_translation((0, 0, 2))
    mesh = turned(outer.difference(inner))
    distance = ci.MeshDistance(mesh)
    found = ci.edges(mesh)
    assert dict(Counter(edge.convexity for edge in found)) == {"convex": 16, "concave": 8}
    for edge in found:
        assert edge.angles == pytest.approx(270 if edge.convexity == "concave" else 90)
        point, along = edge.points.mean(axis=0), edge.tangents[0]
        for side, normal in zip((1, -1), edge.normals[0], strict=True):
            there = point + 0.1 * side * np.cross(normal, along)
            assert distance([there, there - 0.05 * normal]) == pytest.approx([0, 0.05], abs=1e-9)


def test_boundaries_and_edges_of_three() -> None:
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]
    open_mesh = ci.Mesh(vertices, [[0, 1, 2]])
    found = ci.edges(open_mesh)
    assert [edge.convexity for edge in found] == ["boundary"] * 3
    assert [edge.faces for edge in found] == [(1,)] * 3
    assert np.isnan([edge.angle for edge in found]).all()
    for edge in found:  # the face is on the left
        middle = edge.points.mean(axis=0)
        assert np.cross(edge.normals[0, 0], edge.tangents[0]) @ (np.array([0.3, 0.3, 0]) - middle) > 0
    fan = ci.Mesh(vertices, [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    assert dict(Counter(edge.convexity for edge in ci.edges(fan))) == {"nonmanifold": 1, "boundary": 6}


def test_smooth_meshes_have_none() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    with pytest.raises(ci.errors.SelectorError, match="the part has no edges"):
        ci.edges(ball)
    with pytest.raises(ValueError, match="between 0 and 180"):
        ci.edges(ball, sharp=180)
