"""Patches fall apart to triangles, whose edges are halved beside round neighbours."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from cad_implicit.blend_labels import Outward
from cad_implicit.facetting import facetted
from cad_implicit.mesh import Mesh

RADIUS = 2.0
SECTIONS = 24
SAGITTA = RADIUS * (1 - np.cos(np.pi / SECTIONS))


class Around:
    """Distance to the cylinder of radius 2 about z."""

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        away = points * (1.0, 1.0, 0.0)
        length = np.linalg.norm(away, axis=1)
        return length - RADIUS, away / length[:, None]


class Bumpy(Around):
    """The same with steps between the vertices of :func:`rod`, on which no chord lies."""

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        value, gradient = super().value_and_gradient(points)
        turn = np.arctan2(points[:, 1], points[:, 0]) * SECTIONS / (2 * np.pi)
        return value + 0.1 * (np.abs(turn - np.round(turn)) > 1e-6), gradient


class Flat:
    """Distance to a plane at a right angle to z."""

    def __init__(self, height: float) -> None:
        self.height = height

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return points[:, 2] - self.height, np.tile((0.0, 0.0, 1.0), (len(points), 1))


def rod(side: Around) -> tuple[Mesh, np.ndarray, list[Outward]]:
    """Cylinder of radius 2 and height 3; labels 0 for its side, 1 and 2 for its lower and upper end."""
    raw = trimesh.creation.cylinder(RADIUS, 3.0, sections=SECTIONS)
    up = np.round(raw.face_normals[:, 2])
    labels = np.select([up < 0, up > 0], [1, 2], 0).astype(np.int64)
    return Mesh(raw.vertices, raw.faces), labels, [Outward(s, 1.0) for s in (side, Flat(-1.5), Flat(1.5))]


def test_neighbours_that_do_not_gape_stay() -> None:
    mesh, labels, surfaces = rod(Around())
    lost = np.where(labels == 2, -1, labels)
    same, found = facetted(mesh, lost, surfaces.__getitem__, 3, 1.01 * SAGITTA)
    assert (same.faces == mesh.faces).all()
    assert (found[labels == 2] == 3 + np.flatnonzero(labels == 2)).all()
    assert (found[labels != 2] == labels[labels != 2]).all()


@pytest.mark.parametrize(("limit", "pieces"), [(0.99, 2), (0.24, 4), (0.06, 8)])
def test_edges_are_halved_until_they_lie_on_round_neighbours(limit: float, pieces: int) -> None:
    mesh, labels, surfaces = rod(Around())
    finer, found = facetted(mesh, np.where(labels == 2, -1, labels), surfaces.__getitem__, 3, limit * SAGITTA)
    assert finer.is_watertight
    assert finer.volume > mesh.volume
    facets = found >= 3
    assert len(np.unique(found[facets])) == facets.sum()
    assert (finer.vertices[finer.faces[facets], 2] > 1.5 - 1e-12).all()
    rim = np.unique(finer.faces[facets])[np.linalg.norm(finer.vertices[np.unique(finer.faces[facets]), :2], axis=1) > 1]
    assert len(rim) == pieces * SECTIONS
    assert np.linalg.norm(finer.vertices[rim, :2], axis=1) == pytest.approx(RADIUS, abs=1e-12)
    below = finer.vertices[finer.faces[found == 1], 2]
    assert (below < -1.5 + 1e-12).all()
    assert len(below) == (labels == 1).sum()


def test_neighbours_that_gape_all_the_same_follow() -> None:
    mesh, labels, surfaces = rod(Bumpy())
    finer, found = facetted(mesh, np.where(labels == 2, -1, labels), surfaces.__getitem__, 3, 0.5 * SAGITTA)
    assert finer.is_watertight
    flat = (finer.vertices[finer.faces, 2] < -1.5 + 1e-12).all(axis=1)
    assert (found[flat] == 1).all()
    assert (found[~flat] == 3 + np.flatnonzero(~flat)).all()


def test_faces_that_are_triangles_already_stay_so() -> None:
    mesh, labels, surfaces = rod(Around())
    once = facetted(mesh, np.where(labels == 2, -1, labels), surfaces.__getitem__, 3, 1e-3)
    again = facetted(*once, surfaces.__getitem__, 3, 1e-3)
    assert (once[0].faces == again[0].faces).all()
    assert (once[1] == again[1]).all()
