"""Solids of local blends on the part's own surfaces: valid, exact, and good for what is done to them next."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("OCP", reason="needs CadQuery or build123d")

import cad_parts
import edge_parts
from OCP.BRep import BRep_Tool
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_VERTEX, TopAbs_WIRE

import cad_implicit as ci
from cad_implicit.blend_labels import blend_surfaces, label
from cad_implicit.cad import occ, occ_files
from cad_implicit.cad.exact_blends import exact_blend
from cad_implicit.cad.memory import Memory
from cad_implicit.cad.occ_original import ShapeTopology
from cad_implicit.cad.planner import Planner
from cad_implicit.cad.plans import Plan
from cad_implicit.cad.solids import SolidPart
from cad_implicit.facetting import facetted
from cad_implicit.local_blend import blend_edges
from cad_implicit.outliner import Outliner
from cad_implicit.parting import _rebuilt

pytestmark = pytest.mark.host

#: Volumes agree with the truth within this share: edges lie on their faces within 1e-6 mm.
CLOSE = 1e-7

#: Integrals over trimmed faces are exact to this share.
SUMS = 1e-9

#: A fillet of radius 1 in a right angle takes this area off the section, its centroid so far from both sides.
GONE = 1 - np.pi / 4
CENTROID = (0.5 - np.pi / 4 * (1 - 4 / (3 * np.pi))) / GONE


def volume(shape: Any) -> float:
    return occ.volume(shape, SUMS)


def boss() -> Any:
    """Cylinder of radius 5 on a plate of 20 x 18 x 6."""
    return edge_parts.fused(cad_parts.box((20, 18, 6)), edge_parts.cylinder(5.0, 9.0, (10.0, 9.0, 6.0)))


def hole() -> Any:
    """Plate of 14 x 12 x 6 with a hole of radius 3."""
    return edge_parts.cut(cad_parts.box((14, 12, 6)), edge_parts.cylinder(3.0, 8.0, (7, 6, -1)))


def blended(part: Any, edges: str, radius: float, chamfer: bool = False) -> SolidPart:
    """Solid of a blend that is contoured coarsely: valid, and all of it exact."""
    operation = ci.chamfer if chamfer else ci.fillet
    made = ci.to_part(operation(part, radius, edges=edges, spacing=radius / 3))
    assert made.why == ""
    assert made.facets == 0
    assert made.exact_area == made.area
    assert occ.is_valid(made.wrapped)
    return made


def kinds(shape: Any) -> dict[str, int]:
    """How many faces there are of each kind."""
    faces = map(occ.as_face, occ.distinct(shape, TopAbs_FACE))
    names = (type(BRep_Tool.Surface_s(face)).__name__ for face in faces)
    return Counter(name.removeprefix("Geom_").removesuffix("Surface") for name in names)


@pytest.fixture(scope="module")
def rounded_boss() -> tuple[Any, SolidPart]:
    """A boss turned off the axes, and the solid with its base rounded at 1.5."""
    part = cad_parts.moved(boss())
    return part, blended(part, "concave", 1.5)


def test_the_base_of_a_boss_becomes_a_torus(rounded_boss: tuple[Any, SolidPart]) -> None:
    made = rounded_boss[1].wrapped
    truth = 20 * 18 * 6 + np.pi * 25 * 9 + 2 * np.pi * (5.0 + 1.5 * CENTROID) * 1.5**2 * GONE  # Pappus
    assert volume(made) == pytest.approx(truth, rel=CLOSE)
    assert kinds(made) == {"Cylindrical": 1, "Plane": 7, "Toroidal": 2}


def test_untouched_faces_are_those_of_the_part(rounded_boss: tuple[Any, SolidPart]) -> None:
    part, made = rounded_boss
    new = list(occ.distinct(made.wrapped, TopAbs_FACE))
    kept = [face for face in occ.distinct(part, TopAbs_FACE) if any(face.IsSame(other) for other in new)]
    assert len(kept) == 6  # all planes but the one around the boss


def test_further_operations_of_the_kernel_work(rounded_boss: tuple[Any, SolidPart]) -> None:
    part, made = rounded_boss
    drill = cad_parts.moved(edge_parts.cylinder(2.0, 30.0, (10.0, 9.0, -5.0)))
    drilled = BRepAlgoAPI_Cut(made.wrapped, drill).Shape()
    assert occ.is_valid(drilled)
    assert volume(made.wrapped) - volume(drilled) == pytest.approx(np.pi * 4 * 15, rel=1e-6)
    across = cad_parts.moved(cad_parts.box((24, 2, 3), (-2.0, 8.0, 5.0)))  # through the blend
    both = BRepAlgoAPI_Fuse(made.wrapped, across).Shape()
    common = volume(made.wrapped) + volume(across) - volume(both)
    assert occ.is_valid(both)
    assert 2 * 20 * 1 < common < 2 * 24 * 3
    sharp = next(edge for edge in occ.distinct(part, TopAbs_EDGE) if _is_long(part, edge, 6.0))
    fillet = BRepFilletAPI_MakeFillet(made.wrapped)
    fillet.Add(1.0, occ.as_edge(sharp))
    assert occ.is_valid(fillet.Shape())
    assert volume(made.wrapped) - volume(fillet.Shape()) == pytest.approx(6 * GONE, rel=1e-4)


def _is_long(part: Any, edge: Any, length: float) -> bool:
    """Whether an edge has a length."""
    number = occ.shape_map(part, TopAbs_EDGE).FindIndex(edge)
    return any(abs(found.length - length) < 1e-6 for found in ci.edges(part) if found.number == number)


def test_step_files_hold_the_same_solid(rounded_boss: tuple[Any, SolidPart], tmp_path: Path) -> None:
    made = rounded_boss[1].wrapped
    occ_files.write(made, tmp_path / "boss.step", "boss", "2000-01-01T00:00:00")
    again = occ_files.read_product(tmp_path / "boss.step").shape
    assert occ.is_valid(again)
    assert kinds(again) == kinds(made)
    assert volume(again) == pytest.approx(volume(made), rel=CLOSE)


def test_triangles_of_a_solid_with_very_small_faces_meet() -> None:
    """Where four edges of crossing cylinders come to a point the kernel's mesh had holes, though it found it valid."""
    standing = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, -20), gp_Dir(0, 0, 1), gp_Dir(1, 0, 0)), 5.0, 40.0).Shape()
    lying = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 20, 0), gp_Dir(0, -1, 0), gp_Dir(1, 0, 0)), 5.0, 40.0).Shape()
    made = ci.to_part(ci.fillet(BRepAlgoAPI_Common(standing, lying).Shape(), 1.0, edges="all"))
    assert occ.is_valid(made.wrapped)
    mesh = ci.to_mesh(made.wrapped)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(661.2, abs=1.0)


