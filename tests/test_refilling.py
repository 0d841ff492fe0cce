"""Holes of single vertices are filled with the triangles that are nearest to a shape."""

from __future__ import annotations

import numpy as np
import pytest

import cad_implicit as ci
from cad_implicit.refilling import filled, ring

#: Around a vertex on the edge between the top and a side of a box, 2 mm wide.
RING = np.array([[0.3, -0.5, 1], [1, -0.6, 1], [1, -0.5, 0.3], [1, 0.2, 0.4], [1, 0.1, 1]])


def test_rings_follow_their_triangles() -> None:
    fan = np.array([[9, 4, 7], [2, 9, 7], [4, 9, 5], [5, 9, 2]], np.int32)
    found = ring(np.roll(fan, 1, axis=0), 9)
    assert found is not None
    assert np.roll(found, -int(np.flatnonzero(found == 4)[0])).tolist() == [4, 7, 2, 5]
    assert ring(fan[:-1], 9) is None


@pytest.mark.parametrize("turn", range(5))
def test_creases_stay(turn: int) -> None:
    box = ci.box((2, 2, 2))
    around = np.roll(np.arange(5), turn)
    vertex = np.array([0.97, -0.3, 0.96])
    old = np.stack([np.repeat(vertex[None], 5, axis=0), RING, np.roll(RING, -1, axis=0)], axis=1)
    rows = filled(RING, around, box, old, 0.5)
    assert rows is not None
    assert len(rows) == 3
    found = {tuple(sorted(row)) for row in around[rows].tolist()}
    assert (0, 1, 4) in found
    normals = np.cross(*(RING[around[rows[:, k]]] - RING[around[rows[:, 0]]] for k in (1, 2)))
    assert (np.abs(np.sort(np.abs(normals), axis=1)[:, :2]) < 1e-12).all()
    assert (normals.max(axis=1) > 0).all()


def test_nothing_is_filled_farther_from_the_shape() -> None:
    ball = ci.sphere(1.0)
    angle = 2 * np.pi * np.arange(6) / 6
    around = np.stack([np.cos(angle), np.sin(angle), np.full(6, 0.5)], axis=1) / np.sqrt(1.25)
    old = np.stack([np.tile([0.0, 0.0, 1.0], (6, 1)), around, np.roll(around, -1, axis=0)], axis=1)
    assert filled(around, np.arange(6), ball, old, 0.5) is None
