"""Operations of the workbench by the library, in the child process: a part in, an Answer as a dict out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import Part

from cad_implicit.cad import OpenPart, open_part
from cad_implicit.contouring import contour
from cad_implicit.distance import MeshDistance
from cad_implicit.errors import SelectorError
from cad_implicit.implicit import FloatArray
from cad_implicit.job import run as run_job
from cad_implicit.local_blend import LocalBlend
from cad_implicit.mesh import Mesh
from cad_implicit.open_faces import near_kept_faces
from cad_implicit.ops import fillet as fill
from cad_implicit.outcome import Outcome
from cad_implicit.parting import to_part
from cad_implicit.report.measuring import SIGNS, by_rolling_ball
from cad_implicit.sizing import TESSELLATION_PER_SPACING, choose_spacing, error_bound, limit_memory
from cad_implicit.solid_job import worked

from .estimates import draft_spacing, strip_area
from .numbers import edge_numbers, face_numbers

Progress = Callable[[str, float], None]

#: What engines are called in answers.
ENGINES = {"exact": "exact distance", "reinit": "regular grid"}

#: Options that the library's jobs take as they are.
_PASSED = ("spacing", "tolerance", "engine", "force", "threads", "tangent", "second", "side", "cell", "kind", "skin")


def done(
    part: OpenPart,
    shape: Any,
    operation: str,
    amount: float | None,
    edges: Mapping[int, float] | None,
    options: dict[str, Any],
    progress: Progress,
) -> dict[str, Any]:
    """Do one operation; arguments as in a Request, ``shape`` as it came (numbers of edges and faces are its)."""
    limit_memory(options.get("memory_limit"))
    if operation == "boolean":
        return _boolean(part, amount or 0.0, options, progress)
    if operation == "solid":
        return _faceted(part.mesh(), options, progress)
    what = {name: options[name] for name in _PASSED if name in options} | {"progress": progress}
    if operation != "chamfer":
        what.pop("second", None)
    if edges is None and operation == "chamfer":
        what["edges"] = "all"
    elif edges is None:
        what.pop("tangent", None)
    else:
        what.pop("engine", None)
        amount = _choose_edges(shape, part, operation, amount, edges, what)
    if options.get("open"):
        what["open"] = ",".join(str(n) for n in face_numbers(shape, part, options["open"]))
    if options.get("draft"):
        what.pop("tolerance", None)
        what["spacing"] = _draft(part, shape, amount, edges)
        return _meshed(run_job(part, operation, amount, **what), options)
    if options.get("result") == "mesh":
        return _meshed(run_job(part, operation, amount, **what), options)
    return _solid(part, operation, amount, what)


def _choose_edges(
    shape: Any, part: OpenPart, operation: str, amount: float | None, edges: Mapping[int, float], what: dict[str, Any]
) -> float | None:
    """Put edges into what the job takes; gives its amount."""
    own = edge_numbers(shape, part, edges)
    if operation == "chamfer":
        lengths = set(own.values())
        if len(lengths) > 1:
            raise SelectorError("chamfers have one length for all edges; make several features for several lengths")
        what["edges"] = sorted(own)
        return lengths.pop()
    what["edges"] = own
    return None


def _meshed(outcome: Outcome, options: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "brep": None,
        "vertices": outcome.mesh.vertices,
        "faces": outcome.mesh.faces,
        "error": errors(outcome) if options.get("error") else None,
        "error_bound": outcome.error_bound,
        "exact_share": 0.0,
        "engine": ENGINES[outcome.engine],
        "warnings": outcome.warnings,
        "spacing": outcome.spacing,
        "volume_before": outcome.before.volume,
        "volume_after": outcome.mesh.volume,
    }


def _solid(part: OpenPart, operation: str, amount: float | None, what: dict[str, Any]) -> dict[str, Any]:
    solid, provenance = worked(part, operation, amount, **what)
    shape = solid.wrapped
    return {
        "brep": shape.exportBrepToString(),
        "vertices": None,
        "faces": None,
        "error": None,
        "error_bound": provenance.error_bound,
        "exact_share": provenance.exact_share,
        "engine": ENGINES[what.get("engine", "exact")],
        "warnings": [provenance.facets] if provenance.facets else [],
        "spacing": provenance.spacing,
        "volume_before": _volume(part),
        "volume_after": shape.Volume,
    }


def errors(outcome: Outcome) -> FloatArray:
    """Errors (V,) in mm of the vertices of a result, positive where there is too much material; NaN where not known.

    Blends are checked by rolling balls. Offsets and shells by the distance to the part, of which one side is right by
    definition; what an infill builds within is not known.
    """
    part, mesh = MeshDistance(outcome.before), outcome.mesh
    amount = outcome.amount if isinstance(outcome.amount, float) else None
    if outcome.operation in ("fillet", "round", "smooth"):
        blend = outcome.shape if isinstance(outcome.shape, LocalBlend) else None
        sign = SIGNS[outcome.operation]
        return by_rolling_ball(mesh, part, blend, amount or 1.0, outcome.spacing, sign).at_vertices
    value = part(mesh.vertices)
    if outcome.operation == "offset" and amount is not None:
        return -amount - value
    if outcome.operation == "shell" and amount is not None:
        side = outcome.options.get("side", "inward")
        outer = {"inward": 0.0, "outward": -amount, "both": -amount / 2}[side]
        opened = outcome.options.get("open")
        if (
            opened and side == "inward"
        ):  # the wall within is as far from the faces that are kept, not from the open ones
            inner = -near_kept_faces(part, opened, amount)(mesh.vertices)
        else:
            inner = value - (outer + amount)
        walls = np.stack([outer - value, inner])
        return np.asarray(np.take_along_axis(walls, np.abs(walls).argmin(axis=0)[None], axis=0)[0])
    return np.where(np.abs(value) < outcome.spacing / 2, -value, np.nan)


def _boolean(part: OpenPart, radius: float, options: dict[str, Any], progress: Progress) -> dict[str, Any]:
    """Union, difference or intersection of two parts, with the concave edges filleted if there is a radius."""
    tool = open_part(tuple(options["tool_mesh"]) if "tool_mesh" in options else _shape(options["tool_brep"]))
    low = np.minimum(part.bounds[0], tool.bounds[0])
    high = np.maximum(part.bounds[1], tool.bounds[1])
    detail = radius or float(np.linalg.norm(high - low))
    h = choose_spacing(
        (low, high), detail, engine="exact", spacing=options.get("spacing"), tolerance=options.get("tolerance")
    )
    if options.get("draft"):
        h = draft_spacing((low, high), detail, 2 * float(((high - low) * np.roll(high - low, 1)).sum()))
    progress("mesh", 0.0)
    meshes = [item.mesh(TESSELLATION_PER_SPACING["exact"] * h) for item in (part, tool)]
    first, second = (MeshDistance(mesh, threads=options.get("threads")) for mesh in meshes)
    joined = {"union": first | second, "difference": first - second, "intersection": first & second}[options["kind"]]
    shared: dict[str, Any] = {"threads": options.get("threads"), "progress": progress}
    if radius:
        joined = fill(joined, radius, spacing=h, engine="exact", **shared)
    mesh = contour(joined, h, **shared)
    answer: dict[str, Any] = dict.fromkeys(("brep", "vertices", "faces", "error"))
    answer |= {"error_bound": error_bound(h, radius or np.inf, "exact"), "exact_share": 0.0, "engine": ENGINES["exact"]}
    answer |= {"warnings": [], "spacing": h, "volume_before": meshes[0].volume, "volume_after": mesh.volume}
    if options.get("draft") or options.get("result") == "mesh":
        return answer | {"vertices": mesh.vertices, "faces": mesh.faces}
    solid = to_part(mesh, **shared)
    return answer | {"brep": solid.wrapped.exportBrepToString(), "volume_after": solid.wrapped.Volume}


def _faceted(mesh: Mesh, options: dict[str, Any], progress: Progress) -> dict[str, Any]:
    """Solid of plane faces of a mesh, simplified first if that is asked for."""
    solid = to_part(mesh, tolerance=options.get("simplify"), progress=progress)
    answer: dict[str, Any] = dict.fromkeys(("vertices", "faces", "error", "spacing"))
    return answer | {
        "brep": solid.wrapped.exportBrepToString(),
        "error_bound": options.get("simplify", 0.0),
        "exact_share": 0.0,
        "engine": "facets",
        "warnings": [],
        "volume_before": mesh.volume,
        "volume_after": solid.wrapped.Volume,
    }


def _draft(part: OpenPart, shape: Any, amount: float | None, edges: Mapping[int, float] | None) -> float:
    size = part.bounds[1] - part.bounds[0]
    if edges is None:
        return draft_spacing(part.bounds, abs(amount or 1.0), 2 * float((size * np.roll(size, 1)).sum()))
    radius = min(edges.values())
    return draft_spacing(part.bounds, radius, strip_area([shape.Edges[n - 1].Length for n in edges], radius))


def _volume(part: OpenPart) -> float:
    return float(part.triangles.volume if part.triangles is not None else part.shape.Volume)


def _shape(brep: str) -> Any:
    shape = Part.Shape()
    shape.importBrepFromString(brep)
    return shape
