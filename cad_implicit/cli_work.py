"""What the commands of the command line share: run one operation, show figures, turn errors into one line."""

from __future__ import annotations

import json as jsonlib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from .cli_progress import progress_bar

if TYPE_CHECKING:
    from .cad.solids import SolidPart
    from .outcome import Outcome

#: Exit code after Ctrl-C or SIGTERM.
CANCELLED = 130


def work(
    operation: str,
    part: Path,
    amount: float | None,
    output: Path,
    spacing: float | None,
    tolerance: float | None,
    engine: str,
    simplify: float | None,
    threads: int | None,
    quiet: bool,
    json: bool,
    force: bool,
    **options: Any,
) -> None:
    """Run one operation, write the result, and say what was done."""
    if engine not in ("exact", "reinit"):
        raise typer.BadParameter(f"{engine!r} is not an engine; there are exact and reinit", param_hint="--engine")
    with errors(), progress_bar(quiet or json) as progress:
        from .cad import check_output, save
        from .cad.solids import SolidPart
        from .cli_assembly import assembly_for, work_parts
        from .job import run

        check_output(output)
        given: dict[str, Any] = {"spacing": spacing, "tolerance": tolerance, "engine": engine, "simplify": simplify}
        given |= {"force": force, "threads": threads, "progress": progress, **options}
        assembly = assembly_for(part, output, progress)
        if assembly is not None:
            work_parts(assembly, operation, amount, part, output, quiet=quiet, json=json, **given)
            return
        outcome = run(part, operation, amount, **given)
        late: list[str] = []
        with told(late):
            result = outcome.result_for(output.suffix, progress)
            progress("write", 0.0)
            save(result, output)
        progress("write", 1.0)
    solid = result if isinstance(result, SolidPart) else None
    if json:
        figures: dict[str, Any] = {} if solid is None else {"solid": solid.as_dict()}
        figures = {"output": str(output), **outcome.as_dict(), **figures, "input": str(part)}
        show({**figures, "warnings": [*outcome.warnings, *late]}, json)
    elif not quiet:
        _summary(outcome, output, solid)


@contextmanager
def told(texts: list[str]) -> Iterator[None]:
    """Say at once on standard error what the library warns of, and keep it."""
    from .errors import GeometryWarning

    with warnings.catch_warnings():
        usual = warnings.showwarning

        def tell(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
            if issubclass(category, GeometryWarning):
                typer.echo(f"warning: {message}", err=True)
                texts.append(str(message))
            else:
                usual(message, category, *where, **more)

        warnings.simplefilter("always", GeometryWarning)
        warnings.showwarning = tell
        yield


def _summary(outcome: Outcome, output: Path, solid: SolidPart | None) -> None:
    before, after = outcome.before, outcome.mesh
    change = after.volume - before.volume
    bound = outcome.error_bound
    error = "error not known" if bound is None else f"error at most about {bound:.3g} mm"
    typer.echo(
        f"{output}: {outcome.operation} {_amount(outcome)}, spacing {outcome.spacing:.4g} mm, "
        f"{len(after.faces)} triangles, {'closed' if after.is_watertight else 'NOT CLOSED'}, "
        f"volume {before.volume:.6g} -> {after.volume:.6g} mm³ ({change:+.4g}), {error}, "
        f"{sum(outcome.seconds.values()):.2f} s"
    )
    if solid is not None:
        kind = "on the part's surfaces and those of blends" if not solid.facets else "plane facets"
        typer.echo(f"solid of {solid.faces} faces, {kind}")
    for warning in outcome.warnings:
        typer.echo(f"warning: {warning}", err=True)


def _amount(outcome: Outcome) -> str:
    """Say how much: a length, and of chosen edges how many."""
    options = outcome.options
    if "edges" not in options:
        return f"{outcome.amount:g} mm"
    radii = options.get("radii") or {"": outcome.amount, " ": options["second"]}
    lengths = [length for own in radii.values() for length in (own if isinstance(own, list) else [own])]
    low, high = min(lengths), max(lengths)
    count = len(options["edges"])
    return f"{count} edge{'s' if count > 1 else ''}, {low:g}{f' to {high:g}' if high > low else ''} mm"


def show(figures: dict[str, Any], json: bool) -> None:
    """Print figures as one JSON object, or a line each."""
    if json:
        typer.echo(jsonlib.dumps(figures, indent=2, ensure_ascii=False))
        return
    width = max(map(len, figures))
    for key, value in figures.items():
        shown = f"{value:.6g}" if isinstance(value, float) else value
        typer.echo(f"{key.replace('_', ' '):{width}}  {shown}")


@contextmanager
def errors() -> Iterator[None]:
    """Turn the package's errors into one line on standard error and exit code 1."""
    from .errors import CadImplicitError

    try:
        yield
    except CadImplicitError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(1) from None
    except MemoryError as error:
        typer.echo(f"error: not enough memory ({error}); use a larger --spacing", err=True)
        raise typer.Exit(1) from None
    except OSError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        typer.echo("cancelled: nothing was written", err=True)
        raise typer.Exit(CANCELLED) from None
