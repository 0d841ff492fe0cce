"""The whole job, from part to checked mesh: figures, warnings, refusals, progress, cancellation."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
import shapes

import cad_implicit as ci
from cad_implicit.errors import EmptyResultError, OpenMeshError, RadiusError, RefusedError
from cad_implicit.sizing import Engine

ENGINES: list[Engine] = ["exact", "reinit"]


@pytest.mark.parametrize("engine", ENGINES)
def test_outcome_of_a_fillet(engine: Engine) -> None:
    part = shapes.notch(90, 20)
    outcome = ci.run(part, "fillet", 2.5, spacing=0.8, engine=engine)
    figures = json.loads(json.dumps(outcome.as_dict()))
    assert figures["watertight"] is True
    assert figures["engine"] == engine
    assert figures["warnings"] == []
    assert set(figures["seconds"]) == {"read", "mesh", "fillet", "contour", "check"}
    truth = shapes.notch_fillet(90, 2.5, 12)
    assert ci.MeshDistance(outcome.mesh).unsigned(truth).max() < outcome.error_bound
    added = (1 - np.pi / 4) * 2.5**2 * 30  # the whole edge, were it not for its open ends
    if engine == "exact":
        facets = 0.35 * 0.8**2 / 2.5 * (np.pi / 2 * 2.5 * 30)  # chords of a hollow lie on its open side
        assert 0.9 * added < figures["volume_after"] - figures["volume_before"] < added + facets


@pytest.mark.parametrize("engine", ENGINES)
def test_lost_pieces_and_closed_holes(engine: Engine) -> None:
    block = shapes.box([0, 0, 0], [20, 20, 20]) - shapes.box([8, 8, -1], [11, 11, 21])
    part = shapes.as_mesh(block + shapes.box([30, 0, 0], [32, 20, 20]))
    notes = " ".join(ci.run(part, "round", 2, spacing=0.6, engine=engine).warnings)
    assert "material 2 mm wide" in notes
    assert "1 of 2 separate pieces vanished" in notes
    assert "largest radius that keeps it is 1 mm" in notes
    notes = " ".join(ci.run(part, "fillet", 2, spacing=0.6, engine=engine).warnings)
    assert "a gap 3 mm wide" in notes
    assert "through holes changed from 1 to 0" in notes


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("width", [4.0, 4.001, 4.3])
def test_a_ball_that_barely_fits_is_told_where_it_may_be_wrong(engine: Engine, width: float) -> None:
    """The regular grid does not resolve it; the exact engine does (tests of the centres)."""
    slot = shapes.box([-9, -9, -9], [9, 9, 6]) - shapes.box([-width / 2, -10, -3], [width / 2, 10, 7])
    outcome = ci.run(shapes.as_mesh(slot), "fillet", 2, spacing=0.6, engine=engine)
    assert outcome.mesh.is_watertight
    told = any(f"a gap {width:.4g} mm wide" in note and "so near to twice" in note for note in outcome.warnings)
    assert told == (engine == "reinit")


@pytest.mark.parametrize("engine", ENGINES)
def test_refusals_and_errors(engine: Engine) -> None:
    plate = shapes.as_mesh(shapes.box([0, 0, 0], [30, 30, 3]) + shapes.box([0, 0, 0], [6, 6, 6]))
    with pytest.raises(RefusedError, match=r"removes \d+.* most of the part is thinner than 4 mm"):
        ci.run(plate, "round", 2, spacing=0.5, engine=engine)
    outcome = ci.run(plate, "round", 2, spacing=0.5, engine=engine, force=True)
    assert any("most of the part" in note for note in outcome.warnings)
    assert outcome.mesh.volume < 216
    thin = shapes.as_mesh(shapes.box([0, 0, 0], [30, 30, 3]) + shapes.box([0, 0, 0], [3, 3, 30]))
    with pytest.raises(EmptyResultError, match="nowhere 4 mm thick"):
        ci.run(thin, "round", 2, spacing=0.5, engine=engine)
    with pytest.raises(RadiusError, match="too large"):
        ci.run(plate, "round", 30, engine=engine)
    with pytest.raises(ValueError, match="must be one of fillet"):
        ci.run(plate, "sand", 1)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_part_that_leaks_is_refused_unless_forced(engine: Engine) -> None:
    block = shapes.as_mesh(shapes.box([0, 0, 0], [12, 10, 8]) - shapes.box([-1, -1, 4], [4, 11, 9]))
    cut = block.vertices[block.faces].mean(axis=1)
    kept = np.linalg.norm(cut - cut[0], axis=1) > 1e-9  # one triangle is missing
    leaky = ci.Mesh(block.vertices, block.faces[kept])
    with pytest.raises(OpenMeshError, match=r"3 of .* or use --force to have its holes closed by guess, with no bound"):
        ci.run(leaky, "fillet", 1, spacing=0.4, engine=engine)
    outcome = ci.run(leaky, "fillet", 1, spacing=0.4, engine=engine, force=True)
    figures = json.loads(json.dumps(outcome.as_dict()))
    assert figures["error_bound"] is None
    assert any("3 edges" in note and "winding numbers" in note for note in figures["warnings"])
    assert outcome.mesh.is_watertight
    assert outcome.mesh.volume == pytest.approx(block.volume + (1 - np.pi / 4) * 10, rel=0.05)


@pytest.mark.parametrize("engine", ENGINES)
def test_progress_and_cancel(engine: Engine) -> None:
    part = shapes.notch(90, 20)
    seen: list[str] = []
    ci.run(part, "smooth", 2.5, spacing=1.6, engine=engine, progress=lambda stage, fraction: seen.append(stage))
    assert {"read", "mesh", "smooth", "contour", "check"} <= set(seen)
    for stop in sorted(set(seen)):

        def cancel(stage: str, fraction: float, stop: str = stop) -> None:
            if stage == stop:
                raise InterruptedError(stage)

        with pytest.raises(InterruptedError, match=stop):
            ci.run(part, "smooth", 2.5, spacing=1.6, engine=engine, progress=cancel)


@pytest.mark.parametrize("engine", ENGINES)
def test_same_bytes_for_any_number_of_threads(engine: Engine) -> None:
    part = shapes.boss(5, 12, 10, 90)
    one, two = (ci.run(part, "smooth", 2, spacing=0.7, engine=engine, threads=n).mesh for n in (1, 2))
    assert (one.vertices == two.vertices).all()
    assert (one.faces == two.faces).all()


def test_other_warnings_pass_through(tmp_path: Path) -> None:
    def noisy(stage: str, fraction: float) -> None:
        if (stage, fraction) == ("read", 0.0):
            warnings.warn("something else", UserWarning, stacklevel=1)

    with pytest.warns(UserWarning, match="something else"):
        ci.run(shapes.notch(90, 20), "fillet", 2.5, spacing=1, progress=noisy)
