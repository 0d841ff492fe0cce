"""The exact kernel's blends in a child process: believed only if they are sound."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import Any

import pytest

pytest.importorskip("OCP", reason="needs CadQuery or build123d")

from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
from OCP.TopAbs import TopAbs_SHELL

import cad_implicit as ci
from cad_implicit.cad.exact_blends import exact_blend
from cad_implicit.cad.occ import distinct, volume
from cad_implicit.cad.occ_exact import _fault

pytestmark = pytest.mark.host


def all_edges(shape: Any, radius: float) -> Mapping[int, float]:
    return {edge.number: radius for edge in ci.edges(shape)}


def test_a_fillet_that_works() -> None:
    box = BRepPrimAPI_MakeBox(10, 10, 10).Solid()
    done = exact_blend(box, all_edges(box, 2.0))
    # the box grown by 2 from one of 6: Steiner's formula
    truth = 6**3 + 6 * 36 * 2 + 12 * 6 * math.pi * 4 / 4 + 4 / 3 * math.pi * 8
    assert (done.status, done.message) == ("ok", "")
    assert done.after == pytest.approx(truth, rel=1e-9)
    assert volume(done.shape) == pytest.approx(truth, rel=1e-9)
    assert done.change == pytest.approx(truth - 1000, rel=1e-9)
    assert len(done.blend) == 20
    assert 0 < done.tolerance < 1e-5


def test_a_chamfer_with_two_lengths() -> None:
    box = BRepPrimAPI_MakeBox(10, 20, 30).Solid()
    (edge, *_) = ci.edges(box, "|Z")
    assert exact_blend(box, {edge.number: (1.0, 2.0)}, "chamfer").change == pytest.approx(-30.0)


def test_failures_are_told() -> None:
    box = BRepPrimAPI_MakeBox(10, 10, 10).Solid()
    assert exact_blend(box, all_edges(box, 5.0)).status in ("not done", "invalid", "crash")
    assert exact_blend(box, {}).message == "there are no edges to blend"
    late = exact_blend(box, all_edges(box, 1.0), time_limit=0.01)
    assert (late.status, late.shape, late.message) == ("time out", None, "no answer within 0.01 s")


def test_a_program_without_an_interpreter_is_not_started_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    box = BRepPrimAPI_MakeBox(10, 10, 10).Solid()
    assert exact_blend(box, all_edges(box, 1.0)).status == "not tried"


def test_what_is_no_sound_result() -> None:
    can = BRepPrimAPI_MakeCylinder(5, 10).Solid()
    v = volume(can)
    assert _fault(can, v + 1, v, -1) == _fault(can, v - 1, v, 1) == _fault(can, v + 1, v, 0) == ""
    assert "wrong way" in _fault(can, v + 1, v, 1)
    assert "wrong way" in _fault(can, v, v, -1)
    assert _fault(can, v, -v, 0).startswith("the volume is -785.398")
    (shell,) = distinct(can, TopAbs_SHELL)
    assert _fault(shell, v, v, 0) == "the result is not a valid solid"
