"""The page of the paper's tables and figures, at a tiny resolution; and the shapes of its examples."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import cad_implicit as ci

pytest.importorskip("pyvista")
pytest.importorskip("matplotlib")

from validation.paper.__main__ import build
from validation.paper.distance_errors import curves
from validation.paper.examples import SHAPES, cube, iterations, microstructure
from validation.paper.models import mechanical_part, two_boxes
from validation.paper.thickness import measured


@pytest.mark.filterwarnings("ignore:walls of .* are too thin:cad_implicit.errors.GeometryWarning")
def test_page_is_one_file_with_every_table_and_picture(tmp_path: Path) -> None:
    page = build(tmp_path, nodes=40, resolutions=(12, 16, 20), dear=False).read_text(encoding="utf-8")
    for title in ("Table 1", "Table 2", "Table 3", "Figure 8", "Section 5.1", "Section 5.2", "The plane"):
        assert f"<h2>{title}" in page
    pictures = sorted(tmp_path.glob("*.png"))
    assert len(pictures) == len(re.findall(r'src="data:image/png;base64,', page)) == 10
    assert not re.search(r'(?:src|href)="(?!data:)', page)


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_examples_fit_their_cubes_and_their_bounds(name: str) -> None:
    shape = SHAPES[name](None)
    grid = cube(name, 24, shape)
    inside = ci.sample(shape, grid).values > 0
    assert 0.001 < inside.mean() < 0.2
    for axis in range(3):
        assert not np.take(inside, (0, -1), axis).any()
    nodes = grid.nodes()[inside.ravel()]
    assert (nodes >= shape.bounds[0]).all()
    assert (nodes <= shape.bounds[1]).all()


def test_ten_iterations_as_in_the_paper() -> None:
    assert [iterations(*example, 128) for example in (("jaw", 0.1), ("boxes", 0.025), ("part", 0.15))] == [10, 10, 10]


def test_r_functions_of_the_examples_have_the_sign_of_the_sets() -> None:
    x = np.random.default_rng(0).uniform(-0.3, 0.3, (5000, 3))
    flat = (np.abs(x - [0, 0, -0.14]) < [0.30, 0.18, 0.08]).all(axis=1)
    upright = (np.abs(x - [-0.10, 0.02, 0]) < [0.12, 0.11, 0.22]).all(axis=1)
    assert ((two_boxes()(x) > 0) == (flat | upright)).all()
    assert mechanical_part()([[0, 0.2, 0.85], [0, 0.2, 1.6], [1.48, -0.1, -1.2]]).round(1).tolist()[0] < 0


def test_error_near_the_surface_falls_to_a_floor_with_the_fix_and_rises_again_without() -> None:
    fixed, drifting, *_, exact = curves(32, dear=False)
    assert fixed.near[-1] < 1.01 * fixed.least_near
    assert drifting.near[-1] > 2 * drifting.least_near
    assert exact.near[0] < fixed.near[-1]


def test_jaw_is_one_piece_and_its_shell_hollow() -> None:
    made = microstructure(64).fields
    bone, filled = ci.contour(made["distance"]), ci.contour(made["microstructure"])
    assert bone.components == 1
    assert 0.7 * bone.volume < filled.volume < 0.98 * bone.volume
    assert np.abs(bone.vertices.mean(axis=0)[0]) < 0.02  # both halves alike


def test_thickness_is_that_of_a_plate() -> None:
    plate = ci.contour(ci.box((4.0, 4.0, 0.5)).turned((1, 2, 3), 20), 0.2)
    normal = (ci.box((1, 1, 1)).turned((1, 2, 3), 20)).matrix[:, 2]

    def side(middles: np.ndarray, normals: np.ndarray) -> np.ndarray:
        away = normals @ normal
        return np.where(away > 0.99, 1, np.where(away < -0.99, -1, 0))

    wall = measured("plate", True, plate, 0.2, 0.55, side)
    assert wall.worst == pytest.approx(0.25, abs=1e-5)
    assert wall.mean == pytest.approx(0.25, abs=1e-5)
