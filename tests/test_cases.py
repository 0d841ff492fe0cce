"""Parts on which the exact kernel fails: every operation on them gives a sound mesh, or the error that is right."""

from __future__ import annotations

import pytest

pytest.importorskip("cadquery")

import cadquery as cq

import cad_implicit as ci
from cad_implicit.errors import OpenMeshError
from validation.cases import Run, leaking_union
from validation.runs import perform

pytestmark = pytest.mark.host


@pytest.mark.parametrize(
    "run",
    [
        Run("split_cylinder", "round", 4.0, 48, 0.995, 3),
        Run("torus_groove", "round", 3.0, 64, 0.983, 9),
        Run("tangent_boss", "fillet", 1.0, 96, 1.001, 10),
        Run("tangent_boss", "round", 1.0, 96, 0.989, 10),
        Run("steinmetz", "round", 1.0, 64, 0.991, 12),
        Run("leaking_union", "smooth", 0.3, 64, None, 5),
        Run("cube_to_sphere", "round", 2.5, 40, 0.859, 6),
        Run("cube_to_sphere", "round", 5.0, 48, 0.5236, 6),
        Run("tall_stadium", "round", 25.0, 48, 0.6625, 7),
        Run("two_blocks", "offset", 1.0, 48),
    ],
    ids=lambda run: f"{run.part}-{run.operation}-{run.amount:g}",
)
def test_results_are_closed_oriented_and_free_of_self_intersections(run: Run) -> None:
    result = perform(run)
    assert result.error == ""
    assert result.faults == []
    assert result.components > 0


def test_a_union_that_leaks_is_refused_with_what_to_do() -> None:
    with pytest.raises(OpenMeshError, match=r"are open .* or use --force .* try clean=False there"):
        ci.run(leaking_union(), "round", 0.3, spacing=0.2)
    sound = cq.Workplane().box(10, 10, 10).union(cq.Workplane().sphere(6), clean=False)
    assert ci.to_mesh(sound).is_watertight


@pytest.mark.parametrize(
    ("run", "message"),
    [
        (Run("hollow_box", "round", 1.0, 96, 0.0, 1), "EmptyResultError: nothing is left"),
        (Run("hollow_box", "smooth", 1.0, 96, 0.0, 1), "EmptyResultError: nothing is left"),
        (Run("stadium", "round", 25.0, 48, 0.0, 7), "RadiusError: radius 25 mm is too large"),
    ],
    ids=lambda value: value.part if isinstance(value, Run) else "",
)
def test_a_part_thinner_than_the_ball_is_an_error(run: Run, message: str) -> None:
    result = perform(run)
    assert result.error.startswith(message)
    assert result.faults == []
