"""Radius of curvature and tangency, measured on blends whose radius is known."""

from __future__ import annotations

import pytest

from cad_implicit.contouring import contour
from cad_implicit.distance import MeshDistance
from cad_implicit.local_blend import LocalBlend
from cad_implicit.local_ops import chamfer
from cad_implicit.mesh import Mesh
from cad_implicit.ops import round
from cad_implicit.report.bending import Bending, bending
from cad_implicit.shapes import box

RADIUS = 2.0


@pytest.fixture(scope="module")
def block() -> Mesh:
    return contour(box((20, 14, 9)).turned((1, 2, 3), 33.0), 0.5)


def measured(block: Mesh, shape: LocalBlend) -> Bending:
    return bending(contour(shape), shape, MeshDistance(block), RADIUS, 0.4)


def test_rounds_of_a_box(block: Mesh) -> None:
    found = measured(block, round(block, RADIUS, edges="all", spacing=0.4))
    assert found.samples > 200
    assert found.radius == pytest.approx(RADIUS, rel=1e-3)
    assert 0.95 * RADIUS < found.radius_low <= found.radius_high < 1.01 * RADIUS  # less beside the corners' balls
    assert found.contacts > 100
    assert found.tangency < 0.05
    assert found.tangency_high < 6.0


def test_another_radius_shows(block: Mesh) -> None:
    found = measured(block, round(block, 1.05 * RADIUS, edges="all", spacing=0.4))
    assert found.radius == pytest.approx(1.05 * RADIUS, rel=1e-3)


def test_a_chamfer_does_not_bend(block: Mesh) -> None:
    found = measured(block, chamfer(block, RADIUS, edges="all", spacing=0.4))
    assert found.samples < 20


def test_nothing_to_measure(block: Mesh) -> None:
    part = MeshDistance(block)
    found = bending(block, part, part, RADIUS, 0.4)
    assert found.samples == found.contacts == 0
    assert found.as_dict()["radius"] is None
