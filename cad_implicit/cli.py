"""The command line ``cad-implicit``. Holds no mathematics; heavy imports happen inside the commands."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from .cli_options import (
    Both,
    Cell,
    Chosen,
    EdgeRadius,
    Edges,
    Engine,
    Force,
    Input,
    Json,
    Length,
    Length2,
    Memory,
    NoRadius,
    NoTangent,
    Open,
    Output,
    Outward,
    Quiet,
    Radius,
    Simplify,
    Spacing,
    Thickness,
    Threads,
    ToChamfer,
    Tolerance,
    Wall,
)
from .cli_progress import progress_bar
from .cli_selection import selection
from .cli_work import CANCELLED, errors, show, work

app = typer.Typer(
    name="cad-implicit",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def limits(memory: Memory = None) -> None:
    """Fillet, round, smooth and offset CAD parts (STEP, BREP) and meshes (STL, 3MF, OBJ, PLY). Lengths in mm."""
    if memory is not None:
        if not memory > 0:
            raise typer.BadParameter(f"{memory:g} GiB is no memory", param_hint="--memory")
        from .sizing import limit_memory

        limit_memory(memory * 2**30)


@app.command()
def fillet(
    part: Input,
    output: Output,
    radius: Radius = None,
    edges: Chosen = None,
    edge_radius: EdgeRadius = None,
    no_tangent: NoTangent = False,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Fillet all concave edges: the ball of radius R rolls along the outside. With --edges: those, of either kind."""
    chosen = selection(radius, edges, edge_radius, no_tangent, engine)
    work("fillet", part, radius, output, spacing, tolerance, engine, simplify, threads, quiet, json, force, **chosen)


