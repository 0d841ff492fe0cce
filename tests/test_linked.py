"""Groups of items joined by pairs, beside SciPy's connected components; open edges, counted one by one."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from cad_implicit.kernels.edges import open_edges
from cad_implicit.kernels.linked import linked


@pytest.mark.nojit
@pytest.mark.parametrize(("count", "pairs"), [(1, 0), (7, 0), (50, 20), (50, 49), (300, 170), (300, 900)])
def test_groups_are_connected_components(count: int, pairs: int) -> None:
    for seed in range(20):
        both = np.random.default_rng(seed).integers(0, count, (pairs, 2), np.int32)
        graph = coo_matrix((np.ones(pairs), both.T), (count, count))
        assert (linked(count, both) == connected_components(graph, directed=False)[1]).all()


@pytest.mark.nojit
def test_long_chain_from_its_end() -> None:
    chain = np.stack([np.arange(998, -1, -1), np.arange(999, 0, -1)], axis=1).astype(np.int32)
    assert not linked(1000, chain).any()
    assert (linked(1000, chain[1:]) == (np.arange(1000) == 999)).all()


@pytest.mark.nojit
def test_open_edges_of_random_triangles() -> None:
    for seed in range(100):
        random = np.random.default_rng(seed)
        count = int(random.integers(3, 20))
        faces = random.integers(0, count, (int(random.integers(1, 50)), 3), np.int32)
        edges = Counter((int(f[c]), int(f[(c + 1) % 3])) for f in faces for c in range(3))
        wrong = 0
        for (a, b), number in edges.items():
            partners = edges.get((b, a), 0)
            wrong += abs(number - partners) if number != partners else number - 1
        assert open_edges(count, faces) == wrong
