"""Vertices: where curves and surfaces meet, and which chains go to which of two that are one in the mesh."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit.blend_curves import Arc
from cad_implicit.blend_labels import Outward
from cad_implicit.junctions import Meeting, pairings
from cad_implicit.primitives import circle_through, line_through


class Plane:
    def __init__(self, normal: tuple[float, float, float], at: float) -> None:
        self.normal, self.at = np.array(normal) / np.linalg.norm(normal), at

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return points @ self.normal - self.at, np.tile(self.normal, (len(points), 1))


def test_an_arc_meets_a_plane() -> None:
    arc = Arc(np.array([1.0, 2.0, 3.0]), np.array([2.0, 0.0, 0.0]), np.array([0.0, 1.2, 1.6]))
    meeting = Meeting([arc], [Outward(Plane((0.0, 0.6, 0.8), 3.6 + 1.0), 1.0)])
    place = meeting.place(np.array([2.6, 2.7, 3.9]), 1e-12)
    assert place == pytest.approx([1 + np.sqrt(3.0), 2.6, 3.8], abs=1e-9)  # half of the radius up
    assert meeting.off(place) < 1e-9
    assert meeting.off(place + [0.0, 0.06, 0.08]) == pytest.approx(0.1, abs=1e-9)


def test_four_chains_pair_across_either_border() -> None:
    found = pairings([(7, 3), (3, 5), (5, 2), (2, 7)])
    assert {frozenset(map(frozenset, pair[:2])) for pair in found} == {
        frozenset([frozenset([0, 1]), frozenset([2, 3])]),
        frozenset([frozenset([1, 2]), frozenset([3, 0])]),
    }
    for first, second, beside in found:
        assert not set(first) & set(second)
        # the patches beside the new border are on both sides of it
        sides = [(7, 3), (3, 5), (5, 2), (2, 7)]
        for patch in beside:
            assert sum(patch in sides[n] for n in first) == sum(patch in sides[n] for n in second) == 1


@pytest.mark.parametrize("sides", [[(1, 2), (2, 3), (3, 1)], [(1, 2), (2, 1), (1, 3), (3, 1)]])
def test_other_vertices_do_not_part(sides: list[tuple[int, int]]) -> None:
    assert pairings(sides) == []


def test_lines_and_circles_are_told_from_points() -> None:
    turn = np.linspace(0.3, 1.9, 9)
    x, y = np.array([0.6, 0.0, 0.8]), np.array([0.0, 1.0, 0.0])
    points = [1.0, 2.0, 3.0] + 2.5 * (np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y)
    circle = circle_through(points, 1.0)
    assert circle is not None
    assert circle[0] == pytest.approx([1.0, 2.0, 3.0])
    assert np.abs(circle[1] @ np.cross(x, y)) == pytest.approx(1.0)
    assert circle[2] == pytest.approx(2.5)
    assert line_through(points, 1.0) is None
    assert np.abs(line_through(np.outer(turn, x), 1.0) @ x) == pytest.approx(1.0)
    assert circle_through(points + np.outer(np.sin(9 * turn), 1e-3 * x), 1.0) is None
