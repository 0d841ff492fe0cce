"""What a request will cost, told before it is computed: cells, memory, seconds. Quick; imports no numba.

The constants are those of :mod:`cad_implicit.sizing`, which a test compares; importing that takes seconds. Seconds come
from rates that were measured, and are corrected by what each answer took on this machine.
"""

from __future__ import annotations

import hashlib
import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .client import Answer, Request

CELLS_PER_RADIUS = 6.0
CELLS_PER_DIAGONAL = 100.0
RADIUS_PER_WALL = 2.0
FEWEST_CELLS_PER_RADIUS = 3.0
FACETED_TRIANGLES = 300_000
TRIANGLES_PER_CELL = 2.9
BYTES_PER_NODE = 40
BYTES_PER_SURFACE_CELL = 2500
BYTES_PER_STRIP_CELL = 4000

#: Whole parts that become solids get a coarser spacing where they are large beside the radius.
COARSER = ("fillet", "round", "smooth", "offset", "shell")

#: A draft has about so many cells, a second's work, but no fewer than so many to a radius: where there is less than one
#: the library refuses. On large parts with small radii that may be long: there is no preview that takes more seconds.
DRAFT_CELLS = 15_000
DRAFT_CELLS_PER_RADIUS = 1.25
DRAFT_SECONDS = 15.0

#: Width of the strip of a blend in radii: the quarter of a circle, and its neighbourhood.
_STRIP = 2.0

#: Nodes that the regular grid has more along each axis.
_GRID_MARGIN = 9

#: Seconds of a job in a warm child, besides the cells.
_START = 0.5

#: Seconds for each cell: of whole parts by operation, of chosen edges, of the regular grid, of whole parts that become
#: solids; and for each triangle of a mesh that becomes one. Two cores of a server, half of them busy with other work.
RATES = {
    "fillet": 1.5e-5,
    "round": 1.4e-5,
    "smooth": 2.9e-5,
    "offset": 6.5e-6,
    "shell": 1.2e-5,
    "infill": 1.2e-4,
    "boolean": 1.5e-5,
    "edges": 1.3e-4,
    "grid": 2e-7,
    "facets": 1e-5,
    "triangles": 3e-4,
}

#: How far a rate follows each answer, and how far from the measured one it may go.
_FOLLOW = 0.5
_LIMITS = (0.1, 30.0)

#: What answers said of the rates on this machine: factors by kind.
_learnt = dict.fromkeys(RATES, 1.0)


@dataclass(frozen=True)
class Size:
    """What the estimate needs to know of a source: its box ``(2, 3)`` in mm, and its edges, for their lengths."""

    bounds: Any
    edges: Any = ()


#: Sizes of the last sources, by fingerprint: a panel asks again with every keystroke.
_sizes: OrderedDict[str, Size] = OrderedDict()
_KEPT = 8


def estimate(request: Request) -> dict[str, float]:
    """Tell what a request will cost.

    Returns
    -------
    dict
        ``cells``; ``memory_bytes`` at the peak; ``seconds``, without starting the child and compiling; ``spacing`` in
        mm.
    """
    kind, cells, h = _work(request)
    bytes_per_cell = {"grid": BYTES_PER_NODE, "edges": BYTES_PER_STRIP_CELL}.get(kind, BYTES_PER_SURFACE_CELL)
    seconds = _START + sum(cells * RATES[k] * _learnt[k] for k in _kinds(request, kind))
    return {"cells": cells, "memory_bytes": cells * bytes_per_cell, "seconds": seconds, "spacing": h}


def learn(request: Request, answer: Answer) -> None:
    """Correct the rates by what an answer took."""
    expected = estimate(request)["seconds"] - _START
    if expected <= 0 or answer.seconds <= _START:
        return
    ratio = (answer.seconds - _START) / expected
    for kind in _kinds(request, _work(request)[0]):
        factor = _learnt[kind] * ratio**_FOLLOW
        _learnt[kind] = min(max(factor, _LIMITS[0]), _LIMITS[1])


def draft_spacing(bounds: Any, radius: float, area: float) -> float:
    """Spacing in mm of a preview, for a surface of so many mm²."""
    return max(default_spacing(bounds, radius), min(math.sqrt(area / DRAFT_CELLS), radius / DRAFT_CELLS_PER_RADIUS))


def default_spacing(bounds: Any, radius: float) -> float:
    """Spacing in mm where none is given."""
    diagonal = float(np.linalg.norm(np.subtract(bounds[1], bounds[0])))
    return min(radius / CELLS_PER_RADIUS, diagonal / CELLS_PER_DIAGONAL)


def strip_area(lengths: Any, radius: float) -> float:
    """Area in mm² of the blends of edges of these lengths."""
    return _STRIP * radius * float(sum(lengths))


def _work(request: Request) -> tuple[str, float, float]:
    """Kind of work, number of cells, and spacing in mm."""
    if request.operation == "solid":
        assert request.mesh is not None
        return "triangles", float(len(request.mesh[1])), 0.0
    size, options = _size(request), request.options
    radii = list((request.edges or {}).values()) or [request.amount or 0.0]
    extent = np.subtract(size.bounds[1], size.bounds[0])
    radius = min((abs(r) for r in radii if r), default=float(np.linalg.norm(extent)))
    area = (
        strip_area([size.edges[n - 1].Length for n in request.edges if n <= len(size.edges)], radius)
        if request.edges is not None
        else _box_area(extent)
    )
    h = options.get("spacing") or 0.0
    if options.get("draft"):
        h = draft_spacing(size.bounds, radius, area)
    elif not h:
        h = default_spacing(size.bounds, radius * (RADIUS_PER_WALL if request.operation == "infill" else 1.0))
        if options.get("tolerance"):
            h = min(2 * h, 2 * math.sqrt(options["tolerance"] * radius))
        elif request.edges is None and request.operation in COARSER and options.get("result") != "mesh":
            coarse = math.sqrt(TRIANGLES_PER_CELL * _box_area(extent) / FACETED_TRIANGLES)
            h = max(h, min(coarse, radius / FEWEST_CELLS_PER_RADIUS))
    if request.edges is not None:
        return "edges", area / h**2, h
    if options.get("engine") == "reinit" and not options.get("draft"):
        margin = 2 * max(request.amount or 0.0, 0.0)
        return "grid", float(np.prod((extent + margin) / h + _GRID_MARGIN)), h
    return request.operation, area / h**2, h


def _kinds(request: Request, kind: str) -> list[str]:
    """Kinds of work that are done, one after the other: of whole parts solids are made of facets."""
    faceted = (
        kind not in ("edges", "triangles")
        and request.options.get("result") != "mesh"
        and not request.options.get("draft")
    )
    return [kind, "facets"] if faceted else [kind]


def _box_area(extent: Any) -> float:
    return 2 * float((extent * np.roll(extent, 1)).sum())


def _size(request: Request) -> Size:
    """Size of the source, looked up if it was asked for lately."""
    if request.mesh is not None:
        vertices = np.asarray(request.mesh[0])
        return Size((vertices.min(axis=0), vertices.max(axis=0)))
    text = request.shape_brep or ""
    name = hashlib.sha256(text.encode()).hexdigest()
    if name not in _sizes:
        import Part

        shape = Part.Shape()
        shape.importBrepFromString(text)
        box = shape.BoundBox
        bounds = np.array([[box.XMin, box.YMin, box.ZMin], [box.XMax, box.YMax, box.ZMax]])
        _sizes[name] = Size(bounds, shape.Edges)
        while len(_sizes) > _KEPT:
            _sizes.popitem(last=False)
    _sizes.move_to_end(name)
    return _sizes[name]
