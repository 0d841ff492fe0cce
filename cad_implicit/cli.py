"""The command line ``cad-implicit``. Holds no mathematics; heavy imports happen inside the commands."""

from __future__ import annotations

import json as jsonlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .cli_options import (
    Both,
    Cell,
    Edges,
    Engine,
    Force,
    Input,
    Json,
    Open,
    Output,
    Outward,
    Quiet,
    Radius,
    Simplify,
    Spacing,
    Thickness,
    Threads,
    Tolerance,
    Wall,
)
from .cli_progress import progress_bar

if TYPE_CHECKING:
    from .job import Outcome

app = typer.Typer(
    name="cad-implicit",
    help="Fillet, round, smooth and offset CAD parts (STEP, BREP) and meshes (STL, 3MF, OBJ, PLY). Lengths in mm.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def fillet(
    part: Input,
    radius: Radius,
    output: Output,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Fillet all concave edges: the ball of radius R rolls along the outside."""
    _work("fillet", part, radius, output, spacing, tolerance, engine, simplify, threads, quiet, json, force)


@app.command("round")
def round_(
    part: Input,
    radius: Radius,
    output: Output,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Round all convex edges: what a ball of radius R cannot reach from inside is removed."""
    _work("round", part, radius, output, spacing, tolerance, engine, simplify, threads, quiet, json, force)


@app.command()
def smooth(
    part: Input,
    radius: Radius,
    output: Output,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Round all convex and fillet all concave edges."""
    _work("smooth", part, radius, output, spacing, tolerance, engine, simplify, threads, quiet, json, force)


@app.command()
def offset(
    part: Input,
    distance: Annotated[
        float, typer.Option("--distance", "-d", metavar="D", help="Offset in mm: positive grows, negative shrinks.")
    ],
    output: Output,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Move the whole surface outward or inward by a constant distance."""
    _work("offset", part, distance, output, spacing, tolerance, engine, simplify, threads, quiet, json, force)


@app.command()
def shell(
    part: Input,
    thickness: Thickness,
    output: Output,
    outward: Outward = False,
    both: Both = False,
    open_: Open = None,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Carve the part out to a wall of thickness T."""
    if outward and both:
        raise typer.BadParameter("the wall lies outward or on both sides, not both", param_hint="--outward, --both")
    if open_ is not None and (outward or both):
        raise typer.BadParameter("faces can be left open by walls that lie inward only", param_hint="--open")
    side = "outward" if outward else "both" if both else "inward"
    _work(
        "shell", part, thickness, output, spacing, tolerance, engine, simplify, threads, quiet, json, force,
        side=side, open=open_,
    )  # fmt: skip


@app.command()
def infill(
    part: Input,
    cell: Cell,
    wall: Wall,
    output: Output,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Carve the part out to a skin and fill it with a lattice."""
    _work("infill", part, wall, output, spacing, tolerance, engine, simplify, threads, quiet, json, force, cell=cell)


@app.command()
def info(part: Input, json: Json = False) -> None:
    """Tell what a part is: size, volume, pieces, holes, whether it is closed."""
    with _errors():
        from .cad import to_mesh

        mesh = to_mesh(part)
        low, high = mesh.bounds
        _show(
            {
                "input": str(part),
                **{key: value for key, value in mesh.source.items() if key != "name"},
                "triangles": len(mesh.faces),
                "faces": None if mesh.face_ids is None else int(mesh.face_ids.max()) + 1,
                "watertight": mesh.is_watertight,
                "open_edges": mesh.open_edges,
                "components": mesh.components,
                "through_holes": mesh.genus if mesh.is_watertight else None,
                "bounds": [low.tolist(), high.tolist()],
                "size": (high - low).tolist(),
                "volume": mesh.volume,
                "area": mesh.area,
            },
            json,
        )


@app.command()
def edges(part: Input, selector: Edges = "all", json: Json = False) -> None:
    """List edges to choose from: number, length, convexity, angle of the material, curve, faces, tangent chain."""
    with _errors():
        from .cad.edges import edges as edges_of
        from .report.edge_table import edge_figures, edge_table

        found = edges_of(part, selector)
    if json:
        _show({"input": str(part), "selector": selector, "edges": edge_figures(found)}, json)
    else:
        typer.echo(edge_table(found))


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(metavar="A")],
    second: Annotated[Path, typer.Argument(metavar="B")],
    threads: Threads = None,
    json: Json = False,
) -> None:
    """Measure the two-sided distance and the difference of volume between two parts or meshes."""
    with _errors():
        from .cad import to_mesh
        from .comparison import compare as measure

        result = measure(to_mesh(first), to_mesh(second), threads=threads)
        _show({"a": str(first), "b": str(second), **result.as_dict()}, json)


@app.command()
def demo(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the results.")] = Path(
        "demo"
    ),
    radius: Annotated[float, typer.Option("--radius", "-r", metavar="R", help="Fillet radius in mm.")] = 2.0,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Fillet the bracket that comes with the package, picture it, and compare it with the exact B-rep fillet."""
    with _errors(), progress_bar(quiet or json) as progress:
        from .report.demo import run_demo

        report = run_demo(output, radius, progress)
    if not quiet or json:
        _show(report, json)


def main() -> None:
    """Entry point: run the command line; exit 1 with one line on any error that the package foresees."""
    app()


def _work(
    operation: str,
    part: Path,
    amount: float,
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
    with _errors(), progress_bar(quiet or json) as progress:
        from .cad import FIELD_EXTENSIONS, check_output, save
        from .job import run

        check_output(output)
        outcome = run(
            part,
            operation,
            amount,
            spacing=spacing,
            tolerance=tolerance,
            engine=engine,  # type: ignore[arg-type]
            simplify=simplify,
            force=force,
            threads=threads,
            progress=progress,
            **options,
        )
        progress("write", 0.0)
        save(outcome.field() if output.suffix.lower() in FIELD_EXTENSIONS else outcome.mesh, output)
        progress("write", 1.0)
    if json:
        _show({"output": str(output), **outcome.as_dict(), "input": str(part)}, json)
    elif not quiet:
        _summary(outcome, output)


def _summary(outcome: Outcome, output: Path) -> None:
    before, after = outcome.before, outcome.mesh
    change = after.volume - before.volume
    bound = outcome.error_bound
    error = "error not known" if bound is None else f"error at most about {bound:.3g} mm"
    typer.echo(
        f"{output}: {outcome.operation} {outcome.amount:g} mm, spacing {outcome.spacing:.4g} mm, "
        f"{len(after.faces)} triangles, {'closed' if after.is_watertight else 'NOT CLOSED'}, "
        f"volume {before.volume:.6g} -> {after.volume:.6g} mm³ ({change:+.4g}), {error}, "
        f"{sum(outcome.seconds.values()):.2f} s"
    )
    for warning in outcome.warnings:
        typer.echo(f"warning: {warning}", err=True)


def _show(figures: dict[str, Any], json: bool) -> None:
    """Print figures as one JSON object, or a line each."""
    if json:
        typer.echo(jsonlib.dumps(figures, indent=2, ensure_ascii=False))
        return
    width = max(map(len, figures))
    for key, value in figures.items():
        shown = f"{value:.6g}" if isinstance(value, float) else value
        typer.echo(f"{key.replace('_', ' '):{width}}  {shown}")


@contextmanager
def _errors() -> Iterator[None]:
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
        raise typer.Exit(130) from None


if __name__ == "__main__":
    main()
