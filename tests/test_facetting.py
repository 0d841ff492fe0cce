"""Patches fall apart to triangles, with those neighbours that would gape beside straight edges."""

from __future__ import annotations

import numpy as np
import trimesh

from cad_implicit.blend_labels import Outward
from cad_implicit.facetting import facetted
from cad_implicit.mesh import Mesh


class Around:
    """Distance to the cylinder of radius 2 about z."""

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        away = points * (1.0, 1.0, 0.0)
        length = np.linalg.norm(away, axis=1)
        return length - 2.0, away / length[:, None]


class Flat:
    """Distance to a plane at a right angle to z."""

    def __init__(self, height: float) -> None:
        self.height = height

    def value_and_gradient(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return points[:, 2] - self.height, np.tile((0.0, 0.0, 1.0), (len(points), 1))


def rod() -> tuple[Mesh, np.ndarray, list[Outward]]:
    """Cylinder of radius 2 and height 3; labels 0 for its side, 1 and 2 for its lower and upper end."""
    raw = trimesh.creation.cylinder(2.0, 3.0, sections=24)
    up = np.round(raw.face_normals[:, 2])
    labels = np.select([up < 0, up > 0], [1, 2], 0).astype(np.int64)
    return Mesh(raw.vertices, raw.faces), labels, [Outward(s, 1.0) for s in (Around(), Flat(-1.5), Flat(1.5))]


def test_plane_neighbours_stay_and_round_ones_follow() -> None:
    mesh, labels, surfaces = rod()
    sagitta = 2 * (1 - np.cos(np.pi / 24))
    lost = np.where(labels == 2, -1, labels)
    near = facetted(mesh, lost, [], surfaces.__getitem__, 3, 1.01 * sagitta)
    assert (near[labels == 2] == 3 + np.flatnonzero(labels == 2)).all()
    assert (near[labels != 2] == labels[labels != 2]).all()
    far = facetted(mesh, lost, [], surfaces.__getitem__, 3, 0.99 * sagitta)
    assert (far[labels != 1] == 3 + np.flatnonzero(labels != 1)).all()
    assert (far[labels == 1] == 1).all()


def test_faces_that_are_triangles_already_stay_so() -> None:
    mesh, labels, surfaces = rod()
    once = facetted(mesh, np.where(labels == 2, -1, labels), [], surfaces.__getitem__, 3, 1.0)
    again = facetted(mesh, once, [], surfaces.__getitem__, 3, 1.0)
    assert (once == again).all()
