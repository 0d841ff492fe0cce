"""Contoured meshes against analytic parts, off the axes: faces, sharp edges, corners, thin walls, odd functions."""

from __future__ import annotations

import numpy as np
import pytest
from dual_oracles import (
    PARTS,
    FloatArray,
    Placed,
    ball,
    box,
    broken_edges,
    circle,
    disc,
    distance_to_mesh,
    extrusion,
    minus,
    polygon,
    self_intersections,
    smallest_angles,
    status,
)
from numpy.typing import ArrayLike

from cad_implicit.dual import dual_contour
from cad_implicit.errors import EmptyResultError
from cad_implicit.implicit import Function, Implicit
from cad_implicit.mesh import Mesh

H = 1 / 16


def assert_sound(mesh: Mesh) -> None:
    assert broken_edges(mesh) == 0
    assert mesh.open_edges == 0
    assert status(mesh) == "NoError"


@pytest.fixture(scope="module", params=list(PARTS))
def contoured(request: pytest.FixtureRequest) -> tuple[str, Placed, Mesh, float]:
    distance, size, _, _ = PARTS[request.param]
    shape = Placed(distance, size)
    mesh = dual_contour(shape, H)
    return request.param, shape, mesh, shape.evaluations / len(mesh.vertices)


def test_parts_are_closed_of_the_right_genus_and_free_of_self_intersections(contoured) -> None:
    name, _, mesh, _ = contoured
    assert_sound(mesh)
    assert mesh.genus == PARTS[name][3]
    assert mesh.volume > 0
    assert self_intersections(mesh) == 0


def test_vertices_lie_on_the_surface(contoured) -> None:
    name, shape, mesh, _ = contoured
    error = np.abs(shape(mesh.vertices)) / H
    flat = name in ("box", "wedge", "ell")
    assert error.max() < (1e-10 if flat else 1e-4)


def test_sharp_edges_and_corners_are_kept(contoured) -> None:
    name, shape, mesh, _ = contoured
    edges = PARTS[name][2]
    if edges is None:
        pytest.skip("no sharp edges")
    error = distance_to_mesh(mesh, shape.place(edges)) / H
    # The rim of the cylinder is a polygon of chords: off by up to (1.7 h)² / 8 r = 0.032 h.
    assert np.quantile(error, 0.999) < (0.035 if name == "cylinder" else 0.02)
    assert error.max() < 0.04


def test_triangles_are_well_shaped(contoured) -> None:
    angles = smallest_angles(contoured[2])
    assert (angles < 1).sum() <= 2
    assert np.median(angles) > 25


def test_normals_agree_with_the_gradient(contoured) -> None:
    _, shape, mesh, _ = contoured
    area = np.linalg.norm(mesh.face_vectors, axis=1)
    gradient = shape.value_and_gradient(mesh.vertices[mesh.faces].mean(axis=1))[1]
    cosine = -(mesh.face_vectors * gradient).sum(axis=1) / area
    # A thin triangle along a rim may have its centroid nearer to the other face.
    assert area[cosine < 0.5].sum() < 2e-4 * area.sum()


def test_evaluations_are_few(contoured) -> None:
    assert contoured[3] < 7.5


@pytest.mark.parametrize("thickness", [1.05, 1.3, 1.6, 2.0])
def test_thin_walls_stay_whole(thickness: float) -> None:
    wall = thickness * H
    plate = dual_contour(Placed(box(1, 0.8, wall / 2), [1, 0.8, wall / 2]), H)
    tube = minus(extrusion(disc(0.7), 0.9), extrusion(disc(0.7 - wall), 2))
    pipe = dual_contour(Placed(tube, [0.7, 0.7, 0.9]), H)
    for mesh, genus in ((plate, 0), (pipe, 1)):
        assert_sound(mesh)
        assert (mesh.genus, mesh.shells) == (genus, 1)


class Scaled(Implicit):
    """A shape times a positive factor that varies by four orders of magnitude."""

    def __init__(self, shape: Placed) -> None:
        self.shape, self.bounds = shape, shape.bounds

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        x = np.asarray(points, float)
        value, gradient = self.shape.value_and_gradient(x)
        slope = np.array([2.0, -1.5, 1.0])
        factor = 0.01 * np.exp(x @ slope)
        return factor * value, factor[:, None] * (gradient + value[:, None] * slope)


