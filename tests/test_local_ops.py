"""Local operations through the public functions and jobs: volumes of blends, radii that differ, what is refused."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import shapes
import trimesh

import cad_implicit as ci
from cad_implicit import sizing
from cad_implicit.errors import GeometryWarning, MemoryLimitError, RadiusError, RefusedError, SelectorError
from cad_implicit.local_blend import strip_area

#: Area between a right angle and the arc of radius 1 that rounds it.
SPANDREL = 1 - np.pi / 4

SIZE = (20.0, 16.0, 12.0)
CORNER = "|Z and >X and >Y"


@pytest.fixture(scope="module")
def block() -> ci.Mesh:
    raw = trimesh.creation.box(SIZE)
    return ci.Mesh(raw.vertices, raw.faces)


@pytest.fixture(scope="module")
def angle() -> ci.Mesh:
    """L profile, 12 high and off the axes: one concave edge among 18."""
    return shapes.extrusion([(0, 0), (20, 0), (20, 8), (8, 8), (8, 20), (0, 20)], 12)


def chords(radius: float, length: float, spacing: float) -> float:
    """Volume in mm³ that the facets of a rounded right angle may take at most."""
    return 0.2 * spacing**2 / radius * np.pi / 2 * radius * length


def test_one_edge_loses_the_spandrel_and_nothing_else_moves(block: ci.Mesh) -> None:
    blend = ci.fillet(block, 3, edges=CORNER)
    mesh = ci.contour(blend)
    truth = SPANDREL * 3**2 * SIZE[2]
    assert isinstance(blend, ci.LocalBlend)
    assert mesh.is_watertight
    assert truth < block.volume - mesh.volume < truth + chords(3, SIZE[2], blend.spacing)
    kept = block.vertices[(block.vertices[:, :2] != [10, 8]).any(axis=1)]
    assert set(map(tuple, kept.tolist())) <= set(map(tuple, mesh.vertices.tolist()))


def test_contour_takes_the_parts_own_triangles_at_its_own_spacing_only(block: ci.Mesh) -> None:
    blend = ci.fillet(block, 3, edges=CORNER, spacing=0.8)
    own, anew = ci.contour(blend), ci.contour(blend, 0.7)
    assert (own.vertices == blend.mesh().vertices).all()
    assert len(own.faces) < len(anew.faces)
    assert own.volume == pytest.approx(anew.volume, abs=chords(3, SIZE[2], 0.8))


@pytest.mark.parametrize(
    ("edges", "radius"),
    [
        (["|Z and <X and <Y", CORNER], None),
        ({"|Z and <X and <Y": 2.0, CORNER: 3.0}, {2.0, 3.0}),
        ({"|Z": 2.0, "|Z and >Y": 3.0}, {2.0, 3.0}),
    ],
)
def test_radii_by_edge(edges: Any, radius: set[float] | None, block: ci.Mesh) -> None:
    if isinstance(edges, list):
        edges = [ci.edges(block, one)[0] for one in edges]
    blend = ci.round(block, 2.5, edges=edges, spacing=0.4)
    lost = block.volume - ci.contour(blend).volume
    radii = [2.5, 2.5] if radius is None else [2.0, 3.0] * (2 if "|Z" in edges else 1)
    truth = sum(SPANDREL * r**2 * SIZE[2] for r in radii)
    assert truth < lost < truth + sum(chords(r, SIZE[2], 0.4) for r in radii)


def test_ways_to_name_an_edge_give_the_same(block: ci.Mesh) -> None:
    (edge,) = ci.edges(block, CORNER)
    first = ci.contour(ci.fillet(block, 3, edges=CORNER, spacing=0.8)).vertices
    for named in (edge, edge.number, edge.points, [edge.number], {edge: 3.0}, {edge.number: (3.0, 3.0)}):
        assert ci.contour(ci.fillet(block, 3, edges=named, spacing=0.8)).vertices == pytest.approx(first)


def cone_spandrel(slope: float) -> float:
    """Area between a right angle and the cone of balls that touch both sides, across the edge where their radius is 1.

    The balls around (r, r, s) with r = slope s cover, in the plane s = 1 / slope, an ellipse that touches both sides.
    """
    k, q = slope**2, np.linspace(-np.sqrt(0.5), np.sqrt(0.5), 20001)
    ellipse = (np.sqrt(2) - np.sqrt(2 - (1 - k) * (1 + (1 + k) * q * q))) / (1 - k)
    return float(np.trapezoid(ellipse - abs(q), q))


@pytest.mark.parametrize("radius", [(1.0, 4.0), lambda fraction: 1 + 3 * fraction], ids=["pair", "function"])
def test_radius_that_grows_along_the_edge(radius: Any, block: ci.Mesh) -> None:
    assert cone_spandrel(0.0) == pytest.approx(SPANDREL, rel=1e-6)
    mesh = ci.contour(ci.fillet(block, radius, edges=CORNER, spacing=0.2))
    truth = cone_spandrel(3 / SIZE[2]) * SIZE[2] * (4**3 - 1**3) / 9
    assert mesh.is_watertight
    assert 0.995 * truth < block.volume - mesh.volume < 1.005 * truth + chords(2.5, SIZE[2], 0.2)


def test_fillet_does_each_edge_by_its_kind(angle: ci.Mesh) -> None:
    along = [edge for edge in ci.edges(angle) if edge.length == pytest.approx(12)]
    (hollow,) = [edge for edge in along if edge.convexity == "concave"]
    far = max(along, key=lambda edge: float(np.linalg.norm(edge.centre - hollow.centre)))
    filled = ci.contour(ci.fillet(angle, 3, edges="concave", spacing=0.4))
    truth = SPANDREL * 3**2 * 12
    assert truth < filled.volume - angle.volume < truth + chords(3, 12, 0.4)
    for operation in (ci.fillet, ci.smooth):
        both = ci.contour(operation(angle, edges={hollow: 3.0, far: 2.0}, spacing=0.4))
        assert both.is_watertight
        assert both.volume - angle.volume == pytest.approx(SPANDREL * (3**2 - 2**2) * 12, abs=chords(3, 12, 0.4))
    with pytest.raises(SelectorError, match=f"edge {hollow.number} is concave"):
        ci.round(angle, 2, edges=hollow)
    with pytest.raises(SelectorError, match="is concave, and this takes convex edges only"):
        ci.round(angle, 2, edges="all")


def test_plates_thinner_than_the_ball(block: ci.Mesh) -> None:
    raw = trimesh.creation.box((40, 30, 3))
    mesh = ci.contour(ci.round((raw.vertices, raw.faces), 10, edges="|Z", spacing=0.5))
    truth = 4 * SPANDREL * 10**2 * 3
    assert truth < 3600 - mesh.volume < truth + 4 * chords(10, 3, 0.5)


def test_largest_radius_of_a_box_is_half_its_thinnest_side(block: ci.Mesh) -> None:
    assert ci.max_radius(block, "all") == pytest.approx(6, rel=1e-3)
    assert ci.max_radius(ci.MeshDistance(block), "|Z") == ci.max_radius(block, "|Z")
    with pytest.raises(RadiusError, match=r"the largest radius for these edges is (6|5\.99)"):
        ci.fillet(block, 7, edges="all")


def test_results_go_on_into_other_operations(block: ci.Mesh) -> None:
    first = ci.fillet(ci.MeshDistance(block), 3, edges=CORNER, spacing=0.5)
    second = ci.fillet(first, 2, edges="|Z and <X and <Y")
    assert isinstance(second, ci.LocalBlend)
    assert second.spacing == 0.5
    truth = SPANDREL * (3**2 + 2**2) * SIZE[2]
    lost = block.volume - ci.contour(second).volume
    assert truth < lost < truth + chords(3, SIZE[2], 0.5) + chords(2, SIZE[2], 0.5)
    ball = ci.sphere(4).moved((0, 0, 6))
    less = ci.contour(first - ball, 0.5)
    assert less.volume == pytest.approx(ci.contour(first).volume - 2 / 3 * np.pi * 4**3, rel=2e-3)
    shrunk = ci.contour(ci.offset(first, -1))
    truth = 18 * 14 * 10 - SPANDREL * 2**2 * 10
    assert shrunk.volume == pytest.approx(truth, abs=chords(3, 10, 0.5))


def test_what_is_no_part_or_no_edge(block: ci.Mesh) -> None:
    with pytest.raises(SelectorError, match=r"has no edges to choose from; give its mesh instead"):
        ci.fillet(ci.box(SIZE), 1, edges="all")
    with pytest.raises(ValueError, match="by the engine \"exact\", not 'reinit'"):
        ci.fillet(block, 1, edges="all", engine="reinit")
    with pytest.raises(SelectorError, match="selects no edge"):
        ci.fillet(block, 1, edges="concave")
    with pytest.raises(SelectorError, match="there is no edge 99"):
        ci.fillet(block, 1, edges=99)
    with pytest.raises(SelectorError, match=r"no edge at \(1, 2, 3\) mm"):
        ci.fillet(block, 1, edges=[np.array([[1.0, 2.0, 3.0]])])
    with pytest.raises(SelectorError, match="is no edge: give a selector, a number"):
        ci.fillet(block, 1, edges=[object()])
    with pytest.raises(RadiusError, match="give a radius"):
        ci.fillet(block, edges="all")
    for radius in (None, (1.0, 2.0), lambda fraction: 1.0):
        with pytest.raises(RadiusError, match="radii that vary need chosen edges"):
            ci.smooth(block, radius)
    for radius in (0, -1, float("nan"), (1.0, 0.0)):
        with pytest.raises(RadiusError, match="must be a positive number of mm"):
            ci.round(block, radius, edges="all")


def test_job_on_chosen_edges(block: ci.Mesh) -> None:
    seen: list[str] = []
    outcome = ci.run(
        block, "fillet", 2, edges="|Z", edge_radius={CORNER: (1.0, 3.0)}, progress=lambda stage, _: seen.append(stage)
    )
    figures = json.loads(json.dumps(outcome.as_dict()))
    numbers = sorted(edge.number for edge in ci.edges(block, "|Z"))
    (corner,) = (edge.number for edge in ci.edges(block, CORNER))
    assert figures["edges"] == numbers
    assert figures["radii"] == {str(n): [1.0, 3.0] if n == corner else 2.0 for n in numbers}
    assert (figures["radius"], figures["tangent"], figures["engine"]) == (2.0, True, "exact")
    assert figures["warnings"] == []
    assert set(figures["seconds"]) == {"read", "fillet", "contour", "check"} <= set(seen)
    assert figures["spacing"] == pytest.approx(1 / 6)
    assert figures["error_bound"] == pytest.approx(0.35 / 36 + 0.025 / 6)
    assert figures["watertight"] is True
    truth = SPANDREL * 12 * (3 * 2**2 + 26 / 6)
    assert figures["volume_before"] - figures["volume_after"] == pytest.approx(truth, rel=0.01)


def test_job_without_a_radius_for_all(block: ci.Mesh) -> None:
    outcome = ci.run(block, "round", edge_radius={CORNER: 2.0}, spacing=0.5)
    assert outcome.as_dict()["radius"] is None
    assert len(outcome.options["edges"]) == 1
    everything = {"|Z and >Y": 1.0, "|Z and <Y": 2.0}
    assert len(ci.run(block, "round", edges="|Z", edge_radius=everything, spacing=0.5).options["radii"]) == 4
    with pytest.raises(RadiusError, match=r"edges \d+, \d+, \d+ have no radius"):
        ci.run(block, "round", edges="|Z", edge_radius={CORNER: 2.0})
    with pytest.raises(ValueError, match="say which"):
        ci.run(block, "round", 2, edge_radius={CORNER: 2.0})
    with pytest.raises(ValueError, match="edges can be chosen for fillet, round, smooth, chamfer"):
        ci.run(block, "offset", 2, edges="all")
    with pytest.raises(ValueError, match="engine"):
        ci.run(block, "fillet", 2, edges="all", engine="reinit")
    with pytest.raises(ValueError, match="a chamfer needs edges"):
        ci.run(block, "chamfer", 2)
    with pytest.raises(RadiusError, match="one that varies needs chosen edges"):
        ci.run(block, "fillet", (1.0, 2.0))


def test_job_refuses_what_takes_most_of_the_part() -> None:
    blade = shapes.extrusion([(0, 0), (30, 0), (0, 3)], 4)  # a ball of at most 1.427 mm fits between its sides
    along = [edge for edge in ci.edges(blade) if edge.length == pytest.approx(4)]
    with pytest.raises(RefusedError, match=r"changes the volume of 180 mm³ by -1\d\d.* or --force"):
        ci.run(blade, "round", 1.4, edges=along, spacing=0.2)
    outcome = ci.run(blade, "round", 1.4, edges=along, spacing=0.2, force=True)
    assert "more than blends of edges do" in outcome.warnings[0]
    assert outcome.mesh.is_watertight


def test_job_tells_of_holes_that_vanish() -> None:
    part = shapes.as_mesh(shapes.box([0, 0, 0], [20, 20, 10]) - shapes.box([0.7, 0.7, -1], [1.5, 1.5, 11]))
    place = shapes.placed(np.array([0.0, 0.0, 5.0]))
    upright = min(ci.edges(part), key=lambda edge: float(np.linalg.norm(edge.centre - place)))
    outcome = ci.run(part, "round", 6, edges=upright, spacing=0.8)
    assert any("through holes changed from 1 to 0" in note for note in outcome.warnings)
    assert outcome.mesh.is_watertight


def test_job_on_a_part_that_leaks(block: ci.Mesh) -> None:
    centre = block.vertices[block.faces].mean(axis=1)
    leaky = ci.Mesh(block.vertices, block.faces[centre[:, 0] > centre[:, 0].min()])  # without one side
    outcome = ci.run(leaky, "fillet", 3, edges=CORNER, spacing=0.8)
    assert outcome.error_bound is None
    assert "winding numbers" in outcome.warnings[0]
    assert "contoured anew" in outcome.warnings[1]
    assert outcome.mesh.is_watertight


def test_small_radius_on_a_large_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the strips count: the box of the part would take 200 GiB."""
    monkeypatch.setattr(sizing, "available_memory", lambda: 2**33)
    size = np.array([300.0, 200, 100])
    raw = trimesh.creation.box(size)
    part = ci.Mesh(shapes.placed(raw.vertices), raw.faces)
    blend = ci.round(part, 0.3, edges="all")
    assert blend.spacing == pytest.approx(0.05)
    around = strip_area(blend.choices)
    assert around == pytest.approx(2400 * 0.3 * (2 + np.pi / 2), rel=0.01)
    with pytest.raises(MemoryLimitError, match=r"needs .* GiB, but 8.0 GiB may be used; use a spacing of 0.0") as error:
        ci.round(part, 0.3, edges="all", spacing=0.01)
    fits = float(str(error.value).split("spacing of ")[2].split(" mm")[0])
    assert ci.round(part, 0.3, edges="all", spacing=fits).spacing == fits
    leaky = ci.Mesh(part.vertices, part.faces[:-1])
    with pytest.warns(GeometryWarning, match="not closed"):
        assert ci.round(leaky, 1.2, edges="convex").spacing > 0.4
    with (
        pytest.warns(GeometryWarning, match="not closed"),
        pytest.raises(MemoryLimitError, match="too small for all of a part"),
    ):
        ci.round(leaky, 0.3, edges="convex")
    monkeypatch.setattr(sizing, "TRIANGLE_LIMIT", 10**5)
    with pytest.raises(RefusedError, match="million triangles"):
        ci.run(part, "round", 0.3, edges="all")


