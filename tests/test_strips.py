"""Strips along edges, their ends and corners: values by formula, gradients by differences, off the axes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from shapes import SHIFT, TURN, placed

from cad_implicit.blend_regions import Cleared, Corner, Mitre, Regions, Without
from cad_implicit.chamfers import legs
from cad_implicit.faces import CylinderFace, FaceDistance, PlaneFace
from cad_implicit.guides import Guide, Support
from cad_implicit.implicit import FloatArray
from cad_implicit.rails import law
from cad_implicit.spines import spine
from cad_implicit.strips import Cut, Region, Strip, Trimmed

X, Y, Z = TURN.T
LENGTH, RADIUS, MARGIN = 9.0, 2.1, 0.6


def local(points: FloatArray) -> FloatArray:
    return (points - SHIFT) @ TURN


def planes(sign: float = 1.0) -> tuple[Support, Support]:
    """Faces y = 0 and x = 0; the balls are where x and y are positive."""
    return tuple(Support(PlaneFace(SHIFT, -sign * normal), sign) for normal in (Y, X))


def straight(radius: Any = RADIUS, corners: tuple[bool, bool] = (False, False), sign: float = 1.0) -> Strip:
    """Strip along the edge x = y = 0, from z = 0 to z = 9."""
    z = np.linspace(0, LENGTH, 4)
    guide = Guide.along(placed(np.stack([0 * z, 0 * z, z], axis=1)), np.tile(Z, (4, 1)), False)
    found = spine(guide, planes(sign), law(radius, LENGTH), guide.at)
    return Strip(found, planes(sign), MARGIN, corners)


def scattered(low: ArrayLike, high: ArrayLike, count: int = 400) -> FloatArray:
    return placed(np.random.default_rng(5).uniform(low, high, (count, 3)))


def around_edge(count: int = 400) -> FloatArray:
    return scattered([-1, -1, -1], [2.6, 2.6, LENGTH + 1], count)


def twin(points: FloatArray, corners: tuple[bool, bool] = (False, False)) -> FloatArray:
    """Values of the straight strip, one thing after the other; past the ends, the last ball counts."""
    x, y, z = local(points).T
    ball = np.sqrt((x - RADIUS) ** 2 + (y - RADIUS) ** 2 + (z - np.clip(z, 0, LENGTH)) ** 2) - RADIUS
    within = np.minimum(RADIUS - x, RADIUS - y)
    above = np.minimum(x, y) + MARGIN
    value = np.minimum(np.minimum(ball, within), above)
    for corner, end in zip(corners, (z, LENGTH - z), strict=True):
        value = np.minimum(value, np.where((end > 0) & corner, np.inf, end))
    return value


def check_gradients(region: Region, points: FloatArray) -> None:
    """Gradients by differences wherever one thing decides all around."""
    step = 1e-6
    value, gradient = region.value_and_gradient(points)
    moved = [region.value_and_gradient(points + step * e)[0] for e in np.concatenate([np.eye(3), -np.eye(3)])]
    differences = np.stack([(moved[k] - moved[k + 3]) / (2 * step) for k in range(3)], axis=1)
    smooth = np.abs(np.stack([moved[k] + moved[k + 3] - 2 * value for k in range(3)])).max(axis=0) < 1e-10
    assert smooth.mean() > 0.9
    assert np.abs(differences - gradient)[smooth].max() < 1e-6


@pytest.mark.nojit
@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["convex", "concave"])
@pytest.mark.parametrize("corners", [(False, False), (True, False), (False, True)])
def test_straight_strip_is_what_its_twin_is(corners: tuple[bool, bool], sign: float) -> None:
    x = around_edge(150)
    strip = straight(RADIUS, corners, sign)
    value, gradient, way = strip.evaluate(x)
    assert np.abs(value - twin(x, corners)).max() < 1e-9
    assert np.abs(way - local(x)[:, 2]).max() < 1e-9
    assert np.linalg.norm(gradient, axis=1) == pytest.approx(1.0)
    assert (value > 0).sum() > 15
    assert (value < 0).sum() > 15


def test_straight_strip_near_its_ball() -> None:
    strip = straight()
    turn = np.linspace(np.pi, 1.5 * np.pi, 23)[1:-1]
    turn, z = (m.ravel() for m in np.meshgrid(turn, np.linspace(0.5, LENGTH - 0.5, 17)))
    direction = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    for off in (-0.05, 0.0, 0.05):
        points = placed(
            RADIUS * np.array([1.0, 1, 0]) + (RADIUS + off) * direction + z[:, None] * np.array([0.0, 0, 1])
        )
        value, gradient = strip.value_and_gradient(points)
        # close to where a face is touched the sector's end is nearer
        ball = off < RADIUS * np.minimum(-np.cos(turn), -np.sin(turn))
        assert ball.mean() > 0.9
        assert value[ball] == pytest.approx(off, abs=1e-9)
        assert np.abs(gradient - direction @ TURN.T)[ball].max() < 1e-9
    check_gradients(strip, around_edge())


def test_box_holds_what_is_inside() -> None:
    for strip in (straight(), straight((1.0, 2.1))):
        x = scattered([-3, -3, -3], [5, 5, 12], 4000)
        value = strip.value_and_gradient(x)[0]
        inside = ((x > strip.box[0]) & (x < strip.box[1])).all(axis=1)
        assert (value > 0).sum() > 10
        assert inside[value > 0].all()


def test_far_away_values_are_negative_and_grow() -> None:
    away = np.linspace(5, 50, 10)
    value = straight().value_and_gradient(placed(away[:, None] * [-1.0, -1.0, 0.0] + [0, 0, 4.5]))[0]
    assert (np.diff(value) < -1).all()
    assert value[0] < -1


def test_skin_is_a_margin_above_the_faces() -> None:
    x, y, _ = local(np.concatenate(straight().skin())).T
    assert np.minimum(x, y) == pytest.approx(-MARGIN)
    assert np.maximum(x, y).min() > -1e-9
    assert np.maximum(x, y).max() == pytest.approx(RADIUS)


def test_strip_of_a_radius_that_grows() -> None:
    """Between the faces, a point is outside of all balls by so much as outside of the nearest."""
    strip = straight((1.0, 2.1))
    x = scattered([0.05, 0.05, 1.0], [0.9, 0.9, LENGTH - 1.0])
    s = np.linspace(0, LENGTH, 9001)
    r = 1 + 1.1 * s / LENGTH
    centres = np.stack([r, r, s], axis=1)
    truth = np.array([(np.linalg.norm(centres - place, axis=1) - r).min() for place in local(x)])
    value, gradient = strip.value_and_gradient(x)
    near = np.abs(truth) < 0.1
    assert near.sum() > 40
    assert np.abs(value - truth)[near].max() < 1e-6
    assert np.linalg.norm(gradient[near], axis=1) == pytest.approx(1.0)


def ring_strip(radius: float) -> Strip:
    """Of a boss of radius 4 on the plane z = 0, filled in all around."""
    a = np.linspace(0, 2 * np.pi, 65)
    points = 4 * np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
    guide = Guide.along(placed(points), np.stack([-np.sin(a), np.cos(a), 0 * a], axis=1) @ TURN.T, True)
    supports = (Support(PlaneFace(SHIFT, Z), -1.0), Support(CylinderFace(SHIFT, Z, 4.0), -1.0))
    return Strip(spine(guide, supports, law(radius, guide.length), guide.at), supports, MARGIN)


@pytest.mark.parametrize("radius", [1.0, 2.5])
def test_strip_around_a_boss(radius: float) -> None:
    strip = ring_strip(radius)
    random = np.random.default_rng(7)
    angle, b = random.uniform(0, 2 * np.pi, 500), random.uniform(np.pi, 1.5 * np.pi, 500)
    off = random.uniform(-0.1, 0.1, 500) * radius
    rho, z = 4 + radius + (radius + off) * np.cos(b), radius + (radius + off) * np.sin(b)
    points = placed(np.stack([rho * np.cos(angle), rho * np.sin(angle), z], axis=1))
    value, gradient = strip.value_and_gradient(points)
    # towards the contacts the sector ends
    deciding = off < np.minimum(4 + radius - rho, radius - z) - 1e-6
    assert deciding.mean() > 0.9
    assert np.abs(value - off)[deciding].max() < 1e-5 * radius
    outward = np.stack([np.cos(b) * np.cos(angle), np.cos(b) * np.sin(angle), np.sin(b)], axis=1) @ TURN.T
    assert np.abs(gradient - outward)[deciding].max() < 1e-4
    inside = placed(
        np.array([[4 + 0.1 * radius, 0, 0.1 * radius], [0, -4 - 0.5 * radius, -0.3], [3.8, 0, 0.5 * radius]])
    )
    assert (strip.value_and_gradient(inside)[0] > 0).all()
    outside = placed(np.array([[4 + radius, 0, radius], [0, 4 + 0.3 * radius, -2 * MARGIN], [4.01, 0, 1.2 * radius]]))
    assert (strip.value_and_gradient(outside)[0] < 0).all()


class SlotWall(FaceDistance):
    """Wall of a slot with round ends: so far from a segment along x; the material is outside."""

    kind = "group"

    def __init__(self, half: float, radius: float) -> None:
        self.half, self.radius = half, radius

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        x = local(np.asarray(points, np.float64))
        away = np.stack([x[:, 0] - np.clip(x[:, 0], -self.half, self.half), x[:, 1], 0 * x[:, 2]], axis=1)
        far = np.linalg.norm(away, axis=1)
        return far - self.radius, (away / np.where(far > 0, far, 1.0)[:, None]) @ TURN.T


def test_ball_nearly_as_wide_as_its_slot() -> None:
    """There and back the ball runs 0.2 mm apart: each side of the slot is told from the other."""
    radius, half = 5.9, 7.0
    a = np.linspace(-np.pi / 2, np.pi / 2, 25)
    arc = np.stack([6 * np.cos(a), 6 * np.sin(a)], axis=1)
    way = np.stack([-np.sin(a), np.cos(a)], axis=1)
    # one side has another sample, so that those there and back are not beside each other
    line = np.concatenate([arc + [half, 0], -arc - [half, 0], [[-2.9, -6.0], [half, -6.0]]])
    ways = np.concatenate([way, -way, way[:1], way[:1]])
    flat = np.zeros((len(line), 1))
    guide = Guide.along(placed(np.hstack([line, flat])), np.hstack([ways, flat]) @ TURN.T, True)
    supports = (Support(PlaneFace(SHIFT, Z), -1.0), Support(SlotWall(half, 6.0), -1.0))
    found = spine(guide, supports, law(radius, guide.length), guide.at)
    assert found.solved.all()
    strip = Strip(found, supports, MARGIN)
    random = np.random.default_rng(9)
    place, turn = random.uniform(-half, half, 600), random.uniform(np.pi, 1.5 * np.pi, 600)
    side, off = np.where(random.random(600) < 0.5, -1.0, 1.0), random.uniform(-0.05, 0.05, 600)
    # across the slot from its middle, and above its floor
    across, height = 0.1 - (radius + off) * np.cos(turn), radius + (radius + off) * np.sin(turn)
    points = placed(np.stack([place, side * across, height], axis=1))
    value, gradient = strip.value_and_gradient(points)
    deciding = (off < np.minimum(across - 0.1, radius - height) - 1e-6) & (np.abs(place) < half - 0.01)
    assert deciding.sum() > 500
    assert np.abs(value - off)[deciding].max() < 1e-4
    outward = np.stack([0 * turn, -side * np.cos(turn), np.sin(turn)], axis=1) @ TURN.T
    assert np.abs(gradient - outward)[deciding].max() < 1e-3
    # the same in its round ends
    angle = random.uniform(-np.pi / 2, np.pi / 2, 600)
    points = np.stack([side * (half + across * np.cos(angle)), across * np.sin(angle), height], axis=1)
    value = strip.value_and_gradient(placed(points))[0]
    deciding = off < np.minimum(across - 0.1, radius - height) - 1e-6
    assert deciding.sum() > 500
    assert np.abs(value - off)[deciding].max() < 1e-4


def test_cut_ends_a_strip_at_a_face() -> None:
    slanted = np.array([0.3, 0.2, 1.0]) / np.linalg.norm([0.3, 0.2, 1.0])
    face = Support(PlaneFace(placed(np.array([[0, 0, 6.0]]))[0], slanted @ TURN.T), 1.0)
    strip, x = straight(), around_edge()
    plain, _, ways = strip.evaluate(x)
    for side, margin in ((1.0, 0.0), (-1.0, 0.0), (1.0, 0.4)):
        trimmed = Trimmed(strip, [Cut(face, side, 1, 3.0, margin)])
        value, gradient = trimmed.value_and_gradient(x)
        depth = side * (([0, 0, 6] - local(x)) @ slanted) + margin
        truth = np.where(ways >= 3.0, np.minimum(plain, depth), plain)
        assert np.abs(value - truth).max() < 1e-9
        cut = (ways >= 3.0) & (depth < plain - 1e-9)
        assert cut.sum() > 50
        assert np.abs(gradient[cut] + side * slanted @ TURN.T).max() < 1e-9
    start = Trimmed(strip, [Cut(face, 1.0, 0, 3.0, 0.0)]).value_and_gradient(x)[0]
    later = ways > 3.0
    assert (start[later] == plain[later]).all()


def test_mitre_is_what_strips_have_in_common_beyond_faces() -> None:
    first, second, x = straight(), straight(1.5), around_edge()
    beyond = Support(PlaneFace(SHIFT + 4 * Z, Z), -1.0)  # above z = 4
    value, gradient = Mitre([first, second], [beyond]).value_and_gradient(x)
    parts = [*(strip.value_and_gradient(x)[0] for strip in (first, second)), local(x)[:, 2] - 4]
    assert np.abs(value - np.min(parts, axis=0)).max() < 1e-9
    assert {0, 1, 2} == set(np.argmin(parts, axis=0))
    upright = np.argmin(parts, axis=0) == 2
    assert np.abs(gradient[upright] - Z).max() < 1e-9
    assert Mitre([first, second], [beyond]).margin == MARGIN


def test_region_without_others() -> None:
    whole, less, x = straight(), straight(1.5), around_edge()
    value, gradient = Without(whole, [less]).value_and_gradient(x)
    (f, slope), (g, other) = (strip.value_and_gradient(x) for strip in (whole, less))
    box = less.box
    held = ((x >= box[0]) & (x <= box[1])).all(axis=1)
    assert value[held] == pytest.approx(np.minimum(f, -g)[held])
    assert (value[~held] <= f[~held]).all()
    decided = held & (-g < f - 1e-9)
    assert decided.sum() > 50
    assert np.abs(gradient[decided] + other[decided]).max() < 1e-9
    kept = held & (f < -g)
    assert np.abs(gradient[kept] - slope[kept]).max() < 1e-9


def test_region_without_balls_along_an_edge() -> None:
    """What is in the ball that rolls along x = y = 0 is not of a larger strip there."""
    region, strip, x = straight(2 * RADIUS), straight(), scattered([0, 0, 1], [4, 4, LENGTH - 1])
    value, gradient = Cleared(region, [strip]).value_and_gradient(x)
    whole, slope = region.value_and_gradient(x)
    a, b, _ = local(x).T
    ball = np.hypot(a - RADIUS, b - RADIUS) - RADIUS
    assert value == pytest.approx(np.minimum(whole, ball))
    kept = whole < ball
    assert 50 < kept.sum() < 350
    assert (gradient[kept] == slope[kept]).all()
    assert np.abs((gradient[~kept] * Z).sum(axis=1)).max() < 1e-9
    assert ((whole > 0.1) & (value < -0.1)).sum() > 10


def test_corner_of_three_planes() -> None:
    """Outside the ball around (r, r, r), towards the corner, up to a margin above the faces."""
    centre = placed(np.array([[RADIUS] * 3]))[0]
    corner = Corner(centre, RADIUS, -TURN.T, SHIFT, np.full(3, MARGIN))
    x = scattered([-1, -1, -1], [3, 3, 3], 3000)
    value, gradient = corner.value_and_gradient(x)
    away = local(x) - RADIUS
    inside = (np.linalg.norm(away, axis=1) > RADIUS) & (away < 0).all(axis=1)
    close = (away > -RADIUS - MARGIN).all(axis=1)
    assert (inside & close).sum() > 100
    assert ((value > 0) <= inside).all()
    assert (value > 0)[inside & close].all()
    assert ((value > 0) <= (away > -RADIUS - 1.1 * RADIUS - MARGIN).all(axis=1)).all()
    ball = np.linalg.norm(away, axis=1) - RADIUS
    near = inside & (np.abs(ball) < 0.2) & (away < -0.01).all(axis=1)
    assert near.sum() > 30
    assert value[near] == pytest.approx(ball[near])
    outward = away[near] / np.linalg.norm(away[near], axis=1)[:, None]
    assert np.abs(gradient[near] - outward @ TURN.T).max() < 1e-9
    assert ((x > corner.box[0]) & (x < corner.box[1])).all(axis=1)[value > 0].all()


@pytest.mark.parametrize("trimmed", [False, True])
def test_regions_are_their_union(trimmed: bool) -> None:
    cut = Cut(Support(PlaneFace(SHIFT + 6.2 * Z, Z), 1.0), 1.0, 1, 5.0, 0.1)
    one, other = straight(), straight(1.5)
    if trimmed:  # then all strips are looked at together
        one, other = Trimmed(one, []), Trimmed(other, [cut])
    far = Corner(SHIFT + 40.0, RADIUS, -TURN.T, SHIFT + 40.0 - RADIUS * TURN.sum(axis=1), np.full(3, MARGIN))
    both, x = Regions([one, other, far]), around_edge()
    parts = np.stack([region.value_and_gradient(x)[0] for region in (one, other)])
    held = np.all([((x >= r.box[0]) & (x <= r.box[1])).all(axis=1) for r in (one, other)], axis=0)
    assert both(x)[held] == pytest.approx(parts.max(axis=0)[held])
    slopes = np.stack([region.value_and_gradient(x)[1] for region in (one, other)])
    decided = held & (np.abs(parts[0] - parts[1]) > 1e-9)
    assert decided.sum() > 50
    own = slopes[parts.argmax(axis=0), np.arange(len(x))]
    assert np.abs(both.gradient(x) - own)[decided].max() < 1e-9
    assert sorted(len(cluster.regions) for cluster in both.clusters()) == [1, 2]
    assert (both.bounds[0] == np.min([one.box[0], other.box[0], far.box[0]], axis=0)).all()
    assert both.spacing == pytest.approx(MARGIN / 2)
    beyond = np.array([both.bounds[1] + [3.0, 4.0, 0.0]])
    assert both(beyond)[0] < 0


@pytest.mark.nojit
def test_chamfer_strip() -> None:
    """Beyond the plane through lines 1.2 and 2.5 from the edge."""
    z = np.linspace(0, LENGTH, 4)
    guide = Guide.along(placed(np.stack([0 * z, 0 * z, z], axis=1)), np.tile(Z, (4, 1)), False)
    found = legs(guide, planes(), (1.2, 2.5), guide.at)  # on y = 0, and on x = 0
    assert found.solved.all()
    strip, x = Strip(found, planes(), MARGIN), scattered([-0.5, -0.5, 1], [1.5, 2.8, LENGTH - 1], 150)
    value, gradient = strip.value_and_gradient(x)
    a, b, _ = local(x).T
    normal = -np.array([2.5, 1.2, 0]) / np.hypot(2.5, 1.2)
    beyond = (local(x) - [1.2, 0, 0]) @ normal
    above = np.minimum(a, b) + MARGIN
    assert np.abs(value - np.minimum(beyond, above)).max() < 1e-9
    plane = beyond < above - 1e-9
    assert plane.sum() > 50
    assert np.abs(gradient[plane] - normal @ TURN.T).max() < 1e-9
