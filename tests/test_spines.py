"""Spines: centres of balls against formulas for planes and cylinders; guides, and what lies between their samples."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import SHIFT, TURN, placed

from cad_implicit.faces import CylinderFace, PlaneFace
from cad_implicit.guides import Guide, Support, extended, hermite, hermite_slope, speed
from cad_implicit.implicit import FloatArray
from cad_implicit.rails import law
from cad_implicit.spines import Spine, halfway, spine

X, Y, Z = TURN.T
EXACT = 1e-9


def local(points: FloatArray) -> FloatArray:
    return (points - SHIFT) @ TURN


def wedge(degrees: float, sign: float) -> tuple[Support, Support]:
    """Faces that meet along local z; the ball's side is the wedge around local +x, of material if ``sign`` is 1."""
    half = np.radians(degrees / 2)
    normals = (-np.sin(half) * X + np.cos(half) * Y, -np.sin(half) * X - np.cos(half) * Y)
    return tuple(Support(PlaneFace(SHIFT, sign * normal), sign) for normal in normals)


def straight(length: float, count: int = 5) -> Guide:
    z = np.linspace(0, length, count)
    return Guide.along(placed(np.stack([0 * z, 0 * z, z], axis=1)), np.tile(Z, (count, 1)), False)


def circle(radius: float, turn: float = 2 * np.pi, count: int = 65) -> Guide:
    """Around local z, in the plane z = 0; closed if it turns all around."""
    a = np.linspace(0, turn, count)
    points = radius * np.stack([np.cos(a), np.sin(a), 0 * a], axis=1)
    return Guide.along(placed(points), np.stack([-np.sin(a), np.cos(a), 0 * a], axis=1) @ TURN.T, turn == 2 * np.pi)


def around(radius: float, outside: bool, above: bool, sign: float) -> tuple[Support, Support]:
    """Plane z = 0 and cylinder about z, the ball on the given sides of them."""
    plane = PlaneFace(SHIFT, sign * Z if not above else -sign * Z)
    wall = CylinderFace(SHIFT + 3 * Z, Z, radius, side=-sign if outside else sign)
    return Support(plane, sign), Support(wall, sign)


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["convex", "concave"])
@pytest.mark.parametrize("degrees", [60.0, 90.0, 120.0])
def test_between_planes(degrees: float, sign: float) -> None:
    guide, radius = straight(17.0), 2.3
    found = spine(guide, wedge(degrees, sign), law(radius, guide.length), guide.at)
    half = np.radians(degrees / 2)
    assert found.solved.all()
    truth = np.stack([0 * found.at + radius / np.sin(half), 0 * found.at, found.at], axis=1)
    assert np.abs(local(found.centres) - truth).max() < EXACT
    assert np.abs(found.tangents - Z).max() < EXACT
    contacts = np.array([[-np.sin(half), np.cos(half), 0], [-np.sin(half), -np.cos(half), 0]])
    assert np.abs(found.contacts @ TURN - contacts).max() < EXACT
    foot = radius / np.tan(half)  # how far from the edge the ball touches
    touching = np.linalg.norm(found.touching() - found.edge[:, None], axis=2)
    assert np.abs(touching - foot).max() < EXACT
    assert found.length == pytest.approx(17.0)
    assert (found.slope == 0).all()


@pytest.mark.parametrize("above", [True, False])
@pytest.mark.parametrize("outside", [True, False])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ring_between_plane_and_cylinder(outside: bool, above: bool, sign: float) -> None:
    guide, radius = circle(5.3), 1.7
    found = spine(guide, around(5.3, outside, above, sign), law(radius, guide.length), guide.at)
    ring = 5.3 + radius if outside else 5.3 - radius
    assert found.solved.all()
    assert found.closed
    x, y, z = local(found.centres).T
    assert np.abs(np.hypot(x, y) - ring).max() < EXACT
    assert np.abs(z - (radius if above else -radius)).max() < EXACT
    assert np.abs(found.tangents @ TURN - np.stack([-y, x, 0 * x], axis=1) / ring).max() < EXACT
    assert found.length == pytest.approx(2 * np.pi * ring, rel=2e-3)
    x, y, z = local(halfway(found)).T
    assert np.abs(np.hypot(x, y) - ring).max() < 2e-6 * radius


