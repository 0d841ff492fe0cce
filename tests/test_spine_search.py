"""Nearest pieces of a spine: distances to a ring are known."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit.guides import speed
from cad_implicit.kernels.spine_samples import nearest_sample
from cad_implicit.spine_search import spine_samples

RING, REACH = 17.3, 1.9


def asked(points: np.ndarray, most: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is known of the distances of points from a ring: at least, nearly, and the piece or -1."""
    turns = np.linspace(0.0, 2 * np.pi, 61)
    origins = RING * np.stack([np.cos(turns), np.sin(turns), np.zeros(61)], axis=1)
    tangents = np.stack([-np.sin(turns), np.cos(turns), np.zeros(61)], axis=1)
    spans = speed(origins[:-1], origins[1:], tangents[:-1], tangents[1:])
    found = spine_samples(origins, tangents, spans, 1.3, REACH)
    told = [nearest_sample(x, found.middles, found.members, found.points, found.gap, most) for x in points]
    least, away, sample = (np.array(column) for column in zip(*told, strict=True))
    return least, away, np.where(sample < 0, -1, found.pieces[sample])


def truth(points: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - RING, points[:, 2])


def test_what_is_far_is_never_said_to_be_farther() -> None:
    points = np.random.default_rng(5).uniform(-22, 22, (20_000, 3))
    said, _, _ = asked(points, REACH)
    assert (said <= truth(points) + 1e-4).all()  # cubics of 6 degrees each leave the ring by less
    assert (said >= truth(points) - 0.25 * REACH).all()


@pytest.mark.parametrize("most", [REACH, np.inf])
def test_the_nearest_piece_and_nothing_beyond_a_limit(most: float) -> None:
    points = np.random.default_rng(6).uniform(-20, 20, (20_000, 3))
    _, away, piece = asked(points, most)
    known = truth(points) < most - 0.01
    assert known.sum() > 100
    assert np.isinf(away[truth(points) > most + 0.01]).all()
    assert (piece[np.isinf(away)] == -1).all()
    known &= np.hypot(points[:, 0], points[:, 1]) > 0.5  # on the axis all pieces are as near
    assert away[known] == pytest.approx(truth(points)[known], abs=0.01)
    angle = np.degrees(np.arctan2(points[known, 1], points[known, 0])) % 360
    off = np.abs(angle - 6 * (piece[known] + 0.5))
    assert np.minimum(off, 360 - off).max() < 3.1
