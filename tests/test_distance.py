"""Signed distance of points: against analytic truth, and on edges and vertices where signs are hard."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from cad_implicit.distance import MeshDistance
from cad_implicit.mesh import Mesh

ROTATION = trimesh.transformations.rotation_matrix(0.7, [1, 2, 0.5])


def as_mesh(shape, matrix=None):
    if matrix is not None:
        shape = shape.copy()
        shape.apply_transform(matrix)
    return Mesh(shape.vertices, shape.faces)


def box_distance(x, half):
    q = np.abs(x) - half
    return -(np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0))


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_box_is_exact_at_any_scale_and_place(scale, offset):
    half = np.array([1.0, 2.0, 3.0])
    shift = np.array([1.0, -1.0, 0.5]) * offset
    box = as_mesh(trimesh.creation.box(2 * half), ROTATION)
    mesh = Mesh((box.vertices + shift) * scale, box.faces)
    x = np.random.default_rng(1).normal(0, 3, (3000, 3))
    moved = (x @ ROTATION[:3, :3].T + shift) * scale
    value, gradient = MeshDistance(mesh).value_and_gradient(moved)
    truth = box_distance(x, half)
    tolerance = 1e-14 + 1e-16 * offset
    np.testing.assert_allclose(value / scale, truth, atol=10 * tolerance)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-12)
