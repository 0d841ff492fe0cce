"""Signed distance on grids: node by node the same as the exact distance, clipped to the band."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from distance_twins import (
    ROTATION,
    as_mesh,
    box_distance,
    box_with_flat_triangles,
    brute_distance,
    brute_winding,
    flat_wedge,
    joined,
    spiky,
)

from cad_implicit.distance import MeshDistance, sample_distance
from cad_implicit.errors import GeometryWarning, SpacingError
from cad_implicit.grid import Grid
from cad_implicit.mesh import Mesh

BOX = as_mesh(trimesh.creation.box((2, 4, 6)))
MESHES = {
    "box": BOX,
    "torus": as_mesh(trimesh.creation.torus(3, 1)),
    "spiky": spiky(1),
    "wedge": flat_wedge(0.02),
    "flat triangles": box_with_flat_triangles(),
    "fan": as_mesh(trimesh.creation.cylinder(1, 0.3, sections=300)),
}
GRIDS = {
    "even": lambda bounds: Grid.cover(bounds, np.ptp(bounds, axis=0).max() / 25, margin=0.1),
    "uneven": lambda bounds: Grid.cover(bounds, np.ptp(bounds, axis=0) / [11, 17, 40]),
    "tight": lambda bounds: Grid.cover(bounds, shape=(19, 30, 23)),
}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("cover", GRIDS)
@pytest.mark.parametrize("widths", [1.0, 1.5, 4.2])
def test_the_same_as_node_by_node(name, cover, widths):
    mesh = MESHES[name]
    grid = GRIDS[cover](mesh.bounds)
    band = widths * max(grid.spacing)
    distance = MeshDistance(mesh)
    field = sample_distance(distance, grid, band=band)
    truth = distance(grid.nodes()).reshape(grid.shape)
    assert field.values.dtype == np.float32
    np.testing.assert_allclose(field.values, np.clip(truth, -band, band), atol=1e-6 * mesh.diagonal)


@pytest.mark.nojit
def test_against_every_triangle():
    mesh = spiky(4)
    grid = Grid.cover(mesh.bounds, shape=(12, 13, 14))
    x = grid.nodes()
    truth = brute_distance(mesh, x).min(axis=1) * np.where(brute_winding(mesh, x) > 0.5, 1, -1)
    band = 1.5 * max(grid.spacing)
    field = sample_distance(MeshDistance(mesh, sign="pseudonormal"), grid)
    np.testing.assert_allclose(field.values.ravel(), np.clip(truth, -band, band), atol=1e-6)


@pytest.mark.nojit
def test_nodes_on_the_faces_edges_and_corners():
    box = trimesh.creation.box((2, 4, 6))
    grid = Grid((-1, -2, -3), (0.25, 0.25, 0.25), (9, 17, 25))
    field = sample_distance(Mesh(box.vertices, box.faces), grid)
    truth = box_distance(grid.nodes(), np.array([1, 2, 3])).reshape(grid.shape)
    np.testing.assert_allclose(field.values, np.minimum(truth, 0.375), atol=1e-7)


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_any_scale_and_place(scale):
    mesh = Mesh((BOX.vertices + 100) * scale, BOX.faces)
    grid = Grid.cover(mesh.bounds, shape=24, margin=0.3 * scale)
    x = (grid.nodes() / scale - 100) @ ROTATION[:3, :3]
    band = 1.5 * max(grid.spacing)
    truth = np.clip(box_distance(x, np.array([1, 2, 3])) * scale, -band, band).reshape(grid.shape)
    np.testing.assert_allclose(sample_distance(mesh, grid).values, truth, atol=1e-6 * scale)


def test_large_triangles_on_a_fine_grid():
    cube = as_mesh(trimesh.creation.box((2, 2, 2)))
    grid = Grid.cover(cube.bounds, shape=100, margin=0.1)
    band = 1.5 * max(grid.spacing)
    truth = box_distance(grid.nodes() @ ROTATION[:3, :3], np.ones(3)).reshape(grid.shape)
    np.testing.assert_allclose(sample_distance(cube, grid).values, np.clip(truth, -band, band), atol=1e-6)


def test_independent_of_the_number_of_threads():
    mesh = as_mesh(trimesh.creation.icosphere(subdivisions=4))
    grid = Grid.cover(mesh.bounds, shape=(61, 40, 33), margin=0.1)
    one, two = (sample_distance(mesh, grid, threads=n, band=0.3).values for n in (1, 2))
    np.testing.assert_array_equal(one, two)


@pytest.mark.nojit
def test_inside_out_is_the_complement():
    grid = GRIDS["even"](BOX.bounds)
    turned = Mesh(BOX.vertices, BOX.faces[:, ::-1])
    np.testing.assert_allclose(sample_distance(turned, grid).values, -sample_distance(BOX, grid).values, atol=1e-6)


def test_overlapping_solids_are_filled():
    second = trimesh.creation.box((1, 1, 5)).apply_translation((0.7, 0.3, 1.0))
    mesh = joined(trimesh.creation.box((2, 4, 3)), second)
    grid = Grid.cover(mesh.bounds, 0.13, margin=0.2)
    with pytest.warns(GeometryWarning, match="overlaps"):
        field = sample_distance(mesh, grid)
    x = grid.nodes()
    inside = (box_distance(x, np.array([1, 2, 1.5])) > 0) | (
        box_distance(x - [0.7, 0.3, 1.0], np.array([0.5, 0.5, 2.5])) > 0
    )
    np.testing.assert_array_equal(field.values.ravel() > 0, inside)


def test_an_open_mesh_is_closed_where_the_winding_number_falls_to_one_half():
    ball = trimesh.creation.icosphere(subdivisions=2)
    mesh = Mesh(ball.vertices, ball.faces[ball.triangles_center[:, 2] < 0.6])
    grid = Grid.cover(mesh.bounds, shape=(17, 15, 30), margin=0.2)
    with pytest.warns(GeometryWarning, match="not closed"):
        field = sample_distance(mesh, grid)
    number = brute_winding(mesh, grid.nodes())
    clear = abs(number - 0.5) > 0.06
    np.testing.assert_array_equal((field.values.ravel() > 0)[clear], (number > 0.5)[clear])


def test_a_grid_that_does_not_hold_the_mesh():
    grid = Grid.cover(BOX.bounds, shape=20, margin=-0.25)
    with pytest.raises(SpacingError, match=r"sticks out of the grid by 0\.25 mm"):
        sample_distance(BOX, grid)


@pytest.mark.parametrize("band", [0.0, 0.09, np.nan, np.inf])
def test_a_senseless_band(band):
    with pytest.raises(SpacingError, match="at least the largest spacing"):
        sample_distance(BOX, Grid.cover(BOX.bounds, (0.05, 0.1, 0.05)), band=band)


def test_a_grid_in_the_plane():
    with pytest.raises(SpacingError, match="2-D"):
        sample_distance(BOX, Grid((0, 0), (1, 1), (3, 3)))


def test_progress_is_told_and_cancels():
    told = []
    sample_distance(BOX, GRIDS["even"](BOX.bounds), progress=lambda *step: told.append(step))
    assert told[0] == ("distance", 0.0)
    assert told[-1] == ("distance", 1.0)

    def cancel(stage, fraction):
        raise KeyboardInterrupt(stage)

    with pytest.raises(KeyboardInterrupt, match="distance"):
        sample_distance(BOX, GRIDS["even"](BOX.bounds), progress=cancel)
