"""Two-sided distance between meshes, against shapes whose distance is known."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import trimesh

from cad_implicit.comparison import compare, surface_samples
from cad_implicit.mesh import Mesh

ROTATION = trimesh.transformations.rotation_matrix(0.9, [1, 3, -0.5])


def as_mesh(shape):
    shape.apply_transform(ROTATION)
    return Mesh(shape.vertices, shape.faces)


def test_mesh_with_itself():
    mesh = as_mesh(trimesh.creation.torus(10, 3))
    same = compare(mesh, mesh, samples=2000)
    assert same.maximum < 1e-13
    assert same.volume_difference == 0


def test_concentric_spheres():
    small, large = (as_mesh(trimesh.creation.icosphere(subdivisions=4, radius=r)) for r in (1.0, 1.25))
    result = compare(small, large, samples=5000)
    chord = 0.002  # sag of the facets of icosphere 4, radius 1.25
    for way in (result, result.a_to_b, result.b_to_a):
        assert 0.25 - chord < way.mean <= way.rms <= way.p99 <= way.maximum < 0.25 + chord
    assert result.volume_difference == pytest.approx(4 / 3 * math.pi * (1.25**3 - 1), rel=0.01)
    assert result.volume_difference_relative == pytest.approx(1.25**3 - 1, rel=1e-9)
    assert (result.area_a, result.area_b) == (small.area, large.area)


def test_a_pin_shows_one_way_only():
    plain = as_mesh(trimesh.creation.box((10, 10, 10)))
    pin = as_mesh(trimesh.creation.box((0.2, 0.2, 2), transform=trimesh.transformations.translation_matrix([1, 2, 6])))
    both = Mesh(
        np.concatenate([plain.vertices, pin.vertices]), np.concatenate([plain.faces, pin.faces + len(plain.vertices)])
    )
    result = compare(plain, both, samples=20_000)
    assert result.a_to_b.maximum < 1e-13
    assert result.b_to_a.maximum == result.maximum == pytest.approx(2.0, abs=1e-12)
    x = np.array(result.place) @ ROTATION[:3, :3]
    assert x[2] == pytest.approx(7.0)
    assert abs(x[:2] - [1, 2]).max() < 0.11
    assert result.rms < 0.1


@pytest.mark.nojit
def test_figures_are_plain_json():
    mesh = as_mesh(trimesh.creation.box())
    figures = json.loads(json.dumps(compare(mesh, mesh, samples=10).as_dict()))
    assert len(figures["place"]) == 3
    assert set(figures["a_to_b"]) == {"maximum", "mean", "rms", "p99", "place"}


def test_samples_are_uniform_over_the_area_and_reproducible():
    vertices = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 0.01]])
    mesh = Mesh(vertices, [[0, 1, 2], [0, 2, 3]])
    points, triangle = surface_samples(mesh, 4000)
    np.testing.assert_array_equal(points, surface_samples(mesh, 4000)[0])
    np.testing.assert_allclose(points.mean(axis=0), [1, 2 / 3, 0], atol=0.03)
    assert np.bincount(triangle)[0] > 3900
    assert (points[:, 0] / 3 + points[:, 1] / 2 <= 1 + 1e-12).all()


def test_progress_cancels():
    def cancel(stage, fraction):
        raise KeyboardInterrupt(stage)

    mesh = as_mesh(trimesh.creation.box())
    with pytest.raises(KeyboardInterrupt, match="compare"):
        compare(mesh, mesh, progress=cancel)


def test_no_samples_is_an_error():
    mesh = as_mesh(trimesh.creation.box())
    with pytest.raises(ValueError, match="at least 1, not 0"):
        compare(mesh, mesh, samples=0)
