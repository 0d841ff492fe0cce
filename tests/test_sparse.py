"""Sparse sampling finds every change of sign, and only evaluates what it must."""

from __future__ import annotations

import numpy as np
import pytest
from dual_oracles import Placed, ball, box, torus
from numpy.typing import NDArray

from cad_implicit.errors import SpacingError
from cad_implicit.implicit import Function
from cad_implicit.sparse import Bricks, sample_bricks


def dense(bricks: Bricks) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.float32]]:
    """Positions of all nodes of the bricks' bounding block, which of them are held, and their values."""
    size = 8 * (bricks.blocks.max(axis=0) + 2)
    held = np.zeros(size, bool)
    values = np.zeros(size, np.float32)
    for block, brick in zip(bricks.blocks, bricks.values, strict=True):
        where = tuple(slice(8 * b, 8 * b + 8) for b in block)
        held[where], values[where] = True, brick.reshape(8, 8, 8)
    nodes = np.stack(np.meshgrid(*[np.arange(n) for n in size], indexing="ij"), -1)
    return bricks.origin + bricks.spacing * nodes, held, values


@pytest.mark.nojit
@pytest.mark.parametrize("lipschitz", [1.0, 3.0, None])
def test_every_change_of_sign_is_held_with_the_right_signs(lipschitz: float | None) -> None:
    shape = Placed(torus(0.6, 0.25), [0.9, 0.9, 0.3])
    shape.lipschitz = lipschitz
    bricks = sample_bricks(shape, 0.07)
    points, held, values = dense(bricks)
    truth = shape(points.reshape(-1, 3)).reshape(held.shape)
    assert ((values > 0) == (truth > 0))[held].all()
    known = held & np.isfinite(values)
    np.testing.assert_allclose(values[known], truth[known], rtol=1e-5, atol=1e-6)
    for axis in range(3):
        inside = truth > 0
        change = np.diff(inside, axis=axis) != 0
        low = np.moveaxis(held, axis, 0)[:-1]
        high = np.moveaxis(held, axis, 0)[1:]
        assert (low & high)[np.moveaxis(change, axis, 0)].all()


def test_bricks_know_their_neighbours_and_lie_along_the_morton_curve() -> None:
    bricks = sample_bricks(Placed(ball(1.0), [1, 1, 1]), 0.05)
    number = {tuple(block): n for n, block in enumerate(bricks.blocks.tolist())}
    for n in range(0, len(bricks.blocks), 7):
        for offset in range(27):
            step = np.array([offset // 9, offset // 3 % 3, offset % 3]) - 1
            assert bricks.neighbours[n, offset] == number.get(tuple((bricks.blocks[n] + step).tolist()), -1)

    def interleaved(block: list[int]) -> int:
        return sum(((int(x) >> bit) & 1) << (3 * bit + 2 - axis) for axis, x in enumerate(block) for bit in range(21))

    keys = [interleaved(block) for block in bricks.blocks.tolist()]
    assert keys == sorted(keys)


def test_work_and_memory_grow_with_the_surface() -> None:
    counts, evaluations = [], []
    for spacing in (1 / 32, 1 / 64, 1 / 128):
        shape = Placed(ball(1.0), [1, 1, 1])
        counts.append(len(sample_bricks(shape, spacing).blocks))
        evaluations.append(shape.evaluations)
    assert counts[2] < 4.3 * counts[1]
    assert evaluations[2] < 4.3 * evaluations[1]
    # The shell of nodes within one spacing has 8 pi / h² nodes; the search down to it costs a little more.
    assert evaluations[2] < 1.5 * 8 * np.pi * 128**2


def test_no_limit_at_2048_nodes_a_side() -> None:
    small = Placed(ball(0.02), [1, 1, 1])
    bricks = sample_bricks(small, 2 / 2048)
    assert bricks.blocks.max() > 100
    assert len(bricks.blocks) < 2000
    assert small.evaluations < 100_000


def test_a_box_on_round_numbers_has_no_node_on_its_faces() -> None:
    shape = Placed(box(1, 0.5, 0.25), [1, 0.5, 0.25], turn=np.eye(3), shift=np.zeros(3))
    values = sample_bricks(shape, 0.125).values
    assert np.abs(values).min() > 0.02 * 0.125


def test_zero_counts_as_outside() -> None:
    flat = Function(lambda x: np.zeros(len(x)), [[0, 0, 0], [1, 1, 1]])
    assert len(sample_bricks(flat, 0.1).blocks) == 0


def test_what_sticks_out_of_the_bounds_is_cut_off() -> None:
    shape = Placed(ball(1.0), [1, 1, 1], shift=np.zeros(3))
    bounds = np.array([[-2.0, -2, -2], [2, 2, 0.3]])
    bricks = sample_bricks(shape, 0.1, bounds)
    points, held, values = dense(bricks)
    assert bricks.cropped
    assert not (values[held] > 0)[points[held][:, 2] >= 0.3].any()
    assert not sample_bricks(shape, 0.1).cropped


def test_threads_and_batches_do_not_matter() -> None:
    shape = Placed(torus(0.6, 0.25), [0.9, 0.9, 0.3])
    one, two = (sample_bricks(shape, 0.05, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.values, two.values)
    np.testing.assert_array_equal(one.neighbours, two.neighbours)


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan, np.inf, 1e-9])
def test_bad_spacings_are_refused(spacing: float) -> None:
    with pytest.raises(SpacingError, match="spacing"):
        sample_bricks(Placed(ball(1.0), [1, 1, 1]), spacing)


def test_bad_bounds_and_plane_shapes_are_refused() -> None:
    shape = Placed(ball(1.0), [1, 1, 1])
    with pytest.raises(SpacingError, match="bounds"):
        sample_bricks(shape, 0.1, [[0, 0, 0], [1, 1, 0]])
    with pytest.raises(SpacingError, match="2-D"):
        sample_bricks(Function(lambda x: x[:, 0], [[0, 0], [1, 1]]), 0.1)


def test_progress_may_cancel() -> None:
    class CancelError(Exception):
        pass

    def stop(stage: str, fraction: float) -> None:
        assert stage == "sample"
        assert 0 <= fraction <= 1
        raise CancelError

    with pytest.raises(CancelError):
        sample_bricks(Placed(ball(1.0), [1, 1, 1]), 0.1, progress=stop)
