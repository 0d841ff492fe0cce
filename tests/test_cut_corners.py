"""Contours that cut no corners: shallow creases, and edges of blends that fade out."""

from __future__ import annotations

import numpy as np
import pytest
from dual_oracles import FloatArray, Placed

from cad_implicit.dual import dual_contour
from cad_implicit.kernels.intersections import intersecting
from cad_implicit.mesh import Mesh

H = 0.43


def shaft(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cylinder of 5.07 that becomes a cone of 18 degrees: a crease of 18 degrees all around."""
    x, y, z = points.T
    radius = np.hypot(x, y)
    around = np.stack([x, y, 0 * x], axis=1) / np.maximum(radius, 1e-12)[:, None]
    turn = np.radians(18.43)
    normals = [around, np.cos(turn) * around + np.sin(turn) * np.array([0, 0, 1]), 0 * around + [0, 0, 1]]
    normals.append(-normals[2])
    heights = [radius - 5.07, np.cos(turn) * (radius - 5.07) + np.sin(turn) * z, z - 3.9, -z - 4.1]
    which = np.argmax(heights, axis=0)
    return -np.max(heights, axis=0), -np.choose(which[:, None], normals)


def fading(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cylinder lying under a face that cuts it at a slant of 4 degrees: the flat fades out in a point."""
    x, y, z = points.T
    radius = np.hypot(y, z)
    around = np.stack([0 * x, y, z], axis=1) / np.maximum(radius, 1e-12)[:, None]
    slant = np.radians(4.0)
    cut = np.array([np.sin(slant), 0, np.cos(slant)])
    end = 0 * around + [1.0, 0, 0]
    heights = [radius - 3.03, points @ cut - 2.9, x - 6.3, -x - 6.1]
    which = np.argmax(heights, axis=0)
    return -np.max(heights, axis=0), -np.choose(which[:, None], [around, 0 * around + cut, end, -end])


def off(mesh: Mesh, shape: Placed) -> FloatArray:
    """Distances in spacings of places on edges from the surface."""
    start, end = mesh.vertices[mesh.faces], mesh.vertices[np.roll(mesh.faces, -1, axis=1)]
    places = np.concatenate([start + share * (end - start) for share in (0.25, 0.5, 0.75)]).reshape(-1, 3)
    return np.abs(shape(places)) / H


@pytest.mark.parametrize(("distance", "size", "lost"), [(shaft, 5.5, 0.08), (fading, 6.6, 0.06)])
def test_what_no_cell_saw(distance: object, size: float, lost: float, monkeypatch: pytest.MonkeyPatch) -> None:
    shape = Placed(distance, [size] * 3)
    mesh = dual_contour(shape, H)
    assert off(mesh, shape).max() < 0.065  # middles 0.05; other places a little more
    assert np.abs(shape(mesh.vertices)).max() < 5e-3 * H
    assert mesh.is_watertight
    assert not intersecting(mesh.vertices, mesh.faces, H).any()
    monkeypatch.setattr("cad_implicit.dual.mend_corners", lambda mesh, *_: mesh)
    plain = dual_contour(shape, H)
    assert off(plain, shape).max() > lost
    assert len(plain.vertices) < len(mesh.vertices) < 1.05 * len(plain.vertices)


def pyramid(tip: FloatArray) -> Placed:
    """Three faces through a tip, two of them at 28 degrees, and a fourth across."""
    faces = np.array([[-0.497, 0.508, 0.703], [0.497, 0.831, -0.249], [-0.773, -0.627, -0.093]])
    faces /= np.linalg.norm(faces, axis=1)[:, None]
    faces = np.concatenate([faces, [-faces.sum(axis=0) / np.linalg.norm(faces.sum(axis=0))]])

    def distance(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        heights = np.stack([(points - tip) @ face for face in faces])
        heights[3] += 1.6
        return heights.min(axis=0), faces[heights.argmin(axis=0)]

    return Placed(distance, [9.2] * 3)


def test_tips_that_were_taken_back_are_closed_by_cones(monkeypatch: pytest.MonkeyPatch) -> None:
    tip = np.array([-0.019234429697418065, -0.4067078912485862, 0.046747407945714636])
    shape = pyramid(tip)
    mesh = dual_contour(shape, H)
    assert off(mesh, shape).max() < 1e-9
    assert np.linalg.norm(mesh.vertices - shape.place(tip[None]), axis=1).min() < 1e-9
    assert mesh.is_watertight
    assert len(np.unique(mesh.faces)) == len(mesh.vertices)
    assert not intersecting(mesh.vertices, mesh.faces, H).any()
    monkeypatch.setattr("cad_implicit.cut_corners.without_dents", lambda mesh, *_: mesh)
    assert off(dual_contour(shape, H), shape).max() > 0.4


def test_vertices_between_doubled_edges_go_to_the_middle_of_their_quads() -> None:
    shape = pyramid(np.array([-0.10905121101698656, -0.14342849605241093, 0.21890693022688001]))
    mesh = dual_contour(shape, H)
    assert mesh.is_watertight
    assert not intersecting(mesh.vertices, mesh.faces, H).any()