@pytest.mark.host
def test_edges_of_a_host() -> None:
    pytest.importorskip("OCP")
    import edge_parts
    from OCP.TopAbs import TopAbs_EDGE

    from cad_implicit.cad import occ

    bar = edge_parts.angle_bar()
    (hollow,) = ci.edges(bar, "concave")
    shape = occ.as_edge(occ.shape_map(bar, TopAbs_EDGE).FindKey(hollow.number))
    named = [ci.contour(ci.fillet(bar, 1.5, edges=one, spacing=0.25)) for one in (shape, {shape: 1.5}, [hollow])]
    truth = SPANDREL * 1.5**2 * 11
    for mesh in named:
        assert mesh.is_watertight
        assert truth < mesh.volume - (9 * 7 - 7 * 4) * 11 < truth + chords(1.5, 11, 0.25)


@pytest.mark.host
def test_tangent_chains_are_followed() -> None:
    pytest.importorskip("OCP")
    import edge_parts

    plate = edge_parts.slotted_plate()
    rim = next(edge for edge in ci.edges(plate, ">Z and %circle"))
    whole = ci.run(plate, "round", 0.8, edges=rim, spacing=0.2)
    single = ci.run(plate, "round", 0.8, edges=rim, spacing=0.2, tangent=False)
    assert (len(whole.options["edges"]), len(single.options["edges"])) == (4, 1)
    straight, bend = 2 * 14, np.pi * 2 * 3
    lost = SPANDREL * 0.8**2 * (straight + bend)  # and a little more, as the ball runs outside the bends
    assert lost < whole.before.volume - whole.mesh.volume < 1.1 * lost
    third = SPANDREL * 0.8**2 * bend / 2
    assert third < single.before.volume - single.mesh.volume < 1.15 * third


