"""Every awkward input and what it gets: ``python -m validation.hostile [NAME] [--write]``.

Each is filleted by the command line in a process of its own, with a limit in time. Exits with 1 if one hangs, crashes,
or leaves a file behind though it was refused. With ``--write`` the table ``table.md`` is written anew.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

TABLE = Path(__file__).with_name("table.md")

#: Seconds that one input may take.
_LIMIT = 300

_RADIUS = 1.3


@dataclass(frozen=True)
class Case:
    """An input: what it is, the suffix of its file, and what writes it."""

    name: str
    suffix: str
    write: Callable[[Path], None]

    @property
    def key(self) -> str:
        """Name for the table."""
        return f"{self.name} ({self.suffix[1:].upper()})"


def cases() -> list[Case]:
    """All inputs."""
    from . import breps, meshes

    return [Case(*one) for one in (*meshes.files(), *breps.files())]


@dataclass(frozen=True)
class Fate:
    """What became of an input: "works", "works, told", "refused", or a fault; and what was said."""

    what: str
    said: str


#: Runs the command line: exit code, standard output, standard error.
Run = Callable[[list[str]], tuple[int, str, str]]


def in_a_process(arguments: list[str]) -> tuple[int, str, str]:
    """Run the command line in a process of its own."""
    command = [sys.executable, "-m", "cad_implicit", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT, check=False)
    return done.returncode, done.stdout, done.stderr


def fate(case: Case, folder: Path, run: Run = in_a_process) -> Fate:
    """Write an input into a folder, fillet it by the command line, and see what comes of it."""
    part, result = folder / f"part{case.suffix}", folder / "result.stl"
    case.write(part)
    try:
        code, out, err = run(["fillet", str(part), "-r", str(_RADIUS), "-o", str(result), "--json"])
    except subprocess.TimeoutExpired:
        return Fate(f"HANGS: no answer within {_LIMIT} s", "")
    left = sorted(path.name for path in folder.iterdir() if path != part)
    if code == 1:
        lines = [line for line in err.strip().splitlines() if line]
        said = lines[-1].replace(f"{folder}/", "") if lines else ""
        if not said.startswith("error: ") or "Traceback" in err:
            return Fate("FAULT: no clear error", said)
        return Fate("FAULT: files left" if left else "refused", said.removeprefix("error: "))
    if code:
        return Fate(f"CRASH: exit code {code}", err[-200:])
    figures = json.loads(out)
    if not figures["watertight"] or left != ["result.stl"]:
        return Fate("FAULT: an open result, or none", "")
    if "Warning" in err:
        return Fate("FAULT: a stray warning", err[-200:])
    return Fate("works, told" if figures["warnings"] else "works", "; ".join(figures["warnings"]))


def rows() -> dict[str, Fate]:
    """Give the table as it stands."""
    found = {}
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)]
        if len(cells) == 5 and cells[2] in ("works", "works, told", "refused"):
            found[cells[1]] = Fate(cells[2], cells[3])
    return found


def main() -> int:
    """Run all, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="?", default="", help="only inputs whose name contains this")
    parser.add_argument("--write", action="store_true", help="write table.md anew")
    options = parser.parse_args()
    found = rows() if TABLE.exists() else {}
    bad = 0
    for case in cases():
        if options.name not in case.key:
            continue
        with TemporaryDirectory() as folder:
            found[case.key] = fate(case, Path(folder))
        bad += found[case.key].what.isupper() or ":" in found[case.key].what
        print(f"{case.key:55s} {found[case.key].what:12s} {found[case.key].said[:200]}", flush=True)
        if options.write:
            _write(found)
    return 1 if bad else 0


def _write(found: dict[str, Fate]) -> None:
    order = [case.key for case in cases()]
    lines = [f"| {key} | {found[key].what} | {_cell(found[key].said)} |" for key in order if key in found]
    head = (
        "# Awkward input, and what it gets\n\n"
        f"`cad-implicit fillet IN -r {_RADIUS} -o result.stl` on each, by `python -m validation.hostile --write`; "
        "checked by the tests.\nRefused means one clear line, exit code 1 and nothing written.\n\n"
        "| input | fate | what is said |\n| --- | --- | --- |\n"
    )
    TABLE.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


if __name__ == "__main__":
    sys.exit(main())
