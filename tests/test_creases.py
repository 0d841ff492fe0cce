"""Curved creases are cut finer than the grid; straight ones and smooth surfaces are left alone."""

from __future__ import annotations

import numpy as np
import pytest
from dual_oracles import broken_edges, distance_to_mesh, status
from scipy.spatial.transform import Rotation

from cad_implicit import creases
from cad_implicit.dual import dual_contour
from cad_implicit.shapes import box, cylinder, sphere
from validation.intersections import count_intersections

H = 0.1
AXIS = np.array([1, 2, 0.5]) / np.linalg.norm([1, 2, 0.5])
SHIFT = np.array([0.03, 0.01, 0.02])


def rims(radius: float) -> np.ndarray:
    angle = np.tile(np.linspace(0, 2 * np.pi, 2000), 2)
    z = np.repeat([-0.5, 0.5], 2000)
    circles = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    return Rotation.from_rotvec(np.radians(40) * AXIS).apply(circles) + SHIFT


@pytest.mark.parametrize("radius", [0.25, 0.4, 1.0])
def test_rims_follow_their_circles(radius: float, monkeypatch: pytest.MonkeyPatch) -> None:
    shape = cylinder(radius, 1.0).turned(AXIS, 40).moved(SHIFT)
    mesh = dual_contour(shape, H)
    assert broken_edges(mesh) == 0
    assert status(mesh) == "NoError"
    assert count_intersections(mesh) == 0
    assert distance_to_mesh(mesh, rims(radius)).max() < 0.02 * H
    monkeypatch.setattr(creases, "_PASSES", 0)
    coarse = dual_contour(shape, H)
    assert distance_to_mesh(coarse, rims(radius)).max() > 0.02 * H or radius == 1.0
    kept = {tuple(v) for v in coarse.vertices}
    assert kept <= {tuple(v) for v in mesh.vertices}


@pytest.mark.parametrize("shape", [box((1, 0.8, 0.6)), sphere(0.4)], ids=["box", "ball"])
def test_straight_edges_and_smooth_surfaces_stay(shape, monkeypatch: pytest.MonkeyPatch) -> None:
    turned = shape.turned(AXIS, 40)
    mesh = dual_contour(turned, H)
    monkeypatch.setattr(creases, "_PASSES", 0)
    np.testing.assert_array_equal(mesh.faces, dual_contour(turned, H).faces)


def test_any_number_of_cuts_in_a_triangle() -> None:
    faces = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]], np.int32)
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    edges = creases._sharp_edges(points, faces, np.ones(4, bool), np.ones(4, bool))
    assert len(edges.ends) == 6
    for count in range(1, 7):
        split = np.arange(6)[:count]
        cut = creases.split_edges(faces, edges, split, 4)
        assert len(cut) == 4 + 2 * count
        middles = points[edges.ends[split]].mean(axis=1)
        corners = np.concatenate([points, middles])[cut]
        volume = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        assert volume == pytest.approx(1 / 6)
