"""The CadQuery plugin: what is on the stack tells where, and solids come out that go on in the chain."""

from __future__ import annotations

import math
import subprocess
import sys
import warnings

import pytest

pytest.importorskip("cadquery", reason="needs CadQuery")

import cadquery as cq

import cad_implicit.cadquery
from cad_implicit import cadquery_shapes
from cad_implicit.errors import EmptyResultError, GeometryWarning, NoSolidError, RadiusError, SelectorError
from cad_implicit.solid_job import Provenance

pytestmark = pytest.mark.host

#: Area that a fillet of radius 1 takes off a right angle.
CORNER = 1 - math.pi / 4


def block(x: float = 10, y: float = 8, z: float = 6) -> cq.Workplane:
    return cq.Workplane().box(x, y, z)


def turned(part: cq.Workplane) -> cq.Workplane:
    return part.rotate((0, 0, 0), (1, 2, 3), 33).translate((3.1, -2.7, 1.3))


def volume(part: cq.Workplane) -> float:
    """Volume of the only value on the stack, which must be a valid solid."""
    (solid,) = part.vals()
    assert isinstance(solid, cq.Solid)
    assert solid.isValid()
    return float(solid.Volume())


@pytest.fixture(scope="module")
def rounded() -> cq.Workplane:
    return block().edges("|Z").implicitFillet(1, spacing=0.3)


def test_edges_on_the_stack(rounded: cq.Workplane) -> None:
    assert 480 - 4 * CORNER * 6 - 0.4 < volume(rounded) < 480 - 4 * CORNER * 6 + 1e-6
    assert rounded.implicit.engine == "implicit"
    assert rounded.implicit.reason == ""
    assert 0 < rounded.implicit.error_bound < 0.05


def test_the_chain_goes_on(rounded: cq.Workplane) -> None:
    before = volume(rounded)
    assert len(rounded.parent.vals()) == 4  # the edges that were selected
    assert len(rounded.end().end().vals()) == 1
    holed = rounded.faces(">Z").workplane().hole(2)
    assert holed.val().Volume() == pytest.approx(before - math.pi * 6, rel=1e-6)
    assert holed.implicit is rounded.implicit
    assert rounded.cut(cq.Workplane().box(2, 2, 20)).val().Volume() == pytest.approx(before - 24, rel=1e-6)
    assert rounded.union(block(2, 2, 12)).val().Volume() == pytest.approx(before + 24, rel=1e-6)
    again = rounded.edges(cq.selectors.BoxSelector((-3, -5, 2), (3, -3, 4))).fillet(0.5)
    assert again.val().isValid()
    assert again.val().Volume() < before


def test_a_part_off_the_axes() -> None:
    part = turned(block())
    edge = part.edges().vals()[0]
    result = part.newObject([edge]).implicitFillet(1, spacing=0.3)
    assert volume(result) == pytest.approx(480 - CORNER * edge.Length(), abs=0.02 * edge.Length())


def test_faces_stand_for_their_edges_and_vertices_for_those_that_meet_there() -> None:
    of_face = block().faces(">Z").implicitChamfer(1)
    # a frustum on top: edges meet in mitres
    assert volume(of_face) == pytest.approx(480 - 80 + (80 + 48 + 4 * 63) / 6, rel=1e-6)
    of_corner = block().vertices(">X and >Y and >Z").implicitFillet(1, spacing=0.3)
    expected = 480 - CORNER * (9 + 7 + 5) - (1 - math.pi / 6)
    assert expected - 0.3 < volume(of_corner) < expected + 1e-6  # chords lie within the arc


def test_all_edges_leave_out_seams_and_poles() -> None:
    can = cq.Workplane().cylinder(6, 4).edges().implicitFillet(1, spacing=0.3)
    one = 2 * math.pi * CORNER * (4 - (10 - 3 * math.pi) / (12 - 3 * math.pi))  # Pappus
    assert volume(can) == pytest.approx(math.pi * 16 * 6 - 2 * one, rel=3e-3)
    with pytest.raises(SelectorError, match="smoothly at all edges"):
        cq.Workplane().sphere(3).edges().implicitFillet(1)


