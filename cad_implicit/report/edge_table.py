"""Edges of a part as figures for JSON, and as a table to choose from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import compress
from typing import Any

import numpy as np

from cad_implicit.cad.edges import Edge

#: Angles that differ by less than this many degrees along an edge are shown as one.
_SAME_ANGLE = 0.1

_HEADINGS = ("number", "length", "convexity", "angle", "largest_radius", "curve", "faces", "chain")
_TO_RIGHT = (True, True, False, True, True, False, False, True)


#: Largest radius by number; None where an edge cannot be blended.
Radii = Mapping[int, float | None]


def edge_figures(edges: Sequence[Edge], radii: Radii | None = None) -> list[dict[str, Any]]:
    """Figures of each edge.

    Keys: ``number``, from 1; ``length`` in mm; ``convexity``, ``curve``, ``closed``, ``faces`` and ``chain`` as in
    :class:`cad_implicit.Edge`; ``angle``, the dihedral angle of the material in degrees in the middle, and
    ``angle_range``, its least and greatest along the edge (null where there are not two faces); ``centre``, ``start``
    and ``end`` in mm; ``direction`` (null unless straight). With radii also ``largest_radius`` in mm,
    up to which the edge can be blended alone with those that go on smoothly from it (null where it cannot).
    """
    return [
        {
            "number": edge.number,
            "length": edge.length,
            "convexity": edge.convexity,
            "angle": float(edge.angle) if np.isfinite(edge.angle) else None,
            "angle_range": None if not np.isfinite(edge.angles).all() else [edge.angles.min(), edge.angles.max()],
            "curve": edge.curve,
            "closed": edge.closed,
            "faces": list(edge.faces),
            "chain": edge.chain,
            "centre": edge.centre.tolist(),
            "start": edge.points[0].tolist(),
            "end": edge.points[-1].tolist(),
            "direction": None if edge.direction is None else edge.direction.tolist(),
            **({} if radii is None else {"largest_radius": radii[edge.number]}),
        }
        for edge in edges
    ]


def edge_table(edges: Sequence[Edge], radii: Radii | None = None) -> str:
    """Lines of a table: a heading, then one for each edge; lengths in mm, angles of the material in degrees."""
    rows = [
        (
            str(edge.number),
            f"{edge.length:.6g}",
            edge.convexity,
            _angle(edge),
            _radius(edge, radii),
            edge.curve + (", closed" if edge.closed else ""),
            " ".join(map(str, edge.faces)),
            str(edge.chain),
        )
        for edge in edges
    ]
    widths = [max(map(len, column)) for column in zip(_HEADINGS, *rows, strict=True)]
    shown = [radii is not None or heading != "largest_radius" for heading in _HEADINGS]

    def line(cells: Sequence[str]) -> str:
        pairs = compress(zip(cells, widths, _TO_RIGHT, strict=True), shown)
        return "  ".join(cell.rjust(width) if right else cell.ljust(width) for cell, width, right in pairs).rstrip()

    return "\n".join(map(line, [_HEADINGS, *rows]))


def _radius(edge: Edge, radii: Radii | None) -> str:
    radius = None if radii is None else radii[edge.number]
    return "-" if radius is None else f"{radius:.4g}"


def _angle(edge: Edge) -> str:
    angles = edge.angles
    if not np.isfinite(angles).all():
        return "-"
    low, high = float(angles.min()), float(angles.max())
    return f"{edge.angle:.1f}" if high - low < _SAME_ANGLE else f"{low:.1f}..{high:.1f}"
