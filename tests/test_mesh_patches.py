"""Free-form faces of meshes: beside the surfaces that they came from, and one tangent across their borders."""

from __future__ import annotations

import numpy as np
import pytest
from sheets import AXIS, SHEETS, SHIFT, TURN, at, sheet, wave

from cad_implicit import MeshDistance
from cad_implicit.cad.mesh_edges import segment_and_join
from cad_implicit.mesh import Mesh
from cad_implicit.mesh_patches import MeshPatch, vertex_normals

#: Largest error in mm within 0.25 mm of surfaces with curvatures up to 2.3, in coarse triangles and ones half as long,
#: somewhat above what was measured; that of plain triangles is 2 to 100 times that.
ERRORS = {"cylinder": (3e-4, 2e-5), "cone": (3e-3, 2e-4), "sphere": (6e-4, 4e-5), "torus": (5e-3, 5e-4)}


def patch(mesh: Mesh, reach: float = 3.0) -> MeshPatch:
    return MeshPatch(mesh, segment_and_join(mesh, 25.0)[1], reach)


def finer(places: np.ndarray, times: int) -> np.ndarray:
    return np.linspace(places[0], places[-1], times * (len(places) - 1) + 1)


@pytest.mark.parametrize("name", ERRORS)
def test_beside_known_surfaces(name: str) -> None:
    surface, u, v, face = SHEETS[name]
    rng = np.random.default_rng(3)
    x = at(surface, rng.uniform(u[0], u[-1], 1000), rng.uniform(v[0], v[-1], 1000))
    x -= rng.uniform(-0.25, 0.25, (1000, 1)) * face.value_and_gradient(x)[1]
    for times, largest in zip((1, 2), ERRORS[name], strict=True):
        mesh = sheet(surface, finer(u, times), finer(v, times))
        value, gradient = patch(mesh).value_and_gradient(x)
        expected, direction = face.value_and_gradient(x)
        assert largest / 20 < np.abs(value - expected).max() < largest
        assert np.linalg.norm(gradient, axis=1) == pytest.approx(1.0)
        assert np.abs(gradient - direction).max() < 100 * largest
        assert np.abs(MeshDistance(mesh, sign="pseudonormal")(x) - expected).max() > 1.5 * largest


def test_vertex_normals_at_borders() -> None:
    surface, u, v, face = SHEETS["sphere"]
    mesh = sheet(surface, u, v)
    off = np.linalg.norm(vertex_normals(mesh) + face.value_and_gradient(mesh.vertices)[1], axis=1)
    assert off.max() < 2e-2
    assert np.median(off) < 3e-3


def test_continuation_is_tangent() -> None:
    """Across the border values and gradients go on; along straight lines from it the surface stays."""
    mesh = sheet(wave, np.linspace(0, 3, 31), np.linspace(0, 2, 21))
    face = patch(mesh)
    places = np.linspace(0.15, 1.85, 40)
    for side in (0, 1):
        border, step = np.array([3.0 * side]), 1e-4
        base, inner = at(wave, border, places), at(wave, border + (1 - 2 * side) * step, places)
        along = (at(wave, border, places + step) - base) / step
        away = (base - inner) / step
        normal = np.cross(away, along) * (2 * side - 1)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        outward = np.cross(along, normal) * (2 * side - 1)
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        for height in (0.0, -0.4, 0.4):
            line = [base + distance * outward + height * normal for distance in (-1e-6, 1e-6, 0.5, 2.0)]
            values, gradients = zip(*(face.value_and_gradient(x) for x in line), strict=True)
            assert np.abs(values[1] - values[0]).max() < 1e-5
            assert np.abs(gradients[1] - gradients[0]).max() < 1e-4
            assert np.abs(np.array(values) + height).max() < 2.5e-2
            assert np.abs(np.array(gradients) + normal).max() < 3e-2


def test_beyond_its_reach() -> None:
    """Where the continuation ends, so do not values: they go on as the tangent plane."""
    mesh = sheet(lambda u, v: (u, v, 0 * u), np.linspace(0, 3, 4), np.linspace(0, 2, 3))
    face = patch(mesh, 1.0)
    x = SHIFT + np.array([[9.0, 1.0, 0.7], [-9.0, -9.0, -2.0], [1.0, 1.0, 0.2]]) @ TURN.T
    value, gradient = face.value_and_gradient(x)
    assert value == pytest.approx([-0.7, 2.0, -0.2])
    assert gradient == pytest.approx(np.tile(-AXIS, (3, 1)))


def test_slender_strips() -> None:
    """Twisted ruled strips with corners on two borders only, 60 times as long as wide: nowhere worse than triangles."""
    mesh = sheet(lambda u, v: (u, v, 0.02 * u * v + 0.1 * np.sin(u)), np.linspace(0, 4, 33), np.array([0.0, 8.0]))
    rng = np.random.default_rng(6)
    u, v = rng.uniform(0, 4, 500), rng.uniform(0, 8, 500)
    x = at(lambda u, v: (u, v, 0.02 * u * v + 0.1 * np.sin(u)), u, v)
    assert np.abs(patch(mesh)(x)).max() < np.abs(MeshDistance(mesh, sign="pseudonormal")(x)).max() < 6e-3
