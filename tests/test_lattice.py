"""Lattices against brute force and analytic thickness: struts, slabs, minimal surfaces, and graded sizes."""

from __future__ import annotations

import itertools
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import cad_implicit as ci
from cad_implicit import minimal
from cad_implicit.distance import Surface
from cad_implicit.errors import RadiusError
from cad_implicit.grading import as_length
from cad_implicit.kernels.minimal import feet, levels
from cad_implicit.lattice import Crystal
from cad_implicit.minimal import Minimal
from cad_implicit.walls import LONGEST, ON_SURFACE, ROUNDS, STILL, Feet

Points = NDArray[np.float64]
KINDS = get_args(Minimal)


def random_points(count: int, size: float = 4.0) -> Points:
    return np.random.default_rng(11).uniform(-size, size, (count, 3))


def struts_of_a_cell(kind: str) -> list[tuple[Points, Points]]:
    """Struts of the unit cell and its neighbours, from the definition of the crystal."""
    corners = [np.array(c, float) for c in itertools.product((0, 1), repeat=3)]
    faces = [np.array(f) for f in itertools.permutations((0.5, 0.5, 0.0))] + [
        np.array(f) for f in itertools.permutations((0.5, 0.5, 1.0))
    ]
    pairs: list[tuple[Points, Points]] = []
    wanted = {"cubic": [1.0], "bcc": [np.sqrt(3)], "fcc": [np.sqrt(2)], "octet": [np.sqrt(2)]}[kind]
    pairs += [(a, b) for a, b in itertools.combinations(corners, 2) if np.linalg.norm(a - b) in wanted]
    if kind == "octet":
        pairs += [(a, b) for a, b in itertools.combinations(faces, 2) if 0.1 < np.linalg.norm(a - b) < 0.8]
    shifts = [np.array(s) for s in itertools.product((-1, 0, 1), repeat=3)]
    return [(a + s, b + s) for a, b in pairs for s in shifts]


@pytest.mark.parametrize("kind", get_args(Crystal))
@pytest.mark.parametrize("cell", [(2.0, 2.0, 2.0), (2.0, 3.0, 1.5)])
def test_struts_by_brute_force(kind: Crystal, cell: tuple[float, float, float]) -> None:
    lattice = ci.strut_lattice(kind, cell, 0.3)
    x = random_points(400)
    inside_cell = x - cell * np.floor(x / cell)
    best = np.full(len(x), np.inf)
    for a, b in struts_of_a_cell(kind):
        start, along = a * cell, (b - a) * cell
        share = np.clip((inside_cell - start) @ along / (along @ along), 0, 1)
        best = np.minimum(best, np.linalg.norm(inside_cell - start - share[:, None] * along, axis=1))
    value, gradient = lattice.value_and_gradient(x)
    np.testing.assert_allclose(value, 0.15 - best, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-12)
    foot = x - (value - 0.15)[:, None] * gradient
    np.testing.assert_allclose(lattice(foot), 0.15, atol=1e-12)
    assert (lattice.lipschitz, lattice.exact_outside, lattice.exact_inside) == (1.0, True, False)


def test_slabs() -> None:
    x = random_points(2000, 9)
    away = np.sort(np.abs(x - 3 * np.round(x / 3)), axis=1)
    rods, cells = ci.slab_lattice(3.0, 0.8), ci.slab_lattice(3.0, 0.8, closed=True)
    np.testing.assert_allclose(rods(x), 0.4 - away[:, 1], atol=1e-12)
    np.testing.assert_allclose(cells(x), 0.4 - away[:, 0], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(rods.gradient(x), axis=1), 1)
    # the periodic functions of the literature have the same surface
    s = np.cos(2 * np.pi * x / 3) - np.cos(np.pi * 0.8 / 3)
    np.testing.assert_array_equal(rods(x) > 0, np.sort(s, axis=1)[:, 1] > 0)


