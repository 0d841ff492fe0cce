"""The examples of the README run, on the bracket that comes with the package."""

from __future__ import annotations

import math
import re
import shlex
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

import cad_implicit

README = Path(cad_implicit.__file__).parent.parent / "README.md"
HOSTS = ("cadquery", "build123d")
BRACKET = files("cad_implicit") / "data" / "bracket.step"

pytestmark = [pytest.mark.host, pytest.mark.skipif(not README.exists(), reason="the README is not in the wheel")]


def commands() -> list[str]:
    """Lines of the README that call the command line on a part."""
    lines = README.read_text(encoding="utf-8").splitlines() if README.exists() else []
    return [line.split(" #")[0].strip() for line in lines if re.match(r"cad-implicit \w+ part\.step", line)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    pytest.importorskip("OCP")
    shutil.copy(str(BRACKET), tmp_path / "part.step")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def blocks(host: str = "") -> list[str]:
    """Examples in Python that need a host, or none."""
    found = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    return [text for text in found if (host in text if host else not any(name in text for name in HOSTS))]


def test_python(folder: Path) -> None:
    names: dict[str, object] = {}
    for block in blocks():
        exec(compile(block, "README.md", "exec"), names)
    assert len(blocks()) >= 3
    assert cad_implicit.to_mesh(folder / "part.stl").is_watertight


@pytest.mark.parametrize("host", HOSTS)
def test_hosts(host: str, folder: Path) -> None:
    pytest.importorskip(host)
    names: dict[str, Any] = {}
    for block in blocks(host):
        exec(compile(block, "README.md", "exec"), names)
    assert names["stadium"].implicit.engine == "implicit"
    holed = names["holed"].val() if host == "cadquery" else names["holed"]
    volume = holed.Volume() if host == "cadquery" else holed.volume
    assert volume == pytest.approx(10 * (50 * 30 + math.pi * (625 - 100)), rel=2e-4)
    assert cad_implicit.to_mesh(folder / "tray.step").is_watertight


@pytest.mark.parametrize("line", commands())
def test_command_line(line: str, folder: Path) -> None:
    arguments = shlex.split(line)[1:]
    if arguments[0] == "validate":
        pytest.importorskip("plotly", reason="reports need plotly")
    done = subprocess.run(
        [sys.executable, "-m", "cad_implicit", *arguments], capture_output=True, text=True, cwd=folder, check=False
    )
    assert done.returncode == 0, done.stderr
    if arguments[0] == "validate":
        assert (folder / "report" / "report.html").exists()
    elif "-o" in arguments:
        assert cad_implicit.to_mesh(folder / arguments[arguments.index("-o") + 1]).is_watertight
    else:
        assert done.stdout
