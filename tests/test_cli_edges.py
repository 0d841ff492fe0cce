"""The command ``cad-implicit edges``: the table, the documented keys of its JSON, and its errors."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cad_implicit.report.edge_table import edge_figures

BRACKET = str(files("cad_implicit") / "data" / "bracket.step")


def cli(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cad_implicit", "edges", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def tube(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("parts") / "tube.ply"
    trimesh.creation.annulus(3, 5, 4, sections=48).export(path)
    return path


def test_table(tube: Path) -> None:
    headings = ["number", "length", "convexity", "angle", "largest_radius", "curve", "faces", "chain"]
    assert cli(tube, "--no-radius").stdout.splitlines()[0].split() == [h for h in headings if h != "largest_radius"]
    done = cli(tube, "--edges", ">Z")
    assert done.returncode == 0, done.stderr
    heading, *rows = done.stdout.splitlines()
    assert heading.split() == headings
    assert len(rows) == 2
    lengths = sorted(float(row.split()[1]) for row in rows)
    assert lengths == pytest.approx([2 * 48 * r * np.sin(np.pi / 48) for r in (3, 5)], rel=1e-5)
    assert all("convex" in row and "90.0" in row and "polyline, closed" in row for row in rows)


def test_json_has_the_documented_keys(tube: Path) -> None:
    report = json.loads(cli(tube, "--json").stdout)
    assert set(report) == {"input", "selector", "edges"}
    assert (report["input"], report["selector"], len(report["edges"])) == (str(tube), "all", 4)
    plain = json.loads(cli(tube, "--json", "--no-radius").stdout)["edges"]
    documented = set(re.findall(r"``(\w+)``", edge_figures.__doc__ or ""))
    for edge, less in zip(report["edges"], plain, strict=True):
        assert set(edge) == documented == {*less, "largest_radius"}
        assert edge["largest_radius"] > 0.5
        assert edge["closed"] is True
        assert edge["direction"] is None
        assert edge["start"] == edge["end"]
        assert edge["angle_range"] == pytest.approx([90, 90])
        assert edge["chain"] == edge["number"]


def test_edges_with_one_face(tmp_path: Path) -> None:
    path = tmp_path / "open.ply"
    trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).export(path)
    (edge,) = json.loads(cli(path, "--json", "--edges", ">X and >Y").stdout)["edges"]
    assert (edge["convexity"], edge["angle"], edge["angle_range"]) == ("boundary", None, None)
    assert edge["largest_radius"] is None
    assert " -  " in cli(path).stdout


@pytest.mark.host
def test_bracket() -> None:
    pytest.importorskip("OCP")
    report = json.loads(cli(BRACKET, "--edges", "concave and %circle", "--json").stdout)
    (rim,) = report["edges"]
    assert rim["length"] == pytest.approx(2 * np.pi * 11.15)
    assert rim["angle"] == pytest.approx(270)
    assert rim["curve"] == "circle"
    assert len(set(rim["faces"])) == 2


@pytest.mark.parametrize(
    ("selector", "text"),
    [(">W", "cannot be read at '>W'"), ("concave", "selects no edge; the part has 4 edges"), ("7", "no edge 7")],
)
def test_errors_are_one_line(selector: str, text: str, tube: Path) -> None:
    done = cli(tube, "--edges", selector)
    assert (done.returncode, done.stdout) == (1, "")
    assert text in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
