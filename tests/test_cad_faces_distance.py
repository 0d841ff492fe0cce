"""Faces of B-reps as distances: beside the kernel's own, by differences, on the material's side; groups of faces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cad_implicit as ci

pytest.importorskip("OCP", reason="needs CadQuery or build123d")
pytestmark = pytest.mark.host

import cad_parts  # noqa: E402
import edge_parts  # noqa: E402

from cad_implicit.cad import occ, open_part  # noqa: E402
from cad_implicit.cad.occ_faces import face_distance  # noqa: E402
from cad_implicit.errors import SelectorError  # noqa: E402
from cad_implicit.face_groups import PartFaces, smooth_neighbours, tangent_neighbours  # noqa: E402
from cad_implicit.faces import TorusFace  # noqa: E402

PARTS = {
    **{name: (lambda name=name: cad_parts.primitives()[name][0]) for name in cad_parts.primitives()},
    "torus": cad_parts.torus,
    "torus segment": edge_parts.torus_segment,
    "spindle": edge_parts.spindle,
    "drilled block": edge_parts.drilled_block,
    "loft": cad_parts.loft,
    "teardrop": edge_parts.teardrop,
    "hip": edge_parts.hip,
    "vase": edge_parts.vase,
    "thickened": edge_parts.thickened,
}


def faces_of(shape: Any) -> list[Any]:
    return list(occ.distinct(shape, occ.TopAbs_FACE))


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("name", PARTS)
def test_beside_the_kernel(name: str, mirror: bool) -> None:
    """Where the foot is not on a border, the distance is the kernel's, positive in the material."""
    shape = cad_parts.moved(PARTS[name](), mirror=mirror)
    mesh = ci.to_mesh(shape, tolerance=4e-3)
    solid = ci.MeshDistance(mesh)
    rng = np.random.default_rng(11)
    kinds = set()
    for number, shape_face in enumerate(faces_of(shape)):
        face = face_distance(shape_face, 3.0)
        kinds.add(face.kind)
        own = mesh.faces[mesh.face_ids == number]
        starts = mesh.vertices[own[rng.integers(len(own), size=40)]].mean(axis=1)
        x = starts + rng.normal(size=starts.shape) * 0.15
        value, gradient = face.value_and_gradient(x)
        foot = x - value[:, None] * gradient
        inner = cad_parts.distance_to_face(foot, shape_face) < 1e-6
        assert inner.sum() > 12
        expected = cad_parts.distance_to_face(x[inner], shape_face)
        assert np.abs(np.abs(value[inner]) - expected).max() < 2e-7
        near = inner & (np.abs(solid(x)) > 1.5e-2) & (solid.closest(x).distance > np.abs(value) - 1.5e-2)
        assert (np.sign(value[near]) == np.sign(solid(x[near]))).all()
        step = 1e-5
        differences = np.stack([(face(x + step * e) - face(x - step * e)) / (2 * step) for e in np.eye(3)], axis=1)
        assert np.abs(gradient - differences)[inner].max() < 2e-6
        assert np.linalg.norm(gradient, axis=1) == pytest.approx(1.0)
    if name in ("loft", "teardrop", "hip", "vase", "thickened"):
        assert "spline" in kinds


def test_spheres_and_tori_are_told_from_splines() -> None:
    kinds = {name: {face_distance(f, 1.0).kind for f in faces_of(PARTS[name]())} for name in PARTS}
    assert kinds["frustum"] == {"cone", "plane"}
    assert kinds["sphere wedge"] == {"sphere", "plane"}
    assert kinds["torus segment"] == {"torus", "plane"}
    assert kinds["drilled block"] == {"cylinder", "plane"}