def test_ball_larger_than_its_hole() -> None:
    guide = circle(5.3)
    for radius, fits in ((5.2, True), (5.4, False), (8.0, False)):
        found = spine(guide, around(5.3, False, True, -1.0), law(radius, guide.length), guide.at)
        assert (found.solved == fits).all()


@pytest.mark.parametrize("degrees", [60.0, 90.0, 120.0])
def test_radius_that_varies(degrees: float) -> None:
    guide, supports, growth = straight(20.0), wedge(degrees, 1.0), 3 / 20
    half = np.radians(degrees / 2)
    found = spine(guide, supports, law((1.0, 4.0), 20.0), np.linspace(0, 20, 9))
    radius = 1 + growth * found.at
    assert found.solved.all()
    assert found.radius == pytest.approx(radius)
    for support in supports:
        assert np.abs(support(found.centres)[0] - radius).max() < EXACT
    truth = np.stack([radius / np.sin(half), 0 * radius, found.at], axis=1)
    assert np.abs(local(found.centres) - truth).max() < 4 * EXACT
    away = np.linalg.norm(found.touching() - found.edge[:, None], axis=2)
    assert np.abs(away - (radius / np.tan(half))[:, None]).max() < 4 * EXACT
    way = np.array([growth / np.sin(half), 0, 1])  # of the centre, per mm of the edge
    assert found.slope == pytest.approx(growth / np.linalg.norm(way))
    assert np.abs(found.tangents @ TURN - way / np.linalg.norm(way)).max() < EXACT


def test_radius_as_a_function_is_like_two_numbers() -> None:
    guide, supports = straight(20.0), wedge(75.0, 1.0)
    one, other = (spine(guide, supports, law(r, 20.0), guide.at) for r in ((1.0, 4.0), lambda f: 1 + 3 * f))
    assert one.centres == pytest.approx(other.centres)
    assert one.slope[1:-1] == pytest.approx(other.slope[1:-1])


def crossing(small: float, large: float, radius: float) -> Spine:
    """Ball outside a cylinder along z and a larger one along x, along the upper line where these meet."""
    a = np.linspace(0, 2 * np.pi, 33)
    height = np.sqrt(large**2 - (small * np.sin(a)) ** 2)
    points = np.stack([small * np.cos(a), small * np.sin(a), height], axis=1)
    slope = -(small**2) * np.sin(a) * np.cos(a) / height
    tangents = np.stack([-small * np.sin(a), small * np.cos(a), slope], axis=1)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    guide = Guide.along(placed(points), tangents @ TURN.T, True)
    upright, lying = CylinderFace(SHIFT, Z, small), CylinderFace(SHIFT, X, large)
    return spine(guide, (Support(upright, -1.0), Support(lying, -1.0)), law(radius, guide.length), guide.at)


def test_crossing_cylinders_and_what_lies_between_samples() -> None:
    radius = 1.3
    found = crossing(3.0, 4.0, radius)
    assert found.solved.all()
    for centres, most in ((found.centres, EXACT), (halfway(found), 4e-6 * radius)):
        x, y, z = local(centres).T
        assert np.abs(np.hypot(x, y) - 3.0 - radius).max() < most
        assert np.abs(np.hypot(y, z) - 4.0 - radius).max() < most
        assert (z > 0).all()
    assert len(found.at) > 33  # samples were added where the contacts turn
    turned = (found.contacts[1:] * found.contacts[:-1]).sum(axis=2).min()
    assert np.arccos(turned) < 0.12


