"""Sizing: defaults, refusals with figures, the memory that is really used."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import cad_implicit as ci
from cad_implicit import sizing
from cad_implicit.errors import MemoryLimitError, RadiusError, RefusedError, SpacingError
from cad_implicit.sizing import Engine

BOX = [[0, 0, 0], [30, 40, 120]]
ENGINES: list[Engine] = ["exact", "reinit"]


@pytest.mark.parametrize("engine", ENGINES)
def test_default_spacing(engine: Engine) -> None:
    assert sizing.choose_spacing(BOX, 3, engine=engine) == pytest.approx(0.5)
    assert sizing.choose_spacing(BOX, 30, engine=engine) == pytest.approx(1.3)
    assert sizing.choose_spacing(BOX, 3, engine=engine, spacing=0.7) == 0.7


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("tolerance", [0.3, 0.05])
def test_tolerance_bounds_the_error(engine: Engine, tolerance: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sizing, "available_memory", lambda: 2**50)
    h = sizing.choose_spacing(BOX, 3, engine=engine, tolerance=tolerance)
    assert sizing.error_bound(h, 3, engine) <= tolerance * (1 + 1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_memory_is_estimated_before_it_is_taken(engine: Engine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sizing, "available_memory", lambda: 2**27)
    with pytest.raises(MemoryLimitError, match=r"needs \d+.* GiB, but 0.1 GiB may be used; use a spacing of") as error:
        sizing.choose_spacing(BOX, 3, engine=engine, spacing=0.01)
    fits = float(str(error.value).split("spacing of ")[2].split(" mm")[0])
    assert sizing.choose_spacing(BOX, 3, engine=engine, spacing=fits) == fits
    tight = sizing.choose_spacing(BOX, 2, engine=engine)
    assert sizing.estimate_memory(BOX, tight, 0, engine) <= 2**27 * 1.0001
    assert tight > 2 / 6
    with pytest.raises(MemoryLimitError, match="half of it as spacing needs"):
        sizing.choose_spacing(BOX, 0.1, engine=engine)


@pytest.mark.parametrize("bad", [0, -1, float("nan"), float("inf")])
def test_bad_numbers(bad: float) -> None:
    with pytest.raises(RadiusError, match="positive number"):
        sizing.check_radius(bad, BOX, opening=False)
    for name in ("spacing", "tolerance"):
        with pytest.raises(SpacingError, match="positive number"):
            sizing.choose_spacing(BOX, 3, engine="exact", **{name: bad})  # type: ignore[arg-type]
    with pytest.raises(SpacingError, match="not both"):
        sizing.choose_spacing(BOX, 3, engine="exact", spacing=1, tolerance=1)


def test_radius_must_fit_the_part() -> None:
    assert sizing.check_radius(15, BOX, opening=True) == 15
    with pytest.raises(RadiusError, match=r"30 x 40 x 120 mm: it may be at most 15 mm, half its smallest side"):
        sizing.check_radius(15.01, BOX, opening=True)
    assert sizing.check_radius(60, BOX, opening=False) == 60
    with pytest.raises(RadiusError, match="at most 65 mm, half its diagonal"):
        sizing.check_radius(66, BOX, opening=False)


def test_too_many_triangles_are_refused_unless_forced() -> None:
    with pytest.raises(RefusedError, match="million triangles"):
        sizing.check_triangles(1e4, 0.01, force=False)
    sizing.check_triangles(1e4, 0.01, force=True)
    sizing.check_triangles(1e4, 0.1, force=False)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads the peak memory from /proc")
@pytest.mark.parametrize("engine", ENGINES)
def test_the_estimate_holds(engine: Engine) -> None:
    """Peak memory of a real run, less that of a tiny one, stays below the estimate, which is not wildly too high."""
    code = f"""
import re, sys; sys.path.insert(0, {str(Path(__file__).parent)!r})
import shapes
from cad_implicit import run, sizing
peak = lambda: int(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1]) * 1024
part = shapes.corner(15)
run(part, "smooth", 3, spacing=1.5, engine={engine!r})
before = peak()
run(part, "smooth", 3, spacing=0.2, engine={engine!r})
print((peak() - before) / sizing.estimate_memory(part.bounds, 0.2, 3, {engine!r}))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert 0.2 < float(done.stdout) < 1.0


def test_solids_of_large_parts_get_coarser_spacings() -> None:
    small = [[0, 0, 0], [10, 8, 6]]
    assert sizing.spacing_for_facets(small, 1.0) == pytest.approx(min(1 / 6, 200**0.5 / 100))
    disc = [[0, 0, 0], [109, 109, 20]]
    assert sizing.spacing_for_facets(disc, 1.0) == pytest.approx(1 / 3)
    assert 0.5 < sizing.spacing_for_facets(disc, 2.0) < 2 / 3  # by the number of triangles
    assert sizing.spacing_for_facets(disc, 9.0) == pytest.approx(1.5, rel=0.05)  # the default: by the diagonal


def test_memory_can_be_limited() -> None:
    bounds = [[0.0, 0, 0], [10, 10, 10]]
    try:
        sizing.limit_memory(1e6)
        assert sizing.available_memory() == 10**6
        with pytest.raises(MemoryLimitError, match=r"use a spacing of"):
            sizing.choose_spacing(bounds, 1.0, engine="exact", spacing=0.05)
    finally:
        sizing.limit_memory(None)
    assert sizing.available_memory() > 10**6


def test_blends_that_a_spacing_does_not_resolve() -> None:
    notch = ci.box((20, 13, 9)) - ci.box((20, 13, 9)).moved((7, 5, 0.5))
    part = ci.contour(notch.turned((0.48, -0.6, 0.64), 0.7), 0.5)
    for edges in (None, "concave"):
        with pytest.raises(SpacingError, match=r"3 mm does not resolve a radius of 1.5 mm; .* better 0.25 mm"):
            ci.run(part, "fillet", 1.5, edges=edges, spacing=3)
        assert any("hardly resolves" in note for note in ci.run(part, "fillet", 1.5, edges=edges, spacing=1.2).warnings)
    assert not any("resolve" in note for note in ci.run(part, "offset", 0.2, spacing=0.7).warnings)