@pytest.mark.parametrize(("sheet", "low", "high"), [("outer", -1.9, 1.9), ("inner", 2.2, 4.0)])
def test_sheets_of_a_spindle_torus(sheet: str, low: float, high: float) -> None:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Ax3, gp_Dir, gp_Pnt, gp_Torus

    torus = gp_Torus(gp_Ax3(gp_Pnt(1, 2, 3), gp_Dir(1, -2, 0.5)), 1.3, 2.9)
    shape_face = BRepBuilderAPI_MakeFace(torus, 0.2, 5.9, low, high).Face()
    face = face_distance(shape_face, 1.0)
    assert isinstance(face, TorusFace)
    assert face.sheet == sheet
    x = np.array([1, 2, 3]) + np.random.default_rng(6).uniform(-3, 3, (60, 3))
    value, gradient = face.value_and_gradient(x)
    inner = cad_parts.distance_to_face(x - value[:, None] * gradient, shape_face) < 1e-6
    assert inner.sum() > 15
    assert np.abs(np.abs(value) - cad_parts.distance_to_face(x, shape_face))[inner].max() < 1e-7


def test_continuation_along_tangents() -> None:
    """Beyond the border of a spline the face is a plane or a ruled surface; there and inside, it has one tangent."""
    shape = edge_parts.hip()
    place = np.array([[8.0, 4.0, 4 * 0.6 / 5]])
    (ruled,) = (face_distance(f, 2.0) for f in faces_of(shape) if cad_parts.distance_to_face(place, f)[0] < 1e-9)
    assert ruled.kind == "spline"
    # z = y (x / 5 - 1) / 5 between x = 0 and 10, y = 0 and 5, and beyond by the same formula, as it is bilinear
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-1.5, 11.5, 500), rng.uniform(-1.5, 6.5, 500)
    on_it = np.stack([x, y, y * (x / 5 - 1) / 5], axis=1)
    value, gradient = ruled.value_and_gradient(on_it)
    assert np.abs(value).max() < 1e-12
    normal = np.stack([y / 25, (x / 5 - 1) / 5, -np.ones(500)], axis=1)
    assert np.abs(gradient - normal / np.linalg.norm(normal, axis=1)[:, None]).max() < 1e-9
    off = on_it - 0.8 * gradient
    assert ruled(off) == pytest.approx(-0.8, abs=1e-12)


def test_end_arc_of_a_slot_goes_on_along_the_walls() -> None:
    """The cylinder of an end arc alone comes back into the slot; with its tangent neighbours it does not."""
    part = open_part(edge_parts.slotted_plate())
    faces = PartFaces(part, 3.0)
    arc = next(edge for edge in ci.edges(part, "concave and %circle") if edge.centre[0] < -7)
    floor = next(n for n in arc.faces if faces.face(n).kind == "plane")
    end = next(n for n in arc.faces if faces.face(n).kind == "cylinder")
    groups = faces.groups([floor, end])
    assert [sorted(group.members) == [n] for n, group in groups.items()] == [True, False]
    assert len(groups[end].members) == 4
    # in the middle of the slot, where the full cylinder would stand in it
    inside = np.array([[-7 + 3 - 0.1, 0.2, 2.3], [-3.5, -0.4, 3.0]])
    assert np.abs(faces.face(end)(inside)).max() < 0.6
    assert groups[end](inside) == pytest.approx([-2.8, -2.6])
    # no ball of radius 1 touches both floor and wall but beside the walls
    rng = np.random.default_rng(2)
    x = rng.uniform((-12, -5, 2), (12, 5, 6), (4000, 3))
    stadium = 3 - np.hypot(np.maximum(np.abs(x[:, 0]) - 7, 0), x[:, 1])
    assert groups[end](x) == pytest.approx(-stadium)
    region = np.maximum(groups[end](x), groups[floor](x)) > -1
    assert region.tolist() == ((stadium < 1) | (x[:, 2] < 3)).tolist()


def test_group_continues_beyond_sharp_borders() -> None:
    """Above the slot its walls go on upward, all as one surface without a jump."""
    part = open_part(edge_parts.slotted_plate())
    faces = PartFaces(part, 3.0)
    end = next(n for n in range(1, 12) if faces.face(n).kind == "cylinder")
    group = faces.groups([end])[end]
    rng = np.random.default_rng(4)
    x = rng.uniform((-14, -7, 4), (14, 7, 9), (3000, 3))
    stadium = 3 - np.hypot(np.maximum(np.abs(x[:, 0]) - 7, 0), x[:, 1])
    assert group(x) == pytest.approx(-stadium)
    assert np.linalg.norm(group.value_and_gradient(x)[1], axis=1) == pytest.approx(1.0)


