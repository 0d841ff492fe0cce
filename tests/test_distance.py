"""Distance of points to meshes: against analytic truth, and against every triangle one by one."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
import trimesh
from distance_twins import (
    ROTATION,
    as_mesh,
    box_distance,
    brute_distance,
    points_around,
    soup,
    spiky,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cad_implicit.distance import MeshDistance
from cad_implicit.mesh import Mesh

HALF = np.array([1.0, 2.0, 3.0])


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_box_is_exact_at_any_scale_and_place(scale, offset):
    shift = np.array([1.0, -1.0, 0.5]) * offset
    box = as_mesh(trimesh.creation.box(2 * HALF))
    mesh = Mesh((box.vertices + shift) * scale, box.faces)
    x = np.random.default_rng(1).normal(0, 3, (3000, 3))
    value, gradient = MeshDistance(mesh).value_and_gradient((x @ ROTATION[:3, :3].T + shift) * scale)
    rounding = 1e-14 + 1e-15 * offset
    np.testing.assert_allclose(value / scale, box_distance(x, HALF), atol=rounding)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("distance", [1e3, 1e8, 1e15, 1e30])
def test_points_far_away(distance):
    mesh = as_mesh(trimesh.creation.icosphere(subdivisions=2))
    x = np.random.default_rng(2).normal(size=(50, 3))
    x *= distance / np.linalg.norm(x, axis=1)[:, None]
    value, gradient = MeshDistance(mesh).value_and_gradient(x)
    np.testing.assert_allclose(-value, brute_distance(mesh, x).min(axis=1), rtol=1e-12)
    np.testing.assert_allclose(gradient, -x / distance, atol=2 / distance + 1e-12)


def test_sphere_within_the_sag_of_its_facets():
    mesh = as_mesh(trimesh.creation.icosphere(subdivisions=4, radius=2.0))
    x = np.random.default_rng(3).normal(0, 2, (4000, 3))
    error = MeshDistance(mesh)(x) - (2 - np.linalg.norm(x, axis=1))
    sag = 2 - np.linalg.norm(mesh.vertices[mesh.faces].mean(axis=1), axis=1).min()
    assert 0 < sag < 0.005
    assert error.max() < 1e-12
    assert error.min() > -sag - 1e-12


def test_torus_within_the_sag_of_its_facets():
    shape = trimesh.creation.torus(3, 1, major_sections=256, minor_sections=128)
    x = np.random.default_rng(4).normal(0, 2, (4000, 3))
    truth = 1 - np.hypot(np.hypot(x[:, 0], x[:, 1]) - 3, x[:, 2])
    error = MeshDistance(as_mesh(shape))(x @ ROTATION[:3, :3].T) - truth
    sag = 4 * (1 - math.cos(math.pi / 256)) + 1 - math.cos(math.pi / 128)
    assert abs(error).max() < sag


@pytest.mark.nojit
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_closest_point_against_every_triangle_of_a_soup(seed, offset):
    near = soup(seed)
    mesh = Mesh(near.vertices + offset, near.faces)
    x = points_around(mesh, seed, 400)
    found = MeshDistance(mesh, sign="winding").closest(x)
    truth = brute_distance(mesh, x)
    rounding = 1e-13 * mesh.diagonal + 4e-16 * offset
    np.testing.assert_allclose(found.distance, truth.min(axis=1), atol=rounding, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(x - found.point, axis=1), found.distance, atol=rounding, rtol=1e-12)
    named = truth[np.arange(len(x)), found.triangle]
    np.testing.assert_allclose(named, found.distance, atol=rounding, rtol=1e-12)


def test_compiled_distances_are_those_of_the_interpreter_to_the_last_bit(tmp_path):
    # So they depend neither on the processor nor on what else has been compiled.
    mesh = as_mesh(trimesh.creation.torus(3, 1, major_sections=16, minor_sections=7))
    x = np.random.default_rng(5).normal(0, 3, (300, 3))
    np.savez(tmp_path / "given.npz", vertices=mesh.vertices, faces=mesh.faces, x=x)
    code = (
        "import numpy as np; from cad_implicit.distance import MeshDistance; from cad_implicit.mesh import Mesh\n"
        "given = np.load('given.npz'); distance = MeshDistance(Mesh(given['vertices'], given['faces']))\n"
        "found = distance.closest(given['x']); np.savez('found.npz', value=distance(given['x']), point=found.point)"
    )
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)
    distance, found = MeshDistance(mesh), np.load(tmp_path / "found.npz")
    assert distance(x).tobytes() == found["value"].tobytes()
    assert distance.closest(x).point.tobytes() == found["point"].tobytes()


@pytest.mark.nojit
@pytest.mark.parametrize("count", [1, 3, 4, 5, 8, 9, 33])
def test_trees_of_any_size(count):
    whole = soup(9)
    mesh = Mesh(whole.vertices[: 3 * count], whole.faces[:count])
    x = np.random.default_rng(count).normal(size=(200, 3))
    value = MeshDistance(mesh, sign="winding").unsigned(x)
    np.testing.assert_allclose(value, brute_distance(mesh, x).min(axis=1), atol=1e-14)


def test_thousands_of_triangles_in_one_place():
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    mesh = Mesh(np.tile(triangle, (5000, 1)), np.arange(15000).reshape(-1, 3))
    found = MeshDistance(mesh, sign="winding").closest([[0.2, 0.2, 1.0], [5, 5, 5]])
    np.testing.assert_allclose(found.distance[0], 1)
    assert found.triangle.tolist() == [0, 0]  # of equals the first


def test_triangles_that_halve_in_size_forever():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]]) + [1, 1, 1]
    size = 2.0 ** -np.arange(300)[:, None, None]
    mesh = Mesh((corners * size).reshape(-1, 3), np.arange(900).reshape(-1, 3))
    x = np.random.default_rng(5).normal(size=(100, 3))
    value = MeshDistance(mesh, sign="winding").unsigned(x)
    np.testing.assert_allclose(value, brute_distance(mesh, x).min(axis=1), atol=1e-14)


def test_within_agrees_with_the_distance():
    mesh = spiky(1)
    distance = MeshDistance(mesh, sign="pseudonormal")
    x = points_around(mesh, 6, 1000)
    truth = distance.unsigned(x)
    x, truth = x[truth > 1e-5], truth[truth > 1e-5]
    for factor in (1 - 1e-9, 1 + 1e-9):
        np.testing.assert_array_equal(distance.within(x, truth * factor), factor > 1)
    np.testing.assert_array_equal(distance.within(x, 0.3), truth < 0.3)


def test_gradient_is_that_of_the_value():
    mesh = as_mesh(trimesh.creation.torus(3, 1, major_sections=24, minor_sections=12))
    distance = MeshDistance(mesh)
    x = np.random.default_rng(7).normal(0, 2, (500, 3))
    value, gradient = distance.value_and_gradient(x)
    difference = np.stack([(distance(x + e) - distance(x - e)) / 2e-6 for e in np.eye(3) * 1e-6], axis=1)
    smooth = np.linalg.norm(difference, axis=1) > 1 - 1e-6  # away from the medial axis
    assert smooth.mean() > 0.95
    np.testing.assert_allclose(gradient[smooth], difference[smooth], atol=1e-4)
    np.testing.assert_array_equal(distance.gradient(x), gradient)
    np.testing.assert_array_equal(distance(x), value)


@pytest.mark.nojit
def test_on_the_surface_the_gradient_is_the_pseudonormal():
    box = trimesh.creation.box((2, 2, 2))
    distance = MeshDistance(Mesh(box.vertices, box.faces))
    x = np.array([[1, 0.2, 0.3], [1, 1, 0.3], [1, 1, 1]])
    expected = -np.array([[1, 0, 0], [0.5**0.5, 0.5**0.5, 0], [3**-0.5] * 3])
    value, gradient = distance.value_and_gradient(x)
    np.testing.assert_allclose(value, 0, atol=1e-15)
    np.testing.assert_allclose(gradient, expected, atol=1e-15)
    np.testing.assert_allclose(distance.closest(x).normal, -expected, atol=1e-15)


@pytest.mark.parametrize("sign", ["pseudonormal", "winding"])
def test_independent_of_threads_and_of_the_order_of_points(sign):
    mesh = spiky(2)
    x = points_around(mesh, 8, 2000)
    one, two = (MeshDistance(mesh, sign=sign, threads=n) for n in (1, 2))
    value, gradient = one.value_and_gradient(x)
    for a, b in zip((value, gradient), two.value_and_gradient(x), strict=True):
        np.testing.assert_array_equal(a, b)
    order = np.random.default_rng(0).permutation(len(x))
    np.testing.assert_array_equal(one(x[order]), value[order])
    np.testing.assert_array_equal(one.closest(x[order]).triangle, one.closest(x).triangle[order])


def test_points_that_are_not_finite_get_nan():
    distance = MeshDistance(as_mesh(trimesh.creation.box()))
    x = [[math.nan, 0, 0], [0, 0, 0], [math.inf, 0, 0]]
    for value in (distance(x), distance.unsigned(x), distance.closest(x).distance, distance.closest(x).normal[:, 0]):
        assert np.isnan(value).tolist() == [True, False, True]


def test_wrong_arguments():
    mesh = as_mesh(trimesh.creation.box())
    with pytest.raises(ValueError, match="sideways"):
        MeshDistance(mesh, sign="sideways")
    with pytest.raises(ValueError, match=r"\(N, 3\), not \(3,\)"):
        MeshDistance(mesh)([0, 0, 0])


@pytest.mark.nojit
def test_no_points():
    value, gradient = MeshDistance(as_mesh(trimesh.creation.box())).value_and_gradient(np.zeros((0, 3)))
    assert value.shape == (0,)
    assert gradient.shape == (0, 3)


SPIKY = MeshDistance(spiky(3), sign="pseudonormal")
REVERSED = MeshDistance(Mesh(SPIKY.mesh.vertices, SPIKY.mesh.faces[:, ::-1]), sign="pseudonormal")
PAIRS = arrays(np.float64, (20, 2, 3), elements=st.floats(-4, 4, width=32))


@given(PAIRS)
@settings(max_examples=100, deadline=None)
def test_the_signed_distance_is_1_lipschitz(pairs):
    x, y = pairs[:, 0], pairs[:, 1]
    assert (abs(SPIKY(x) - SPIKY(y)) <= np.linalg.norm(x - y, axis=1) + 1e-12).all()


@given(PAIRS)
@settings(max_examples=50, deadline=None)
def test_turning_the_faces_turns_the_sign(pairs):
    x = pairs[:, 0]
    np.testing.assert_allclose(REVERSED(x), -SPIKY(x), atol=1e-14)


def test_a_clean_mesh_gives_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert MeshDistance(as_mesh(trimesh.creation.torus(3, 1))).sign == "pseudonormal"