def test_radii_of_their_own() -> None:
    several = block().implicitFillet({"|Z and >X": 1.0, "|Z and <X": 2.0}, spacing=0.3)
    assert volume(several) == pytest.approx(480 - 2 * 6 * CORNER * (1 + 4), abs=0.6)
    edge = block().edges("|Z and >X and >Y")
    rising = edge.implicitRound((1.0, 2.0), spacing=0.3)
    assert volume(rising) == pytest.approx(480 - 6 * CORNER * (1 + 2 + 4) / 3, abs=0.2)
    function = edge.implicitRound(lambda t: 1 + t, spacing=0.3)
    assert volume(function) == pytest.approx(volume(rising), abs=1e-3)


def test_a_selector_that_finds_nothing_is_an_error() -> None:
    for method in ("implicitFillet", "implicitRound", "implicitSmooth", "implicitChamfer", "implicitShell"):
        with pytest.raises(SelectorError, match=f"{method}: nothing is selected"):
            getattr(block().edges(">Z and <Z"), method)(1.0)
    with pytest.raises(SelectorError, match="safeFillet: nothing is selected"):
        block().edges("%circle").safeFillet(1.0)
    with pytest.raises(SelectorError, match="there is Vector on the stack"):
        block().pushPoints([(1, 2)]).implicitFillet(1.0)
    with pytest.raises(NoSolidError, match="Cannot find a solid"):
        cq.Workplane().rect(2, 3).implicitFillet(0.5)
    with pytest.raises(SelectorError, match="works on the whole solid"):
        block().faces(">Z").implicitOffset(1.0)
    with pytest.raises(RadiusError, match="largest radius"):
        block().edges().implicitFillet(5)


def test_a_solid_on_the_stack_means_all_of_it() -> None:
    step = turned(block().cut(block().translate((5, 4, 3))))
    filled = step.implicitFillet(1, spacing=0.3)
    assert volume(filled) > step.val().Volume() + 0.5
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rounded = turned(block()).implicitRound(1, spacing=0.3)
    steiner = 8 * 6 * 4 + 2 * (48 + 32 + 24) + math.pi * (8 + 6 + 4) + 4 / 3 * math.pi
    assert volume(rounded) == pytest.approx(steiner, rel=2e-3)
    with pytest.raises(EmptyResultError, match="nothing is left"):
        block(50, 50, 20).faces("+Z").shell(-1, kind="intersection").implicitRound(1, spacing=0.5)


def test_a_global_fillet_that_changes_nothing_warns() -> None:
    with pytest.warns(GeometryWarning, match="fillet changed nothing.*use round") as caught:
        same = block().implicitFillet(1, spacing=0.5)
    assert caught[0].filename == __file__
    assert volume(same) == pytest.approx(480, rel=1e-9)


def test_a_part_that_leaks_gives_a_solid_and_warns() -> None:
    part = block(10, 10, 10).union(cq.Workplane().sphere(6))  # an invalid solid, by the union's cleaning
    if part.val().isValid():
        pytest.skip("this release of the kernel makes that union well")
    with pytest.warns(GeometryWarning) as caught:
        filled = part.edges().implicitFillet(0.5, spacing=0.4)
    told = " | ".join(str(warning.message) for warning in caught)
    assert "edges selected have one face only" in told
    assert "the part is not closed" in told
    assert 1000 < volume(filled) < 1107  # the cube with the six caps of the sphere is 1106.8
    assert filled.implicit.error_bound is None


def test_offset_shell_and_infill() -> None:
    assert volume(turned(block()).implicitOffset(-1)) == pytest.approx(8 * 6 * 4, rel=1e-6)
    box = turned(block())
    assert volume(box.implicitShell(-1)) == pytest.approx(480 - 8 * 6 * 4, rel=1e-6)
    assert volume(block().faces(">Z").implicitShell(-1)) == pytest.approx(480 - 8 * 6 * 5, rel=1e-6)
    light = block().implicitInfill(4, 1.0, skin=1.0, spacing=0.5)
    assert 480 - 8 * 6 * 4 < volume(light) < 480
    with pytest.raises(SelectorError, match="use a negative thickness"):
        block().faces(">Z").implicitShell(1)
    with pytest.raises(SelectorError, match="Edge was given"):
        block().edges(">Z").implicitShell(-1)


