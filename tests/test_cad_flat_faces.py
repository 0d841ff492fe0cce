"""Plane polygons of meshes: what is joined, what is not, and that the polygons fit together."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from cad_parts import ball

from cad_implicit import Mesh
from cad_implicit.cad.flat_faces import FlatFaces, flat_faces, twins
from cad_implicit.cad.weld import parted

TURN = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [5, -3, 2])


def turned(raw: trimesh.Trimesh) -> Mesh:
    return Mesh(raw.vertices, raw.faces).transformed(TURN)


def fits(found: FlatFaces) -> bool:
    """Whether each side of an outline is met by exactly one opposite side."""
    vertex, after, _ = found.corners()
    sides = list(zip(vertex.tolist(), vertex[after].tolist(), strict=True))
    return len(set(sides)) == len(sides) and set(sides) == {(b, a) for a, b in sides}


def shape_of(found: FlatFaces) -> list[list[int]]:
    """Numbers of corners of each face's outlines."""
    return sorted([len(loop) for loop in loops] for loops in found.loops)


def test_twins() -> None:
    mesh = ball()
    start, end = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    twin = twins(mesh)
    assert np.array_equal(start[twin], end)
    assert np.array_equal(end[twin], start)


def test_a_fine_box_has_six_squares() -> None:
    raw = trimesh.creation.box((10, 20, 30)).subdivide().subdivide().subdivide()
    found = flat_faces(turned(raw), 1e-6)
    assert shape_of(found) == [[4]] * 6
    assert sorted(found.areas.round(6)) == [200, 200, 300, 300, 600, 600]
    assert found.deviations.max() < 1e-12
    assert fits(found)


def test_noise_within_the_tolerance_is_flat_and_beyond_it_is_not() -> None:
    raw = trimesh.creation.box((10, 20, 30)).subdivide().subdivide().subdivide()
    noise = np.random.default_rng(3).uniform(-1, 1, raw.vertices.shape)
    mesh = turned(trimesh.Trimesh(raw.vertices + 1e-5 * noise, raw.faces, process=False))
    assert shape_of(found := flat_faces(mesh, 5e-5)) == [[4]] * 6
    assert found.deviations.max() < 4e-5
    assert len(flat_faces(mesh, 1e-7).loops) > 500


def test_holes() -> None:
    annulus = trimesh.creation.annulus(3.0, 7.0, 5.0, sections=24)
    found = flat_faces(turned(annulus), 1e-6)
    assert shape_of(found) == [[4]] * 48 + [[24, 24]] * 2
    assert fits(found)
    for loops, normal in zip(found.loops, found.normals, strict=True):
        points = turned(annulus).vertices
        areas = [np.cross(points[a], points[b]) @ normal for loop in loops for a, b in pairwise([*loop, loop[0]])]
        signed = [sum(areas[: len(loops[0])]), sum(areas[len(loops[0]) :])]
        assert signed[0] > 0
        assert signed[1] < 0 or len(loops) == 1


def test_steps_larger_than_the_tolerance_stay() -> None:
    """A plate with a thin layer on a part of it."""
    low = trimesh.creation.box((10, 10, 2))
    for step, faces in ((1e-3, 11), (1e-8, 6)):
        high = trimesh.creation.box((4, 10, 2 + step))
        high.apply_translation((3, 0, step / 2))
        mesh = _union(low, high)
        assert len(flat_faces(mesh, 1e-6).loops) <= faces
    assert len(flat_faces(_union(low, trimesh.creation.box((4, 4, 3))), 1e-6).loops) > 6


def _union(*bodies: trimesh.Trimesh) -> Mesh:
    from manifold3d import Manifold, Mesh64

    parts = [Manifold(Mesh64(b.vertices.copy(), b.faces.astype(np.uint64))) for b in bodies]
    result = sum(parts[1:], parts[0]).to_mesh64()
    return Mesh(np.asarray(result.vert_properties)[:, :3], np.asarray(result.tri_verts, np.int64)).transformed(TURN)


def test_a_gently_curved_surface_is_not_flattened_away() -> None:
    """Each pair of neighbours is flat within the tolerance, the whole is not."""
    mesh = ball(50.0, (0.0, 0.0, 0.0))
    found = flat_faces(mesh, 1.0)
    assert 50 < len(found.loops) < len(mesh.faces) / 2
    assert found.deviations.max() <= 2.0
    assert fits(found)


def test_triangles_can_be_kept_apart() -> None:
    mesh = turned(trimesh.creation.box((10, 20, 30)))
    apart = np.zeros(12, bool)
    apart[0] = True
    found = flat_faces(mesh, 1e-6, apart)
    assert shape_of(found) == [[3]] * 2 + [[4]] * 5
    assert fits(found)


def test_a_face_that_touches_itself_in_a_point() -> None:
    """A block with a pit in its top, the mouth of which touches the outline of the top in one vertex."""
    top = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (2, 1, 0), (3, 2, 0)]  # the pit's mouth is 1, 4, 5
    points = np.array([*top, (3, 1, -0.5), (0, 0, -1), (4, 0, -1), (4, 4, -1), (0, 4, -1)], float)
    flat = [(0, 1, 4), (0, 4, 3), (4, 5, 3), (5, 2, 3), (5, 1, 2)]
    pit = [(4, 1, 6), (5, 4, 6), (1, 5, 6)]
    walls = [t for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)) for t in ((b, a, a + 7), (b, a + 7, b + 7))]
    mesh = Mesh(points, [*flat, *pit, *walls, (7, 9, 8), (7, 10, 9)]).transformed(TURN)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(15.75)
    found = flat_faces(mesh, 1e-6)
    assert fits(found)
    assert found.areas.sum() == pytest.approx(mesh.area)
    assert shape_of(found) == [[3]] * 3 + [[4]] * 5 + [[4, 3]]


def test_shells_that_touch_in_a_vertex_come_apart() -> None:
    low, high = trimesh.creation.box((2, 2, 2)), trimesh.creation.box((2, 2, 2))
    high.apply_translation((2, 2, 2))
    both = trimesh.util.concatenate([low, high])
    both.merge_vertices()
    mesh = turned(both)
    assert (len(mesh.vertices), mesh.shells) == (15, 1)
    two = parted(mesh)
    assert (len(two.vertices), two.shells, two.is_watertight) == (16, 2, True)
    assert two.volume == pytest.approx(16)
    assert parted(two) is two
