"""Tiles: what is done in pieces is what is done at once, to the last bit; memory, cancelling, regions."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import exact_cases as cases
import numpy as np
import pytest
import shapes

import cad_implicit as ci
from cad_implicit import exact, piecewise, sizing
from cad_implicit.distance import MeshDistance
from cad_implicit.errors import EmptyResultError, MemoryLimitError
from cad_implicit.implicit import Implicit
from cad_implicit.regions import Region
from cad_implicit.sparse import lattice
from cad_implicit.tiles import HALO, contour_in_tiles, tiles_over

R = 2.0


def canonical(mesh: ci.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces in an order of their own."""
    vertices, number = np.unique(mesh.vertices, axis=0, return_inverse=True)
    assert len(vertices) == len(mesh.vertices)
    faces = number.ravel()[mesh.faces]
    turned = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
    faces = np.take_along_axis(faces, turned, 1)
    return vertices, faces[np.lexsort(faces.T)]


def assert_same(one: ci.Mesh, other: ci.Mesh) -> None:
    for mine, theirs in zip(canonical(one), canonical(other), strict=True):
        assert np.array_equal(mine, theirs)


OPERATIONS: dict[str, Callable[..., Implicit]] = {
    "fillet": exact.Closing,
    "round": exact.opening,
    "smooth": exact.smoothing,
}


@pytest.mark.parametrize(
    ("operation", "make"),
    [
        ("fillet", lambda: cases.cross(2, 1.5, R)),
        ("round", lambda: cases.cross(2, 1.5, R)),
        ("smooth", lambda: cases.corner(R)),
    ],
    ids=["fillet", "round", "smooth"],
)
def test_tiles_give_what_the_whole_gives(operation: str, make: Callable[[], cases.Case]) -> None:
    radius, h = (0.87, 0.137) if operation == "round" else (1.13, 0.151)
    part, function = MeshDistance(make().mesh), OPERATIONS[operation]
    whole = ci.contour(function(part, radius, h))
    tiles = tiles_over(part, h, 90)
    assert len(tiles) >= 4
    pieces = contour_in_tiles(lambda region: function(part, radius, h, region=region), tiles, part, h)
    assert pieces.is_watertight
    assert_same(pieces, whole)
    # Seams run through the blend, not only beside it.
    moved = np.abs(part(pieces.vertices)) > 0.05 * h
    bricks = np.floor((pieces.vertices[moved] - lattice(part, h)[1]) / (8 * h))
    owner = [((bricks >= tile.low) & (bricks < tile.high)).all(axis=1).any() for tile in tiles]
    assert sum(owner) >= 2


def test_a_zone_that_is_too_small_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    case = cases.corner(R)
    part, radius, h = MeshDistance(case.mesh), 1.13, 0.151
    whole = ci.contour(exact.Closing(part, radius, h))

    def nowhere(parent: Implicit, radius: float, spacing: float, region: Region, *rest: object) -> Region:
        return Region(region.origin, region.cell, np.zeros(region.mask.shape, np.bool_))

    monkeypatch.setattr(exact, "blend_zone", nowhere)
    tiles = tiles_over(part, h, 90)
    assert_same(contour_in_tiles(lambda region: exact.Closing(part, radius, h, region=region), tiles, part, h), whole)


@pytest.mark.parametrize(("operation", "amount"), [("fillet", 1.1), ("offset", 0.7), ("offset", -0.6)])
def test_jobs_go_to_tiles_where_memory_is_short(operation: str, amount: float, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shapes.corner(15)
    at_once = ci.run(mesh, operation, amount, spacing=0.21)
    cells = mesh.area / 0.21**2
    stages = set()
    monkeypatch.setattr(sizing, "available_memory", lambda: int(cells * sizing.BYTES_PER_TILED_CELL + 2.5e7))
    outcome = ci.run(
        mesh, operation, amount, spacing=0.21, progress=lambda stage, fraction: stages.add((stage, fraction))
    )
    fractions = {fraction for stage, fraction in stages if stage == "tiles"}
    assert len(fractions) > 2
    assert_same(outcome.mesh, at_once.mesh)
    assert outcome.warnings == at_once.warnings
    with pytest.raises(MemoryLimitError, match="GiB may be used"):
        outcome.shape([[0.0, 0.0, 0.0]])


def test_memory_that_even_tiles_do_not_have(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shapes.corner(15)
    monkeypatch.setattr(sizing, "available_memory", lambda: 4 * 10**7)
    with pytest.raises(MemoryLimitError, match=r"use a spacing of [\d.]+ mm or more") as refused:
        ci.run(mesh, "fillet", 1.0, spacing=0.1)
    fits = float(str(refused.value).split("use a spacing of ")[1].split()[0])
    assert sizing.bricks_in_a_tile(mesh.area, fits) > 0


def test_a_cancelled_run_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    seen: list[int] = []

    def stop(stage: str, fraction: float) -> None:
        if stage == "tiles" and fraction > 0.3:
            seen.extend(len(list(folder.iterdir())) for folder in tmp_path.iterdir())
            raise KeyboardInterrupt

    part = MeshDistance(shapes.corner(15))
    tiles = tiles_over(part, 0.3, 60)
    with pytest.raises(KeyboardInterrupt):
        contour_in_tiles(lambda region: part, tiles, part, 0.3, progress=stop)
    assert seen[0] > 0
    assert not list(tmp_path.iterdir())


def test_nothing_left_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(piecewise, "_LARGE", 0)
    block = ci.Mesh([[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    with pytest.raises(EmptyResultError, match="the largest that does has a radius of"):
        ci.run(block, "round", 3.0, spacing=0.5)


def test_tiles_fill_the_lattice() -> None:
    part = MeshDistance(shapes.corner(15))
    tiles = tiles_over(part, 0.2, 100)
    whole = tiles_over(part, 0.2, 10**9)
    assert len(whole) == 1
    volume = [(tile.high - tile.low).prod() for tile in tiles]
    assert sum(volume) == (whole[0].high - whole[0].low).prod()
    assert min((tile.high - tile.low).min() for tile in tiles) >= 2 * HALO


def test_regions() -> None:
    rng = np.random.default_rng(5)
    mask = rng.random((7, 5, 6)) < 0.2
    region = Region([1.3, -2.1, 0.4], 0.7, mask)
    cells = np.argwhere(mask)
    low = rng.uniform([-1, -4, -2], [8, 4, 6], (300, 3))
    for side in (0.3, 0.9, 2.3):
        first, last = (low - region.origin) / 0.7, (low + side - region.origin) / 0.7
        touched = ((cells[None] + 1 > first[:, None]) & (cells[None] < last[:, None])).all(axis=2)
        assert np.array_equal(region.overlaps(low, side), touched.any(axis=1))
        count = (np.ceil(last) - np.floor(first)).prod(axis=1)
        assert np.array_equal(region.holds(low, side), touched.sum(axis=1) == count)
    inside = region.contains(low)
    assert inside.any()
    assert region.grown(0.8).contains(low[inside] + 0.8).all()
    there = ((low >= region.origin) & (low < region.origin + 0.7 * np.array(mask.shape))).all(axis=1)
    assert region.joined(low[there][:9]).contains(low[there][:9]).all()
    assert region.joined(low[there][:9]).contains(low[inside]).all()
