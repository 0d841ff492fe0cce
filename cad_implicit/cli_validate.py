"""The command ``validate``: a report for each part, one table for all."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import typer

from .cli_progress import progress_bar
from .cli_work import errors, show


def validate_parts(parts: list[Path], radius: float, output: Path, *, quiet: bool, json: bool, **options: Any) -> None:
    """Validate parts and write their reports; exit with 1 if one of them does not pass."""
    with errors():
        from .errors import CadImplicitError
        from .report.validation import limit_of, validate
        from .report.writing import markdown, write_report

        limit_of(options.get("max_error"))
        results, unread = [], []
        with as_file(files("cad_implicit") / "data" / "bracket.step") as bracket:
            chosen = parts or [bracket]
            for number, part in enumerate(chosen):
                folder = output if len(chosen) == 1 else output / f"{number + 1:03d}-{part.stem}"
                try:
                    with progress_bar(quiet or json) as progress:
                        result = validate(part, radius, progress=progress, **options)
                except CadImplicitError as error:
                    unread.append(f"{part}: {error}")
                    continue
                results.append(result)
                write_report(result, folder)
                if not (quiet or json):
                    _tell(result, folder)
        if len(chosen) > 1 and results:
            (output / "report.md").write_text(markdown(results), encoding="utf-8")
    if json:
        show({"output": str(output), "reports": [r.as_dict() for r in results], "unread": unread}, json)
    for line in unread:
        typer.echo(f"error: {line}", err=True)
    if unread or not all(result.passed for result in results):
        raise typer.Exit(1)


def _tell(result: Any, folder: Path) -> None:
    figures = ""
    if result.outcome is not None:
        s = result.regions["all"]
        figures = f", error max {s.max:.3g} mm, RMS {s.rms:.2g} mm against the {result.measured.against}"
    verdict = "passed" if result.passed else "FAILED: " + "; ".join(result.faults)
    typer.echo(f"{folder / 'report.html'}: {result.part}, exact kernel {result.kernel['fate']}{figures}: {verdict}")
