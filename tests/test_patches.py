"""Patches of labelled meshes, their borders and the chains these are made of."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from cad_implicit.mesh import Mesh
from cad_implicit.patches import connected, divide, opposite

NONE = np.zeros(0, np.int64)


def cube() -> tuple[Mesh, np.ndarray]:
    """Unit cube in 12 triangles, and their sides: 0, 1, 2 for -x, -y, -z and 3, 4, 5 for +x, +y, +z."""
    raw = trimesh.creation.box((1.0, 1.0, 1.0))
    side = np.abs(raw.face_normals).argmax(axis=1)
    positive = raw.face_normals[np.arange(12), side] > 0
    return Mesh(raw.vertices, raw.faces), (side + 3 * positive).astype(np.int64)


def ring() -> tuple[Mesh, np.ndarray]:
    """Torus, one half of whose tube is labelled 1: two patches with two borders, which meet at no vertex."""
    raw = trimesh.creation.torus(3.0, 1.0, major_sections=12, minor_sections=8)
    return Mesh(raw.vertices, raw.faces), (raw.triangles_center[:, 2] > 0).astype(np.int64)


def walk(mesh: Mesh, labels: np.ndarray, junctions: np.ndarray = NONE) -> None:
    """Check that borders close, run with their patch on the left, and hold each edge between patches once a side."""
    patches = divide(mesh, labels, junctions)
    used = np.zeros((len(patches.chains), 2), int)
    for patch, loops in enumerate(patches.loops):
        for loop in loops:
            ends = []
            for number, forward in loop:
                chain = patches.chains[number]
                used[number, int(forward)] += 1
                assert (chain.left if forward else chain.right) == patch
                run = chain.vertices if forward else chain.vertices[::-1]
                ends.append((run[0], run[-1]))
            assert [end for _, end in ends] == [start for start, _ in ends[1:] + ends[:1]]
    assert (used == 1).all()
    between = sum(len(chain.vertices) - 1 for chain in patches.chains)
    of_edge = patches.of_triangle[_beside(mesh)]
    assert between == np.count_nonzero(of_edge[:, 0] != of_edge[:, 1])


def _beside(mesh: Mesh) -> np.ndarray:
    """Triangles (E, 2) on both sides of each edge."""
    start, end = mesh.faces.ravel().astype(np.int64), np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    other = opposite(start, end, len(mesh.vertices))
    once = np.flatnonzero(start < end)
    return np.column_stack([once // 3, other[once] // 3])


def test_a_cube_has_twelve_chains() -> None:
    mesh, labels = cube()
    patches = divide(mesh, labels, NONE)
    assert sorted(patches.labels) == [0, 1, 2, 3, 4, 5]
    assert [len(loops) for loops in patches.loops] == 6 * [1]
    assert [len(loop) for loops in patches.loops for loop in loops] == 6 * [4]
    assert [len(chain.vertices) for chain in patches.chains] == 12 * [2]
    walk(mesh, labels)


def test_two_sides_of_one_label_are_one_patch_where_they_touch() -> None:
    mesh, labels = cube()
    labels[labels == 3] = 4  # +x and +y share an edge, -z and +z do not
    labels[labels == 5] = 2
    own, patch = connected(mesh.faces, labels)
    assert sorted(own) == [0, 1, 2, 2, 4]
    assert len(np.unique(patch[labels == 4])) == 1
    walk(mesh, labels)


def test_closed_chains_start_anywhere_or_at_junctions() -> None:
    mesh, labels = ring()
    patches = divide(mesh, labels, NONE)
    assert sorted(len(loops) for loops in patches.loops) == [2, 2]
    assert [chain.vertices[0] == chain.vertices[-1] for chain in patches.chains] == [True, True]
    walk(mesh, labels)
    junctions = patches.chains[0].vertices[[2, 5]]
    cut = divide(mesh, labels, junctions)
    assert sorted(len(chain.vertices) - 1 for chain in cut.chains) == sorted(
        [3, len(patches.chains[0].vertices) - 4, len(patches.chains[1].vertices) - 1]
    )
    walk(mesh, labels, junctions)


@pytest.mark.parametrize("seed", range(4))
def test_any_labels_give_closed_borders(seed: int) -> None:
    mesh, _ = ring()
    random = np.random.default_rng(seed)
    labels = random.integers(0, 3, len(mesh.faces))
    walk(mesh, labels)
    walk(mesh, labels, random.integers(0, len(mesh.vertices), 5))
