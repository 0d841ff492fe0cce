"""Operations for build123d, in algebra and builder mode: parts come out that go on."""

from __future__ import annotations

import math
from typing import Any

import pytest

pytest.importorskip("build123d", reason="needs build123d")

from build123d import (
    Axis,
    Box,
    BuildPart,
    Color,
    Compound,
    Cylinder,
    Edge,
    GridLocations,
    Location,
    Locations,
    Part,
    Pos,
    Rot,
    Solid,
    Sphere,
    fillet,
)

from cad_implicit.build123d import (
    Provenance,
    implicit_chamfer,
    implicit_fillet,
    implicit_infill,
    implicit_offset,
    implicit_round,
    implicit_shell,
    implicit_smooth,
    safe_fillet,
)
from cad_implicit.errors import EmptyResultError, GeometryWarning, NoSolidError, RadiusError, SelectorError

pytestmark = pytest.mark.host

#: Area that a fillet of radius 1 takes off a right angle.
CORNER = 1 - math.pi / 4

#: Volume of a box of 10 x 8 x 6 with all edges rounded by 1: Steiner's formula.
ROUNDED = 8 * 6 * 4 + 2 * (48 + 32 + 24) + math.pi * (8 + 6 + 4) + 4 / 3 * math.pi

TURN = Pos(3.1, -2.7, 1.3) * Rot(23, 37, 11)


def volume(part: Any) -> float:
    """Volume of a part that must be one valid solid."""
    assert isinstance(part, Compound | Solid)  # build123d's own booleans give either, or a Part
    assert len(part.solids()) == 1
    valid = part.is_valid  # a method in old releases
    assert valid() if callable(valid) else valid
    return float(part.volume)


@pytest.fixture(scope="module")
def rounded() -> Part:
    return implicit_fillet(Box(10, 8, 6).edges().filter_by(Axis.Z), radius=1, spacing=0.3)


def test_edges_find_their_part(rounded: Part) -> None:
    assert 480 - 4 * CORNER * 6 - 0.4 < volume(rounded) < 480 - 4 * CORNER * 6 + 1e-6
    assert type(rounded) is Part
    assert isinstance(rounded.implicit, Provenance)
    assert rounded.implicit.engine == "implicit"
    assert 0 < rounded.implicit.error_bound < 0.05


def test_the_part_goes_on(rounded: Part) -> None:
    before = volume(rounded)
    assert volume(rounded - Cylinder(1, 20)) == pytest.approx(before - math.pi * 6, rel=1e-6)
    assert volume(rounded + Box(2, 2, 12)) == pytest.approx(before + 24, rel=1e-6)
    post = rounded + Pos(0, 0, 4) * Box(2, 2, 4)
    foot = post.edges().filter_by(lambda edge: abs(edge.center().Z - 3) < 0.1 and edge.center().length < 4)
    assert before + 12 < volume(fillet(foot, 0.5)) < before + 13
    assert len(rounded.faces().filter_by(Axis.Z)) == 2


def test_builder_mode() -> None:
    with BuildPart() as made:
        Box(10, 8, 6)
        part = implicit_chamfer(made.edges().filter_by(Axis.Z), 1)
        assert volume(part) == pytest.approx(480 - 4 * 3, rel=1e-6)
        with Locations((0, 0, 3)):
            Cylinder(1, 4)
        implicit_offset(amount=-0.5, spacing=0.3)
    assert isinstance(part.implicit, Provenance)
    octagon = 9 * 7 - 4 * (1 - 0.5 * (2 - math.sqrt(2))) ** 2 / 2  # the chamfers' lengths shrink by 0.5 (2 - sqrt 2)
    assert volume(made.part) == pytest.approx(octagon * 5 + math.pi * 0.25 * 2.0, rel=5e-3)
    with pytest.raises(NoSolidError, match="no part"), BuildPart():
        implicit_offset(amount=1)


def test_faces_stand_for_their_edges_and_vertices_for_those_that_meet_there() -> None:
    box = TURN * Box(10, 8, 6)
    top = box.faces().sort_by(lambda face: face.center().Z)[-1]
    a, b = sorted(edge.length for edge in top.edges())[::2]
    mitred = a * b - (a * b + (a - 2) * (b - 2) + 4 * (a - 1) * (b - 1)) / 6
    assert volume(implicit_chamfer(top, 1)) == pytest.approx(480 - mitred, rel=1e-6)
    corner = implicit_fillet(box.vertices().sort_by(Axis.Z)[-1], 1, spacing=0.3)
    expected = 480 - CORNER * (9 + 7 + 5) - (1 - math.pi / 6)
    assert expected - 0.3 < volume(corner) < expected + 1e-6


def test_all_edges_leave_out_seams_and_poles() -> None:
    can = implicit_round(Cylinder(4, 6).edges(), 1, spacing=0.3)
    one = 2 * math.pi * CORNER * (4 - (10 - 3 * math.pi) / (12 - 3 * math.pi))  # Pappus
    assert volume(can) == pytest.approx(math.pi * 16 * 6 - 2 * one, rel=3e-3)
    with pytest.raises(SelectorError, match="smoothly at all edges"):
        implicit_fillet(Sphere(3).edges(), 1)


