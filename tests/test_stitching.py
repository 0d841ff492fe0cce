"""Shapes cut off meshes and joined to them: vertices against the exact surfaces, all else bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from stitching_regions import (
    ORIGIN,
    TURN,
    Region,
    X,
    Y,
    Z,
    angle_profile,
    at,
    boss,
    box,
    edge_region,
    half,
    inside_cylinder,
    local,
    outside_cylinder,
    outside_torus,
)

from cad_implicit import Mesh, run, stitching
from cad_implicit.distance import MeshDistance
from cad_implicit.dual import dual_contour
from cad_implicit.errors import EmptyResultError, OpenMeshError, SpacingError
from cad_implicit.implicit import FloatArray, Function
from cad_implicit.kernels import seams
from cad_implicit.missed_creases import split_at_creases
from cad_implicit.stitching import stitched
from validation.intersections import count_intersections

H = 0.5
MARGIN = 2 * H
SIZE = (30.0, 20.0, 25.0)


def box_edge(radius: float) -> Region:
    """Convex edge of the box along local x, with ends in the air."""
    return edge_region(at(-15, 10, 12.5), at(15, 10, 12.5), (Y, Z), radius, MARGIN, convex=True, cuts=(1, 1))


def new_points(result: Mesh, part: Mesh) -> FloatArray:
    old = set(map(bytes, part.vertices))
    return result.vertices[[bytes(v) not in old for v in result.vertices]]


def check_sound(result: Mesh) -> None:
    assert result.is_watertight
    assert result.shells == 1
    assert count_intersections(result) == 0


def off_rounded_box(points: FloatArray, radius: float) -> FloatArray:
    """Distance from the box with one rounded edge, for points on its planes or on the blend."""
    depth = np.array(SIZE) / 2 - local(points)
    in_blend = (depth[:, 1:] < radius - 1e-9).all(axis=1)
    blend = np.abs(np.linalg.norm(radius - depth[:, 1:], axis=1) - radius)
    planes = np.minimum(np.abs(depth), np.abs(np.array(SIZE) - depth))
    ends = np.where(np.linalg.norm(radius - depth[:, 1:], axis=1) < radius, planes[:, 0], np.inf)
    return np.where(in_blend, np.minimum(blend, ends), planes.min(axis=1))


@pytest.mark.parametrize("radius", [2 * H, 3.4 * H, 8 * H, 20 * H])
@pytest.mark.parametrize("cuts", [0, 3])
def test_convex_edge_is_exact_at_all_vertices(radius: float, cuts: int) -> None:
    part = box(SIZE, cuts)
    result = stitched(part, [], [box_edge(radius)], H)
    check_sound(result)
    assert off_rounded_box(new_points(result, part), radius).max() < 2e-4 * H
    blend_area = SIZE[0] * radius * np.pi / 2
    missing = result.volume - (part.volume - SIZE[0] * radius**2 * (1 - np.pi / 4))
    assert -0.2 * H**2 / radius * blend_area < missing < 0


def test_everything_else_is_the_same_bit_for_bit() -> None:
    part = box(SIZE, 3)
    region = box_edge(4 * H)
    result = stitched(part, [], [region], H)
    low, high = region.bounds
    corners = part.vertices[part.faces]
    far = ((corners < low) | (corners > high)).all(axis=1).any(axis=1)
    kept = {corners.tobytes() for corners in result.vertices[result.faces]}
    kept |= {np.roll(corners, k, axis=0).tobytes() for corners in result.vertices[result.faces] for k in (1, 2)}
    assert far.sum() > 300
    assert all(triangle.tobytes() in kept for triangle in corners[far])


def test_faces_keep_their_ids_and_blends_have_none() -> None:
    part = box(SIZE, 2)
    result = stitched(part, [], [box_edge(4 * H)], H)
    assert part.face_ids is not None
    assert result.face_ids is not None
    depth = np.array(SIZE) / 2 - np.abs(local(result.vertices))
    on_plane = depth[result.faces].max(axis=1).min(axis=1) < 5e-4 * H
    np.testing.assert_array_equal(result.face_ids >= 0, on_plane)
    normal = part.face_vectors / np.linalg.norm(part.face_vectors, axis=1)[:, None]
    of_id = np.array([normal[part.face_ids == k].mean(axis=0) for k in range(6)])
    area = np.linalg.norm(result.face_vectors, axis=1)
    fair = on_plane & (area > 1e-6)
    turned = (result.face_vectors[fair] * of_id[result.face_ids[fair]]).sum(axis=1) / area[fair]
    assert turned.min() > 1 - 2e-5


@pytest.mark.parametrize("radius", [2 * H, 6 * H, 11.3 * H])
@pytest.mark.parametrize("cuts", [0, 2])
def test_concave_edge_with_flush_ends(radius: float, cuts: int) -> None:
    part = angle_profile(cuts)
    region = edge_region(at(10, 0, 8), at(10, 36, 8), (X, Z), radius, MARGIN, convex=False, cuts=(0, 0))
    result = stitched(part, [region], [], H)
    check_sound(result)
    x, y, z = local(new_points(result, part)).T
    beyond = np.hypot(x - 10 - radius, z - 8 - radius) - radius
    ends = np.minimum(np.abs(y), np.abs(y - 36))
    inside = (x < 10 + radius - 1e-6) & (z < 8 + radius - 1e-6)
    planes = np.minimum(np.abs(x - 10), np.abs(z - 8))
    off = np.where(inside, np.minimum(np.abs(beyond), ends), np.minimum(planes, ends))
    assert off.max() < (0.02 if radius == 2 * H else 1e-4) * H
    assert np.percentile(off, 98) < 1e-5 * H
    assert np.percentile(ends[ends < 1e-3], 95) < 1e-6 * H
    gain = result.volume - part.volume - 36 * radius**2 * (1 - np.pi / 4)
    assert 0 < gain < 0.2 * H**2 / radius * 36 * radius * np.pi / 2


@pytest.mark.parametrize("radius", [3 * H, 9 * H])
def test_end_cut_in_the_plane_of_another_face(radius: float) -> None:
    part = angle_profile(1)
    region = edge_region(at(10, 0, 8), at(30, 0, 8), (-Y, Z), radius, MARGIN, convex=True, cuts=(0, MARGIN))
    result = stitched(part, [], [region], H)
    check_sound(result)
    x, y, z = local(new_points(result, part)).T
    inside = (x > 10 + 1e-5) & (y < radius - 1e-6) & (z > 8 - radius + 1e-6)
    blend = np.abs(np.hypot(y - radius, z - 8 + radius) - radius)
    planes = np.abs(np.stack([x - 10, x - 30, y, z - 8])).min(axis=0)
    assert np.where(inside, blend, planes).max() < 0.02 * H
    assert np.percentile(np.where(inside, blend, planes), 95) < 1e-4 * H
    assert result.volume == pytest.approx(part.volume - 20 * radius**2 * (1 - np.pi / 4), rel=1e-4)


def boss_region(foot: float, radius: float) -> Region:
    parts = [
        outside_torus(at(0, 0, radius), Z, foot + radius, radius),
        inside_cylinder(at(0, 0, 0), Z, foot + radius),
        outside_cylinder(at(0, 0, 0), Z, foot - MARGIN),
        half(-Z, at(0, 0, radius)),
        half(Z, at(0, 0, -MARGIN)),
    ]
    pad = 2 * (foot + radius)
    return Region(parts, ORIGIN - pad, ORIGIN + pad)


def test_surface_behind_the_triangles() -> None:
    foot, radius, sides = 9.7, 4 * H, 64
    part = boss(foot, sides)
    sag = foot * (1 - np.cos(np.pi / sides))

    def cylinder_on_plate(x: FloatArray) -> FloatArray:
        u, v, w = local(x).T
        return np.maximum(foot - np.hypot(u, v), -w)

    exact = Function(cylinder_on_plate, [ORIGIN - 40, ORIGIN + 40], lipschitz=1.0)
    for shape, mean in ((None, 0.3 * sag), (exact, 0.05 * sag)):
        result = stitched(part, [boss_region(foot, radius)], [], H, shape=shape)
        check_sound(result)
        u, v, w = local(new_points(result, part)).T
        out = np.hypot(u, v)
        blend = np.abs(np.hypot(out - foot - radius, w - radius) - radius)
        faces = np.minimum(np.abs(w), np.abs(out - foot))
        inside = (out < foot + radius - 1e-9) & (w < radius - 1e-9) & (w > 1e-9) & (out > foot + 1e-9)
        off = np.where(inside, blend, np.minimum(blend, faces))
        assert off.max() < 1.05 * sag
        assert off.mean() < mean


def off_stitched(result: Mesh, part: Mesh, added: list[Region], removed: list[Region]) -> FloatArray:
    """Values of (part | added) - removed at the vertices."""
    x = result.vertices
    value = np.max([MeshDistance(part)(x), *(shape(x) for shape in added)], axis=0)
    return np.abs(np.min([value, *(-shape(x) for shape in removed)], axis=0))


def test_overlapping_shapes_and_both_kinds_at_once() -> None:
    part = angle_profile()
    inner = edge_region(at(10, 0, 8), at(10, 36, 8), (X, Z), 5 * H, MARGIN, convex=False, cuts=(0, 0))
    end = edge_region(at(30, 0, 8), at(30, 36, 8), (X, Z), 4 * H, MARGIN, convex=True, cuts=(MARGIN, MARGIN))
    side = edge_region(at(10, 0, 8), at(30, 0, 8), (-Y, Z), 4 * H, MARGIN, convex=True, cuts=(0, MARGIN))
    result = stitched(part, [inner], [end, side], H)
    check_sound(result)
    ball, strip = (4 * H) ** 2 * (1 - np.pi / 4), (5 * H) ** 2 * (1 - np.pi / 4)
    assert result.volume == pytest.approx(part.volume + 36 * strip - 56 * ball, rel=1e-3)
    assert off_stitched(result, part, [inner], [end, side]).max() < 5e-3 * H


@pytest.mark.parametrize("radius", [2.3 * H, 4 * H, 5 * H])
def test_seams_of_added_and_removed_shapes(radius: float) -> None:
    part = angle_profile()
    inner = edge_region(at(10, 0, 8), at(10, 36, 8), (X, Z), radius, MARGIN, convex=False, cuts=(0, 0))
    groove = edge_region(at(10, 9, 8), at(30, 9, 8), (Y, Z), 0.8 * radius, MARGIN, convex=True, cuts=(MARGIN, MARGIN))
    result = stitched(part, [inner], [groove], H)
    check_sound(result)
    assert off_stitched(result, part, [inner], [groove]).max() < 5e-3 * H


@pytest.mark.parametrize("calm_reach", [stitching._CALM, ()])
def test_seams_far_from_a_tangle_stay_polished(monkeypatch: pytest.MonkeyPatch, calm_reach: tuple[float, ...]) -> None:
    part = angle_profile()
    inner = edge_region(at(10, 0, 8), at(10, 36, 8), (X, Z), 4 * H, MARGIN, convex=False, cuts=(0, 0))
    groove = edge_region(at(10, 9, 8), at(30, 9, 8), (Y, Z), 3.2 * H, MARGIN, convex=True, cuts=(MARGIN, MARGIN))
    tangled, calmed = stitching._Seams._tangled, stitching._Seams._calmed
    place, calm = at(30, 9 - 3.2 * H, 8), False

    def stuck(run: Any, position: FloatArray, faces: np.ndarray, facing: FloatArray) -> np.ndarray:
        near = (np.linalg.norm(position - place, axis=1) < H) & run.loose
        return tangled(run, position, faces, facing) if calm else np.flatnonzero(near[faces].any(axis=1))

    def late(run: Any, moves: FloatArray, bad: np.ndarray) -> Mesh:
        nonlocal calm
        calm = True
        return calmed(run, moves, bad)

    monkeypatch.setattr(stitching, "_CALM", calm_reach)
    monkeypatch.setattr(stitching._Seams, "_tangled", stuck)
    monkeypatch.setattr(stitching._Seams, "_calmed", late)
    result = stitched(part, [inner], [groove], H)
    assert calm
    check_sound(result)
    far = np.linalg.norm(result.vertices - place, axis=1) > 8 * H
    off = off_stitched(result, part, [inner], [groove])[far].max()
    assert (off < 5e-3 * H) == bool(calm_reach)


def test_shape_smaller_than_a_cell() -> None:
    part = box(SIZE)
    region = edge_region(at(-15, 10, 12.5), at(15, 10, 12.5), (Y, Z), 0.3, 0.2, convex=True, cuts=(0.2, 0.2))
    region.spacing = 0.1
    result = stitched(part, [], [region], H)
    check_sound(result)
    assert result.volume == pytest.approx(part.volume - 30 * 0.3**2 * (1 - np.pi / 4), abs=0.05)
    pin = Function(lambda x: 0.06 - np.abs(x - at(0, 0, 12.5)).max(axis=1), [at(0, 0, 12.5) - 1, at(0, 0, 12.5) + 1])
    assert stitched(part, [], [pin], H).volume < part.volume


def test_what_cannot_be_stitched() -> None:
    part = box(SIZE)
    assert stitched(part, [], [], H) is part
    with pytest.raises(OpenMeshError, match="not closed"):
        stitched(Mesh(part.vertices, part.faces[1:]), [], [box_edge(2.0)], H)
    with pytest.raises(SpacingError, match="spacing"):
        stitched(part, [], [box_edge(2.0)], 0.0)
    everything = Function(lambda x: 40 - np.abs(x).max(axis=1), [[-40] * 3, [40] * 3], lipschitz=1.0)
    with pytest.raises(EmptyResultError, match="nothing is left"):
        stitched(part, [], [everything], 5.0)


def test_contours_get_the_creases_they_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    radius = 2 * H
    region = box_edge(radius)
    monkeypatch.setattr("cad_implicit.dual.mend_corners", lambda mesh, *_: mesh)  # finds most of them already
    before = dual_contour(region, H)
    after = split_at_creases(before, region.value_and_gradient, H)
    assert after.is_watertight
    assert count_intersections(after) == 0
    assert np.abs(region(after.vertices)).max() < 1e-3 * H

    def cut_corners(mesh: Mesh) -> int:
        """Edges from the ball to a wall without a vertex where these meet."""
        y, z = (local(mesh.vertices) - [0, 10, 12.5])[:, 1:].T
        ball = (np.abs(np.hypot(y + radius, z + radius) - radius) < 1e-3) & (np.maximum(y, z) < -1e-3)
        wall = ((np.abs(y + radius) < 1e-3) & (z > 0.05)) | ((np.abs(z + radius) < 1e-3) & (y > 0.05))
        start, end = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
        in_part = np.abs(local(mesh.vertices)[:, 0]) < 15
        return int((ball[start] & wall[end] & in_part[start]).sum())

    assert cut_corners(before) > 10
    assert cut_corners(after) == 0


def test_sheets_thinner_than_cells_get_no_creases_within() -> None:
    """Between a cylinder and a wall 0.15 spacings from it, where the gradient jumps halfway."""
    radius, wall = 8 * H, 8.15 * H
    cylinder, ahead = outside_cylinder(at(0, 0, 0), Z, radius), half(X, at(0.7 * radius, 0, 0))
    walls = [half(-X, at(wall, 0, 0)), half(Z, at(0, 0, 0)), half(-Z, at(0, 0, 2))]
    sheet = Region([cylinder, ahead, *walls], at(0, 0, 0) - 12 * H, at(0, 0, 0) + 12 * H)
    before = dual_contour(sheet, H)
    after = split_at_creases(before, sheet.value_and_gradient, H)
    new = after.vertices[len(before.vertices) :]
    assert len(new) > 0
    assert np.abs(sheet(new)).max() < 5e-3 * H
    assert count_intersections(after) <= count_intersections(before)


@pytest.mark.nojit
def test_strips_without_area_go() -> None:
    """One upright in the middle of a flat face, with a needle beside it from corner to corner."""
    x = np.array([0.0, 0.23, 0.41, 0.66, 0.85, 1.0, 1.0])
    y = np.array([0.0, 1e-9, -1e-9, 1e-9, -1e-9, 1e-5, 0.0])
    corners = np.array([[0.4, 1, 0], [0.4, -1, 0], [0.4, 0, -1]])
    points = np.concatenate([np.stack([x, y, 0 * x], axis=1), corners]) @ TURN.T + ORIGIN
    strip, needle = [[5, k + 1, k] for k in range(4)], [[5, 0, 6]]
    front, back = [*([k, k + 1, 7] for k in range(4)), [4, 5, 7], [5, 6, 7]], [[6, 0, 8]]
    faces = np.array([*strip, *needle, *back, *front, [0, 7, 9], [7, 6, 9], [8, 0, 9], [6, 8, 9]], np.int32)
    assert Mesh(points, faces).is_watertight
    vectors = Mesh(points, faces).face_vectors
    facing = np.zeros((len(faces), 4))
    facing[:, :3] = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    facing[:4, :3], facing[4:12, :3] = Y, Z
    facing[:, 3] = [*[1] * 4, 2, 2, *[3] * 6, 4, 5, 6, 7]
    loose = np.array([0, 2, 2, 2, 2, 2, 0, 0, 0, 0], np.int8)
    kept = seams.tidy(points, faces, facing, loose, 1e-3, 1e-3, 0.01, 0.0)
    mesh = Mesh(points, faces[kept])
    assert mesh.is_watertight
    longest = ((points[mesh.faces] - points[np.roll(mesh.faces, 1, axis=1)]) ** 2).sum(axis=2).max(axis=1)
    assert (np.linalg.norm(mesh.face_vectors, axis=1) > 0.05 * longest).all()


@pytest.mark.nojit
def test_caps_and_tiny_edges_go() -> None:
    # The flat top of a pyramid is cut along its middle, with caps and a tiny edge.
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.4, 1e-9, 0], [0.4, 0, 1e-9], [0.5, 0, -1]])
    faces = np.array(
        [[0, 4, 2], [4, 1, 2], [0, 5, 4], [5, 1, 4], [0, 3, 5], [3, 1, 5], [0, 2, 6], [2, 1, 6], [1, 3, 6], [3, 0, 6]],
        np.int32,
    )
    assert Mesh(points, faces).is_watertight
    facing = np.zeros((len(faces), 4))
    vectors = Mesh(points, faces).face_vectors
    facing[:, :3] = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    facing[:6, :3] = [0, 0, 1]
    loose = np.array([0, 0, 0, 0, 1, 2, 0], np.int8)
    kept = seams.tidy(points, faces, facing, loose, 1e-4, 1e-3, 0.1, 0.0)
    result = Mesh(points, faces[kept])
    assert result.is_watertight
    assert len(result.faces) == 8
    assert np.linalg.norm(result.face_vectors, axis=1).min() > 0.1


@pytest.mark.parametrize("seed", range(12))
def test_a_needle_of_14_mm_beside_an_edge_is_turned_into_the_other_face(seed: int) -> None:
    """Its height of 1e-10 mm is none; from squared lengths it seemed to be 2e-7 mm, too much for seams tidied less."""
    x, y = 14.0, 3.0
    corners = [[0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0], [0, 0, -y], [x, 0, -y], [x, y, -y], [0, y, -y]]
    points = np.array([*corners, [x - 0.1, 1e-10, 0], [x / 2, y / 2, 0], [x / 2, 0, -y / 2]])
    on_edge, above, beside = 8, 9, 10
    top = [[0, on_edge, above], [on_edge, 1, above], [1, 2, above], [2, 3, above], [3, 0, above], [0, 1, on_edge]]
    side = [[4, 5, beside], [5, 1, beside], [1, 0, beside], [0, 4, beside]]
    rest = [[1, 5, 6], [1, 6, 2], [0, 3, 7], [0, 7, 4], [3, 2, 6], [3, 6, 7], [4, 7, 6], [4, 6, 5]]
    faces = np.array([*top, *side, *rest], np.int32)
    normals = np.zeros((len(faces), 3))
    normals[:6, 2], normals[6:10, 1] = 1, -1
    normals[10:] = np.repeat([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, -1]], 2, axis=0)
    number = np.repeat([17, 11, 1, 2, 3, 4], [6, 4, 2, 2, 2, 2])
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    facing = np.column_stack([normals @ turn.T, number])
    points = points @ turn.T + ORIGIN
    assert Mesh(points, faces).is_watertight
    assert ((Mesh(points, faces).face_vectors * facing[:, :3]).sum(axis=1) > 0).all()
    kept = seams.tidy(points, faces, facing, np.full(len(points), 2, np.int8), 2e-8, 4e-8, 0.05, 2e-6)
    assert kept.all()
    assert Mesh(points, faces).is_watertight
    assert np.linalg.norm(Mesh(points, faces).face_vectors, axis=1).min() > 0.01
    np.testing.assert_array_equal(np.bincount(facing[:, 3].astype(int))[[11, 17]], [5, 5])


def test_flaps_where_a_blend_ends_in_a_face_are_taken_off() -> None:
    # At one place of this part the boolean leaves four triangles that lie on each other.
    pytest.importorskip("OCP")
    from validation.fillets.corpus import jobs
    from validation.fillets.performing import prepared

    part, radius, _ = prepared(next(job for job in jobs() if job.key == "bracket round convex 0.01"))
    mesh = run(part, "round", radius, edges="convex", spacing=radius / 4).mesh
    assert count_intersections(mesh) == 0
    assert mesh.is_watertight
