"""The command line ``cad-implicit``. Holds no mathematics; heavy imports happen inside the commands."""

from __future__ import annotations

import json as jsonlib
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from .job import Outcome
    from .parallel import Progress

app = typer.Typer(
    name="cad-implicit",
    help="Fillet, round, smooth and offset CAD parts (STEP, BREP) and meshes (STL, 3MF, OBJ, PLY). Lengths in mm.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Input = Annotated[Path, typer.Argument(metavar="IN", help="Part: .step .stp .brep .stl .3mf .obj .ply")]
Output = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="OUT", help="Result: .stl .3mf .obj .ply .step .brep, or a field .npz .vti .nrrd"
    ),
]
Radius = Annotated[float, typer.Option("--radius", "-r", metavar="R", help="Radius of the ball in mm.")]
Spacing = Annotated[
    float | None,
    typer.Option("--spacing", metavar="H", help="Grid spacing in mm (default: min(r/6, diagonal/100))."),
]
Tolerance = Annotated[
    float | None,
    typer.Option("--tolerance", metavar="T", help="Largest accepted error in mm; the spacing follows from it."),
]
Engine = Annotated[
    str,
    typer.Option(
        "--engine", metavar="exact|reinit", help="exact (default); reinit: the paper's re-distancing on a regular grid."
    ),
]
Simplify = Annotated[
    float | None,
    typer.Option("--simplify", metavar="T", help="Merge triangles of the result within T mm (flat regions above all)."),
]
Threads = Annotated[int | None, typer.Option("--threads", min=1, metavar="N", help="Default: all cores.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
Force = Annotated[bool, typer.Option("--force", help="Go past refusals (lost pieces, size, leaks), never past memory.")]


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
    with _errors(), _progress(quiet or json) as progress:
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
) -> None:
    """Run one operation, write the result, and say what was done."""
    if engine not in ("exact", "reinit"):
        raise typer.BadParameter(f"{engine!r} is not an engine; there are exact and reinit", param_hint="--engine")
    with _errors(), _progress(quiet or json) as progress:
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


@contextmanager
def _progress(silent: bool) -> Iterator[Progress]:
    """Progress bar on a terminal; nothing in a pipe. Says once when kernels are being compiled. Ctrl-C cancels."""
    with _interruptible() as check:
        if silent:
            yield check
            return
        with _compile_notice():
            if not sys.stderr.isatty():
                yield check
                return
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

            columns = (TextColumn("{task.description:12}"), BarColumn(), TimeElapsedColumn())
            with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
                task = bar.add_task("start", total=1.0)

                def show(stage: str, fraction: float) -> None:
                    check(stage, fraction)
                    bar.update(task, description=stage, completed=fraction)

                yield show


@contextmanager
def _interruptible() -> Iterator[Progress]:
    """Give a progress callback that raises KeyboardInterrupt after Ctrl-C or SIGTERM.

    The signal itself raises too, but where it falls into a destructor Python only reports it and goes on, and where it
    falls into a compiled module another error may come of it.
    """
    told = False

    def stop(number: int, frame: object) -> None:
        nonlocal told
        told = True
        raise KeyboardInterrupt

    def check(stage: str, fraction: float) -> None:
        if told:
            raise KeyboardInterrupt

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield check
    except Exception:
        if told:
            raise KeyboardInterrupt from None
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _compile_notice() -> Iterator[None]:
    """Say so, once, when a kernel is compiled for the first time on this machine."""
    from numba.core import event

    class Notice(event.Listener):  # type: ignore[misc]
        said = False

        def on_start(self, event: object) -> None:
            if not self.said:
                typer.echo("compiling kernels, once per machine (about a minute) …", err=True)
            self.said = True

        def on_end(self, event: object) -> None:
            pass

    with event.install_listener("numba:compile", Notice()):
        yield


if __name__ == "__main__":
    main()
