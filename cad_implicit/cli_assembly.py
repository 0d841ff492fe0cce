"""Assemblies on the command line: a STEP file of several parts, worked on part by part and written as one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer

from .assembly_job import run_assembly
from .cad import Assembly, open_assembly
from .cad.files import STEP_EXTENSIONS
from .cli_work import show, told
from .parallel import Progress


def assembly_for(part: Path, output: Path, progress: Progress) -> Assembly | None:
    """Assembly in a file, if there is one and the output can hold one."""
    both = {part.suffix.lower(), output.suffix.lower()} <= set(STEP_EXTENSIONS)
    return open_assembly(part, progress=progress) if both else None


def work_parts(
    assembly: Assembly,
    operation: str,
    amount: float | None,
    part: Path,
    output: Path,
    *,
    quiet: bool,
    json: bool,
    **options: Any,
) -> None:
    """Run one operation on all parts, write the assembly, and say what was done."""
    warnings: list[str] = []
    with told(warnings):
        outcomes = run_assembly(assembly, operation, amount, output, **options)
    figures = []
    for own, uses, outcome in zip(assembly.parts, assembly.uses, outcomes, strict=True):
        more = {} if outcome is None else outcome.as_dict()
        figures.append({**more, "input": own.name, "uses": uses, "changed": outcome is not None})
    if json:
        whole = {"output": str(output), "operation": operation, "parts": figures, "input": str(part)}
        show({**whole, "warnings": warnings}, json)
    elif not quiet:
        for row in figures:
            change = f"volume {row['volume_before']:.6g} -> {row['volume_after']:.6g} mm³" if row["changed"] else "kept"
            typer.echo(f"{row['input']} ({row['uses']}x): {change}")
            for warning in row.get("warnings", []):
                typer.echo(f"warning: {row['input']}: {warning}", err=True)
        typer.echo(f"{output}: {operation} of {sum(row['changed'] for row in figures)} parts")