@pytest.mark.nojit
@pytest.mark.parametrize("kind", KINDS)
def test_kernel_twins(kind: Minimal) -> None:
    number, reach = minimal._KINDS[kind]
    x = random_points(40)
    values, slopes = np.zeros(len(x)), np.zeros_like(x)
    levels(x, number, values, slopes)
    s, c = np.sin(x), np.cos(x)
    expected = {
        "gyroid": s[:, 0] * c[:, 1] + s[:, 1] * c[:, 2] + s[:, 2] * c[:, 0],
        "schwarz_p": c.sum(axis=1),
        "diamond": c.prod(axis=1) - s.prod(axis=1),
        "iwp": 2 * (c * np.roll(c, 1, axis=1)).sum(axis=1) - np.cos(2 * x).sum(axis=1),
    }[kind]
    np.testing.assert_allclose(values, expected, atol=1e-12)
    for axis, step in enumerate(1e-6 * np.eye(3)):
        ahead, behind = np.zeros(len(x)), np.zeros(len(x))
        levels(x + step, number, ahead, np.zeros_like(x))
        levels(x - step, number, behind, np.zeros_like(x))
        np.testing.assert_allclose(slopes[:, axis], (ahead - behind) / 2e-6, atol=1e-7)

    distance, away = np.zeros(len(x)), np.zeros_like(x)
    turn = 2 * np.pi
    feet(x, number, turn * reach, ROUNDS, turn * LONGEST, turn * ON_SURFACE, turn * STILL, distance, away)
    slow = Feet(minimal._level(number), as_length("the cell", turn), reach)
    expected_distance, expected_away = slow(x)
    np.testing.assert_allclose(distance, expected_distance, atol=1e-9)
    np.testing.assert_allclose(away, expected_away, atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_minimal_surfaces_have_distances(kind: Minimal) -> None:
    """Against the nearest of many points of the surface, which are too far off by up to half their spacing."""
    level = minimal._level(minimal._KINDS[kind].number)
    cell, wall = 5.0, 0.7
    turn = 2 * np.pi / cell
    surface = np.random.default_rng(3).uniform(-4, 4, (400_000, 3))
    for _ in range(12):
        value, slope = level(turn * surface)
        surface -= (value / np.maximum((slope**2).sum(axis=1), 1e-2))[:, None] * slope / turn
    surface = surface[np.abs(level(turn * surface)[0]) < 1e-9]
    shape = ci.tpms(kind, cell, wall)
    x = random_points(4000, 2.5)
    truth, _ = cKDTree(surface).query(x)
    limit = minimal._KINDS[kind].reach * cell
    near = truth < 0.8 * limit
    error = (wall / 2 - shape(x)) - np.minimum(truth, limit)
    assert error[near].max() < 1e-6
    assert error.max() < 0.02 * cell
    assert error.min() > -0.06
    gradient = shape.gradient(x)[near]
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_minimal_walls_are_as_thick_as_asked(kind: Minimal) -> None:
    cell, width, h = 6.0, 0.8, 0.2
    wall = ci.tpms(kind, cell, width)
    mesh = ci.contour(wall & ci.box((9, 9, 9)).turned((1, 2, 3), 20), h)
    assert mesh.is_watertight
    level = minimal._level(minimal._KINDS[kind].number)
    on_wall = np.abs(wall(mesh.vertices)) < 0.02 * h
    sign = np.where(on_wall, np.sign(level(2 * np.pi / cell * mesh.vertices)[0]), 0)
    other = Surface(ci.Mesh(mesh.vertices, mesh.faces[(sign[mesh.faces] < 0).all(axis=1)]))
    inner = np.linalg.norm(mesh.vertices, axis=1) < 3.5
    start = np.random.default_rng(0).choice(np.flatnonzero((sign > 0) & inner), 1000)
    thickness, _ = other.closest(mesh.vertices[start])
    assert abs(thickness.mean() - width) < 0.03 * h
    assert np.abs(thickness - width).max() < 0.1 * h


def test_graded_walls_and_cells() -> None:
    ball = ci.sphere(10)
    wall = ci.graded(ball, 0.4, 1.2, 8.0)
    shape = ci.tpms("gyroid", 6.0, wall)
    even = ci.tpms("gyroid", 6.0, 0.4)
    x = random_points(500, 6)
    value, gradient = shape.value_and_gradient(x)
    np.testing.assert_allclose(value, even(x) + (wall(x) - 0.4) / 2, atol=1e-12)
    assert shape.lipschitz == pytest.approx(1.05)
    assert np.linalg.norm(gradient, axis=1).max() <= 1.05 + 1e-12
    as_function = ci.tpms("gyroid", 6.0, lambda p: 0.4 + 0.1 * np.clip(ball(p), 0, 8))
    np.testing.assert_allclose(as_function(x), value, atol=1e-12)
    np.testing.assert_allclose(as_function.gradient(x), gradient, atol=1e-6)
    assert as_function.lipschitz is None

    # a cell that is a function but constant gives the same wall by the slow way
    constant = ci.tpms("gyroid", lambda p: np.full(len(p), 6.0), 0.4)
    np.testing.assert_allclose(constant(x), even(x), atol=1e-9)
    slabs = ci.slab_lattice(lambda p: np.full(len(p), 6.0), 0.4)
    near = ci.slab_lattice(6.0, 0.4)(x) > -2
    np.testing.assert_allclose(slabs(x)[near], ci.slab_lattice(6.0, 0.4)(x)[near], atol=6e-6)


@pytest.mark.parametrize("name", ["slabs", "gyroid"])
def test_lattices_grow_denser_near_a_surface(name: str) -> None:
    """The thickness stays what it is while the cells shrink: measured across, at points of the middle."""
    ball = ci.sphere(10)
    cell = ci.graded(ball, 2.0, 4.0, 8.0)
    shape = ci.slab_lattice(cell, 0.3, closed=True) if name == "slabs" else ci.tpms("gyroid", cell, 0.3)
    x = random_points(40000, 7)
    x = x[np.linalg.norm(x, axis=1) < 9.5]
    value, gradient = shape.value_and_gradient(x)
    on_middle = x - (value - 0.15)[:, None] * gradient
    found = np.abs(shape(on_middle) - 0.15) < 1e-6
    assert found[value > -0.2].mean() > 0.95
    if name == "slabs":
        found &= ci.slab_lattice(cell, 0.3)(on_middle) < -0.3  # away from where slabs cross
    y = on_middle[found][:1000]
    across = shape.gradient(y)
    for side in (1, -1):
        np.testing.assert_allclose(np.percentile(shape(y + side * 0.15 * across), [1, 99]), 0, atol=2e-3)
    share = value > 0
    r = np.linalg.norm(x, axis=1)
    assert share[r > 8].mean() > 1.3 * share[r < 4].mean()


def test_a_lattice_in_a_part_contours() -> None:
    part = ci.sphere(5).moved((0.3, 0.2, 0.1))
    for lattice in (ci.strut_lattice("octet", 4.0, 0.7), ci.slab_lattice(3.0, 0.8), ci.tpms("schwarz_p", 4.0, 0.5)):
        mesh = ci.contour(part & lattice, 0.2)
        assert mesh.is_watertight
        assert 0.05 < mesh.volume / (4 / 3 * np.pi * 125) < 0.5


def test_halved_cells_meet() -> None:
    """The recipe for a lattice that grows denser towards a surface without folding."""
    ball, wall = ci.sphere(6), 0.5
    rods = ci.slab_lattice(4.0, wall) | (ci.slab_lattice(2.0, wall) - ci.sphere(6 - 2))
    mesh = ci.contour(ci.shell(ball, wall, spacing=0.2) | (rods & ball), 0.2)
    assert mesh.is_watertight
    assert mesh.components == 1
    x = random_points(20000, 6)
    depth = ball(x)
    solid = rods(x) > 0
    assert solid[(depth > 0.5) & (depth < 2)].mean() > 1.8 * solid[depth > 2].mean()


def test_bad_input() -> None:
    with pytest.raises(
        RadiusError, match=r"too thick for gyroid cells of 2 mm; use up to 0\.576 mm, or cells from 3\.47"
    ):
        ci.tpms("gyroid", 2.0, 1.0)
    with pytest.raises(RadiusError, match="the cell"):
        ci.strut_lattice("bcc", -1.0, 0.2)
    with pytest.raises(RadiusError, match="near"):
        ci.graded(ci.sphere(1), 0, 1, 1)
    with pytest.raises(ValueError, match="kind"):
        ci.tpms("neovius", 2.0, 0.1)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="kind"):
        ci.strut_lattice("kelvin", 2.0, 0.1)  # type: ignore[arg-type]