@pytest.mark.parametrize(("first", "second"), [(2.0, None), (2.0, 3.0), (3.0, 2.0)])
def test_chamfers_of_a_right_angle(first: float, second: float | None, block: ci.Mesh) -> None:
    mesh = ci.contour(ci.chamfer(block, first, second, edges=CORNER, spacing=0.5))
    assert mesh.is_watertight
    assert block.volume - mesh.volume == pytest.approx(first * (second or first) / 2 * SIZE[2], rel=1e-5)
    (edge,) = ci.edges(block, CORNER)
    left, right = np.cross(edge.normals[0], edge.tangents[0]) * [[first], [-(second or first)]]  # into each face
    sides = np.concatenate([edge.points + left, edge.points + right])
    away = np.linalg.norm(mesh.vertices[:, None] - sides, axis=2).min(axis=0)
    assert away.max() < 1e-5


def test_chamfers_around_a_cylinder_and_in_a_notch(angle: ci.Mesh) -> None:
    raw = trimesh.creation.cylinder(5, 10, sections=720)
    mesh = ci.contour(ci.chamfer(raw, 1.0, edges=">Z", spacing=0.2))
    assert raw.volume - mesh.volume == pytest.approx(np.pi * (25 - (25 + 20 + 16) / 3), rel=2e-3)
    filled = ci.contour(ci.chamfer(angle, 2.0, edges="concave", spacing=0.5))
    assert filled.volume - angle.volume == pytest.approx(2 * 2 / 2 * 12, rel=1e-5)


