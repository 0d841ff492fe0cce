"""The exact engine against analytic fillets, off the axes; errors in units of the spacing.

Bounds are a few times what was measured; ``python -m validation.accuracy`` prints the figures.
"""

from __future__ import annotations

from collections.abc import Callable

import exact_cases as cases
import numpy as np
import pytest
import shapes

import cad_implicit as ci

R = 2.0
PLANAR = [lambda: cases.wedge(60, R), lambda: cases.wedge(90, R), lambda: cases.wedge(120, R),
          lambda: cases.corner(R), lambda: cases.pocket(R)]  # fmt: skip
CURVED = [lambda: cases.cone_boss(2, 2, R), lambda: cases.cone_boss(2.5, 1.5, R), lambda: cases.cone_boss(1.5, 2.2, R),
          lambda: cases.cross(2, 1.5, R), lambda: cases.cross(2, 2, R)]  # fmt: skip

#: Centroids of triangles, and points of the truth, are off by the chord: h² / r times this at most.
CHORD = 0.35


def filleted(case: cases.Case, cells: float) -> cases.Errors:
    """Errors of the fillet at ``cells`` spacings to the radius."""
    h = case.radius / cells
    return cases.errors(case, ci.contour(ci.fillet(case.mesh, case.radius, spacing=h)), h)


@pytest.mark.parametrize("make", PLANAR)
def test_planar_contacts_are_exact(make: Callable[[], cases.Case]) -> None:
    error = filleted(make(), 5)
    assert error.blend < 1e-4
    assert error.blend_rms < 1e-5
    assert error.facets < CHORD / 5
    assert error.missed < CHORD / 5
    assert error.face < 1e-5
    assert error.sharp_p999 < 0.02
    assert error.sharp < 0.2


@pytest.mark.parametrize("make", CURVED)
def test_curved_contacts(make: Callable[[], cases.Case]) -> None:
    error = filleted(make(), 5)
    assert error.blend < 5e-3
    assert error.blend_rms < 5e-4
    assert error.facets < CHORD / 5
    assert error.missed < CHORD / 5
    assert error.face < 1e-3


@pytest.mark.filterwarnings("ignore:a gap")
@pytest.mark.parametrize(("hole", "bound"), [(0.1, 1e-3), (0.3, 0.05), (0.6, 0.05), (0.9, 0.05)])
def test_plugged_hole(hole: float, bound: float) -> None:
    error = filleted(cases.plug(hole, R), 5)
    assert error.blend < bound
    assert error.face < 1e-5


def test_opening_is_the_closing_of_the_cavity() -> None:
    case = cases.cone_boss(2, 2, R, 240)
    h = R / 4
    error = cases.errors(case, ci.contour(ci.round(shapes.cavity(case.mesh, 2.5 * R), R, spacing=h)), h)
    assert error.blend < 5e-3
    assert error.face < 1e-3


@pytest.mark.parametrize("first", ["round", "fillet"])
def test_smoothing_is_as_accurate(first: str) -> None:
    case, h = cases.cone_boss(2, 2, R, 240), R / 5
    error = cases.errors(case, ci.contour(ci.smooth(case.mesh, R, first=first, spacing=h)), h)
    assert error.blend < 5e-3  # of which 1e-3 is the tessellation
    assert error.face < 1e-3


@pytest.mark.filterwarnings("ignore::cad_implicit.errors.GeometryWarning")
def test_six_operations_do_not_drift() -> None:
    case, h = cases.corner(R), R / 4
    shape = ci.fillet(case.mesh, R, spacing=h)
    shape = ci.offset(shape, 0.7, spacing=h)
    shape = ci.offset(shape, -0.7, spacing=h)
    shape = ci.fillet(shape, R, spacing=h)
    shape = ci.round(shape, 1.0, spacing=h)
    shape = ci.fillet(shape, 1.5, spacing=h)
    error = cases.errors(case, ci.contour(shape), h)
    assert error.blend < 1e-3
    assert error.face < 1e-3


def test_a_hole_wider_than_the_ball_stays_on_its_facets() -> None:
    part = shapes.drilled(1.5 * R, 4 * R, 3 * R, segments=180)
    mesh = ci.contour(ci.fillet(part, R, spacing=R / 5))
    assert np.abs(ci.MeshDistance(part)(mesh.vertices)).max() < 0.005 * R / 5


def test_balls_of_a_second_operation_may_lie_outside_of_the_box() -> None:
    """A step lower than the radius: its edge is rounded, and the ball in its corner sticks out at the top."""
    step = shapes.box([0, 0, 0], [30, 30, 8]) + shapes.box([0, 0, 7], [12, 30, 10])
    faces = step.to_mesh()  # along the axes, for a tight box
    smoothed = ci.smooth(ci.Mesh(faces.vert_properties[:, :3], faces.tri_verts), 3.0, spacing=0.7)
    centre = np.array([12 - np.sqrt(8) + np.sqrt(20), 15, 11])
    points = np.array([[12.0, 15, 8.05], [11.95, 15, 8.3]])
    expected = np.linalg.norm(points - centre, axis=1) - 3
    assert smoothed(points) == pytest.approx(expected, abs=0.01)
