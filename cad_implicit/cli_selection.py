"""Chosen edges on the command line: ``--edges``, ``--edge-radius``, ``--radius`` and ``--no-tangent``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import typer

Length = float | tuple[float, float]


def selection(
    radius: float | None, edges: str | None, edge_radius: Sequence[str] | None, no_tangent: bool, engine: str
) -> dict[str, Any]:
    """Options of :func:`cad_implicit.run` for chosen edges; none if the whole part is worked on.

    Raises
    ------
    typer.BadParameter
        If they do not go together, or a radius cannot be read.
    """
    own = dict(map(_edge_radius, edge_radius or ()))
    if edges is None and not own:
        if radius is None:
            raise typer.BadParameter("give a radius in mm", param_hint="--radius")
        if no_tangent:
            raise typer.BadParameter("there are no chosen edges; add --edges", param_hint="--no-tangent")
        return {}
    if edges is None and radius is not None:
        raise typer.BadParameter(
            "say which edges get it: add --edges all, or leave it out to work on those of --edge-radius only",
            param_hint="--radius",
        )
    if radius is None and not own:
        raise typer.BadParameter("give a radius in mm, or one for each edge by --edge-radius", param_hint="--radius")
    if engine == "reinit":
        raise typer.BadParameter("chosen edges are worked on by the engine exact only", param_hint="--engine")
    return {"edges": edges, "edge_radius": own, "tangent": not no_tangent}


def _edge_radius(text: str) -> tuple[str, Length]:
    """Selector and radius of ``SELECTOR=R`` or ``SELECTOR=R0:R1``; selectors hold no ``=``."""
    selector, equals, value = text.rpartition("=")
    try:
        lengths = [float(one) for one in value.split(":")]
    except ValueError:
        lengths = []
    if not (equals and selector.strip()) or len(lengths) not in (1, 2):
        raise typer.BadParameter(f"{text!r} is not SELECTOR=R or SELECTOR=R0:R1", param_hint="--edge-radius")
    return selector.strip(), lengths[0] if len(lengths) == 1 else (lengths[0], lengths[1])
