"""Awkward input: each gets what the table in the documentation says, and nothing worse."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from cad_implicit.cli import app

hostile = pytest.importorskip("validation.hostile.__main__", reason="parts of CadQuery")
pytest.importorskip("cadquery")

#: Takes 20 s: left to `python -m validation.hostile`.
_LONG = ("two million triangles (STL)",)


def in_this_process(arguments: list[str]) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, arguments)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.stdout, done.stderr


@pytest.mark.parametrize("case", [c for c in hostile.cases() if c.key not in _LONG], ids=lambda case: case.key)
def test_fate(case: object, tmp_path: Path) -> None:
    found = hostile.fate(case, tmp_path, in_this_process)
    assert found.what == hostile.rows()[case.key].what, found.said  # type: ignore[attr-defined]


def test_the_table_is_whole() -> None:
    assert sorted(hostile.rows()) == sorted(case.key for case in hostile.cases())
