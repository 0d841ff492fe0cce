"""The command ``validate`` as a guard: what it makes of the largest error that is allowed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("OCP")
pytest.importorskip("plotly")

from typer.testing import CliRunner

from cad_implicit.cli import app

cq = pytest.importorskip("cadquery")


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    block = cq.Workplane().box(17.3, 12.1, 5.7).union(cq.Workplane().circle(3.9).extrude(9.3))
    path = tmp_path_factory.mktemp("part") / "boss.step"
    cq.exporters.export(block.rotate((0, 0, 0), (1, 2, 3), 33), str(path))
    return path


@pytest.mark.parametrize(("largest", "code"), [("0.0001h", 1), ("0.5h", 0)])
def test_the_largest_error_guards(largest: str, code: int, part: Path, tmp_path: Path) -> None:
    options = ["-r", "1.3", "--edges", "concave", "--spacing", "0.4", "--max-error", largest, "-o", str(tmp_path), "-q"]
    found = CliRunner().invoke(app, ["validate", str(part), *options])
    assert found.exit_code == code, found.output
    told = json.loads((tmp_path / "report.json").read_text())
    assert told["verdict"] == ("failed" if code else "passed")
    limit = told["limits"]["the largest error in mm"]
    assert limit["limit"] == pytest.approx(float(largest.removesuffix("h")) * 0.4)
    assert (limit["value"] > limit["limit"]) == bool(code)
    assert limit["value"] < 0.1 * 0.4
