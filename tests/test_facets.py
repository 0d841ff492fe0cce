"""Edges follow curved surfaces: they are turned where the other diagonal is nearer, and split where none is near."""

from __future__ import annotations

from contextlib import AbstractContextManager

import exact_cases as cases
import numpy as np
import pytest
import shapes
from dual_oracles import FloatArray, broken_edges, smallest_angles, status
from scipy.spatial.transform import Rotation

from cad_implicit import Mesh, MeshDistance, contour, facets, parallel, untangling
from cad_implicit.dual import dual_contour
from cad_implicit.exact import Closing
from cad_implicit.kernels import sagitta, slivers
from cad_implicit.shapes import cylinder, sphere
from validation.intersections import count_intersections

AXIS = np.array([1, 2, 0.5]) / np.linalg.norm([1, 2, 0.5])
H = 0.1


def off(mesh: Mesh, points: FloatArray) -> FloatArray:
    return np.abs(MeshDistance(mesh)(points))


def turned_cylinder() -> tuple[Mesh, FloatArray]:
    """Contour of a cylinder off the axes, and points on its curved face."""
    mesh = dual_contour(cylinder(0.4, 1.0).turned(AXIS, 40).moved([0.03, 0.01, 0.02]), H)
    angle, z = np.random.default_rng(3).uniform([[0], [-0.35]], [[2 * np.pi], [0.35]], (2, 4000))
    points = np.column_stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), z])
    return mesh, Rotation.from_rotvec(np.radians(40) * AXIS).apply(points) + [0.03, 0.01, 0.02]


def test_turned_edges_halve_the_error_and_leave_no_thin_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh, points = turned_cylinder()
    monkeypatch.setattr(untangling, "turn_edges", lambda *_: None)
    plain, _ = turned_cylinder()
    assert len(mesh.vertices) <= len(plain.vertices)
    errors = [np.sqrt((off(one, points) ** 2).mean()) for one in (plain, mesh)]
    assert errors[0] > 0.01 * H
    assert errors[1] < 0.5 * errors[0]
    assert broken_edges(mesh) == 0
    assert count_intersections(mesh) == 0
    worst = [np.quantile(smallest_angles(one), 0.03) for one in (plain, mesh)]
    assert worst[1] > min(5.0, worst[0])


def bent_quad(turn: float) -> tuple[FloatArray, np.ndarray, FloatArray]:
    """Two triangles on a cylinder of radius 1 along z whose shared edge runs around it, and its other one along it."""
    angle = np.array([0.0, turn / 2, turn, turn / 2])
    normals = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(4)])
    points = normals + np.array([0, -0.1, 0, 0.1])[:, None] * [0, 0, 1]
    ring = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    lid = np.array([[1, 0, 4], [2, 1, 4], [3, 2, 4], [0, 3, 4]], np.int32)  # closes it behind
    points = np.concatenate([points, [[0.5, 0, 0]]])
    return points, np.concatenate([ring, lid]), np.concatenate([normals, np.zeros((1, 3))])


@pytest.mark.parametrize(
    ("change", "turns"), [("none", True), ("fixed", False), ("sharp ends", False), ("flat", False)]
)
def test_an_edge_around_a_cylinder_becomes_one_along_it(change: str, turns: bool) -> None:
    points, faces, normals = bent_quad(0.3)
    rank = np.ones(5, np.int8)
    rank[4] = slivers.FIXED
    if change == "fixed":
        rank[1] = slivers.FIXED
    if change == "sharp ends":
        normals[[1, 3]] = 0
    least = 1.0 if change == "flat" else 1e-4
    before = faces.copy()
    with parallel.threads(1):
        sagitta.turn_edges(points, faces, normals, rank, least)
    turns = change == "none"
    has = {frozenset(pair) for face in faces for pair in zip(face, np.roll(face, 1), strict=True)}
    assert (frozenset((1, 3)) in has) == turns
    assert (frozenset((0, 2)) in has) != turns
    assert status(Mesh(points, faces)) == "NoError"
    assert turns or (faces == before).all()


