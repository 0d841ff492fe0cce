"""Chosen edges on the command line: results, figures, what is refused and how."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import trimesh

import cad_implicit as ci

BRACKET = str(files("cad_implicit") / "data" / "bracket.step")
SPANDREL = 1 - np.pi / 4
LOCAL = {"edges", "radii", "tangent"}
CONTRACT = {
    "input",
    "output",
    "operation",
    "radius",
    "spacing",
    "engine",
    "triangles",
    "watertight",
    "volume_before",
    "volume_after",
    "components_before",
    "components_after",
    "seconds",
    "warnings",
    "error_bound",
}


def cli(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cad_implicit", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("parts") / "block.ply"
    trimesh.creation.box((20, 16, 12)).export(path)
    return path


def test_figures_and_file(block: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.stl"
    done = cli("fillet", block, "--edges", "|Z and >X", "-r", 3, "-o", out, "--spacing", 0.5, "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert set(report) == CONTRACT | LOCAL
    assert (report["operation"], report["radius"], report["engine"]) == ("fillet", 3.0, "exact")
    assert len(report["edges"]) == 2
    assert report["radii"] == {str(number): 3.0 for number in report["edges"]}
    truth = 2 * SPANDREL * 3**2 * 12
    assert truth < report["volume_before"] - report["volume_after"] < 1.02 * truth
    mesh = ci.to_mesh(out)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(report["volume_after"], rel=1e-5)


def test_radii_of_some_edges(block: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.ply"
    common = ("round", block, "-o", out, "--spacing", 0.5, "--json")
    report = json.loads(cli(*common, "--edge-radius", "|Z and >X=2", "--edge-radius", ">X and >Y = 1:3").stdout)
    assert report["radius"] is None
    assert sorted(map(str, report["radii"].values())) == ["2.0", "[1.0, 3.0]"]
    rest = json.loads(cli(*common, "--edges", "|Z", "-r", 1, "--edge-radius", ">X and >Y=(2)").stdout or "null")
    assert rest is None  # 2 in brackets is no number
    rest = json.loads(cli(*common, "--edges", "|Z", "-r", 1, "--edge-radius", ">X and >Y=2").stdout)
    assert sorted(rest["radii"].values()) == [1.0, 1.0, 1.0, 2.0]
    truth = SPANDREL * (3 + 2**2) * 12
    assert truth < rest["volume_before"] - rest["volume_after"] < 1.08 * truth


def test_chamfer(block: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.ply"
    common = ("chamfer", block, "-l", 2, "--edges", "|Z and >X", "-o", out, "--spacing", 0.5)
    report = json.loads(cli(*common, "--length2", 3, "--json").stdout)
    assert set(report) == CONTRACT | {"edges", "second", "tangent"}
    assert (report["radius"], report["second"], len(report["edges"])) == (2.0, 3.0, 2)
    assert report["volume_before"] - report["volume_after"] == pytest.approx(2 * 3 * 12, rel=1e-5)
    assert "chamfer 2 edges, 2 mm, spacing" in cli(*common).stdout
    assert "chamfer 2 edges, 2 to 3 mm, spacing" in cli(*common, "--length2", 3).stdout


def test_summary_says_how_many_edges(block: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.ply"
    common = ("smooth", block, "-o", out, "--spacing", 0.5)
    assert "smooth 4 edges, 2 mm, spacing" in cli(*common, "-r", 2, "--edges", "|Z").stdout
    assert "smooth 1 edge, 1 to 2 mm, spacing" in cli(*common, "--edge-radius", "3=1:2").stdout
    assert cli(*common, "-r", 2, "--edges", "|Z", "--quiet").stdout == ""


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("fillet",), "--radius"),
        (("fillet", "--edges", "all"), "--radius"),
        (("fillet", "-r", 2, "--edge-radius", "3=1"), "--edges all"),
        (("fillet", "--edge-radius", "3"), "SELECTOR=R"),
        (("fillet", "--edge-radius", "=3"), "SELECTOR=R"),
        (("fillet", "--edge-radius", "3=two"), "SELECTOR=R"),
        (("fillet", "--edge-radius", "3=1:2:3"), "SELECTOR=R"),
        (("round", "-r", 2, "--no-tangent"), "--edges"),
        (("smooth", "-r", 2, "--edges", "all", "--engine", "reinit"), "engine"),
        (("chamfer", "-l", 2), "--edges"),
        (("chamfer", "--edges", "all"), "--length"),
        (("offset", "-d", 1, "--edges", "all"), "--edges"),
    ],
)
def test_wrong_usage(arguments: tuple[object, ...], text: str, block: Path, tmp_path: Path) -> None:
    done = cli(arguments[0], block, *arguments[1:], "-o", tmp_path / "out.stl")
    assert done.returncode == 2, done.stderr
    assert text in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("fillet", "-r", 2, "--edges", "concave"), "selects no edge; the part has 12 edges"),
        (("fillet", "-r", 2, "--edges", ">W"), "cannot be read at '>W'"),
        (("fillet", "-r", 2, "--edges", "40"), "no edge 40"),
        (("fillet", "-r", 0, "--edges", "all"), "must be a positive number of mm"),
        (("fillet", "--edge-radius", "3=-1"), "must be a positive number of mm"),
        (("fillet", "--edges", "all", "--edge-radius", "3=1"), "edges 1, 2, 4, 5, 6, 7, 8, 9 … have no radius"),
        (("round", "-r", 9, "--edges", "all"), "the largest radius for these edges is"),
        (("chamfer", "-l", 0, "--edges", "3"), "must be a positive number of mm"),
        (("chamfer", "-l", 1, "--length2", -1, "--edges", "3"), "must be a positive number of mm"),
    ],
)
def test_errors_are_one_line(arguments: tuple[object, ...], text: str, block: Path, tmp_path: Path) -> None:
    done = cli(arguments[0], block, *arguments[1:], "--quiet", "-o", tmp_path / "out.stl")
    assert (done.returncode, done.stdout) == (1, "")
    assert text in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.host
@pytest.mark.parametrize("suffix", [".stl", ".step"])
def test_bracket(suffix: str, tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    out = tmp_path / f"out{suffix}"
    done = cli("fillet", BRACKET, "--edges", "concave and |Z", "-r", 2, "--spacing", 0.5, "-o", out, "--json")
    report = json.loads(done.stdout)
    lengths = [edge.length for edge in ci.edges(BRACKET) if edge.number in report["edges"]]
    truth = SPANDREL * 2**2 * sum(lengths)
    assert len(lengths) == 4
    assert report["warnings"] == []
    assert 0.9 * truth < report["volume_after"] - report["volume_before"] < 1.1 * truth
    # a STEP file holds the exact faces: the mesh's chords are what it differs by
    assert ci.to_mesh(out, tolerance=0.005).volume == pytest.approx(report["volume_after"], rel=1e-4)
    assert ("solid" in report) == (suffix == ".step")
    assert report.get("solid", {"facets": 0})["facets"] == 0
