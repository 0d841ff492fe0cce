"""All sign cases and random functions give closed 2-manifolds; slivers are mended without changing the topology."""

from __future__ import annotations

import numpy as np
import pytest
from dual_oracles import FloatArray, Placed, ball, box, broken_edges, smallest_angles, status
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from cad_implicit.dual import dual_contour
from cad_implicit.field import Field
from cad_implicit.grid import Grid
from cad_implicit.implicit import Function
from cad_implicit.kernels import slivers
from cad_implicit.kernels.cell_tables import (
    AMBIGUOUS,
    EDGE_CORNERS,
    FACE_EDGES,
    FIRST_ROW,
    LOOP_OF_EDGE,
    LOOPS,
)
from cad_implicit.mesh import Mesh
from cad_implicit.sparse import sample_bricks


def on_the_nodes(values: FloatArray) -> tuple[Field, FloatArray]:
    """A field, and bounds for which contouring at a spacing of one samples exactly its nodes."""
    field = Field(Grid((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), values.shape), values)
    high = np.array(values.shape) - 1.0
    ahead = sample_bricks(field, 1.0, [[0, 0, 0], high]).origin
    return field, np.stack([-ahead - 1, high - 0.01])


def contour_nodes(values: FloatArray) -> Mesh:
    field, bounds = on_the_nodes(np.pad(values, 2, constant_values=-1.0))
    mesh = dual_contour(field, 1.0, bounds=bounds)
    # The nodes must be those of the field, or the cases under test are not the ones that were meant.
    sampled = sample_bricks(field, 1.0, bounds)
    np.testing.assert_allclose(sampled.origin, np.round(sampled.origin), atol=1e-12)
    return mesh


@pytest.mark.nojit
def test_tables_cross_every_changed_edge_once_in_closed_loops() -> None:
    for mask in range(256):
        faces = [f for f in range(6) if AMBIGUOUS[mask] >> f & 1]
        for choice in range(1 << len(faces)):
            loops = LOOP_OF_EDGE[FIRST_ROW[mask] + choice]
            for edge, (a, b) in enumerate(EDGE_CORNERS):
                assert (loops[edge] >= 0) == ((mask >> a & 1) != (mask >> b & 1))
            assert set(loops[loops >= 0]) == set(range(LOOPS[FIRST_ROW[mask] + choice]))
            # A loop passes through a face by two of its edges, or by four.
            for edges in FACE_EDGES:
                for loop in range(4):
                    assert sum(loops[e] == loop for e in edges) in (0, 2, 4)


def blocks_of_signs(shape: tuple[int, int, int], rng: np.random.Generator) -> FloatArray:
    """Every sign case of a block of nodes, each padded with outside nodes, side by side in one array."""
    count = int(np.prod(shape))
    side = int(2 ** np.ceil(count / 2))
    cell = tuple(n + 1 for n in shape)
    values = np.full((side * cell[0], side * cell[1], cell[2]), -1.0)
    for case in range(1 << count):
        inside = np.array([case >> n & 1 for n in range(count)], bool).reshape(shape)
        corner = case // side * cell[0], case % side * cell[1]
        size = rng.uniform(0.2, 1.0, shape)
        values[corner[0] : corner[0] + shape[0], corner[1] : corner[1] + shape[1], : shape[2]] = np.where(
            inside, size, -size
        )
    return values


@pytest.mark.parametrize("shape", [(2, 2, 2), (3, 2, 2), (2, 2, 3)])
def test_every_sign_case_of_a_cell_and_of_two_neighbours(shape: tuple[int, int, int]) -> None:
    mesh = contour_nodes(blocks_of_signs(shape, np.random.default_rng(5)))
    assert broken_edges(mesh) == 0
    assert status(mesh) == "NoError"


@settings(max_examples=25, deadline=None)
@given(st.integers(3, 11), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.6, 1.2]), st.booleans())
def test_random_fields(size: int, seed: int, blur: float, on_nodes: bool) -> None:
    values = np.random.default_rng(seed).standard_normal((size, size, size))
    values = gaussian_filter(values, blur) if blur else values
    values[size // 2, size // 2, size // 2] = 1.0
    if on_nodes:
        mesh = contour_nodes(values)
    else:
        grid = Grid((0.1, 0.2, 0.3), (1.0, 1.0, 1.0), values.shape)
        mesh = dual_contour(Field(grid, values), 0.77)
    assert broken_edges(mesh) == 0
    assert status(mesh) == "NoError"


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_signs_without_any_slope(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = np.sign(rng.standard_normal((7, 7, 7)))
    values[3, 3, 3] = 1.0
    mesh = contour_nodes(values)
    assert broken_edges(mesh) == 0
    assert status(mesh) == "NoError"


def jittered(mesh: Mesh, seed: int) -> tuple[FloatArray, NDArray[np.int32]]:
    """The mesh with some vertices moved almost onto a neighbour."""
    rng = np.random.default_rng(seed)
    vertices = mesh.vertices.copy()
    for t in rng.choice(len(mesh.faces), len(mesh.faces) // 20, replace=False):
        a, b = mesh.faces[t, :2]
        vertices[a] = vertices[b] + 0.02 * (vertices[a] - vertices[b])
    return vertices, mesh.faces.copy()


@pytest.mark.parametrize("seed", range(5))
def test_slivers_are_mended_without_changing_the_topology(seed: int) -> None:
    shape = Placed(box(1, 0.8, 0.6), [1, 0.8, 0.6])
    before = dual_contour(shape, 0.1)
    vertices, faces = jittered(before, seed)
    gradient = shape.value_and_gradient(vertices[faces].mean(axis=1))[1]
    thin = Mesh(vertices, faces)
    facing = np.ascontiguousarray(-gradient)
    kept = slivers.remove_slivers(vertices, faces, facing, np.ones(len(vertices), np.int8), 0.1)
    mended = Mesh(*slivers.compact(vertices, faces[kept])[:2])
    assert broken_edges(mended) == 0
    assert mended.genus == 0
    assert (smallest_angles(mended) < 2).sum() < 0.2 * (smallest_angles(thin) < 2).sum()
    assert set(map(tuple, mended.vertices)) <= set(map(tuple, vertices))


def test_a_tetrahedron_is_not_collapsed() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1e-4, 1e-4, 1e-4]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    facing = Mesh(vertices, faces).face_vectors.copy()
    kept = slivers.remove_slivers(vertices, faces.copy(), facing, np.ones(4, np.int8), 1.0)
    assert kept.all()


def test_the_ball_is_round_whatever_the_spacing() -> None:
    volumes = [dual_contour(Placed(ball(1.0), [1, 1, 1]), h).volume for h in (0.2, 0.1, 0.05)]
    errors = 4 / 3 * np.pi - np.array(volumes)
    assert (errors > 0).all()
    assert (errors[:-1] / errors[1:] > 3.5).all()


@pytest.mark.parametrize("step", [0.3, 1.0, 2.5])
def test_a_function_that_breaks_its_lipschitz_constant_is_closed_too(step: float) -> None:
    def jump(x: np.ndarray) -> np.ndarray:
        return np.where(x[:, 2] + 0.3 * x[:, 0] > 0.2, 3.0, 3.0 + step) - np.linalg.norm(x, axis=1)

    mesh = dual_contour(Function(jump, [[-6, -6, -6], [6, 6, 6]], lipschitz=1.0), 0.11)
    assert mesh.is_watertight
    assert mesh.components == 1
    halves = 2 / 3 * np.pi * (3.0**3 + (3 + step) ** 3)
    assert mesh.volume == pytest.approx(halves, rel=0.05 * (1 + step))
