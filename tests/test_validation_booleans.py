"""What the comparison with manifold3d measures, on solids whose distance is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cadquery")
pytest.importorskip("manifold3d")

from cad_implicit.mesh import Mesh
from cad_implicit.report.exact_surfaces import Surfaces
from validation import booleans
from validation.readme import into_readme

RADIUS = 5.3


def ball_of_manifold() -> Mesh:
    return booleans.from_manifold(booleans.Manifold.sphere(RADIUS, 40))


def test_facets_of_a_ball() -> None:
    truth = Surfaces(booleans.cq.Workplane().sphere(RADIUS).val().wrapped, 0.002)
    mesh = ball_of_manifold()
    deepest = RADIUS - np.linalg.norm(mesh.vertices[mesh.faces].mean(axis=1), axis=1).min()
    largest, rms = booleans.errors(mesh, truth)
    assert 0.9 * deepest < largest < deepest + 0.003
    assert 0.2 * largest < rms < 0.8 * largest


def test_a_moved_mesh() -> None:
    way = np.array([0.03, -0.02, 0.06])
    block = booleans.cq.Workplane().box(7, 5, 3)
    mesh = booleans._mesh(block)
    moved = Mesh(mesh.vertices + way, mesh.faces)
    truth = Surfaces(block.val().wrapped, 0.001)
    largest, _ = booleans.errors(moved, truth)
    assert np.linalg.norm(way) - truth.tolerance - 1e-9 < largest < np.linalg.norm(way) + 1e-9  # at corners


def test_a_boolean_both_ways() -> None:
    numbers = [n for n, (case, _, _) in enumerate(booleans.tasks()) if case == "difference: box, cylinder"]
    theirs, ours = map(booleans.perform, numbers)
    assert theirs.largest < 2 * booleans.TOLERANCE  # facets of the cylinder
    assert theirs.triangles < ours.triangles
    assert ours.largest < 0.05 * booleans.SPACING
    assert booleans.table([theirs, ours]).count("|\n") == 4


def test_tables_in_the_readme(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("a\n<!-- t -->\nold\n<!-- /t -->\nb\n")
    into_readme("t", "new\n", readme)
    assert readme.read_text() == "a\n<!-- t -->\nnew\n<!-- /t -->\nb\n"
    with pytest.raises(ValueError, match="no marks"):
        into_readme("u", "new\n", readme)
