"""Sorting of triangles into the nodes of a tree."""

from __future__ import annotations

import numpy as np
import pytest

from cad_implicit import parallel
from cad_implicit.kernels.partition import LEAF, partition


@pytest.mark.parametrize("even", [False, True])
def test_boxes_whose_centres_differ_by_rounding_errors_only(even: bool) -> None:
    random = np.random.default_rng(0)
    along = random.uniform(0, 300, 5000)
    ulp = np.spacing(300.0)
    middle = np.stack([along, 300 + ulp * random.integers(0, 4, 5000), 256 + ulp * random.integers(0, 3, 5000)], axis=1)
    half = random.uniform(0, 0.1, (5000, 3))
    order = np.arange(5000, dtype=np.int32)
    with parallel.threads():
        _, ranges, first = partition(np.concatenate([middle - half, middle + half], axis=1), order, even)
    np.testing.assert_array_equal(np.sort(order), np.arange(5000))
    assert (np.diff(first) > 0).all()
    assert np.diff(first).max() <= LEAF
    assert ranges.min() == 0
    assert ranges.max() == 5000
