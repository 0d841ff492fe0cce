"""The demonstration: fillet the bracket that comes with the package, picture it, measure it."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

from cad_implicit.cad import open_part, save, to_mesh
from cad_implicit.cad.edges import part_edges, selected
from cad_implicit.cad.exact_blends import exact_blend
from cad_implicit.comparison import compare
from cad_implicit.errors import CadImplicitError
from cad_implicit.job import run
from cad_implicit.outcome import Outcome
from cad_implicit.parallel import Progress
from cad_implicit.pictures import render

#: Nodes along the longest side of the demonstration's grid.
_RESOLUTION = 128


def run_demo(folder: Path, radius: float, progress: Progress) -> dict[str, Any]:
    """Fillet the bracket, write STL, 3MF and a picture into ``folder``, and compare with the exact B-rep fillet.

    Returns
    -------
    dict
        What was done and how far the result is from the exact one, lengths in mm.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with as_file(files("cad_implicit") / "data" / "bracket.step") as path:
        part = open_part(path)
    low, high = part.bounds
    spacing = float((high - low).max()) / _RESOLUTION
    outcome = run(part, "fillet", radius, spacing=spacing, progress=progress)
    written = [folder / "bracket_fillet.stl", folder / "bracket_fillet.3mf"]
    for target in written:
        save(outcome.mesh, target)
    report: dict[str, Any] = {"written": ", ".join(map(str, written)), **outcome.as_dict()}
    report["seconds"] = {stage: round(seconds, 3) for stage, seconds in outcome.seconds.items()}
    report |= _picture(outcome, folder / "bracket.png", progress)
    return report | _accuracy(part, radius, outcome, progress)


def _picture(outcome: Outcome, path: Path, progress: Progress) -> dict[str, Any]:
    progress("picture", 0.0)
    try:
        render([outcome.before, outcome.mesh], ["before", f"filleted, r = {outcome.amount:g} mm"], path)
    except CadImplicitError as error:
        return {"picture": f"none: {error}"}
    progress("picture", 1.0)
    return {"picture": str(path)}


def _accuracy(part: Any, radius: float, outcome: Outcome, progress: Progress) -> dict[str, Any]:
    """Distance to the exact kernel's fillet of all concave edges, if the kernel manages it."""
    progress("exact fillet", 0.0)
    edges = selected(part_edges(part), "concave")
    exact = exact_blend(part.shape, {edge.number: radius for edge in edges})
    if exact.shape is None:
        return {"exact_fillet": f"{exact.status}: {exact.message}"}
    truth = to_mesh(exact.shape, tolerance=outcome.spacing / 100)
    progress("compare", 0.0)
    distance = compare(outcome.mesh, truth)
    progress("compare", 1.0)
    return {
        "exact_fillet": f"ok, {len(edges)} concave edges",
        "volume_exact": truth.volume,
        "distance_max": distance.maximum,
        "distance_p99": distance.p99,
        "distance_rms": distance.rms,
        "distance_max_in_spacings": distance.maximum / outcome.spacing,
        "distance_rms_in_spacings": distance.rms / outcome.spacing,
        "largest_at": "({:.1f}, {:.1f}, {:.1f})".format(*distance.place),
        "why": "where an edge ends in the open the ball rolls off its end, and the B-rep fillet goes on",
    }