@pytest.mark.parametrize("name", ["sphere", "hole"])
def test_badly_scaled_functions(name: str) -> None:
    distance, size, edges, genus = PARTS[name]
    shape = Placed(distance, size)
    mesh = dual_contour(Scaled(shape), H)
    assert_sound(mesh)
    assert mesh.genus == genus
    assert np.abs(shape(mesh.vertices)).max() < 1e-4 * H
    if edges is not None:
        assert np.quantile(distance_to_mesh(mesh, shape.place(edges)), 0.999) < 0.02 * H


def test_functions_without_gradients() -> None:
    shape = Placed(box(0.5, 0.4, 0.3), [0.5, 0.4, 0.3])
    mesh = dual_contour(Function(shape, shape.bounds), H)
    assert_sound(mesh)
    assert np.abs(shape(mesh.vertices)).max() < 1e-3 * H


@pytest.mark.parametrize(("scale", "offset"), [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e5)])
def test_size_and_place_do_not_matter(scale: float, offset: float) -> None:
    r = 0.8 * scale
    shape = Placed(extrusion(polygon([(-r, -r), (r, -r), (0.0, r)]), r), [r] * 3, shift=np.full(3, offset))
    mesh = dual_contour(shape, 0.1 * scale)
    assert_sound(mesh)
    assert np.abs(shape(mesh.vertices)).max() < (1e-6 if offset == 0 else 1e-5) * 0.1 * scale
    assert mesh.volume == pytest.approx(4 * r**3, rel=1e-6)


def test_threads_do_not_matter() -> None:
    shape = Placed(*PARTS["hole"][:2])
    one, two = (dual_contour(shape, H, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.vertices, two.vertices)
    np.testing.assert_array_equal(one.faces, two.faces)


def test_bounds_cut_flat_with_sharp_edges() -> None:
    shape = Placed(ball(1.0), [1, 1, 1], shift=np.zeros(3))
    mesh = dual_contour(shape, H, bounds=[[-2, -2, -2], [2, 2, 0.3]])
    assert_sound(mesh)
    rim = circle(np.sqrt(1 - 0.3**2), 0.3)
    assert mesh.bounds[1, 2] == pytest.approx(0.3, abs=1e-9)
    assert distance_to_mesh(mesh, rim).max() < 0.02 * H


@pytest.mark.parametrize("part", ["sphere", "box"])
def test_a_draft_is_close_and_keeps_its_edges(part: str) -> None:
    shape = Placed(*PARTS[part][:2])
    draft, mesh = dual_contour(shape, H, draft=True), dual_contour(shape, H)
    assert np.abs(shape(draft.vertices)).max() < (0.03 if part == "sphere" else 1e-3) * H
    assert distance_to_mesh(draft, mesh.vertices).max() < (0.03 if part == "sphere" else 1e-3) * H


def test_polish_decides_where_the_vertices_lie() -> None:
    true, rough = Placed(ball(1.0), [1, 1, 1]), Placed(ball(0.97 * 1.0), [1, 1, 1])
    mesh = dual_contour(rough, H, polish=true.value_and_gradient)
    assert_sound(mesh)
    assert np.abs(true(mesh.vertices)).max() < 1e-6 * H


def test_nothing_to_contour() -> None:
    with pytest.raises(EmptyResultError, match=r"spacing of 0\.5 mm"):
        dual_contour(Placed(ball(0.01), [1, 1, 1]), 0.5)


@pytest.mark.parametrize("stage", ["sample", "hermite", "vertices", "triangles"])
def test_every_stage_reports_and_may_be_cancelled(stage: str) -> None:
    class CancelError(Exception):
        pass

    def progress(name: str, fraction: float) -> None:
        assert 0 <= fraction <= 1
        if name == stage:
            raise CancelError

    with pytest.raises(CancelError):
        dual_contour(Placed(ball(1.0), [1, 1, 1]), 0.3, progress=progress)
