"""Edges of B-reps: numbers, sides, angles, convexity and chains."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

import cad_implicit as ci
from cad_implicit.cad.edges import Edge
from cad_implicit.errors import SelectorError

pytest.importorskip("OCP", reason="needs CadQuery or build123d")
pytestmark = pytest.mark.host

import cad_parts  # noqa: E402
import edge_parts  # noqa: E402

from cad_implicit.cad import occ  # noqa: E402

PARTS = {
    "angle bar": edge_parts.angle_bar,
    "slotted plate": edge_parts.slotted_plate,
    "hip": edge_parts.hip,
    "teardrop": edge_parts.teardrop,
    "frustum": lambda: cad_parts.primitives()["frustum"][0],
    "loft": cad_parts.loft,
}


def by_kind(found: tuple[Edge, ...]) -> dict[str, int]:
    return dict(Counter(edge.convexity for edge in found))


def degenerate(shape: Any) -> set[int]:
    from OCP.BRep import BRep_Tool

    edges = enumerate(occ.distinct(shape, occ_edge()), 1)
    return {number for number, edge in edges if BRep_Tool.Degenerated_s(occ.as_edge(edge))}


def occ_edge() -> Any:
    from OCP.TopAbs import TopAbs_EDGE

    return TopAbs_EDGE


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("name", PARTS)
def test_sides_and_normals(name: str, mirror: bool) -> None:
    """A small step to its left leads from an edge onto its first face, and into the material against the normal."""
    shape = cad_parts.moved(PARTS[name](), mirror=mirror)
    faces = list(occ.distinct(shape, occ.TopAbs_FACE))
    inside = ci.MeshDistance(ci.to_mesh(shape, tolerance=1e-3))
    for edge in ci.edges(shape):
        middle = len(edge.points) // 2
        point, along = edge.points[middle], edge.tangents[middle]
        for face, normal, side in zip(edge.faces, edge.normals[middle], (1, -1), strict=True):
            there = point + 0.01 * side * np.cross(normal, along)
            assert cad_parts.distance_to_face(there[None], faces[face - 1])[0] < 2e-5
            if edge.convexity == "convex":
                assert cad_parts.distance_to_face((there + 0.01 * normal)[None], faces[face - 1])[0] > 0.0099
            above, below = inside([there + 0.004 * normal, there - 0.004 * normal])
            assert above < -0.002
            assert below > 0.002
        assert np.allclose(np.linalg.norm(edge.tangents, axis=1), 1)
        assert np.allclose(np.linalg.norm(edge.normals, axis=2), 1)


def test_angle_bar() -> None:
    shape = cad_parts.moved(edge_parts.angle_bar())
    found = ci.edges(shape)
    assert [edge.number for edge in found] == list(range(1, 19))
    assert by_kind(found) == {"convex": 17, "concave": 1}
    (inner,) = (edge for edge in found if edge.convexity == "concave")
    assert inner.length == pytest.approx(11)
    assert np.allclose(inner.angles, 270)
    assert all(np.allclose(edge.angles, 90) for edge in found if edge is not inner)
    assert {edge.curve for edge in found} == {"line"}
    assert sorted(round(edge.length, 6) for edge in found) == sorted([2, 3, 4, 7, 7, 9] * 2 + [11] * 6)
    for edge in found:
        assert np.allclose(edge.centre, edge.points[[0, -1]].mean(axis=0))
        assert np.allclose(edge.direction * edge.length, edge.points[-1] - edge.points[0])
        assert edge.chain == edge.number


@pytest.mark.parametrize("name", cad_parts.primitives())
def test_degenerate_edges_are_counted_but_left_out(name: str) -> None:
    shape = cad_parts.primitives()[name][0]
    count = occ.shape_map(shape, occ_edge()).Extent()
    numbers = {edge.number for edge in ci.edges(shape)}
    assert numbers == set(range(1, count + 1)) - degenerate(shape)
    assert (name in ("sphere", "sphere wedge", "cone")) == bool(degenerate(shape))


def test_seams_and_cones() -> None:
    cone = ci.edges(cad_parts.primitives()["frustum"][0])
    assert by_kind(cone) == {"convex": 2, "seam": 1}
    slope = np.degrees(np.arctan2(7.9, 5.3 - 2.1))
    rims = sorted((edge for edge in cone if edge.convexity == "convex"), key=lambda edge: edge.length)
    assert [edge.closed for edge in rims] == [True, True]
    assert [edge.curve for edge in rims] == ["circle", "circle"]
    assert rims[0].length == pytest.approx(2 * np.pi * 2.1)
    assert rims[0].angles == pytest.approx(180 - slope)
    assert rims[1].angles == pytest.approx(slope)
    (seam,) = (edge for edge in cone if edge.convexity == "seam")
    assert seam.faces[0] == seam.faces[1]


def test_a_face_that_meets_itself_at_an_angle() -> None:
    found = ci.edges(edge_parts.teardrop())
    assert by_kind(found) == {"convex": 3}
    (upright,) = ci.edges(edge_parts.teardrop(), "|Z")
    assert upright.faces[0] == upright.faces[1]
    assert upright.length == pytest.approx(5)
    assert upright.angle == pytest.approx(90, abs=3)  # the spline rounds it a little


def test_mixed_edge() -> None:
    found = ci.edges(cad_parts.moved(edge_parts.hip()))
    (edge,) = (edge for edge in found if edge.convexity == "mixed")
    start, end = sorted(edge.angles[[0, -1]])
    turn = np.degrees(np.arctan2(1, 5))
    assert (start, end) == (pytest.approx(180 - turn), pytest.approx(180 + turn))


def test_chains_go_round_the_slot() -> None:
    found = ci.edges(cad_parts.moved(edge_parts.slotted_plate()))
    assert by_kind(found) == {"convex": 16, "concave": 4, "smooth": 4}
    chains = Counter(edge.chain for edge in found)
    assert sorted(chains.values()) == [1] * 16 + [4, 4]
    for chain in (number for number, count in chains.items() if count == 4):
        own = [edge for edge in found if edge.chain == chain]
        assert min(edge.number for edge in own) == chain
        assert len({edge.convexity for edge in own}) == 1
        assert sum(edge.length for edge in own) == pytest.approx(2 * 14 + 6 * np.pi)
    assert [edge.angle for edge in found if edge.convexity == "smooth"] == pytest.approx([180] * 4)


def test_polylines_stay_on_their_curves() -> None:
    shape = cad_parts.moved(edge_parts.slotted_plate())
    allowed = np.linalg.norm(np.diff(occ.bounds(shape), axis=0)) / 2000
    all_faces = list(occ.distinct(shape, occ.TopAbs_FACE))
    for edge in ci.edges(shape, "%circle"):
        for face in edge.faces:
            assert cad_parts.distance_to_face(edge.points, all_faces[face - 1]).max() < 1e-9
        chord = np.linalg.norm(np.diff(edge.points, axis=0), axis=1)
        assert (3 - np.sqrt(9 - (chord / 2) ** 2)).max() < allowed
        assert (chord < 3 * 0.21).all()


def test_selectors_choose_edges() -> None:
    shape = edge_parts.slotted_plate()
    assert len(ci.edges(shape, "concave")) == 4
    assert {edge.curve for edge in ci.edges(shape, "concave and %circle")} == {"circle"}
    assert len(ci.edges(shape, ">Z")) == 8
    assert [edge.number for edge in ci.edges(shape, "5,3")] == [3, 5]
    with pytest.raises(SelectorError, match=r"'%ellipse' selects no edge; .*24 edges .*16 convex, .*; 20 line"):
        ci.edges(shape, "%ellipse")
    with pytest.raises(SelectorError, match="no edge 25"):
        ci.edges(shape, "1,25")


@pytest.mark.parametrize("name", ["angle bar", "slotted plate", "frustum"])
def test_triangles_have_the_same_sharp_edges(name: str) -> None:
    shape = cad_parts.moved(PARTS[name]())
    raw = ci.to_mesh(shape, tolerance=1e-3)
    exact = [edge for edge in ci.edges(shape) if edge.convexity in ("convex", "concave")]
    mesh = ci.edges(ci.Mesh(raw.vertices, raw.faces))
    whole = {edge.chain: edge.convexity for edge in exact}
    assert by_kind(mesh) == dict(Counter(whole.values()))
    for convexity in ("convex", "concave"):
        lengths = [sum(edge.length for edge in found if edge.convexity == convexity) for found in (exact, mesh)]
        assert lengths[1] == pytest.approx(lengths[0], rel=1e-3)
