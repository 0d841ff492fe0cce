"""Vertices that are off their shape are moved onto it, unless a triangle would fold."""

from __future__ import annotations

import numpy as np
import trimesh

import cad_implicit as ci
from cad_implicit.mesh import Mesh
from cad_implicit.settling import settled
from validation.intersections import count_intersections


def ball(radius: float = 5.0) -> Mesh:
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return Mesh(np.asarray(sphere.vertices), np.asarray(sphere.faces, np.int32))


def test_single_vertices_are_moved_onto_the_shape() -> None:
    true, spacing = ball(), 0.7
    vertices = true.vertices.copy()
    vertices[[3, 77, 400]] *= 1.02
    off = Mesh(vertices, true.faces)
    done = settled(off, ci.sphere(5.0), ball(2.0), spacing)
    assert np.abs(np.linalg.norm(done.vertices, axis=1) - 5.0).max() < 1e-6
    assert (done.faces == off.faces).all()


def test_vertices_of_the_other_mesh_stay() -> None:
    true = ball()
    vertices = true.vertices.copy()
    vertices[3] *= 1.02
    off = Mesh(vertices, true.faces)
    assert (settled(off, ci.sphere(5.0), off, 0.7).vertices == vertices).all()


def test_where_all_moves_would_fold_nothing_moves() -> None:
    true, spacing = ball(), 0.7
    vertices = true.vertices.copy()
    low, high = true.faces[0][:2]
    # dented so far aside that its triangles lie the wrong way round, and cannot come back within the limit
    vertices[low] = vertices[high] + (vertices[high] - vertices[low]) * 0.2
    vertices[low] *= 1.01
    off = Mesh(vertices, true.faces)
    done = settled(off, ci.sphere(5.0), Mesh(true.vertices, true.faces), spacing)
    assert np.isfinite(done.vertices).all()
    assert np.linalg.norm(done.vertices - vertices, axis=1).max() < 0.3 * spacing


def test_vertices_too_far_off_to_be_moved_go() -> None:
    true, spacing, sphere = ball(), 0.7, ci.sphere(5.0)
    vertices = true.vertices.copy()
    chosen: list[int] = []
    for vertex in np.random.default_rng(5).permutation(len(vertices)).tolist():
        beside = around(true, vertex)
        if len(chosen) < 20 and not set(beside) & set(around(true, *chosen)):
            chosen.append(vertex)
            vertices[vertex] *= 1 + 0.4 * spacing / 5.0
    off = Mesh(vertices, true.faces, np.arange(len(true.faces), dtype=np.int32))
    done = settled(off, sphere, ball(2.0), spacing)
    assert done.is_watertight
    assert len(done.faces) == len(true.faces) - 2 * len(chosen)
    assert np.abs(sphere(done.vertices)).max() < 1e-9
    assert count_intersections(done) == 0
    kept = ~np.isin(true.faces, chosen).any(axis=1)
    assert (done.face_ids[: kept.sum()] == np.flatnonzero(kept)).all()  # type: ignore[index]


def around(mesh: Mesh, *vertices: int) -> list[int]:
    return np.unique(mesh.faces[np.isin(mesh.faces, vertices).any(axis=1)]).tolist()
