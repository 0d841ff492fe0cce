"""Booleans of Implicits against manifold3d's exact ones, with sharp intersection curves; simplified meshes."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import shapes

import cad_implicit as ci
from cad_implicit.errors import EmptyResultError, OpenMeshError, SpacingError

H = 0.6


def solids() -> tuple[manifold3d.Manifold, manifold3d.Manifold]:
    cylinder = manifold3d.Manifold.cylinder(24, 4, 4, 720, True).rotate([60, 20, 0])
    return shapes.box([-7, -6, -5], [7, 6, 5]), cylinder


@pytest.mark.parametrize("name", ["union", "intersection", "difference"])
def test_against_exact_booleans(name: str) -> None:
    a, b = solids()
    truth = shapes.as_mesh({"union": a + b, "intersection": a ^ b, "difference": a - b}[name])
    p, q = (ci.MeshDistance(shapes.as_mesh(s)) for s in (a, b))
    result = {"union": p | q, "intersection": p & q, "difference": p - q}[name]
    mesh = ci.contour(result, H)
    assert mesh.is_watertight
    assert (mesh.components, mesh.genus) == (truth.components, truth.genus)
    assert mesh.volume == pytest.approx(truth.volume, rel=5e-3)
    assert ci.MeshDistance(truth).unsigned(mesh.vertices).max() < 0.01 * H
    edges = sharp_points(truth)
    assert np.percentile(ci.MeshDistance(mesh).unsigned(edges), 99.9) < 0.05 * H


def sharp_points(mesh: ci.Mesh) -> np.ndarray:
    """Middles of the edges at which the normal turns by more than 30 degrees."""
    normals = mesh.face_vectors / np.linalg.norm(mesh.face_vectors, axis=1)[:, None]
    ends = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    order = np.lexsort(ends.T)
    one, other = order[::2], order[1::2]
    turn = (normals[one // 3] * normals[other // 3]).sum(axis=1)
    return np.asarray(mesh.vertices[ends[one[turn < np.cos(np.pi / 6)]]].mean(axis=1))


def test_operations_go_on_from_booleans() -> None:
    p, q = (ci.MeshDistance(shapes.as_mesh(s)) for s in solids())
    joined = p | q
    filleted = ci.fillet(joined, 1.5, spacing=H)
    mesh = ci.contour(filleted)
    assert mesh.is_watertight
    assert mesh.volume > ci.contour(joined, H).volume


def test_functions_in_the_plane() -> None:
    disc = ci.Function(lambda x: 2 - np.linalg.norm(x, axis=1), [[-2, -2], [2, 2]], lipschitz=1.0)
    half = ci.Function(lambda x: x[:, 0], [[-3, -3], [3, 3]], lipschitz=1.0)
    both = disc & half
    assert both.lipschitz == 1.0
    assert both([[1, 0], [-1, 0], [3, 0]]) == pytest.approx([1, -1, -1])
    assert (disc - half)([[-1, 0], [1, 0]]) == pytest.approx([1, -1])
    assert both.gradient([[0.1, 0.0]]) == pytest.approx(np.array([[1.0, 0.0]]), abs=1e-6)
    with pytest.raises(EmptyResultError, match="do not meet"):
        _ = disc & ci.Function(half, [[5, 5], [6, 6]])
    with pytest.raises(ValueError, match="2-D and one in 3-D"):
        _ = disc | ci.MeshDistance(shapes.notch(90, 20))


def test_simplify_keeps_the_tolerance() -> None:
    mesh = ci.run(shapes.boss(5, 12, 10, 90), "fillet", 2, spacing=0.5).mesh
    fewer = ci.simplify(mesh, 0.01)
    assert fewer.is_watertight
    assert len(fewer.faces) < 0.3 * len(mesh.faces)
    assert ci.compare(mesh, fewer).maximum < 0.02
    with pytest.raises(SpacingError, match="positive"):
        ci.simplify(mesh, 0)
    with pytest.raises(OpenMeshError):
        ci.simplify(ci.Mesh(mesh.vertices, mesh.faces[1:]), 0.01)
