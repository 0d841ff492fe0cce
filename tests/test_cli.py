"""The command line as a process: results, figures, errors, exit codes, nothing left behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import shapes

import cad_implicit as ci

BRACKET = str(files("cad_implicit") / "data" / "bracket.step")
CONTRACT = {
    "input",
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


def cli(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cad_implicit", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)


def failed(done: subprocess.CompletedProcess[str], folder: Path, text: str, code: int = 1) -> None:
    """The process failed with one clear line and wrote nothing."""
    assert done.returncode == code, done.stderr
    assert text in done.stderr
    assert "Traceback" not in done.stderr
    if code == 1:
        assert len(done.stderr.strip().splitlines()) == 1
    assert done.stdout == ""
    assert not list(folder.glob("out*"))


@pytest.fixture(scope="module")
def notch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("parts") / "notch.ply"
    ci.save(shapes.notch(90, 20), path)
    return path


@pytest.mark.host
@pytest.mark.parametrize("operation", ["fillet", "round", "smooth", "offset"])
def test_operations_on_the_bracket(operation: str, tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    out = tmp_path / "out.stl"
    amount = ("-d", 1) if operation == "offset" else ("-r", 2)
    done = cli(operation, BRACKET, *amount, "-o", out, "--engine", "reinit", "--spacing", 0.8, "--json", "--force")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert set(report) >= CONTRACT
    assert report["input"] == BRACKET
    assert report["engine"] == "reinit"
    assert report["operation"] == operation
    assert report["watertight"] is True
    assert report["components_after"] == report["components_before"] == 1
    assert (report["volume_after"] > report["volume_before"]) == (operation in ("fillet", "offset"))
    mesh = ci.to_mesh(out)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(report["volume_after"], rel=1e-5)
    assert len(mesh.faces) <= report["triangles"]


@pytest.mark.parametrize("suffix", [".stl", ".3mf", ".obj", ".ply", ".npz", ".vti", ".nrrd"])
def test_outputs_by_suffix(suffix: str, notch: Path, tmp_path: Path) -> None:
    out = tmp_path / f"out{suffix}"
    done = cli("fillet", notch, "-r", 2, "-o", out, "--spacing", 1.5, "--quiet")
    assert done.returncode == 0, done.stderr
    assert done.stdout == done.stderr == ""
    assert [p.name for p in tmp_path.iterdir()] == [out.name]
    if suffix in (".stl", ".3mf", ".obj", ".ply"):
        assert ci.to_mesh(out).is_watertight


def test_summary_and_info_and_compare(notch: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.stl"
    done = cli("round", notch, "-r", 2, "-o", out, "--tolerance", 1.0, "--engine", "reinit")
    assert done.returncode == 0
    assert "closed" in done.stdout
    assert "error at most about 1 mm" in done.stdout
    figures = json.loads(cli("info", out, "--json").stdout)
    assert figures["watertight"] is True
    assert figures["components"] == 1
    distance = json.loads(cli("compare", notch, out, "--json").stdout)
    corner_of_block = 2 * (np.sqrt(3) - 1)
    assert corner_of_block - 1.0 < distance["maximum"] < corner_of_block + 1.0
    assert "volume" in cli("info", notch).stdout


def test_a_part_that_leaks_needs_force(tmp_path: Path) -> None:
    block = shapes.notch(90, 20)
    ci.save(ci.Mesh(block.vertices, block.faces[1:]), tmp_path / "in.ply")
    common = ("fillet", tmp_path / "in.ply", "-r", 2, "--spacing", 0.8, "-o", tmp_path / "out.ply")
    failed(cli(*common), tmp_path, "--force")
    done = cli(*common, "--force", "--json")
    assert json.loads(done.stdout)["error_bound"] is None
    assert ci.to_mesh(tmp_path / "out.ply").is_watertight
    assert "error not known" in cli(*common, "--force").stdout


def test_simplified_result(notch: Path, tmp_path: Path) -> None:
    full, fewer = (tmp_path / f"{name}.ply" for name in ("full", "fewer"))
    common = ("fillet", notch, "-r", 2, "--spacing", 0.8, "--json")
    before = json.loads(cli(*common, "-o", full).stdout)
    after = json.loads(cli(*common, "-o", fewer, "--simplify", 0.02).stdout)
    assert after["triangles"] < 0.2 * before["triangles"]
    assert after["error_bound"] == pytest.approx(before["error_bound"] + 0.02)
    assert ci.compare(ci.to_mesh(full), ci.to_mesh(fewer)).maximum < 0.04


def test_lost_pieces_are_told(tmp_path: Path) -> None:
    part = (
        shapes.box([0, 0, 0], [20, 20, 20]) + shapes.box([30, 0, 0], [32, 20, 20]) + shapes.box([5, 5, 20], [15, 7, 30])
    )
    ci.save(shapes.as_mesh(part), tmp_path / "in.stl")
    done = cli("round", tmp_path / "in.stl", "-r", 2, "-o", tmp_path / "out.stl", "--spacing", 0.7, "--json")
    report = json.loads(done.stdout)
    assert (report["components_before"], report["components_after"]) == (2, 1)
    text = " ".join(report["warnings"])
    assert "1 of 2 separate pieces vanished" in text
    assert "mm³" in text
    assert "largest radius that keeps it is 1 mm" in text


def test_bad_input(notch: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.stl"
    empty, corrupt, text = tmp_path / "empty.step", tmp_path / "corrupt.stl", tmp_path / "part.txt"
    empty.write_bytes(b"")
    corrupt.write_bytes(b"solid nothing\nfacet normal x\n")
    text.write_text("hello")
    for part in (empty, corrupt, text, tmp_path / "missing.stl", tmp_path):
        failed(cli("fillet", part, "-r", 2, "-o", out), tmp_path, str(part.name))
    mesh = shapes.notch(90, 20)
    ci.save(ci.Mesh(mesh.vertices, mesh.faces[3:]), tmp_path / "open.ply")
    failed(cli("fillet", tmp_path / "open.ply", "-r", 2, "-o", out), tmp_path, "edges are open")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("-r", 0), "must be a positive number"),
        (("-r", -1), "must be a positive number"),
        (("-r", "nan"), "must be a positive number"),
        (("-r", "inf"), "must be a positive number"),
        (("-r", 1000), "too large for a part of"),
        (("-r", 2, "--spacing", 0), "must be a positive number"),
        (("-r", 2, "--spacing", 1e-4), "use a spacing of"),
        (("-r", 2, "--spacing", 1, "--tolerance", 1), "not both"),
    ],
)
def test_bad_values(arguments: tuple[object, ...], text: str, notch: Path, tmp_path: Path) -> None:
    failed(cli("fillet", notch, *arguments, "-o", tmp_path / "out.stl"), tmp_path, text)


def test_bad_usage(notch: Path, tmp_path: Path) -> None:
    failed(cli("fillet", notch, "-o", tmp_path / "out.stl"), tmp_path, "--radius", code=2)
    failed(
        cli("fillet", notch, "-r", 1, "-o", tmp_path / "out.stl", "--engine", "x"), tmp_path, "not an engine", code=2
    )
    failed(cli("fillet", notch, "-r", "two", "-o", tmp_path / "out.stl"), tmp_path, "valid", code=2)
    failed(cli("fillet", notch, "-r", 1, "-o", tmp_path / "out.xyz"), tmp_path, ".xyz")
    failed(cli("fillet", notch, "-r", 1, "-o", tmp_path / "no" / "out.stl"), tmp_path, "no")


def test_memory_is_limited(notch: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.stl"
    refused = cli("--memory", 0.002, "fillet", notch, "-r", 2, "-o", out, "--spacing", 0.1)
    failed(refused, tmp_path, "but 0.002 GiB may be used; use a spacing of")
    fits = float(refused.stderr.split("use a spacing of ")[1].split()[0])
    assert 0.1 < fits < 20
    failed(cli("--memory", -1, "fillet", notch, "-r", 2, "-o", out), tmp_path, "--memory", code=2)


def test_too_thin_is_an_error(tmp_path: Path) -> None:
    ci.save(shapes.as_mesh(shapes.box([0, 0, 0], [30, 30, 3])), tmp_path / "plate.stl")
    failed(cli("round", tmp_path / "plate.stl", "-r", 2, "-o", tmp_path / "out.stl"), tmp_path, "mm")


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise on Windows")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("after", [2.0, 4.0])
def test_interrupt_leaves_nothing(number: signal.Signals, after: float, notch: Path, tmp_path: Path) -> None:
    """At any time, also while modules are imported and kernels loaded."""
    command = [sys.executable, "-m", "cad_implicit", "smooth", str(notch), "-r", "4", "-o", str(tmp_path / "out.stl")]
    with subprocess.Popen([*command, "--spacing", "0.08"], stderr=subprocess.PIPE, text=True) as process:
        time.sleep(after)
        process.send_signal(number)
        _, stderr = process.communicate(timeout=120)
    assert process.returncode == 130, stderr
    assert "cancelled" in stderr
    assert list(tmp_path.iterdir()) == []