def test_a_box_rounded_everywhere() -> None:
    made = blended(cad_parts.moved(cad_parts.box((10, 8, 6))), "all", 1.5).wrapped
    a, b, c, r = 7.0, 5.0, 3.0, 1.5  # Steiner's formula for the box that the ball's centre stays in
    truth = a * b * c + 2 * r * (a * b + b * c + c * a) + np.pi * r * r * (a + b + c) + 4 / 3 * np.pi * r**3
    assert volume(made) == pytest.approx(truth, rel=CLOSE)
    assert kinds(made) == {"Plane": 6, "Cylindrical": 12, "Spherical": 8}


def test_edges_of_both_kinds_meet_in_mitres() -> None:
    part = cad_parts.moved(edge_parts.angle_bar())
    made = blended(part, "all", 0.7).wrapped
    truth = exact_blend(part, {edge.number: 0.7 for edge in ci.edges(part)})
    assert truth.ok, truth.message
    assert volume(made) == pytest.approx(volume(truth.shape), rel=CLOSE)


def test_rims_of_a_hole_that_keeps_its_seam() -> None:
    made = blended(cad_parts.moved(hole()), "%circle", 1.0).wrapped
    truth = 14 * 12 * 6 - np.pi * 9 * 6 - 2 * 2 * np.pi * (3.0 + CENTROID) * GONE
    assert volume(made) == pytest.approx(truth, rel=CLOSE)
    assert kinds(made) == {"Plane": 6, "Cylindrical": 1, "Toroidal": 4}