def test_radii_of_their_own() -> None:
    several = implicit_fillet(Box(10, 8, 6), {"|Z and >X": 1.0, "|Z and <X": 2.0}, spacing=0.3)
    assert volume(several) == pytest.approx(480 - 2 * 6 * CORNER * (1 + 4), abs=0.6)
    edge = Box(10, 8, 6).edges().filter_by(Axis.Z)[0]
    rising = implicit_smooth(edge, (1.0, 2.0), spacing=0.3)
    assert volume(rising) == pytest.approx(480 - 6 * CORNER * (1 + 2 + 4) / 3, abs=0.2)


def test_what_is_chosen_wrongly() -> None:
    box = Box(10, 8, 6)
    with pytest.raises(SelectorError, match="implicit_fillet: nothing is selected"):
        implicit_fillet(box.edges().filter_by(lambda edge: False), 1)
    with pytest.raises(NoSolidError, match="belongs to no part"):
        implicit_fillet(Edge.make_line((0, 0, 0), (1, 0, 0)), 1)
    with pytest.raises(SelectorError, match="not both"):
        implicit_fillet([box, box.edges()[0]], 1)
    with pytest.raises(SelectorError, match="works on a whole part"):
        implicit_offset(box.faces()[0], 1)  # type: ignore[arg-type]
    with pytest.raises(RadiusError, match="largest radius"):
        implicit_fillet(box.edges(), 5)
    with pytest.raises(SelectorError, match="use a negative thickness"):
        implicit_shell(box, 1, openings=box.faces()[0])


def test_a_part_means_all_of_it() -> None:
    box = TURN * Box(10, 8, 6)
    assert volume(implicit_round(box, 1, spacing=0.3)) == pytest.approx(ROUNDED, rel=2e-3)
    with pytest.warns(GeometryWarning, match="fillet changed nothing.*use round") as caught:
        same = implicit_fillet(box, 1, spacing=0.5)
    assert caught[0].filename == __file__
    assert volume(same) == pytest.approx(480, rel=1e-9)
    thin = Box(50, 50, 20) - Pos(0, 0, 1) * Box(48, 48, 20)
    with pytest.raises(EmptyResultError, match="nothing is left"):
        implicit_round(thin, 1, spacing=0.5)


def test_offset_shell_and_infill() -> None:
    box = TURN * Box(10, 8, 6)
    assert volume(implicit_offset(box, -1)) == pytest.approx(8 * 6 * 4, rel=1e-6)
    assert volume(implicit_shell(box, -1)) == pytest.approx(480 - 8 * 6 * 4, rel=1e-6)
    straight = Box(10, 8, 6)
    opened = implicit_shell(straight, amount=-1, openings=straight.faces().sort_by(Axis.Z)[-1])
    assert volume(opened) == pytest.approx(480 - 8 * 6 * 5, rel=1e-6)
    light = implicit_infill(straight, 4, 1.0, skin=1.0, spacing=0.5)
    assert 480 - 8 * 6 * 4 < volume(light) < 480


def test_safe_fillet() -> None:
    exact = safe_fillet((TURN * Box(10, 8, 6)).edges(), 1)
    assert volume(exact) == pytest.approx(ROUNDED, rel=1e-9)
    assert (exact.implicit.engine, exact.implicit.exact_share) == ("exact kernel", 1.0)
    with BuildPart() as made:
        Box(50, 80, 10)
        stadium = safe_fillet(made.edges().filter_by(Axis.Z), 25)
    assert volume(made.part) == pytest.approx(10 * (50 * 30 + math.pi * 625), rel=2e-4)
    assert stadium.implicit.engine == "implicit"
    assert stadium.implicit.reason
    late = safe_fillet(Box(10, 8, 6), 1, time_limit=0.01, spacing=0.3)
    assert late.implicit.reason == "time out: no answer within 0.01 s"


def test_labels_colours_and_assemblies() -> None:
    box = Box(4, 4, 4)
    box.label, box.color = "box", Color("red")
    chamfered = implicit_chamfer(box.edges().filter_by(Axis.Z), 1)
    assert chamfered.label == "box"
    assert tuple(chamfered.color) == tuple(box.color)
    other = Box(2, 2, 2)
    other.label = "other"
    assembly = Compound(label="both", children=[Pos(1, 2, 3) * box, Location((3, 0, 0), (0, 0, 30)) * other])
    grown = implicit_offset(assembly, -0.5)
    assert grown.label == "both"
    assert [child.label for child in grown.children] == ["box", "other"]
    assert [round(child.volume, 6) for child in grown.children] == [27.0, 1.0]
    for child, before in zip(grown.children, assembly.children, strict=True):
        assert child.location.position == before.location.position
        assert child.location.orientation == before.location.orientation
    first = grown.children[0]
    assert tuple(first.color) == tuple(box.color)
    assert tuple(first.center()) == pytest.approx((1, 2, 3), abs=1e-6)


def test_several_solids() -> None:
    with BuildPart() as made:
        with GridLocations(20, 0, 2, 1):
            Box(4, 4, 4)
        implicit_chamfer(made.edges().filter_by(Axis.Z), 1)
    assert [round(solid.volume, 6) for solid in made.part.solids()] == [56.0, 56.0]