def test_cubic_pieces_follow_arcs() -> None:
    """The error falls with the sixth power of the turn."""
    t = np.linspace(0, 1, 101)[:, None]
    errors = []
    for turn in (0.4, 0.2, 0.1):
        ends = np.array([[np.cos(a), np.sin(a), 0.0] for a in (0.0, turn)])
        along = np.array([[-np.sin(a), np.cos(a), 0.0] for a in (0.0, turn)])
        length = speed(ends[:1], ends[1:], along[:1], along[1:])
        piece = [ends[:1], ends[1:], length * along[:1], length * along[1:]]
        errors.append(np.abs(np.linalg.norm(hermite(*piece, t), axis=1) - 1).max())
        step = 1e-6
        differences = (hermite(*piece, t + step) - hermite(*piece, t - step)) / (2 * step)
        assert hermite_slope(*piece, t) == pytest.approx(differences, abs=1e-8)
    assert errors[0] < 1e-6
    assert errors[0] / errors[1] == pytest.approx(64, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(64, rel=0.1)


def test_guide_places_and_positions() -> None:
    guide = circle(4.1, 2.0, 33)
    assert guide.length == pytest.approx(8.2)
    at = np.linspace(0, 8.2, 57)
    points, directions = guide.place(at)
    truth = 4.1 * np.stack([np.cos(at / 4.1), np.sin(at / 4.1), 0 * at], axis=1)
    assert np.abs(local(points) - truth).max() < 1e-6
    outward = np.cross(directions, Z)
    for away in (-3.0, -0.5, 0.0, 1.9, 6.0):
        beside = points + away * outward - 0.7 * Z
        assert np.abs(guide.position(beside) - at).max() < 1e-6
    ends, directions = guide.place(np.array([-3.0, 11.2]))
    for end, direction, inner, way in zip(ends, directions, guide.points[[0, -1]], (-3.0, 3.0), strict=True):
        assert np.abs(end - inner - way * direction).max() < EXACT
    assert np.abs(directions - guide.tangents[[0, -1]]).max() < EXACT


def test_guide_that_is_closed_goes_on_at_its_start() -> None:
    guide = circle(4.1)
    at = np.array([0.3, 11.0, 25.0])
    for turns in (-1, 1, 3):
        again = guide.place(at + turns * guide.length)
        assert np.abs(again[0] - guide.place(at)[0]).max() < EXACT
    assert not np.allclose(guide.place(at + 1.0)[0], guide.place(at)[0], atol=0.5)


def test_guide_searches_between_positions() -> None:
    """Between the legs of a U, both are near; the search starts where it is told to."""
    legs = np.array([[-1.0, 5, 0], [-1, 0, 0], [0, -1, 0], [1, 0, 0], [1, 5, 0]])
    ways = np.array([[0.0, -1, 0], [0, -1, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]])
    guide = Guide.along(placed(legs), ways @ TURN.T, False)
    assert guide.length == pytest.approx(10 + np.pi)
    point = placed(np.array([[0.1, 3.0, 0.4]]))
    assert guide.position(point) == pytest.approx(guide.length - 2.0)
    assert guide.position(point, 0.0, 5.0) == pytest.approx(2.0)
    assert guide.position(point, 5.0) == pytest.approx(guide.length - 2.0)


def test_guide_is_extended_along_the_line_of_its_faces() -> None:
    guide, radius = circle(5.3, 1.1, 17), 5.3
    longer = extended(guide, around(radius, True, True, -1.0), 4.0, 9.0, 0.25)
    assert (len(longer.at), longer.length, longer.closed) == (17 + 16 + 36, guide.length, False)
    x, y, z = local(longer.points).T
    assert np.abs(np.hypot(x, y) - radius).max() < EXACT
    assert np.abs(z).max() < EXACT
    assert np.abs(np.unwrap(np.arctan2(y, x)) * radius - longer.at).max() < EXACT
    assert np.abs(longer.tangents @ TURN - np.stack([-y, x, 0 * x], axis=1) / radius).max() < EXACT
    assert longer.at[0] < -3.9
    assert longer.at[-1] > guide.length + 8.9
    assert longer.at[16] == 0
    assert longer.at[16 : 16 + 17] == pytest.approx(guide.at)


def test_guide_goes_straight_on_where_its_faces_do_not_meet() -> None:
    flat = Support(PlaneFace(SHIFT, Z), 1.0)
    longer = extended(circle(5.3, 1.1, 17), (flat, flat), 1.0, 2.0, 0.5)
    guide = circle(5.3, 1.1, 17)
    assert np.abs(longer.points[0] - guide.points[0] + guide.tangents[0]).max() < EXACT
    assert np.abs(longer.points[-1] - guide.points[-1] - 2 * guide.tangents[-1]).max() < EXACT


def test_spine_beyond_the_ends_of_a_guide_is_that_of_the_continued_edge() -> None:
    guide, supports = circle(5.3, 1.1, 17), around(5.3, True, True, -1.0)
    longer = extended(guide, supports, 6.0, 6.0, 0.4)
    found = spine(longer, supports, law(1.7, guide.length), longer.at)
    x, y, z = local(found.centres).T
    assert found.solved.all()
    assert np.abs(np.hypot(x, y) - 7.0).max() < EXACT
    assert np.abs(z - 1.7).max() < EXACT
    assert np.degrees(np.ptp(np.unwrap(np.arctan2(y, x)))) > 180