@app.command("round")
def round_(
    part: Input,
    output: Output,
    radius: Radius = None,
    edges: Chosen = None,
    edge_radius: EdgeRadius = None,
    no_tangent: NoTangent = False,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Round all convex edges: what a ball of radius R cannot reach from inside is removed. With --edges: those."""
    chosen = selection(radius, edges, edge_radius, no_tangent, engine)
    work("round", part, radius, output, spacing, tolerance, engine, simplify, threads, quiet, json, force, **chosen)


@app.command()
def smooth(
    part: Input,
    output: Output,
    radius: Radius = None,
    edges: Chosen = None,
    edge_radius: EdgeRadius = None,
    no_tangent: NoTangent = False,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Round all convex and fillet all concave edges. With --edges: those."""
    chosen = selection(radius, edges, edge_radius, no_tangent, engine)
    work("smooth", part, radius, output, spacing, tolerance, engine, simplify, threads, quiet, json, force, **chosen)


@app.command()
def chamfer(
    part: Input,
    length: Length,
    edges: ToChamfer,
    output: Output,
    length2: Length2 = None,
    no_tangent: NoTangent = False,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    simplify: Simplify = None,
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Chamfer chosen edges."""
    work(
        "chamfer", part, length, output, spacing, tolerance, "exact", simplify, threads, quiet, json, force,
        edges=edges, second=length2, tangent=not no_tangent,
    )  # fmt: skip


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
    work("offset", part, distance, output, spacing, tolerance, engine, simplify, threads, quiet, json, force)


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
    work(
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
    work("infill", part, wall, output, spacing, tolerance, engine, simplify, threads, quiet, json, force, cell=cell)


@app.command()
def info(part: Input, json: Json = False) -> None:
    """Tell what a part is: size, volume, pieces, holes, whether it is closed."""
    with errors():
        from .cad import to_mesh

        mesh = to_mesh(part)
        low, high = mesh.bounds
        show(
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
def edges(part: Input, selector: Edges = "all", no_radius: NoRadius = False, json: Json = False) -> None:
    """List edges to choose from: number, length, convexity, angle, largest radius, curve, faces, tangent chain."""
    with errors(), progress_bar(json) as progress:
        from .cad import open_part
        from .cad.edges import part_edges, selected
        from .report.edge_table import edge_figures, edge_table

        opened = open_part(part)
        found = selected(part_edges(opened), selector)
        radii = None
        if not no_radius:
            from .local_ops import largest_radii

            radii = largest_radii(opened, found, progress=progress)
    if json:
        show({"input": str(part), "selector": selector, "edges": edge_figures(found, radii)}, json)
    else:
        typer.echo(edge_table(found, radii))


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(metavar="A")],
    second: Annotated[Path, typer.Argument(metavar="B")],
    threads: Threads = None,
    json: Json = False,
) -> None:
    """Measure the two-sided distance and the difference of volume between two parts or meshes."""
    with errors():
        from .cad import to_mesh
        from .comparison import compare as measure

        result = measure(to_mesh(first), to_mesh(second), threads=threads)
        show({"a": str(first), "b": str(second), **result.as_dict()}, json)


@app.command()
def validate(
    radius: Annotated[float, typer.Option("--radius", "-r", metavar="R", help="Radius of the ball in mm.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the reports.")],
    parts: Annotated[list[Path] | None, typer.Argument(metavar="[IN]...", help="Parts; by default a bracket.")] = None,
    operation: Annotated[
        str, typer.Option("--operation", metavar="NAME", help="fillet (default), round or smooth.")
    ] = "fillet",
    edges: Chosen = None,
    max_error: Annotated[
        str | None,
        typer.Option(metavar="E", help="Exit with 1 above it: mm, 0.02h (spacings) or 1% (of R); default: the bound."),
    ] = None,
    convergence: Annotated[bool, typer.Option("--convergence", help="Measure at 4h, 2h and h/2, too.")] = False,
    time_limit: Annotated[float, typer.Option(metavar="S", help="Seconds for the exact kernel.")] = 120.0,
    spacing: Spacing = None,
    engine: Engine = "exact",
    threads: Threads = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Report how far a fillet is from the exact kernel's, or from the rolling ball where that one fails."""
    from .cli_validate import validate_parts

    if operation not in ("fillet", "round", "smooth"):
        raise typer.BadParameter(f"{operation!r} is none of fillet, round, smooth", param_hint="--operation")
    validate_parts(
        parts or [], radius, output, quiet=quiet, json=json, operation=operation, edges=edges, max_error=max_error,
        convergence=convergence, time_limit=time_limit, spacing=spacing, engine=engine, threads=threads,
    )  # fmt: skip


@app.command()
def batch(
    parts: Annotated[list[Path], typer.Argument(metavar="IN...", help="Parts, and folders of parts.")],
    operation: Annotated[str, typer.Option("--op", metavar="NAME", help="fillet, round, smooth, offset, shell …")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the results.")],
    radius: Radius = None,
    distance: Annotated[
        float | None, typer.Option("--distance", "-d", "--thickness", "-t", "--length", "-l", help="Instead of -r.")
    ] = None,
    edges: Chosen = None,
    suffix: Annotated[str, typer.Option(metavar="S", help="Kind of the results.")] = ".stl",
    workers: Annotated[int | None, typer.Option(min=1, metavar="N", help="Processes; default: all cores.")] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://…", help="Scheduler of a dask cluster to work on, whose workers see the same files."
        ),
    ] = None,
    spacing: Spacing = None,
    tolerance: Tolerance = None,
    engine: Engine = "exact",
    quiet: Quiet = False,
    json: Json = False,
    force: Force = False,
) -> None:
    """Work on many parts; what is done is not done again after an interruption, and one bad part stops no other."""
    from .cli_batch import work_on_all

    if operation not in ("fillet", "round", "smooth", "chamfer", "offset", "shell"):
        raise typer.BadParameter(f"{operation!r} is no operation for many parts", param_hint="--op")
    if (radius is None) == (distance is None):
        raise typer.BadParameter("give a radius, or a distance, thickness or length", param_hint="-r")
    work_on_all(
        parts, operation, distance if radius is None else radius, output, suffix, quiet=quiet, json=json,
        workers=workers, scheduler=scheduler, edges=edges, spacing=spacing, tolerance=tolerance, engine=engine,
        force=force,
    )  # fmt: skip


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
    with errors(), progress_bar(quiet or json) as progress:
        from .report.demo import run_demo

        report = run_demo(output, radius, progress)
    if not quiet or json:
        show(report, json)


def main() -> None:
    """Entry point: run the command line; exit 1 with one line on any error that the package foresees."""
    try:
        app()
    except SystemExit as end:
        if end.code == CANCELLED:
            # Where the interrupt fell into an exec(), as of a module being imported, Python would end by SIGINT all the
            # same.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(CANCELLED)
        raise


if __name__ == "__main__":
    main()
