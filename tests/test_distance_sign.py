"""Inside or outside: pseudonormals on nasty polyhedra, winding numbers where they do not help, and when to warn."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from distance_twins import (
    ROTATION,
    as_mesh,
    box_distance,
    box_with_flat_triangles,
    brute_winding,
    flat_wedge,
    joined,
    points_around,
    soup,
    spiky,
)

from cad_implicit.distance import MeshDistance
from cad_implicit.errors import GeometryWarning
from cad_implicit.mesh import Mesh


def moved(shape, *shift):
    return shape.copy().apply_translation(shift)


NASTY = {
    "spiky 1": spiky(1),
    "spiky 2": spiky(2),
    "thin wedge": flat_wedge(0.01),
    "very thin wedge": flat_wedge(1e-6),
    "needle": as_mesh(trimesh.creation.cone(0.01, 10, sections=7)),
    "fan": as_mesh(trimesh.creation.cylinder(1, 0.01, sections=400)),
    "corner to corner": joined(trimesh.creation.box(), moved(trimesh.creation.box(), 1, 1, 1)),
    "cavity": joined(trimesh.creation.icosphere(radius=2), trimesh.creation.icosphere(radius=1).copy()),
}
cavity = trimesh.creation.icosphere(radius=1)
cavity.invert()
NASTY["cavity"] = joined(trimesh.creation.icosphere(radius=2), cavity)


@pytest.mark.parametrize("name", NASTY)
@pytest.mark.parametrize("sign", ["pseudonormal", "winding"])
def test_sign_against_exact_winding_numbers(name, sign):
    mesh = NASTY[name]
    x = points_around(mesh, 1, 1500)
    value = MeshDistance(mesh, sign=sign)(x)
    number = brute_winding(mesh, x)
    clear = abs(value) > 1e-9 * mesh.diagonal  # nearer, the sum of angles itself is rounded
    np.testing.assert_array_equal((value > 0)[clear], (number > 0.5)[clear])


def test_flat_triangles_do_not_spoil_the_sign():
    mesh = box_with_flat_triangles()
    assert mesh.open_edges == 0
    half = np.array([1.0, 2.0, 3.0])
    x = points_around(mesh, 2, 3000)
    distance = MeshDistance(mesh)
    assert distance.sign == "pseudonormal"
    value, gradient = distance.value_and_gradient(x)
    np.testing.assert_allclose(value, box_distance(x @ ROTATION[:3, :3], half), atol=1e-13)
    assert np.isfinite(gradient).all()


def test_winding_numbers_against_all_triangles():
    for mesh in (soup(1), NASTY["spiky 1"], as_mesh(trimesh.creation.torus(3, 1))):
        x = points_around(mesh, 3, 500)
        number = MeshDistance(mesh, sign="winding").winding(x)
        np.testing.assert_allclose(number, brute_winding(mesh, x), atol=0.06)


def test_an_open_mesh_is_told_and_closed_by_winding_numbers():
    ball = trimesh.creation.icosphere(subdivisions=3)
    lidless = Mesh(ball.vertices, ball.faces[ball.triangles_center[:, 2] < 0.9])
    with pytest.warns(GeometryWarning, match=rf"not closed: {lidless.open_edges} edges"):
        distance = MeshDistance(lidless)
    assert distance.sign == "winding"
    x = np.random.default_rng(4).normal(0, 1, (2000, 3))
    radius = np.linalg.norm(x, axis=1)
    below = x[:, 2] < 0.8
    np.testing.assert_array_equal(distance(x[below]) > 0, brute_winding(lidless, x[below]) > 0.5)
    assert (distance(x[below & (radius < 0.9)]) > 0).all()
    assert (distance(x[radius > 1.01]) < 0).all()


@pytest.mark.nojit
def test_overlapping_solids_are_told():
    mesh = joined(trimesh.creation.box(), moved(trimesh.creation.box(), 0.5, 0.3, 0.2))
    with pytest.warns(GeometryWarning, match="overlaps itself"):
        distance = MeshDistance(mesh)
    assert distance.sign == "winding"
    value = distance([[0.25, 0.2, 0.1], [-0.4, 0, 0], [0.9, 0.5, 0.5], [1.5, 0, 0]])
    assert (value > 0).tolist() == [True, True, True, False]


def test_touching_solids_are_told():
    mesh = joined(trimesh.creation.box(), moved(trimesh.creation.box(), 1, 0, 0))
    with pytest.warns(GeometryWarning, match="overlaps"):
        distance = MeshDistance(mesh)
    x = np.random.default_rng(5).uniform([-0.49, -0.49, -0.49], [1.49, 0.49, 0.49], (500, 3))
    assert (distance(x) > 0).all()


def test_a_part_that_is_inside_out_is_told():
    flipped = moved(trimesh.creation.box(), 3, 0, 0)
    flipped.invert()
    with pytest.warns(GeometryWarning, match="inside out"):
        MeshDistance(joined(trimesh.creation.box(), flipped))


@pytest.mark.nojit
def test_inside_out_as_a_whole_is_the_complement():
    ball = trimesh.creation.icosphere()
    ball.invert()
    distance = MeshDistance(Mesh(ball.vertices, ball.faces))
    assert (distance([[0, 0, 0], [0, 0, 9.0]]) > 0).tolist() == [False, True]


@pytest.mark.nojit
def test_a_mesh_without_area_is_told():
    mesh = Mesh(np.outer(np.arange(3.0), [1, 2, 3]), [[0, 1, 2], [0, 2, 1]])
    with pytest.warns(GeometryWarning, match="no area"):
        distance = MeshDistance(mesh)
    assert distance([[0, 0, 1.0]])[0] < 0
