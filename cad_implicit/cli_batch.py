"""The command ``batch``: one line for each part, and a count."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from .cli_progress import progress_bar
from .cli_work import errors, show


def work_on_all(
    parts: list[Path], operation: str, amount: float | None, folder: Path, suffix: str, *, quiet: bool, json: bool,
    workers: int | None, scheduler: str | None, **options: Any,
) -> None:  # fmt: skip
    """Work on all parts and tell what happened to each; exit with 1 if one of them failed."""
    with errors(), progress_bar(quiet or json) as progress:
        from .batch import items, run_batch
        from .cad import OUTPUT_EXTENSIONS, check_suffix

        suffix = suffix if suffix.startswith(".") else f".{suffix}"
        check_suffix(f"x{suffix}", OUTPUT_EXTENSIONS)
        chosen = items(parts, folder, suffix)
        rows = []
        where: dict[str, Any] = {"workers": workers, "scheduler": scheduler}
        for row in run_batch(chosen, folder, operation, amount, **where, progress=progress, **options):
            rows.append(row)
            if not (quiet or json):
                typer.echo(_line(row))
    counts = {fate: sum(row["fate"] == fate for row in rows) for fate in ("done", "failed", "killed")}
    resumed = sum(bool(row.get("resumed")) for row in rows)
    if json:
        show({"output": str(folder), **counts, "resumed": resumed, "parts": rows}, json)
    elif not quiet:
        again = f" ({resumed} of them before)" if resumed else ""
        typer.echo(f"{len(rows)} parts: {counts['done']} done{again}, {counts['failed'] + counts['killed']} failed")
    if counts["failed"] or counts["killed"]:
        raise typer.Exit(1)


def _line(row: dict[str, Any]) -> str:
    if row["fate"] != "done":
        return f"{row['input']}: {row['fate']}: {row['message']}"
    again = ", done before" if row.get("resumed") else ""
    seconds = sum(row["seconds"].values())
    return (
        f"{row['output']}: {row['triangles']} triangles, volume {row['volume_before']:.6g} -> "
        f"{row['volume_after']:.6g} mm³, {seconds:.1f} s{again}"
    )