def test_neighbours_go_to_the_nearest_seed() -> None:
    def smooth(*faces: int) -> Any:
        return replace(ci.edges(_triangle())[0], convexity="smooth", faces=faces)

    edges = [smooth(1, 2), smooth(2, 3), smooth(3, 4), smooth(4, 5), smooth(5, 6), smooth(7, 8)]
    beside = smooth_neighbours(edges)
    assert tangent_neighbours(beside, [1, 6]) == {1: [1, 2, 3], 6: [6, 5, 4]}
    assert tangent_neighbours(beside, [1, 5]) == {1: [1, 2], 5: [5, 4, 6]}
    assert tangent_neighbours(beside, [9]) == {9: [9]}
    assert tangent_neighbours(beside, [8, 9]) == {8: [8, 7], 9: [9]}


def test_face_that_meets_itself() -> None:
    """The side of the teardrop, cut at its nose: each half goes on along its tangents."""
    shape = edge_parts.teardrop()
    faces = PartFaces(open_part(shape), 3.0)
    (edge,) = (edge for edge in faces.edges if edge.convexity == "convex" and edge.faces[0] == edge.faces[1])
    left, right = faces.beside(edge)
    whole = faces.face(edge.faces[0])
    rng = np.random.default_rng(8)
    angle = rng.uniform(0.05, np.pi / 2 - 0.1, 200)
    upper = np.column_stack([6 * np.sin(angle), 3 * np.sin(2 * angle), rng.uniform(1, 4, 200)])
    upper += 0.2 * whole.value_and_gradient(upper)[1]
    lower = upper * [1, -1, 1]
    first, second = (upper, lower) if np.abs(left(upper)).max() < 0.3 else (lower, upper)
    assert left(first) == pytest.approx(whole(first), abs=1e-9)
    assert right(second) == pytest.approx(whole(second), abs=1e-9)
    assert right(first) == pytest.approx(left(second), abs=1e-6)
    # along its tangent beyond the edge, and beyond the nose
    for half, normal, side in ((left, edge.normals[0, 0], 1.0), (right, edge.normals[0, 1], -1.0)):
        beyond = edge.points.mean(axis=0) - side * 2 * np.cross(normal, edge.tangents[0])
        value, gradient = half.value_and_gradient(beyond[None] + 0.5 * normal)
        assert value == pytest.approx(-0.5, abs=1e-9)
        assert gradient[0] == pytest.approx(-normal, abs=1e-9)
        assert half([[8.0, 0.0, 2.5]]) == pytest.approx(-2, abs=1e-3)


def test_two_faces_beside_an_edge() -> None:
    faces = PartFaces(open_part(edge_parts.slotted_plate()), 3.0)
    edge = next(edge for edge in faces.edges if edge.convexity == "concave")
    left, right = faces.beside(edge)
    groups = faces.groups(edge.faces)
    x = np.random.default_rng(9).uniform(-6, 6, (50, 3))
    assert (left(x) == groups[edge.faces[0]](x)).all()
    assert (right(x) == groups[edge.faces[1]](x)).all()


def _triangle() -> ci.Mesh:
    return ci.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_faces_that_are_not_there() -> None:
    faces = PartFaces(open_part(cad_parts.box((1, 2, 3))), 1.0)
    with pytest.raises(SelectorError, match="no face 7; the part has 6"):
        faces.face(7)
    faces = PartFaces(open_part(_triangle()), 1.0)
    with pytest.raises(SelectorError, match="no face 2; the part has 1"):
        faces.face(2)
    with pytest.raises(ValueError, match="edge 1 is boundary: it is not between two faces"):
        faces.beside(faces.edges[0])