def test_job_on_chamfers(block: ci.Mesh) -> None:
    figures = ci.run(block, "chamfer", 2, second=3, edges=CORNER, spacing=0.5).as_dict()
    assert (figures["operation"], figures["radius"], figures["second"]) == ("chamfer", 2.0, 3.0)
    assert len(figures["edges"]) == 1
    assert figures["volume_before"] - figures["volume_after"] == pytest.approx(3 * SIZE[2], rel=1e-5)
    with pytest.raises(ValueError, match="several calls"):
        ci.chamfer(block, 1, edges={CORNER: 2.0})
    for lengths in ((0, None), (1, 0), (float("inf"), None)):
        with pytest.raises(RadiusError, match="must be a positive number of mm"):
            ci.chamfer(block, *lengths, edges=CORNER)


@pytest.mark.host
def test_blend_of_a_notch_too_narrow_for_its_ball_stays_behind_the_face_beside() -> None:
    """A foot whose side is shorter than the ball needs: what fills the notch touches its plane in front of its end."""
    pytest.importorskip("OCP")
    import cad_parts
    import edge_parts

    radius, depth = 0.33, 0.75
    slope = depth * np.tan(np.pi / 6)
    corners = [(0, 0), (0, depth), (-5 * slope, -4 * depth), (-3, -4 * depth), (-3, 3), (0.9, 3), (0.9, 0)]
    foot = edge_parts.prism(edge_parts.closed_wire([(x, y, 0) for x, y in corners]), 1.5)
    part = edge_parts.fused(cad_parts.box((9, 9, 1), (-5, -4.5, -1)), foot)
    mesh = ci.contour(ci.fillet(part, radius, edges="concave", spacing=radius / 4))
    x, y, z = mesh.vertices.T
    beside = (x > 0.03) & (x < 0.3) & (y < -0.01) & (y > -radius) & (z > 0.01)
    assert beside.sum() > 5
    high = radius - np.sqrt(radius**2 - (radius + y[beside]) ** 2)
    assert z[beside] == pytest.approx(high, abs=0.01)
