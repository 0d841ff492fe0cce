"""Raw triangles repaired where that takes no guess: against the mesh they were made from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cad_implicit as ci
from cad_implicit.cad.repair import repaired
from cad_implicit.cad.weld import welded
from cad_implicit.mesh import Mesh


def torus() -> Mesh:
    """Closed triangles of a torus off the axes: a surface whose turning takes a way around."""
    u, v = np.meshgrid(np.arange(11), np.arange(7), indexing="ij")
    a, b = 2 * np.pi * u / 11, 2 * np.pi * v / 7
    ring = 5.3 + 1.7 * np.cos(b)
    points = np.stack([ring * np.cos(a), ring * np.sin(a), 1.7 * np.sin(b)], axis=-1).reshape(-1, 3)
    at = lambda i, j: (i % 11) * 7 + j % 7  # noqa: E731
    i, j = u.ravel(), v.ravel()
    one = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1)], axis=1)
    other = np.stack([at(i, j), at(i + 1, j + 1), at(i, j + 1)], axis=1)
    return Mesh(points @ np.linalg.qr(np.vander([0.3, 1.1, 2.7]))[0], np.concatenate([one, other]))


def test_flipped_triangles_are_turned_back() -> None:
    good = welded(torus().vertices, torus().faces)
    chosen = np.random.default_rng(5).random(len(good.faces)) < 0.3
    faces = np.where(chosen[:, None], good.faces[:, ::-1], good.faces)
    mesh = welded(good.vertices, faces)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(good.volume, rel=1e-12)
    assert mesh.source["repairs"] == [
        f"triangles turned over that faced another way than their neighbours: {chosen.sum()}"
    ]


def test_a_surface_with_one_side_is_left_alone() -> None:
    turns = np.linspace(0, 2 * np.pi, 13)[:-1]
    inner, outer = ([(2 + w * np.cos(t / 2)) * np.array([np.cos(t), np.sin(t), 0]) + [0, 0, w * np.sin(t / 2)]
                     for t in turns] for w in (-0.5, 0.5))  # fmt: skip
    faces = []
    for n in range(12):
        a, b = n, n + 12
        c, d = (n + 1, n + 13) if n < 11 else (12, 0)
        faces += [(a, c, b), (c, d, b)]
    strip = Mesh(np.array(inner + outer), faces)
    mesh, done = repaired(strip)
    assert mesh is strip
    assert done == []


def test_three_triangles_at_an_edge_are_left_alone() -> None:
    good = torus()
    fin = np.concatenate([good.vertices, [[9.0, 9.0, 9.0]]])
    mesh = Mesh(fin, np.concatenate([good.faces, [[*good.faces[0, :2], len(good.vertices)]]]))
    again, done = repaired(mesh)
    assert again.open_edges == mesh.open_edges
    assert done == []


def test_edges_are_split_at_several_vertices_that_lie_on_them() -> None:
    good = torus()
    a, b, c = good.faces[3]
    shares = np.array([0.21, 0.5, 0.83])[:, None]
    new = good.vertices[a] + shares * (good.vertices[b] - good.vertices[a])
    n = len(good.vertices)
    fan = [(p, q, c) for p, q in zip([a, n, n + 1, n + 2], [n, n + 1, n + 2, b], strict=True)]
    mesh = welded(np.concatenate([good.vertices, new]), np.concatenate([np.delete(good.faces, 3, axis=0), fan]))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(abs(good.volume), rel=1e-12)
    assert "T-junctions): 1" in str(mesh.source["repairs"])


def test_polygons_that_are_not_convex(tmp_path: Path) -> None:
    outline = [(0, 0), (9, 0), (9, 7), (5, 2), (3, 6), (0, 5)]
    area = 0.5 * sum(x * v - u * y for (x, y), (u, v) in zip(outline, [*outline[1:], outline[0]], strict=True))
    lines = [f"v {x} {y} {z}" for z in (0, 4) for x, y in outline] + ["vt 0 0"]
    lines += ["f 6/1 5/1 4/1 3/1 2/1 1/1", "f -6 -5 -4 -3 -2 -1"]
    lines += [f"f {i + 1} {(i + 1) % 6 + 1} {(i + 1) % 6 + 7} {i + 7}" for i in range(6)]
    (tmp_path / "part.obj").write_text("\n".join(lines))
    mesh = ci.to_mesh(tmp_path / "part.obj")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 * area)
    assert mesh.area == pytest.approx(2 * area + 4 * np.linalg.norm(np.diff([*outline, (0, 0)], axis=0), axis=1).sum())


def test_repairs_are_told_with_the_result(tmp_path: Path) -> None:
    good = ci.to_mesh((torus().vertices, torus().faces))
    faces = np.where(np.arange(len(good.faces))[:, None] % 5 == 0, good.faces[:, ::-1], good.faces)
    outcome = ci.run((good.vertices, faces), "offset", 0.4, spacing=0.3)
    assert any("turned over" in note for note in outcome.warnings)
    assert outcome.error_bound is not None
