"""Edges cut where the faces beside them are tangent: places, kinds and ends, beside formulas and B-reps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from sheets import TURN, placed

from cad_implicit.cad.edge_pieces import pieces
from cad_implicit.cad.edges import Edge, convexity, turns


def circle(
    turn: Callable[[np.ndarray], np.ndarray],
    count: int = 33,
    *,
    curve: str = "circle",
    start: float = 0.0,
    end: float = 2 * np.pi,
) -> Edge:
    """Arc of radius 5 with the z face on its right, and a face on its left that is turned from that by some degrees."""
    angle = np.linspace(start, end, count)
    points = placed(np.stack([5 * np.cos(angle), 5 * np.sin(angle), 0 * angle], axis=1))
    tangents = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1) @ TURN.T
    up = np.tile(TURN[:, 2], (count, 1))
    inward = np.cross(up, tangents)
    by = np.radians(turn(angle))[:, None]
    normals = np.stack([np.cos(by) * up + np.sin(by) * inward, up], axis=1)
    closed = abs(end - start - 2 * np.pi) < 1e-9
    return Edge(
        7, convexity(tangents, normals, (3, 4)), curve, closed, 5 * (end - start), points.mean(axis=0), None, (3, 4),
        (1, 1) if closed else (1, 2), points, tangents, normals, 5,
    )  # fmt: skip


def angles(part: Edge) -> np.ndarray:
    local = (part.points - placed(np.zeros((1, 3)))) @ TURN
    return np.unwrap(np.arctan2(local[:, 1], local[:, 0]))


def test_cut_where_it_changes() -> None:
    """20 degrees times a sine: convex, tangent, concave; the piece around the vertex is one."""
    edge = circle(lambda t: 20 * np.sin(t - 1))
    assert edge.convexity == "mixed"
    first, second = pieces(edge)
    tangent = np.arcsin(1 / 20)
    assert [first.convexity, second.convexity] == ["convex", "concave"]
    assert angles(first)[[0, -1]] == pytest.approx([1 + tangent, 1 + np.pi - tangent], abs=1e-4)
    assert angles(second)[[0, -1]] == pytest.approx([1 - np.pi + tangent, 1 - tangent], abs=1e-4)
    for part in (first, second):
        assert (part.number, part.faces, part.chain, part.closed, part.ends) == (7, (3, 4), 5, False, (0, 0))
        middle = placed(np.zeros((1, 3)))
        assert np.linalg.norm(part.points - middle, axis=1) == pytest.approx(5, abs=1e-7)
        assert part.length == pytest.approx(5 * (np.pi - 2 * tangent), abs=1e-3)
        half = part.length / 10
        assert np.linalg.norm(part.centre - middle) == pytest.approx(5 * np.sin(half) / half, abs=1e-3)
        turn = turns(part.tangents, part.normals)
        assert np.abs(turn[[0, -1]]) == pytest.approx(1, abs=1e-6)
        assert (np.abs(turn[1:-1]) > 1).all()
        assert np.linalg.norm(part.tangents, axis=1) == pytest.approx(1)
        assert np.linalg.norm(part.normals, axis=2) == pytest.approx(1)
        radial = part.points - middle
        assert np.abs((radial * part.tangents).sum(axis=1)).max() < 1e-5


def test_open_edges_keep_their_ends() -> None:
    edge = circle(lambda t: 20 * np.sin(t - 1), start=0.2, end=4.0)
    first, second = pieces(edge)
    assert [first.convexity, second.convexity] == ["concave", "convex"]
    assert [first.ends, second.ends] == [(1, 0), (0, 2)]
    assert first.points[0] == pytest.approx(edge.points[0])
    assert second.points[-1] == pytest.approx(edge.points[-1])
    assert angles(first)[-1] == pytest.approx(1 - np.arcsin(1 / 20), abs=1e-4)
    assert first.length + second.length < edge.length


@pytest.mark.parametrize("touch", [0.0, 1.234, 2 * np.pi * 5 / 32])
def test_tangent_at_one_point(touch: float) -> None:
    """A closed edge that is tangent in one place, at its vertex, at a point of it or between, becomes an open one."""
    edge = circle(lambda t: -20 * (1 - np.cos(t - touch)))
    (part,) = pieces(edge)
    assert part.convexity == edge.convexity == "concave"
    assert (part.closed, part.ends) == (False, (0, 0))
    tangent = np.arccos(1 - 1 / 20)
    ends = angles(part)[[0, -1]] - touch
    assert np.mod(ends, 2 * np.pi) == pytest.approx([tangent, 2 * np.pi - tangent], abs=1e-3)
    assert part.length == pytest.approx(5 * (2 * np.pi - 2 * tangent), abs=1e-2)


def test_of_one_kind_it_is_the_same() -> None:
    for edge in (
        circle(lambda t: 20 + 0 * t),
        circle(lambda t: 0.4 + 0 * t),
        circle(lambda t: -9 + np.sin(t), end=2.0),
    ):
        assert pieces(edge) == (edge,)
        assert pieces(edge)[0] is edge


def test_polylines_stay_straight() -> None:
    """A mesh's edge is cut between its points, on the line between them."""
    edge = circle(lambda t: 20 * np.sin(t - 1), 13, curve="polyline")
    first, second = pieces(edge)
    assert [first.convexity, second.convexity] == ["convex", "concave"]
    chord = edge.points[2] + np.linspace(0, 1, 2001)[:, None] * (edge.points[3] - edge.points[2])
    assert np.linalg.norm(chord - first.points[0], axis=1).min() < 1e-3
    assert first.length == pytest.approx(np.linalg.norm(np.diff(first.points, axis=0), axis=1).sum())


@pytest.mark.host
def test_beside_a_brep() -> None:
    """Pieces of the hip's ridge end where its faces turn by 1 degree; the tangent of the turn is linear along it."""
    pytest.importorskip("OCP", reason="needs CadQuery or build123d")
    import cad_parts
    import edge_parts

    from cad_implicit.cad import open_part
    from cad_implicit.cad.edges import part_edges
    from cad_implicit.face_groups import PartFaces

    part = open_part(cad_parts.moved(edge_parts.hip()))
    found = part_edges(part)
    (ridge,) = (edge for edge in found if edge.convexity == "mixed")
    parts = pieces(ridge)
    assert sorted(edge.convexity for edge in parts) == ["concave", "convex"]
    assert [edge.length for edge in parts] == pytest.approx([5 - 25 * np.tan(np.radians(1))] * 2, abs=1e-4)
    assert sorted(edge.ends.count(0) for edge in parts) == [1, 1]
    faces = PartFaces(part, 1.0, found)
    for edge in parts:
        normals = [faces.face(number).value_and_gradient(edge.points)[1] for number in edge.faces]
        turn = np.degrees(np.linalg.norm(np.cross(*normals), axis=1))
        assert turn.min() == pytest.approx(1, abs=1e-3)
