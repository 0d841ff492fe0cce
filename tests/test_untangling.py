"""Triangles of a dual contour that run through each other: found as the independent check finds them, and mended."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from dual_oracles import broken_edges, status
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from cad_implicit import Mesh, parallel, untangling
from cad_implicit.dual import dual_contour
from cad_implicit.field import Field
from cad_implicit.grid import Grid
from cad_implicit.implicit import FloatArray
from cad_implicit.kernels.intersections import intersecting
from validation.intersections import count_intersections, find_intersections

TURN = Rotation.from_euler("xyz", [23, 37, 11], degrees=True).as_matrix()


def found(vertices: FloatArray, faces: NDArray[np.int32], spacing: float) -> NDArray[np.bool_]:
    with parallel.threads(1):
        return np.asarray(intersecting(vertices, faces, spacing))


def expected(mesh: Mesh) -> NDArray[np.bool_]:
    marks = np.zeros(len(mesh.faces), np.bool_)
    for pairs in find_intersections(mesh):
        marks[pairs.ravel()] = True
    return marks


def soup(seed: int, count: int) -> Mesh:
    random = np.random.default_rng(seed)
    points = random.uniform(-1, 1, (count, 1, 3)) + random.uniform(-0.4, 0.4, (count, 3, 3))
    return Mesh(points.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


@pytest.mark.nojit
def test_triangles_at_random() -> None:
    mesh = soup(3, 40)
    marks = expected(mesh)
    assert 10 < marks.sum() < 40
    np.testing.assert_array_equal(found(mesh.vertices, mesh.faces, 0.4), marks)


@pytest.mark.parametrize("spacing", [0.02, 0.1, 1.0])
def test_pushed_vertices_whatever_the_bins(spacing: float) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4)
    random = np.random.default_rng(1)
    vertices = ball.vertices @ TURN.T
    vertices[random.choice(len(vertices), 60, replace=False)] += random.uniform(-0.12, 0.12, (60, 3))
    mesh = Mesh(vertices, ball.faces)
    marks = expected(mesh)
    assert marks.sum() > 20
    np.testing.assert_array_equal(found(mesh.vertices, mesh.faces, spacing), marks)


@pytest.mark.nojit
def test_folds_double_triangles_and_overlaps_in_a_plane() -> None:
    fold = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.4, 0.9, 1e-4]])
    pair = np.array([[0, 1, 2], [1, 0, 3]], np.int32)
    assert found(fold, pair, 1.0).all()
    open_pair = fold + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0.1]]
    assert not found(open_pair, pair, 1.0).any()
    assert found(np.eye(3), np.array([[0, 1, 2], [0, 2, 1]], np.int32), 1.0).all()
    plane = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 0], [1, 3, 0], [3, 1, 0]])
    assert found(plane, np.array([[0, 1, 2], [3, 4, 5]], np.int32), 4.0).all()
    assert not found(plane + 1.0, np.array([[0, 1, 3], [3, 5, 4]], np.int32), 4.0).any()


def fans(spikes: int) -> Mesh:
    """A box, off the axes, with a fine rim around its middle: all its walls are fans; some rim vertices are moved."""
    turn = np.linspace(0, 2 * np.pi, 1200, endpoint=False) + 0.1
    square = np.abs(np.stack([np.cos(turn), np.sin(turn)])).max(axis=0)
    rim = np.stack([20 * np.cos(turn) / square, 20 * np.sin(turn) / square, 0.3 * np.sin(7 * turn)], axis=1)
    corners = np.array([[x, y, z] for z in (-9.0, 9.0) for x, y in ((20, 20), (-20, 20), (-20, -20), (20, -20))])
    side = ((turn + np.pi / 4) // (np.pi / 2)).astype(int) % 4
    faces = [[8 + i, 8 + (i + 1) % 1200, 4 + side[i]] for i in range(1200)]
    faces += [[8 + (i + 1) % 1200, 8 + i, side[i]] for i in range(1200)]
    random = np.random.default_rng(spikes)
    moved = random.choice(1200, spikes, replace=False)
    rim[moved] += random.uniform(-4, 4, (spikes, 3))
    return Mesh(np.concatenate([corners, rim]) @ TURN.T, faces)


@pytest.mark.parametrize("spikes", [0, 40])
def test_fans_of_long_thin_triangles(spikes: int) -> None:
    mesh = fans(spikes)
    marks = expected(mesh)
    assert (marks.sum() > 50) == (spikes > 0)
    np.testing.assert_array_equal(found(mesh.vertices, mesh.faces, 0.1), marks)


def test_large_and_small_triangles_at_random() -> None:
    small = soup(7, 600)
    random = np.random.default_rng(8)
    large = random.uniform(-1.5, 1.5, (12, 3, 3)).reshape(-1, 3)
    points = np.concatenate([0.08 * small.vertices + 0.5 * np.repeat(small.vertices[::3], 3, axis=0), large])
    mesh = Mesh(points, np.arange(len(points)).reshape(-1, 3))
    marks = expected(mesh)
    assert marks[-12:].all()
    assert 20 < marks.sum() < 400
    np.testing.assert_array_equal(found(mesh.vertices, mesh.faces, 0.1), marks)


def test_two_folds_of_a_large_face() -> None:
    fold = np.array([[0.0, 0, 0], [40, 0, 0], [20, 30, 0], [19, 29, 1e-4]]) @ TURN.T
    pair = np.array([[0, 1, 2], [1, 0, 3]], np.int32)
    assert found(fold, pair, 0.1).all()
    fold[3] += TURN @ [0, 0, 3.0]
    assert not found(fold, pair, 0.1).any()


def test_a_grid_with_more_bins_than_there_is_room_for() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3).apply_scale(0.5)
    two = trimesh.util.concatenate([ball.copy().apply_translation([0.6, 0.1, 0.2]), ball])
    far = ball.copy().apply_translation([90.0, 80, 70])
    mesh = Mesh(*(lambda whole: (whole.vertices @ TURN.T, whole.faces))(trimesh.util.concatenate([two, far])))
    marks = expected(mesh)
    assert 20 < marks.sum() < 600
    np.testing.assert_array_equal(found(mesh.vertices, mesh.faces, 0.08), marks)


def test_nothing_is_found_in_nothing() -> None:
    assert len(found(np.zeros((0, 3)), np.zeros((0, 3), np.int32), 1.0)) == 0


def test_the_number_of_threads_does_not_matter() -> None:
    mesh = soup(5, 400)
    one = found(mesh.vertices, mesh.faces, 0.3)
    with parallel.threads(2):
        np.testing.assert_array_equal(intersecting(mesh.vertices, mesh.faces, 0.3), one)


def random_field(size: int, seed: int, blur: float) -> Field:
    values = np.random.default_rng(seed).standard_normal((size, size, size))
    values = gaussian_filter(values, blur) if blur else values
    values[size // 2, size // 2, size // 2] = 1.0
    return Field(Grid((0.1, 0.2, 0.3), (1.0, 1.0, 1.0), values.shape), values)


@settings(max_examples=25, deadline=None)
@given(st.integers(3, 11), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.6, 1.2]))
def test_random_fields_have_no_self_intersections(size: int, seed: int, blur: float) -> None:
    mesh = dual_contour(random_field(size, seed, blur), 0.77)
    assert broken_edges(mesh) == 0
    assert status(mesh) == "NoError"
    assert count_intersections(mesh) == 0


def test_what_is_far_from_a_tangle_does_not_change(monkeypatch: pytest.MonkeyPatch) -> None:
    field, h = random_field(14, 7, 1.0), 0.31
    after = dual_contour(field, h)
    monkeypatch.setattr(untangling, "_tangled", lambda *args: np.zeros(0, np.int64))
    before = dual_contour(field, h)
    assert count_intersections(before) > 0
    assert count_intersections(after) == 0
    tangles = before.vertices[before.faces[expected(before)]].reshape(-1, 3)
    for mesh, other in ((before, after), (after, before)):
        gone = mesh.vertices[cKDTree(other.vertices).query(mesh.vertices)[0] > 0]
        assert 0 < len(gone) < 0.2 * len(mesh.vertices)
        assert cKDTree(tangles).query(gone)[0].max() < 4 * h


def corners(mesh: Mesh) -> set[tuple[bytes, ...]]:
    """Triangles as their corners, from the first one in some order on."""
    rows = [[corner.tobytes() for corner in triangle] for triangle in mesh.vertices[mesh.faces]]
    return {tuple(np.roll(np.array(row, object), -row.index(min(row)))) for row in rows}


@pytest.mark.parametrize(("seed", "fit"), [(7, True), (8, True), (9, False)])
def test_a_mended_zone_comes_out_as_in_the_whole(seed: int, fit: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    field, fits = random_field(14, seed, 1.0), []
    replaced = untangling._replaced

    def noting(*args: object) -> object:
        fits.append(replaced(*args))  # type: ignore[arg-type]
        return fits[-1]

    monkeypatch.setattr(untangling, "_replaced", noting)
    one = dual_contour(field, 0.31)
    assert [zone is not None for zone in fits] == [fit]  # what does not fit is done once more with the whole
    monkeypatch.setattr(untangling, "_replaced", lambda *_: None)
    assert corners(one) == corners(dual_contour(field, 0.31))


def test_tangles_are_mended_alike_on_any_number_of_threads() -> None:
    one, two = (dual_contour(random_field(11, 7, 0.6), 0.5, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.faces, two.faces)
    np.testing.assert_array_equal(one.vertices, two.vertices)


@pytest.mark.parametrize("rounds", [1, 2, 3, 5])
def test_the_mesh_is_closed_after_any_number_of_rounds(rounds: int, monkeypatch: pytest.MonkeyPatch) -> None:
    field = random_field(11, 7, 0.6)
    whole = dual_contour(field, 0.5)
    monkeypatch.setattr(untangling, "_ROUNDS", rounds)
    mesh = dual_contour(field, 0.5)
    assert broken_edges(mesh) == 0
    assert status(mesh) == "NoError"
    assert mesh.volume == pytest.approx(whole.volume, rel=0.01)
    assert rounds > 1 or count_intersections(mesh) > 0