@pytest.mark.nojit
def test_the_sagitta_is_that_of_a_circle() -> None:
    points, faces, normals = bent_quad(0.3)
    expected = 1 - np.cos(0.15)
    curved = [
        sagitta.curved_edges(points, faces[:1], normals, np.ones(5, np.int8), m * expected, 0.0) for m in (0.98, 1.02)
    ]
    assert curved[0][0].tolist() == [False, False, True]
    assert not curved[1].any()
    normals[0] = 0  # an end on a crease: its other one tells it
    assert sagitta.curved_edges(points, faces[:1], normals, np.ones(5, np.int8), 0.98 * expected, 0.0)[0, 2]
    normals[2] = 0
    assert not sagitta.curved_edges(points, faces[:1], normals, np.ones(5, np.int8), 0.0, 0.0)[0, 2]


@pytest.mark.parametrize("case", [cases.corner(2.0), cases.cone_boss(2.5, 1.5, 2.0, 240)], ids=lambda case: case.name)
def test_blends_miss_the_truth_by_a_quarter(case: cases.Case, monkeypatch: pytest.MonkeyPatch) -> None:
    part, samples = MeshDistance(case.mesh), shapes.placed(case.blend_samples(60_000))
    errors = {}
    for cells in (3, 6):
        h = case.radius / cells
        mesh = contour(Closing(part, case.radius, h))
        assert mesh.is_watertight
        assert count_intersections(mesh) == 0
        errors[cells] = off(mesh, samples)
        assert errors[cells].max() < 1.6 * facets.tolerance(h, case.radius)
    assert errors[3].max() > 3 * errors[6].max()  # second order
    monkeypatch.setattr(facets, "_PASSES", 0)
    h = case.radius / 6
    coarse = off(contour(Closing(part, case.radius, h)), samples)
    assert np.sqrt((coarse**2).mean()) > 1.4 * np.sqrt((errors[6] ** 2).mean())
    assert coarse.max() > 2.2 * errors[6].max()


def test_long_edges_are_looked_at_where_surfaces_turn_both_ways_below_them(monkeypatch: pytest.MonkeyPatch) -> None:
    case, h = cases.cross(2, 1.5, 2.0, 240), 1.0
    part, samples = MeshDistance(case.mesh), shapes.placed(case.blend_samples(60_000))
    allowed = facets.tolerance(h, case.radius)
    mesh = contour(Closing(part, case.radius, h))
    assert count_intersections(mesh) == 0
    assert off(mesh, samples).max() < 1.2 * allowed
    monkeypatch.setattr(facets, "_LONG_EDGE", np.inf)
    assert off(contour(Closing(part, case.radius, h)), samples).max() > 1.4 * allowed


def test_facets_of_shapes_without_blends_stay() -> None:
    ball = sphere(0.4)
    assert ball.radius is None
    mesh = dual_contour(ball, H)
    ball.radius = 0.4
    finer = dual_contour(ball, H)
    assert len(finer.faces) > 2 * len(mesh.faces)
    assert abs(np.linalg.norm(finer.vertices, axis=1) - 0.4).max() < 1e-9


class _Kinked:
    """Says that a surface is where it is expected, but is wrong about the middles of new edges."""

    spacing = 0.6

    def kernels(self, items: int) -> AbstractContextManager[None]:
        return parallel.threads(1, items)

    def onto_face(self, points: FloatArray, enough: FloatArray) -> tuple[FloatArray, FloatArray, np.ndarray]:
        return points, points / np.linalg.norm(points, axis=1)[:, None], np.ones(len(points), np.bool_)

    def misses(self, points: FloatArray) -> FloatArray:
        return np.full(len(points), np.inf)


@pytest.mark.nojit
def test_edges_that_end_on_a_crease_are_split_only_if_the_halves_are_on_the_surface() -> None:
    points, faces, normals = bent_quad(0.5)
    rank = np.ones(5, np.int8)
    rank[4] = slivers.FIXED
    rank[[1, 3]] = slivers.FIXED
    some, _ = facets.refined_facets(points, faces.copy(), normals, rank, _Kinked(), 1.0)
    assert len(some) == len(points) + 1
    normals[0] = 0
    none, same = facets.refined_facets(points, faces.copy(), normals, rank, _Kinked(), 1.0)
    assert len(none) == len(points)
    np.testing.assert_array_equal(same, faces)
