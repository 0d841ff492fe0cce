"""Mesh: what it knows of itself, against solids with known figures."""

from __future__ import annotations

import numpy as np
import pytest
import shapes

from cad_implicit import Mesh
from cad_implicit.errors import InvalidMeshError, OpenMeshError


def test_figures_of_a_block_with_two_holes() -> None:
    part = shapes.box([0, 0, 0], [9, 4, 3]) - shapes.box([1, 1, -1], [3, 3, 5]) - shapes.box([5, 1, -1], [8, 3, 5])
    mesh = shapes.as_mesh(part)
    assert mesh.is_watertight
    assert (mesh.genus, mesh.components, mesh.shells) == (2, 1, 1)
    assert mesh.volume == pytest.approx(9 * 4 * 3 - 2 * 2 * 3 - 3 * 2 * 3)
    assert mesh.area == pytest.approx(2 * (36 + 27 + 12) - 2 * (4 + 6) + 3 * (8 + 10))


def test_pieces_and_cavities() -> None:
    hollow = shapes.box([0, 0, 0], [4, 4, 4]) - shapes.box([1, 1, 1], [2, 2, 2])
    mesh = shapes.as_mesh(hollow + shapes.box([6, 0, 0], [7, 1, 1]))
    assert (mesh.shells, mesh.components, mesh.genus) == (3, 2, 0)
    assert sorted(np.round(mesh.shell_volumes, 9)) == [-1, 1, 64]
    assert mesh.volume == pytest.approx(64)


def test_open_edges_are_counted() -> None:
    mesh = shapes.notch(90, 5)
    assert mesh.open_edges == 0
    opened = Mesh(mesh.vertices, mesh.faces[1:])
    assert opened.open_edges == 3
    with pytest.raises(OpenMeshError, match="3 of") as error:
        opened.require_closed()
    assert error.value.open_edges == 3
    doubled = Mesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[:1]]))
    assert doubled.open_edges > 0
    turned = mesh.faces.copy()
    turned[0] = turned[0, ::-1]
    assert Mesh(mesh.vertices, turned).open_edges > 0


def test_moving_and_mirroring_keeps_the_inside() -> None:
    mesh = shapes.notch(90, 5)
    mirror = np.diag([-1.0, 1, 1, 1])
    mirror[:3, 3] = [3, 4, 5]
    moved = mesh.transformed(mirror)
    assert moved.volume == pytest.approx(mesh.volume)
    assert moved.bounds[0, 0] == pytest.approx(3 - mesh.bounds[1, 0])


@pytest.mark.parametrize(
    ("vertices", "faces", "ids", "text"),
    [
        ([[0, 0, 0]], [[0, 0, 1]], None, "faces name vertices 0..1, but there are 1"),
        ([[0, 0]], [[0, 0, 0]], None, r"not \(1, 2\)"),
        ([[0, 0, 0]], np.zeros((0, 3), int), None, "no triangles"),
        ([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], None, "1 of 3 vertices are not finite"),
        ([[0, 0, 0]], [[0.0, 0, 0]], None, "must be integers"),
        ([[0, 0, 0]], [[0, 0, 0]], [1, 2], "one entry for each of 1 faces"),
    ],
)
def test_bad_arrays(vertices: object, faces: object, ids: object, text: str) -> None:
    with pytest.raises(InvalidMeshError, match=text):
        Mesh(vertices, faces, ids)  # type: ignore[arg-type]


def test_a_mesh_does_not_change() -> None:
    mesh = shapes.notch(90, 5)
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0] = 0
