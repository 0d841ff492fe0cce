"""Faces of parts that came as triangles: surfaces told apart where they are tangent, groups, halves."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
import shapes
import trimesh
from sheets import TURN, placed

import cad_implicit as ci
from cad_implicit.cad import open_part
from cad_implicit.face_groups import FaceGroup, PartFaces
from cad_implicit.mesh_patches import MeshPatch


def as_triangles(shape: Any, single: bool = False) -> Any:
    mesh = ci.to_mesh(shape)
    return open_part((mesh.vertices.astype(np.float32) if single else mesh.vertices, mesh.faces))


def kinds(faces: PartFaces, number: int) -> Counter[str]:
    face = faces.face(number)
    return Counter(member.kind for member in (face.members.values() if isinstance(face, FaceGroup) else [face]))


def test_faces_of_a_tube() -> None:
    raw = trimesh.creation.annulus(3, 5, 4, sections=48)
    part = open_part((placed(raw.vertices), raw.faces))
    faces = PartFaces(part, 2.0)
    assert sorted(faces.face(number).kind for number in range(1, 5)) == ["cylinder", "cylinder", "plane", "plane"]
    assert sorted(faces.face(n).radius for n in range(1, 5) if faces.face(n).kind == "cylinder") == pytest.approx(
        [3, 5]
    )
    inner = placed(np.array([[3.5, 0.0, 0.3]]))
    assert sorted(float(faces.face(n)(inner)[0]) for n in range(1, 5)) == pytest.approx([0.5, 1.5, 1.7, 2.3])
    for edge in faces.edges:
        left, right = faces.beside(edge)
        for side, normal in ((left, edge.normals[:, 0]), (right, edge.normals[:, 1])):
            value, gradient = side.value_and_gradient(edge.points)
            assert np.abs(value).max() < 1e-12
            assert np.abs(gradient + normal).max() < 1e-12


def test_free_form_face() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = ball.vertices * [3, 2, 1]
    (face,) = (PartFaces(open_part((placed(vertices), ball.faces)), 2.0).face(1),)
    assert isinstance(face, MeshPatch)
    rng = np.random.default_rng(5)
    on = rng.normal(size=(300, 3))
    on /= np.linalg.norm(on, axis=1)[:, None]
    normal = on / [3, 2, 1]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for height in (-0.3, 0.0, 0.2):
        value, gradient = face.value_and_gradient(placed(on * [3, 2, 1] + height * normal))
        assert np.abs(value + height).max() < 6e-3
        assert np.abs(gradient + normal @ TURN.T).max() < 0.25


def test_planes_that_meet_at_a_small_angle() -> None:
    """A ridge of 15 degrees is no edge, but does not bend the planes beside it; beyond it each goes on."""
    half = np.radians(7.5)
    mesh = shapes.extrusion([(-4, 0), (4, 0), (4, 2), (0, 2 + 4 * np.tan(half)), (-4, 2)], 5)
    faces = PartFaces(open_part(mesh), 2.0)
    (number,) = (n for n in range(1, 7) if kinds(faces, n).total() > 1)
    assert kinds(faces, number) == {"plane": 2}
    x, z = np.random.default_rng(7).uniform((-3.5, -2), (3.5, 2), (200, 2)).T
    on = shapes.placed(np.column_stack([x, 2 + (4 - np.abs(x)) * np.tan(half), z]))
    assert np.abs(faces.face(number)(on)).max() < 1e-7


brep = pytest.mark.host


@brep
@pytest.mark.parametrize("single", [False, True])
def test_rounded_part(single: bool) -> None:
    """Everything tangent, one piece without an edge: all 30 surfaces are found."""
    pytest.importorskip("OCP", reason="needs CadQuery or build123d")
    import cad_parts
    import edge_parts

    shape = cad_parts.moved(edge_parts.all_rounded())
    part = as_triangles(shape, single)
    faces = PartFaces(part, 3.0)
    assert not faces.edges
    assert kinds(faces, 1) == {"plane": 7, "cylinder": 13, "torus": 2, "sphere": 8}
    group = faces.face(1)
    assert isinstance(group, FaceGroup)
    radii = [m.tube if m.kind == "torus" else m.radius for m in group.members.values() if m.kind != "plane"]
    assert sorted(radii)[:-1] == pytest.approx([0.9] * 22, rel=3e-6 if single else 1e-9)
    assert max(radii) == pytest.approx(4, rel=1e-6 if single else 1e-9)
    x = part.triangles.vertices[::7] + np.random.default_rng(2).normal(size=(1, 3)) * 0.1
    exact = ci.MeshDistance(ci.to_mesh(shape, tolerance=1e-3, angular_tolerance=0.1))
    assert np.abs(group(x) - exact(x)).max() < 3e-3


@brep
def test_slot() -> None:
    """Its walls and end arcs are one piece, in four surfaces, and go on upward without a jump."""
    pytest.importorskip("OCP", reason="needs CadQuery or build123d")
    import edge_parts

    faces = PartFaces(as_triangles(edge_parts.slotted_plate(), True), 3.0)
    (wall,) = (n for n in range(1, 9) if len(kinds(faces, n)) > 1)
    assert kinds(faces, wall) == {"cylinder": 2, "plane": 2}
    x = np.random.default_rng(4).uniform((-14, -7, 1), (14, 7, 9), (3000, 3))
    stadium = 3 - np.hypot(np.maximum(np.abs(x[:, 0]) - 7, 0), x[:, 1])
    assert faces.face(wall)(x) == pytest.approx(-stadium, abs=2e-6)
    floor = next(edge for edge in faces.edges if edge.convexity == "concave").faces
    assert set(faces.groups(floor)) == set(floor)


@brep
def test_face_that_meets_itself() -> None:
    """Halves of the teardrop's side: as those of its B-rep, but for the triangles."""
    pytest.importorskip("OCP", reason="needs CadQuery or build123d")
    import edge_parts

    exact, coarse = (
        PartFaces(part, 3.0) for part in (open_part(edge_parts.teardrop()), as_triangles(edge_parts.teardrop()))
    )
    first, second = (
        next(edge for edge in faces.edges if edge.faces[0] == edge.faces[1] and edge.convexity == "convex")
        for faces in (exact, coarse)
    )
    angle = np.random.default_rng(8).uniform(0.1, np.pi / 2 - 0.1, 100)
    x = np.column_stack([6 * np.sin(angle), 2.8 * np.sin(2 * angle), 2.5 + 0 * angle])
    if first.tangents[0] @ second.tangents[0] < 0:
        x = x * [1, -1, 1]
    for one, other in zip(exact.beside(first), coarse.beside(second), strict=True):
        same = x if one(x).max() < 1.5 else x * [1, -1, 1]
        assert np.abs(one(same) - other(same)).max() < 2e-3
        assert one(x * [1, -1, 1]) != pytest.approx(one(x), abs=0.1)
