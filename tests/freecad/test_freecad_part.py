"""FreeCAD's own shapes through its Part module: meshes, edges, exact solids; without OCP, CadQuery or build123d."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import FreeCAD
import numpy as np
import Part
import pytest
from FreeCAD import Placement, Rotation, Vector

import cad_implicit as ci
from cad_implicit.cad import open_part, to_mesh
from cad_implicit.cad.edges import edges, part_edges
from cad_implicit.cad.solids import SolidPart
from cad_implicit.solid_job import safely_filleted, shelled, worked

pytestmark = pytest.mark.freecad

#: Off all axes, and not at the origin.
PLACE = Placement(Vector(1.3, -2.1, 3.7), Rotation(13, 27, 41))


@pytest.fixture(autouse=True)
def _alone() -> Any:
    yield
    assert "OCP" not in sys.modules


def placed(shape: Any) -> Any:
    """Shape with locations within locations, as parts of documents have them."""
    shape = shape.copy()
    shape.Placement = PLACE.multiply(shape.Placement)
    return shape


def fused(*shapes: Any) -> Any:
    return placed(shapes[0].fuse(list(shapes[1:])).removeSplitter().Solids[0])


def boss() -> Any:
    """Cylinder of radius 5 on a plate of 20 x 18 x 6."""
    return fused(Part.makeBox(20, 18, 6), Part.makeCylinder(5, 9, Vector(10, 9, 6)))


def step() -> Any:
    """L of 20 x 18 x 6 and 8 x 18 x 15."""
    return fused(Part.makeBox(20, 18, 6), Part.makeBox(8, 18, 15))


def groove() -> Any:
    """Disc of radius 14 with a groove that is a torus."""
    return placed(Part.makeCylinder(14, 6).cut(Part.makeTorus(9, 2.5, Vector(0, 0, 6))).Solids[0])


def loft() -> Any:
    circles = [(8, Vector(0, 0, 0)), (5, Vector(1, 0, 8)), (6, Vector(0, 1, 14))]
    return placed(Part.makeLoft([Part.Wire(Part.makeCircle(*circle)) for circle in circles], True))


def waves() -> Any:
    """Plate with a side that is an extruded spline."""
    curve = Part.BSplineCurve()
    curve.interpolate([Vector(*p) for p in ((0, 0, 0), (6, 2, 0), (12, -1, 0), (20, 1, 0))])
    corners = [Vector(20, 1, 0), Vector(20, 15, 0), Vector(0, 15, 0), Vector(0, 0, 0)]
    lines = [Part.makeLine(a, b) for a, b in pairwise(corners)]
    return placed(Part.Face(Part.Wire([curve.toShape(), *lines])).extrude(Vector(0, 0, 8)))


def chosen(shape: Any, convexity: str, curve: str = "") -> list[int]:
    found = part_edges(open_part(shape))
    return [edge.number for edge in found if edge.convexity == convexity and curve in edge.curve]


def exact(shape: Any, radius: float, numbers: list[int]) -> Any:
    return shape.makeFillet(radius, [shape.Edges[number - 1] for number in numbers])


def kinds(shape: Any) -> Counter[str]:
    return Counter(type(face.Surface).__name__ for face in shape.Faces)


def sound(made: SolidPart, exact_share: float = 1.0) -> Any:
    """Shape of a result, a solid that the kernel finds nothing wrong with and goes on working on."""
    shape = made.wrapped
    assert isinstance(shape, Part.Solid)
    assert shape.isValid()
    assert shape.isClosed()
    assert made.exact_share == pytest.approx(exact_share, abs=1e-12)
    assert made.faces == len(shape.Faces)
    drilled = shape.cut(Part.makeCylinder(0.3, 400, shape.CenterOfMass - Vector(0, 0, 200)))
    assert drilled.isValid()
    assert 0 < drilled.Volume < shape.Volume
    return shape


@pytest.mark.parametrize("make", [boss, step, groove, loft, waves])
def test_meshes_are_closed_and_know_their_faces(make: Any) -> None:
    shape = make()
    mesh = to_mesh(shape, tolerance=0.004)
    assert mesh.is_watertight
    assert mesh.components == 1
    assert mesh.volume == pytest.approx(shape.Volume, rel=2e-3)
    assert mesh.face_ids is not None
    area = np.bincount(mesh.face_ids, np.linalg.norm(mesh.face_vectors, axis=1))
    assert area == pytest.approx([face.Area for face in shape.Faces], rel=4e-3)


def test_solids_that_touch_share_no_vertices_and_overlapping_ones_are_united() -> None:
    both = Part.makeCompound([Part.makeBox(3, 4, 5), Part.makeBox(3, 4, 5, Vector(3, 4, 0))])
    mesh = to_mesh(placed(both), unite=False)
    assert mesh.is_watertight
    assert mesh.components == 2
    overlapping = Part.makeCompound([Part.makeBox(3, 4, 5), Part.makeBox(3, 4, 5, Vector(1, 1, 1))])
    assert to_mesh(placed(overlapping)).volume == pytest.approx(2 * 60 - 2 * 3 * 4, rel=1e-9)


def test_edges_are_numbered_as_in_freecad() -> None:
    shape = fused(Part.makeBox(9, 9, 9), Part.makeSphere(4, Vector(9, 9, 9)))
    found = edges(shape)
    assert [edge.number for edge in found] == [n for n, edge in enumerate(shape.Edges, 1) if not edge.Degenerated]
    for edge in found:
        own = shape.Edges[edge.number - 1]
        assert edge.length == pytest.approx(own.Length)
        assert edge.points[[0, -1]] == pytest.approx(
            np.array([tuple(own.valueAt(t)) for t in own.ParameterRange]), abs=1e-9
        )
        for number in edge.faces:
            face = shape.Faces[number - 1]
            assert any(own.isSame(one) for one in face.Edges)


def test_the_base_of_a_boss_is_the_torus_of_the_exact_kernel() -> None:
    shape = boss()
    numbers = chosen(shape, "concave")
    made, told = worked(open_part(shape), "fillet", 2.0, edges=numbers)
    result = sound(made)
    assert result.Volume == pytest.approx(exact(shape, 2.0, numbers).Volume, rel=1e-9)
    assert kinds(result) == {"Plane": 7, "Cylinder": 1, "Toroid": 2}
    assert told.engine == "implicit"
    again = result.makeFillet(0.4, [edge for edge in result.Edges if type(edge.Curve).__name__ == "Line"][:1])
    assert again.isValid()


def test_untouched_faces_are_those_of_the_part() -> None:
    shape = boss()
    made, _ = worked(open_part(shape), "fillet", 2.0, edges=chosen(shape, "concave"))
    kept = [face for face in made.wrapped.Faces if type(face.Surface).__name__ != "Toroid"]
    for face in kept:
        own = [f for f in shape.Faces if type(f.Surface) is type(face.Surface) and f.Area >= face.Area - 1e-9]
        u, v = face.ParameterRange[::2]
        assert any(f.Surface.value(u, v).distanceToPoint(face.Surface.value(u, v)) < 1e-12 for f in own)


def test_objects_of_documents_and_their_edges() -> None:
    document = FreeCAD.newDocument("part", hidden=True, temp=True)
    try:
        box = document.addObject("Part::Box", "Box")
        box.Length, box.Width, box.Height, box.Placement = 20, 18, 6, PLACE
        document.recompute()
        part = open_part(box)
        assert part.name == "Box"
        made, _ = worked(part, "fillet", 2.0, edges=[box.Shape.Edges[4]])
        assert sound(made).Volume == pytest.approx(exact(box.Shape, 2.0, [5]).Volume, rel=1e-9)
    finally:
        FreeCAD.closeDocument(document.Name)


def test_copies_of_one_shape_in_two_places_are_two_parts() -> None:
    """Their faces and edges are the same ones to the kernel, but for their places."""
    plate = Part.makeBox(20, 18, 6)
    other = Part.Shape(plate)
    other.Placement = Placement(Vector(40, 1, 2), Rotation(10, 20, 30))
    both = placed(Part.makeCompound([plate, other]))
    found = part_edges(open_part(both))
    assert len(found) == 24
    first, last = found[0], found[-1]
    made, _ = worked(open_part(both), "fillet", 1.5, edges=[first.number, last.number])
    assert isinstance(made.wrapped, Part.Compound)
    assert made.wrapped.isValid()
    gone = (1 - np.pi / 4) * 1.5**2 * (first.length + last.length)
    assert made.wrapped.Volume == pytest.approx(2 * plate.Volume - gone, rel=1e-9)
    assert [len(solid.Faces) for solid in made.wrapped.Solids] == [7, 7]


def test_edges_of_both_kinds() -> None:
    made, _ = worked(open_part(step()), "fillet", 1.5, edges="all")
    result = sound(made)
    assert kinds(result) == {"Plane": 8, "Cylinder": 18, "Sphere": 10, "Toroid": 2}


def test_rim_of_a_groove() -> None:
    shape = groove()
    numbers = chosen(shape, "convex", "circle")[:1]
    made, _ = worked(open_part(shape), "fillet", 1.0, edges=numbers)
    assert sound(made).Volume == pytest.approx(exact(shape, 1.0, numbers).Volume, rel=1e-8)


def test_what_is_worked_on_as_a_whole_becomes_facets() -> None:
    shape = step()
    made, told = worked(open_part(shape), "shell", 1.0, side="inward")
    assert told.exact_share == made.exact_share == 0.0
    assert made.wrapped.isValid()
    inner = 18 * 16 * 4 + 6 * 16 * 9 + 16 * (1 - np.pi / 4)  # its wall is round along the concave edge
    assert told.error_bound is not None
    assert made.wrapped.Volume == pytest.approx(shape.Volume - inner, abs=told.error_bound * made.area)


def test_shells_with_an_open_face() -> None:
    shape = placed(Part.makeBox(20, 18, 6))
    top = max(range(6), key=lambda n: PLACE.inverse().multVec(shape.Faces[n].CenterOfMass).z)
    made, _ = shelled(open_part(shape), -1.0, [shape.Faces[top]])
    assert made.wrapped.isValid()
    assert made.wrapped.Volume == pytest.approx(20 * 18 * 6 - 18 * 16 * 5, rel=1e-3)


def test_the_exact_kernel_is_asked_in_a_process_of_its_own() -> None:
    shape = step()
    numbers = chosen(shape, "concave")
    made, told = safely_filleted(open_part(shape), 1.5, numbers)
    assert (told.engine, told.reason) == ("exact kernel", "")
    assert sound(made).Volume == pytest.approx(exact(shape, 1.5, numbers).Volume, rel=1e-9)


@pytest.mark.parametrize(
    ("size", "radius", "lengths", "volume"),
    [((10, 10, 10), 5.0, 10.0, 4 / 3 * np.pi * 125), ((50, 80, 10), 25.0, 10.0, 10 * (50 * 30 + np.pi * 625))],
    ids=["ball", "stadium"],
)
def test_where_the_exact_kernel_fails(size: tuple[float, ...], radius: float, lengths: float, volume: float) -> None:
    shape = placed(Part.makeBox(*size))
    numbers = [edge.number for edge in part_edges(open_part(shape)) if edge.length == pytest.approx(lengths)]
    with pytest.raises(Part.OCCError):
        exact(shape, radius, numbers)
    made, told = safely_filleted(open_part(shape), radius, numbers)
    assert told.engine == "implicit"
    assert told.reason.startswith("not done")
    assert made.wrapped.isValid()
    assert made.exact_share == 1.0
    assert made.wrapped.Volume == pytest.approx(volume, rel=1e-6)


def test_results_are_written_and_read_again(tmp_path: Any) -> None:
    shape = placed(Part.makeBox(20, 18, 6))
    made, _ = worked(open_part(shape), "fillet", 2.0, edges=[1])
    for name in ("a.step", "a.brep"):
        again = open_part(ci.save(made, tmp_path / name))
        assert again.shape.Volume == pytest.approx(made.wrapped.Volume, rel=1e-9)


ALONE = """
import sys, warnings
sys.modules["manifold3d"] = sys.modules["skimage"] = None
sys.path.insert(0, {root!r}); sys.path.append({library!r})
import FreeCAD, Part
import cad_implicit as ci
from cad_implicit.cad import open_part
from cad_implicit.solid_job import worked
shape = Part.makeBox(20, 18, 6).fuse(Part.makeBox(8, 18, 15)).removeSplitter().Solids[0]
shape.Placement = FreeCAD.Placement(FreeCAD.Vector(1.3, -2.1, 3.7), FreeCAD.Rotation(13, 27, 41))
for operation, options in (("fillet", dict(edges="all")), ("offset", {{}}), ("smooth", dict(spacing=0.5))):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        made, told = worked(open_part(shape), operation, 1.5, **options)
    print(operation, made.wrapped.isValid(), made.wrapped.Volume, told.exact_share, *(w.message for w in caught))
print(*sorted({{"OCP", "cadquery", "build123d"}} & set(sys.modules)))
"""


def test_neither_manifold3d_nor_scikit_image_is_needed() -> None:
    """Local blends are contoured whole then, and still find the surfaces."""
    code = ALONE.format(root=str(Path(ci.__file__).parents[1]), library=str(Path(Part.__file__).parent))
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    fillet, offset, smooth, rest = run.stdout.split("\n")[:4]
    assert rest == ""
    name, valid, volume, share, *warning = fillet.split(" ", 4)
    with_it, _ = worked(open_part(step()), "fillet", 1.5, edges="all")
    assert (name, valid, float(share)) == ("fillet", "True", 1.0)
    assert float(volume) == pytest.approx(with_it.wrapped.Volume, rel=1e-7)
    assert "pip install manifold3d" in warning[0]
    grown = 20 * 18 * 6 + 8 * 18 * 9
    for line, low, high in ((offset, 1.3 * grown, 2.2 * grown), (smooth, 0.95 * grown, 1.0 * grown)):
        _, valid, volume, *_ = line.split(" ")
        assert valid == "True"
        assert low < float(volume) < high