def test_safe_fillet_takes_the_exact_kernel_where_it_can() -> None:
    exact = turned(block()).safeFillet(1)
    steiner = 8 * 6 * 4 + 2 * (48 + 32 + 24) + math.pi * (8 + 6 + 4) + 4 / 3 * math.pi
    assert volume(exact) == pytest.approx(steiner, rel=1e-9)
    assert exact.implicit.engine == "exact kernel"
    assert exact.implicit.exact_share == 1.0
    assert exact.implicit.error_bound < 1e-5
    assert exact.faces().implicit is exact.implicit


def test_safe_fillet_where_the_exact_kernel_gives_up() -> None:
    stadium = cq.Workplane().box(50, 80, 10).edges("|Z").safeFillet(25)
    assert volume(stadium) == pytest.approx(10 * (50 * 30 + math.pi * 625), rel=2e-4)
    assert stadium.implicit.engine == "implicit"
    assert "not done" in stadium.implicit.reason
    assert stadium.implicit.error_bound < 0.1
    late = block().edges("|Z").safeFillet(1, timeLimit=0.01, spacing=0.3)
    assert late.implicit.reason == "time out: no answer within 0.01 s"
    varies = block().edges("|Z and >X and >Y").safeFillet((1, 2), spacing=0.3)
    assert varies.implicit.reason == "not tried: the radius varies along an edge"
    with pytest.raises(RadiusError, match="largest radius") as caught:
        block().edges("|Z").safeFillet(5)
    assert "The exact kernel was asked first" in caught.value.__notes__[0]


def test_functions_of_shapes_patch_nothing() -> None:
    code = (
        "import cadquery as cq; from cad_implicit.cadquery_shapes import implicitChamfer\n"
        "box = cq.Workplane().box(1, 1, 1); part = implicitChamfer(box.val(), 0.1, edges=box.edges('|Z').vals())\n"
        "print(part.isValid(), round(part.Volume(), 6), hasattr(cq.Workplane, 'implicitFillet'))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "0.98", "False"]
    box = block()
    box.val().label = "box"
    shape = cadquery_shapes.implicitFillet(box.val(), 1.0, box.edges("|Z and >X and >Y").val(), spacing=0.5)
    assert (shape.label, type(shape), type(shape.implicit)) == ("box", cq.Solid, Provenance)


def test_assemblies_part_by_part() -> None:
    place = cq.Location(cq.Vector(2, 0, 0), cq.Vector(0, 0, 1), 30)
    assembly = cq.Assembly(name="both").add(block(4, 4, 4), name="box", color=cq.Color("red"))
    assembly.add(cq.Assembly(block(2, 2, 2), name="other", loc=place))  # they overlap
    shrunk = cadquery_shapes.implicitOffset(assembly, -0.5)
    assert (shrunk.name, [child.name for child in shrunk.children]) == ("both", ["box", "other"])
    assert [round(child.obj.Volume(), 6) for child in shrunk.children] == [27.0, 1.0]
    assert shrunk.children[0].color.toTuple() == cq.Color("red").toTuple()
    assert shrunk.children[1].loc.toTuple() == place.toTuple()
    assert assembly.children[0].obj.val().Volume() == pytest.approx(64)


def test_several_solids_and_progress() -> None:
    stages: set[str] = set()

    def progress(stage: str, fraction: float) -> None:
        assert 0 <= fraction <= 1
        stages.add(stage)

    two = cq.Workplane().pushPoints([(0, 0), (20, 0)]).box(4, 4, 4, combine=False)
    both = two.edges("|Z").implicitChamfer(1, progress=progress)
    assert stages >= {"chamfer", "contour", "solid"}
    (shape,) = both.vals()
    assert [round(solid.Volume(), 6) for solid in shape.Solids()] == [56.0, 56.0]
    assert shape.isValid()


def test_what_the_plugin_adds() -> None:
    names = {name for name in vars(cq.Workplane) if name.startswith(("implicit", "safe"))}
    operations = {"Fillet", "Round", "Smooth", "Chamfer", "Offset", "Shell", "Infill"}
    assert names == {f"implicit{name}" for name in operations} | {"safeFillet", "implicit"}
    assert all(getattr(cq.Workplane, name).__doc__ for name in names)
    assert block().implicit is None
    assert cad_implicit.cadquery.__doc__