def test_chamfers_along_the_axes() -> None:
    made = blended(cad_parts.box((9, 8, 7)), "|Z", 1.0, chamfer=True).wrapped
    assert volume(made) == pytest.approx(9 * 8 * 7 - 4 * 7 / 2, rel=CLOSE)
    assert kinds(made) == {"Plane": 10}


def test_chamfers_meet_in_corners() -> None:
    made = blended(cad_parts.moved(cad_parts.box((9, 8, 7))), "all", 1.0, chamfer=True).wrapped
    corner = 1 - 1 / 6  # all but the part of a unit cube beyond x + y + z = 2
    assert volume(made) == pytest.approx(9 * 8 * 7 - 4 * (7 + 6 + 5) / 2 - 8 * corner, rel=CLOSE)
    assert kinds(made) == {"Plane": 26}


def test_a_radius_hardly_smaller_than_that_of_the_corners() -> None:
    sharp = cad_parts.moved(cad_parts.box((14, 12, 8)))
    rounded = BRepFilletAPI_MakeFillet(sharp)
    upright = [edge for edge in occ.distinct(sharp, TopAbs_EDGE) if _is_long(sharp, edge, 8.0)]
    rounded.Add(3.0, occ.as_edge(upright[0]))
    part = rounded.Shape()
    numbers = {edge.number: 2.95 for edge in ci.edges(part) if abs(edge.length - np.pi * 3 / 2) < 1e-6}
    chosen = dict(sorted(numbers.items())[:1])
    made = ci.to_part(blend_edges(part, None, chosen, spacing=1.0))  # on along the tangents
    assert (made.why, made.facets) == ("", 0)
    truth = exact_blend(part, chosen)
    assert truth.ok, truth.message
    assert volume(made.wrapped) == pytest.approx(volume(truth.shape), rel=CLOSE)


def test_a_chamfer_that_comes_to_a_point_has_facets_there() -> None:
    """Around an edge as round as the chamfer is wide it is a cone up to its tip, where its surface has no one place."""
    width, depth, height = 4.1, 4.3, 2.7
    sharp = cad_parts.moved(cad_parts.box((width, depth, height)))
    rounded = BRepFilletAPI_MakeFillet(sharp)
    upright = [edge for edge in occ.distinct(sharp, TopAbs_EDGE) if _is_long(sharp, edge, height)]
    rounded.Add(1.0, occ.as_edge(upright[0]))
    part = rounded.Shape()
    arc = next(edge.number for edge in ci.edges(part) if abs(edge.length - np.pi / 2) < 1e-6)
    made = ci.to_part(ci.chamfer(part, 1.0, edges=[arc], spacing=0.34))  # on along the tangents
    assert occ.is_valid(made.wrapped)
    assert "a face ends in a point" in made.why
    assert 0.97 < made.exact_share < 1.0
    before = width * depth * height - (1 - np.pi / 4) * height
    assert volume(made.wrapped) == pytest.approx(before - (width + depth - 2) / 2 - np.pi / 6, rel=3e-4)


def test_only_what_fits_no_surface_becomes_facets() -> None:
    part = cad_parts.moved(boss())
    blend = ci.fillet(part, 1.5, edges="all", spacing=0.5)
    mesh = blend.mesh()
    surfaces = blend_surfaces(blend.laid)
    count = occ.count_faces(part)
    labels = label(mesh, count, blend.faces, surfaces, blend.spacing)
    plate = [n for n, surface in enumerate(surfaces, count) if surface.surface.primitive().kind != "torus"]
    labels[labels == plate[0]] = -1
    lost = int((labels < 0).sum())
    product, stands, why = _rebuilt(blend, mesh, labels, surfaces)
    shape, facets = product.shape, len(stands)
    assert why == f"{lost} triangles lie on no known surface"
    assert occ.is_valid(shape)
    # edges beside the round neighbours are halved until they lie on these
    assert lost < facets < 6 * lost
    whole = kinds(ci.to_part(blend, mesh=mesh).wrapped)
    left = kinds(shape)
    assert sum(number - left[kind] for kind, number in whole.items() if kind != "Plane") == 1
    assert volume(shape) == pytest.approx(mesh.volume, rel=2e-3)


