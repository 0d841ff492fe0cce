"""Nearest pieces of a spine: distances to a ring are known."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit.guides import speed
from cad_implicit.spine_search import SpineSearch

RING, REACH = 17.3, 1.9


@pytest.fixture(scope="module")
def search() -> SpineSearch:
    turns = np.linspace(0.0, 2 * np.pi, 61)
    origins = RING * np.stack([np.cos(turns), np.sin(turns), np.zeros(61)], axis=1)
    tangents = np.stack([-np.sin(turns), np.cos(turns), np.zeros(61)], axis=1)
    spans = speed(origins[:-1], origins[1:], tangents[:-1], tangents[1:])
    return SpineSearch(origins, tangents, spans, 1.3, REACH)


def truth(points: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - RING, points[:, 2])


def test_what_is_far_is_never_said_to_be_farther(search: SpineSearch) -> None:
    points = np.random.default_rng(5).uniform(-22, 22, (20_000, 3))
    said = search.at_least(points)
    assert (said <= truth(points) + 1e-4).all()  # cubics of 6 degrees each leave the ring by less
    assert (said >= truth(points) - 0.5 * REACH).all()


def test_the_nearest_piece_and_nothing_beyond_a_limit(search: SpineSearch) -> None:
    points = np.random.default_rng(6).uniform(-20, 20, (20_000, 3))
    away, piece = search.nearest(points, REACH)
    known = truth(points) < REACH - 0.01
    assert np.isinf(away[truth(points) > REACH + 0.01]).all()
    assert away[known] == pytest.approx(truth(points)[known], abs=0.01)
    angle = np.degrees(np.arctan2(points[known, 1], points[known, 0])) % 360
    off = np.abs(angle - 6 * (piece[known] + 0.5))
    assert np.minimum(off, 360 - off).max() < 3.1
