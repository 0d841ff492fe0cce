"""Arguments and options that the commands of the command line share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Input = Annotated[Path, typer.Argument(metavar="IN", help="Part: .step .stp .brep .stl .3mf .obj .ply")]
Output = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="OUT", help="Result: .stl .3mf .obj .ply .step .brep, or a field .npz .vti .nrrd"
    ),
]
Radius = Annotated[
    float | None,
    typer.Option(
        "--radius", "-r", metavar="R", help="Radius of the ball in mm; not needed if --edge-radius tells all."
    ),
]
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
Memory = Annotated[
    float | None,
    typer.Option("--memory", metavar="GIB", help="GiB that may be used at most (default: 60 % of what is free)."),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
Force = Annotated[bool, typer.Option("--force", help="Go past refusals (lost pieces, size, leaks), never past memory.")]
Thickness = Annotated[float, typer.Option("--thickness", "-t", metavar="T", help="Thickness of the wall in mm.")]
Outward = Annotated[bool, typer.Option("--outward", help="The wall lies around the part.")]
Both = Annotated[bool, typer.Option("--both", help="The wall lies half within the part, half around it.")]
Open = Annotated[
    str | None,
    typer.Option(
        "--open", metavar="SELECTOR", help='Faces of a STEP or BREP part that get no wall: ">Z", "<X or |Y", "3,5" …'
    ),
]
Edges = Annotated[
    str,
    typer.Option("--edges", metavar="SELECTOR", help='Edges: all, concave, convex, "|Z", ">Z", "%circle", "3,5,7" …'),
]
_SELECTOR = 'all, concave, convex, "|Z", ">Z", "%circle", "3,5,7" …'
Chosen = Annotated[
    str | None,
    typer.Option(
        "--edges",
        metavar="SELECTOR",
        help=f"Edges to work on, as in CAD, each by its kind: {_SELECTOR} Without it the whole part is worked on.",
    ),
]
ToChamfer = Annotated[str, typer.Option("--edges", metavar="SELECTOR", help=f"Edges to chamfer: {_SELECTOR}")]
EdgeRadius = Annotated[
    list[str] | None,
    typer.Option(
        "--edge-radius",
        metavar="SELECTOR=R",
        help="Radius of some edges in mm, or R0:R1 from the start to the end of each; may repeat, the last one counts.",
    ),
]
NoTangent = Annotated[
    bool, typer.Option("--no-tangent", help="Leave out edges that go on smoothly from the chosen ones.")
]
NoRadius = Annotated[bool, typer.Option("--no-radius", help="Do not look for the largest radius of each edge.")]
Length = Annotated[float, typer.Option("--length", "-l", metavar="L", help="Length of the chamfer on a face in mm.")]
Length2 = Annotated[
    float | None,
    typer.Option("--length2", metavar="L2", help="Its length on the second face, listed by the command edges."),
]
Cell = Annotated[float, typer.Option("--cell", metavar="C", help="Period of the lattice, a gyroid, in mm.")]
Wall = Annotated[float, typer.Option("--wall", metavar="W", help="Thickness of its walls and of the skin in mm.")]