def test_plans_do_not_depend_on_those_before() -> None:
    part = cad_parts.moved(boss())
    blend = ci.fillet(part, 1.5, edges="all", spacing=0.5)
    mesh, count, surfaces = blend.mesh(), occ.count_faces(part), blend_surfaces(blend.laid)
    labels = label(mesh, count, blend.faces, surfaces, blend.spacing)
    own = ShapeTopology(part)

    def known() -> tuple[Outliner, Memory]:
        return Outliner(count, blend.faces, surfaces, own, blend.spacing), Memory()

    used = known()
    whole = _planned(mesh, labels, *used)
    straight = next(n for n, one in enumerate(surfaces, count) if one.surface.primitive().kind == "cylinder")
    inside = np.flatnonzero(labels == straight)
    labels[inside[(mesh.faces[inside] == mesh.faces[inside[7], 1]).any(axis=1)]] = -1
    mesh, labels = facetted(mesh, labels, used[0].surface, used[0].first_facet, 5e-4)
    again, anew = (_planned(mesh, labels, *own) for own in (used, known()))
    assert len(again.faces) == len(anew.faces) > len(whole.faces)
    assert again.edges.keys() == anew.edges.keys()
    for number, edge in again.edges.items():
        other = anew.edges[number]
        assert (edge.ends, edge.on.keys()) == (other.ends, other.on.keys())
        assert edge.tolerance == pytest.approx(other.tolerance, rel=1e-3)
        ways = np.linspace(edge.span.low, edge.span.high, 7)
        np.testing.assert_allclose(edge.span.at(ways), other.span.at(ways), rtol=0, atol=1e-9)


def _planned(mesh: ci.Mesh, labels: Any, outliner: Outliner, memory: Memory) -> Plan:
    outline = outliner.outline(mesh, labels)
    planner = Planner(mesh, outline, outliner.patches, outliner.count, outliner.surfaces, outliner.original, memory)
    planner.plan()
    return planner._plan


def tolerances(shape: Any) -> list[float]:
    """Of all vertices and edges in mm."""
    vertices, edges = (occ.distinct(shape, kind) for kind in (TopAbs_VERTEX, TopAbs_EDGE))
    own = [BRep_Tool.Tolerance_s(occ.as_vertex(vertex)) for vertex in vertices]
    return own + [BRep_Tool.Tolerance_s(occ.as_edge(edge)) for edge in edges]


def test_the_part_keeps_its_tolerances() -> None:
    part = cad_parts.moved(hole())
    before = tolerances(part)
    upright = next(edge.number for edge in ci.edges(part) if abs(edge.length - 6) < 1e-6 and edge.convexity == "convex")
    blend = ci.fillet(part, 1.0, edges=[upright], spacing=0.3)
    mesh = blend.mesh()
    faces = list(occ.distinct(part, TopAbs_FACE))
    labels = label(mesh, len(faces), blend.faces, blend_surfaces(blend.laid), blend.spacing)
    holed = next(n for n, face in enumerate(faces) if len(list(occ.distinct(face, TopAbs_WIRE))) == 2)
    labels[labels == holed] = -1  # chords of the hole's rim end at the vertex of its seam
    shape = _rebuilt(blend, mesh, labels, blend_surfaces(blend.laid))[0].shape
    assert occ.is_valid(shape)
    assert max(tolerances(shape)) > 1e-5
    assert tolerances(part) == before


def test_what_is_no_blend_becomes_facets() -> None:
    ball = cad_parts.ball()
    made = ci.to_part(ball)
    assert made.facets == made.faces == len(ball.faces)
    assert made.exact_area == 0.0
    assert occ.is_valid(made.wrapped)
