"""The ball-centre polish against analytic centres, off the axes; errors in units of the spacing.

Bounds are a few times what was measured.
"""

from __future__ import annotations

from collections.abc import Callable

import exact_cases as cases
import numpy as np
import pytest
import shapes

import cad_implicit as ci
from cad_implicit.implicit import FloatArray, polished
from cad_implicit.polish import polish_centres

R = 2.0
H = R / 5

#: How far rough centres are from the right ones, in spacings.
ROUGH = 0.07


def problem(case: cases.Case, count: int = 300) -> tuple[FloatArray, FloatArray]:
    """Points on the blend, and rough centres."""
    local = case.blend_samples(20_000)[:count]
    truth = shapes.placed(case.centre(local))
    noise = np.random.default_rng(3).normal(size=truth.shape)
    noise *= ROUGH * H / np.linalg.norm(noise, axis=1)[:, None]
    return shapes.placed(local), truth + noise


def errors(points: FloatArray, centres: FloatArray) -> FloatArray:
    return np.asarray(np.abs(np.linalg.norm(points - centres, axis=1) - R) / H)


@pytest.mark.parametrize(
    ("make", "bound"),
    [
        (lambda: cases.wedge(60, R), 5e-8),
        (lambda: cases.wedge(120, R), 5e-8),
        (lambda: cases.corner(R), 1e-4),
        (lambda: cases.pocket(R), 1e-4),
        (lambda: cases.square_boss(R), 1e-3),
        (lambda: cases.cone_boss(2, 2, R), 2e-3),
        (lambda: cases.cone_boss(1.5, 2.2, R), 2e-3),
        (lambda: cases.cross(2, 1.5, R), 2e-3),
        (lambda: cases.blind(2, R), 2e-3),
        (lambda: cases.blind(1.1, R), 2e-3),
    ],
)
def test_centres_are_found(make: Callable[[], cases.Case], bound: float) -> None:
    case = make()
    points, rough = problem(case)
    part = ci.MeshDistance(case.mesh)
    centres, found = polish_centres(part.value_and_gradient, R, H, points, rough, within=part.within)
    assert len(points) > 100
    assert found.all()
    assert errors(points, centres).max() < bound
    assert part(centres).max() < -R + 3e-3 * H  # the balls fit
    assert errors(points, rough).max() > 10 * bound  # it was worth it


@pytest.mark.parametrize("hole", [0.1, 0.3, 0.6, 0.9])
def test_the_ball_over_a_plugged_hole_sits_on_its_rim(hole: float) -> None:
    case = cases.plug(hole, R)
    points, rough = problem(case)
    part = ci.MeshDistance(case.mesh)
    centres, found = polish_centres(part.value_and_gradient, R, H, points, rough, within=part.within)
    assert found.all()
    assert errors(points, centres).max() < 5e-3
    assert np.percentile(errors(points, centres), 99) < 2e-3


def test_asking_whether_balls_fit_changes_nothing() -> None:
    case = cases.corner(R)
    points, rough = problem(case)
    part = ci.MeshDistance(case.mesh)
    plain, _ = polish_centres(part.value_and_gradient, R, H, points, rough)
    quick, _ = polish_centres(part.value_and_gradient, R, H, points, rough, within=part.within)
    assert np.abs(plain - quick).max() < 1e-3 * H


def test_rough_values_are_corrected_by_better_ones() -> None:
    case = cases.cone_boss(2, 2, R)
    points, rough = problem(case)
    part = ci.MeshDistance(case.mesh)
    asked = []

    def wavy(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values off by 0.02 spacings, as from a contoured surface."""
        value, gradient = part.value_and_gradient(x)
        return value + 0.02 * H * np.sin(x / H).prod(axis=1), gradient

    def better(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        asked.append(len(x))
        return part.value_and_gradient(x)

    centres, found = polish_centres(wavy, R, H, points, rough, better=better)
    assert found.all()
    assert errors(points, centres).max() < 2e-3
    assert errors(points, polish_centres(wavy, R, H, points, rough)[0]).max() > 5e-3
    assert sum(asked) < 3 * len(points)


def test_a_centre_out_of_reach_stays() -> None:
    case = cases.wedge(90, R)
    points, rough = problem(case, 20)
    away = rough + 5 * H * (rough - points) / R
    part = ci.MeshDistance(case.mesh)
    centres, found = polish_centres(part.value_and_gradient, R, H, points, away)
    assert not found.any()
    assert (centres == away).all()


@pytest.mark.parametrize("make", [lambda: cases.corner(R), lambda: cases.cone_boss(2, 2, R, 360)])
def test_a_second_closing_leaves_the_first(make: Callable[[], cases.Case]) -> None:
    case = make()
    points, _ = problem(case)
    shape = ci.fillet(ci.fillet(case.mesh, R, spacing=H), 0.75 * R, spacing=H)
    assert np.abs(polished(shape, points)[0]).max() / H < 3e-3


def test_smoothing_knows_its_fillets() -> None:
    case = cases.cone_boss(2, 2, R)
    points, _ = problem(case)
    shape = ci.smooth(case.mesh, R, spacing=H)
    assert np.abs(polished(shape, points)[0]).max() / H < 3e-3
    assert np.abs(shape(points)).max() / H > 3e-3


def test_threads_do_not_matter() -> None:
    case = cases.cross(2, 1.5, R, 180)
    points, rough = problem(case)
    part = ci.MeshDistance(case.mesh)
    one, _ = polish_centres(part.value_and_gradient, R, H, points, rough, threads=1)
    two, _ = polish_centres(part.value_and_gradient, R, H, points, rough, threads=2)
    assert (one == two).all()
