"""The examples of the README run, on the bracket that comes with the package."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

import cad_implicit

README = Path(cad_implicit.__file__).parent.parent / "README.md"
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


def test_python(folder: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "README.md", "exec"), names)
    assert len(blocks) >= 3
    assert cad_implicit.to_mesh(folder / "part.stl").is_watertight


@pytest.mark.parametrize("line", commands())
def test_command_line(line: str, folder: Path) -> None:
    arguments = shlex.split(line)[1:]
    done = subprocess.run(
        [sys.executable, "-m", "cad_implicit", *arguments], capture_output=True, text=True, cwd=folder, check=False
    )
    assert done.returncode == 0, done.stderr
    if "-o" in arguments:
        assert cad_implicit.to_mesh(folder / arguments[arguments.index("-o") + 1]).is_watertight
    else:
        assert done.stdout
