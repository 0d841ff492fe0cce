"""The counter of self-intersections against meshes that have a known number of them."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cad_implicit import Mesh
from validation.intersections import count_intersections, find_intersections

TURN = Rotation.from_euler("xyz", [23, 37, 11], degrees=True).as_matrix()


def mesh_of(*bodies: trimesh.Trimesh) -> Mesh:
    whole = trimesh.util.concatenate(bodies)
    return Mesh(whole.vertices @ TURN.T + [3.1, -2.7, 0.3], whole.faces)


def box(size: list[float], at: list[float]) -> trimesh.Trimesh:
    return trimesh.creation.box(size).apply_translation(at)


def volume(a, b, c, d) -> Fraction:
    """Six times the volume of a tetrahedron, exactly."""
    (p, q, r) = ([Fraction(float(x)) - Fraction(float(y)) for x, y in zip(e, d, strict=True)] for e in (a, b, c))
    return p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) + p[2] * (q[0] * r[1] - q[1] * r[0])


def crosses(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether an edge of one triangle runs through the other, in exact arithmetic."""
    for s, t in ((one, other), (other, one)):
        for k in range(3):
            p, q = s[k], s[(k + 1) % 3]
            if volume(*t, p) * volume(*t, q) >= 0:
                continue
            sides = [volume(p, q, t[m], t[(m + 1) % 3]) for m in range(3)]
            if all(side > 0 for side in sides) or all(side < 0 for side in sides):
                return True
    return False


@pytest.mark.parametrize(
    "body",
    [
        trimesh.creation.icosphere(subdivisions=4),
        trimesh.creation.box([1, 2, 3]),
        trimesh.creation.torus(3, 1, major_sections=80, minor_sections=40),
        trimesh.creation.cylinder(1, 5, sections=200),
    ],
    ids=["sphere", "box", "torus", "cylinder"],
)
def test_clean_bodies_have_none(body: trimesh.Trimesh) -> None:
    assert count_intersections(mesh_of(body)) == 0


def test_random_triangles_as_in_exact_arithmetic() -> None:
    random = np.random.default_rng(3)
    points = random.uniform(-1, 1, (40, 1, 3)) + random.uniform(-0.6, 0.6, (40, 3, 3))
    mesh = Mesh(points.reshape(-1, 3), np.arange(120).reshape(-1, 3))
    found = {tuple(sorted(pair)) for pair in find_intersections(mesh).crossings.tolist()}
    t = mesh.vertices[mesh.faces]
    expected = {(i, j) for i, j in itertools.combinations(range(40), 2) if crosses(t[i], t[j])}
    assert found == expected
    assert len(expected) > 10


def test_edges_that_all_but_meet_as_in_exact_arithmetic() -> None:
    # Far from the origin, each pair on its own: an edge of one ends, rounded, in an edge of the other.
    random = np.random.default_rng(5)
    place = 977.3 + 7.0 * np.arange(400)[:, None, None] * [1, 0.3, 0.7]
    one = random.uniform(-1, 1, (400, 3, 3))
    part = random.uniform(0.1, 0.9, (400, 1))
    end = part * one[:, 0] + (1 - part) * one[:, 1]
    t = np.stack([one, np.stack([end, *random.uniform(-1, 1, (2, 400, 3))], axis=1)], axis=1) + place[:, None]
    mesh = Mesh(t.reshape(-1, 3), np.arange(2400).reshape(-1, 3))
    found = {tuple(sorted(pair)) for pair in find_intersections(mesh).crossings.tolist()}
    expected = {(2 * k, 2 * k + 1) for k in range(400) if crosses(*t[k])}
    assert 50 < len(expected) < 350
    assert found <= expected
    assert len(found) > 0.9 * len(expected)


def test_a_bar_through_a_plate() -> None:
    # The bar's four sides (two triangles each) run through both faces of the plate, two triangles each.
    bar = box([0.2, 0.2, 4], [0.41, 0.13, 0])
    result = find_intersections(mesh_of(box([2, 2, 1], [0, 0, 0]), bar))
    assert len(result.at_vertices) == len(result.folds) == 0
    # 8 side triangles cross the triangle of each face over which the bar stands
    assert len(result.crossings) == 16


def test_overlap_in_one_plane_counts_and_touching_does_not() -> None:
    square = Mesh([[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 0], [3, 1, 0], [1, 3, 0]], [[0, 1, 2], [3, 4, 5]])
    assert len(find_intersections(square).crossings) == 1
    stacked = mesh_of(box([1, 1, 1], [0, 0, 0]), box([1, 1, 1], [5, 0, 0]))
    assert count_intersections(stacked) == 0
    apart = Mesh([[0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0], [4, 5, 0], [0, 4, 0]], [[0, 1, 2], [3, 4, 5]])
    assert count_intersections(apart) == 0


def test_a_vertex_pushed_through_the_other_side() -> None:
    plate = trimesh.creation.box([2, 2, 0.2]).subdivide().subdivide().subdivide()
    pushed = np.argmin(np.linalg.norm(plate.vertices - [0.25, 0.25, 0.1], axis=1))
    plate.vertices[pushed, 2] = -0.3
    result = find_intersections(mesh_of(plate))
    assert len(result.crossings) > 0


def test_a_fan_twisted_about_its_vertex() -> None:
    # Two triangles with one common vertex; the far edge of one runs through the other.
    mesh = Mesh([[0, 0, 0], [2, -1, 0], [2, 1, 0], [1, 0, -1], [1, 0.1, 1]], [[0, 1, 2], [0, 3, 4]])
    result = find_intersections(mesh)
    assert len(result.at_vertices) == 1
    assert result.count == 1


def test_folded_neighbours() -> None:
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.4, 0.9, 1e-4]], [[0, 1, 2], [1, 0, 3]])
    assert len(find_intersections(mesh).folds) == 1
    assert count_intersections(Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.4, 0.9, 0.1]], mesh.faces)) == 0
    assert count_intersections(Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.4, -0.9, 0]], mesh.faces)) == 0


def test_double_triangles() -> None:
    assert len(find_intersections(Mesh(np.eye(3), [[0, 1, 2], [0, 1, 2]])).folds) == 1


def test_a_tube_run_through_itself() -> None:
    turns = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    radius = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    # a figure of eight with a round section: its two strands run through each other in the middle
    path = np.stack([3 * np.sin(turns), 3 * np.sin(2 * turns), 0.1 * np.sin(turns)], axis=1)
    along = np.gradient(np.concatenate([path[-1:], path, path[:1]]), axis=0)[1:-1]
    side = np.cross(along, [0, 0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    tube = path[:, None] + 0.25 * (np.cos(radius)[:, None] * side[:, None] + np.sin(radius)[:, None] * [0, 0, 1.0])
    i, j = (m.ravel() for m in np.meshgrid(np.arange(200), np.arange(24), indexing="ij"))
    a, b, c, d = (((i + di) % 200) * 24 + (j + dj) % 24 for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    result = find_intersections(Mesh(tube.reshape(-1, 3), faces))
    assert len(result.crossings) > 100
    middle = tube.reshape(-1, 3)[faces[result.crossings]].mean(axis=(1, 2))
    assert np.linalg.norm(middle, axis=1).max() < 1.5


def test_the_count_does_not_depend_on_the_order() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    mesh = mesh_of(ball, ball.copy().apply_translation([1.03, 0.17, 0.29]))
    shuffled = Mesh(mesh.vertices, np.random.default_rng(0).permutation(mesh.faces))
    assert count_intersections(mesh) == count_intersections(shuffled) > 100
