"""Parts into which, or holes through which, the ball barely fits: against the analytic truth, on and off the axes.

The ball's centres then make a point, a line, a sheet, or a body thinner than the spacing.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import shapes
import trimesh
from manifold3d import Manifold
from numpy.typing import NDArray

import cad_implicit as ci
from cad_implicit.errors import EmptyResultError
from cad_implicit.exact import Closing, opening
from cad_implicit.inscribed import largest_ball

Points = NDArray[np.float64]
R, H = 2.0, 0.4

#: Facets of the mesh that lie on a blend are off by this many spacings² over the radius.
CHORD = 0.35


def box(half: list[float]) -> Manifold:
    return shapes.box([-x for x in half], half)


def box_error(half: list[float], radius: float) -> Callable[[Points], Points]:
    """Distance from the surface of a box whose edges are all round, in its frame."""
    room = np.maximum(np.array(half) - radius, 0)
    return lambda x: np.linalg.norm(x - np.clip(x, -room, room), axis=1) - radius


def on_box(half: list[float], radius: float, count: int = 4000) -> Points:
    """Points on that surface."""
    random = np.random.default_rng(5)
    direction = random.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    room = np.maximum(np.array(half) - radius, 0)
    return room * np.where(np.abs(direction) > 0.2, np.sign(direction), random.uniform(-1, 1, (count, 3))) + (
        radius * np.where(room > 0, np.where(np.abs(direction) > 0.2, direction, 0), direction)
    )


def rod(radius: float, height: float, facets: float) -> Manifold:
    """Cylinder around z with so much sagitta."""
    segments = int(np.ceil(np.pi / np.arccos(1 - facets / radius)))
    return Manifold.cylinder(height, radius, radius, segments, center=True)


def part_of(shape: Manifold, turned: bool) -> ci.Mesh:
    raw = shape.to_mesh64()
    points, faces = np.asarray(raw.vert_properties)[:, :3], np.asarray(raw.tri_verts, np.int64)
    return ci.Mesh(shapes.placed(points) if turned else points + shapes.SHIFT, faces)


def local(points: Points, turned: bool) -> Points:
    moved = points - shapes.SHIFT
    return np.asarray(moved @ shapes.TURN) if turned else moved


def both_ways(result: ci.Mesh, error: Callable[[Points], Points], turned: bool) -> tuple[float, float]:
    """Largest distance in spacings of the vertices from the truth, and of the points of a coarse sample of the mesh."""
    triangles = result.vertices[result.faces].mean(axis=1)
    vertex, facet = (np.abs(error(local(x, turned))).max() / H for x in (result.vertices, triangles))
    return float(vertex), float(facet)


@pytest.mark.parametrize("turned", [True, False])
@pytest.mark.parametrize("room", [0.0, 1e-9, 0.1, 0.3, 0.7, 1.1, 1.5])
@pytest.mark.parametrize("kind", ["point", "line", "sheet"])
def test_walls_as_thick_as_the_ball(kind: str, room: float, turned: bool) -> None:
    tight = R + room * H / 2
    half = {"point": [tight] * 3, "line": [5.0, tight, tight], "sheet": [5.0, 6.1, tight]}[kind]
    result = ci.contour(ci.round(part_of(box(half), turned), R, spacing=H))
    vertex, facet = both_ways(result, box_error(half, R), turned)
    assert vertex < 1e-3
    assert facet < CHORD * H / R
    assert result.components == 1
    truth = on_box(half, R)
    truth = truth[np.abs(box_error(half, R)(truth)) < 1e-9]
    assert len(truth) > 200
    placed = shapes.placed(truth) if turned else truth + shapes.SHIFT
    assert ci.MeshDistance(result).unsigned(placed).max() < CHORD * H**2 / R


def chamfered() -> Manifold:
    """Cube of side 10 with round vertical edges of radius 1 and a chamfer as large below, which comes to points."""
    angle = np.arange(360) * np.pi / 180
    corner = np.sign(np.round(np.cos(angle + np.pi / 4e3), 9)), np.sign(np.round(np.sin(angle + np.pi / 4e3), 9))
    outline = np.stack([4 * corner[0] + np.cos(angle), 4 * corner[1] + np.sin(angle)], axis=1)
    low = [[x, y, 0.0] for x in (-4, 4) for y in (-4, 4)]
    points = np.concatenate([low, *(np.column_stack([outline, np.full(360, z)]) for z in (1.0, 10.0))])
    return Manifold.hull_points(points.astype(np.float32))


def steiner(room: Manifold, radius: float) -> float:
    """Volume of all that balls with their centres in a convex body sweep."""
    raw = room.to_mesh64()
    body = trimesh.Trimesh(np.asarray(raw.vert_properties)[:, :3], np.asarray(raw.tri_verts), process=False)
    sheets = body.area * radius + body.integral_mean_curvature * radius**2
    return float(body.volume + sheets + 4 / 3 * np.pi * radius**3)


ROOT = np.sqrt(2)
CASES = {
    "cube to sphere": (box([5, 5, 5]), 5.0, 4 / 3 * np.pi * 125),
    "nearly": (box([5, 5, 5]), 4.999, steiner(box([0.001] * 3), 4.999)),
    "stadium": (box([25, 40, 30]), 25.0, 50 * 300 + np.pi * 625 * 40 + 4 / 3 * np.pi * 25**3),
    "nearly a stadium": (box([25, 40, 30]), 24.99, steiner(box([0.01, 15.01, 5.01]), 24.99)),
    "chamfered": (
        chamfered(), 1.0,
        steiner(
            Manifold.hull_points(np.array(
                [[x, y, z] for z, b in ((1, 5 - ROOT), (ROOT, 4), (9, 4)) for x in (-b, b) for y in (-b, b)], np.float32
            )), 1.0,
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_volumes_of_parts_that_exact_kernels_fail_on(name: str) -> None:
    shape, radius, volume = CASES[name]
    h = radius / 5
    result = ci.contour(ci.round(part_of(shape, True), radius, spacing=h))
    assert result.is_watertight
    # Chords of hollow balls lie inside.
    assert -1e-4 * volume < volume - result.volume < CHORD * h**2 / radius * result.area


@pytest.mark.parametrize("room", [-1e-9, 1e-12])
def test_fits_to_nine_digits(room: float) -> None:
    shape = opening(ci.MeshDistance(part_of(box([R, 5.0, 6.0]), True)), R * (1 - room), H)
    assert shape(shapes.placed(np.zeros((1, 3)))) == pytest.approx(R, rel=1e-6)


@pytest.mark.parametrize("room", [0.0, 1e-6, 0.1, 0.3, 0.7, 1.1])
def test_rods_as_thick_as_the_ball(room: float) -> None:
    radius, height = R + room * H, 11.0

    def error(x: Points) -> Points:
        across = np.hypot(x[:, 0], x[:, 1])
        beyond = x[:, 2] - np.clip(x[:, 2], R - height / 2, height / 2 - R)
        return np.hypot(across - np.minimum(across, radius - R), beyond) - R

    result = ci.contour(ci.round(part_of(rod(radius, height, 0.005 * H), True), R, spacing=H))
    vertex, facet = both_ways(result, error, True)
    # Facets cut into the ball if the rod is no thicker: it fits up to 0.01 spacings.
    assert vertex < (0.03 if room < 1e-3 else 0.006)
    assert facet < CHORD * H / R
    assert result.components == 1


@pytest.mark.parametrize("room", [0.0, 1e-6, 0.1, 0.3, 0.7, 1.1])
def test_holes_as_wide_as_the_ball_stay_as_they_are(room: float) -> None:
    hole = rod(R + room * H, 20, 0.005 * H)
    part = part_of(box([6, 6, 3]) - hole, True)
    shape, distance = ci.fillet(part, R, spacing=H), ci.MeshDistance(part)
    result = ci.contour(shape)
    assert result.genus == 1
    assert np.percentile(np.abs(distance(result.vertices)), 99.9) < 0.02 * H
    near = np.random.default_rng(3).uniform(-1, 1, (5000, 3)) * [R + H, R + H, 4]
    near = near[np.hypot(near[:, 0], near[:, 1]) > R - H] @ shapes.TURN.T + shapes.SHIFT
    # Not polished: facets count, and the layer of centres is contoured by chords.
    assert np.abs(shape(near) - distance(near)).max() < 0.25 * H


@pytest.mark.parametrize(("room", "bound"), [(0.0, 0.06), (0.3, 1e-3), (1.0, 1e-3)])
def test_tubes_with_walls_as_thick_as_the_ball(room: float, bound: float) -> None:
    """The centres make a curved sheet; facets are in the way of an exact fit."""
    inner, height = 6.0, 11.0
    outer = inner + 2 * R + room * H
    part = Manifold.cylinder(height, outer, outer, 720, center=True) - Manifold.cylinder(20, inner, inner, 720, True)

    def error(x: Points) -> Points:
        across = np.hypot(x[:, 0], x[:, 1])
        across -= np.clip(across, inner + R, outer - R)
        return np.hypot(across, x[:, 2] - np.clip(x[:, 2], R - height / 2, height / 2 - R)) - R

    result = ci.contour(ci.round(part_of(part, True), R, spacing=H))
    off = np.abs(error(local(result.vertices, True))) / H
    assert off.max() < bound
    assert np.percentile(off, 98) < 0.02
    assert result.genus == 1


@pytest.mark.parametrize("room", [0.0, 0.1, 0.7])
def test_slots_as_wide_as_the_ball(room: float) -> None:
    """A slot through a block, with a flat bottom: filleted by one half cylinder if it is no wider."""
    half = R + room * H / 2
    part = box([6, 9, 5]) - shapes.box([-half, -10, -1], [half, 10, 6])
    result = ci.contour(ci.fillet(part_of(part, True), R, spacing=H))
    x = local(result.vertices, True)
    below = (np.abs(x[:, 0]) < half - 1e-3) & (x[:, 2] > -1.5) & (x[:, 2] < 1 - 1e-3) & (np.abs(x[:, 1]) < 9 - R)
    axis = np.clip(x[below, 0], R - half, half - R)
    off = np.hypot(x[below, 0] - axis, x[below, 2] - (R - 1)) - R
    assert below.sum() > 100
    assert np.abs(off).max() < 1e-3 * H
    assert ci.MeshDistance(result)(shapes.placed(np.array([[0, 0, 4.0]])))[0] == pytest.approx(-half, abs=0.02)


def test_a_neck_that_barely_fits_between_thick_ends() -> None:
    """Sheets join the contoured surface without a gap: the rounds of a plate that is thicker at both ends."""
    half = [9.0, 5.0, R]
    part = box(half) + shapes.box([-9, -5, -4], [-5, 5, 4]) + shapes.box([5, -5, -4], [9, 5, 4])
    result = ci.contour(ci.round(part_of(part, True), R, spacing=H))
    x = local(result.vertices, True)
    middle = np.abs(x[:, 0]) < 5 - R
    assert middle.sum() > 500
    assert np.abs(box_error(half, R)(x[middle])).max() < 1e-3 * H
    assert result.components == 1


def test_a_second_operation_sees_the_first_one_that_barely_fits() -> None:
    half = [6.0, 5.0, R]
    shape = ci.smooth(part_of(box(half), True), R, spacing=H)
    vertex, facet = both_ways(ci.contour(shape), box_error(half, R), True)
    assert vertex < 0.01
    assert facet < CHORD * H / R


@pytest.mark.filterwarnings("ignore:material")
def test_where_nothing_fits_the_largest_ball_is_told() -> None:
    part = part_of(box([9, 7, 1.5]) + shapes.box([2, 2, -1.75], [7, 7, 1.75]), True)
    with pytest.raises(EmptyResultError, match=r"nowhere 4 mm thick.* has a radius of 1\.7\d* mm, around"):
        ci.round(part, R, spacing=H)
    fits, place = largest_ball(ci.MeshDistance(part))
    assert fits == pytest.approx(1.75, rel=1e-6)
    assert local(np.array([place]), True)[0, 2] == pytest.approx(0, abs=1e-5)
    assert ci.contour(ci.round(part, fits, spacing=H)).volume > 0


def test_nothing_is_added_where_the_contour_is_right() -> None:
    distance = ci.MeshDistance(shapes.notch(90, 20))
    assert Closing(distance, R, H)._centres.surface.mesh.is_watertight  # the contour alone


def test_the_same_for_any_number_of_threads() -> None:
    part = part_of(box([5, 6, R + 0.1 * H]), True)
    one, two = (ci.contour(ci.round(part, R, spacing=H, threads=n), threads=n) for n in (1, 2))
    assert (one.vertices == two.vertices).all()
    assert (one.faces == two.faces).all()
