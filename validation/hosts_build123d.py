"""The parts at which the exact kernel fails, made in build123d and through the operations for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from build123d import (
    Axis,
    Box,
    Circle,
    Cylinder,
    Keep,
    Kind,
    Locations,
    Plane,
    Pos,
    Rectangle,
    Rot,
    Sphere,
    Text,
    Torus,
    extrude,
    fillet,
    loft,
    offset,
    split,
)

from cad_implicit.build123d import implicit_chamfer, implicit_round, safe_fillet

#: Centres less than that many mm from the lowest and highest edge are as low and as high.
_LEVEL = 1e-6


def hollow_box() -> Any:
    """Box open at the top, walls 1 thick."""
    box = Box(50, 50, 20)
    return offset(box, -1, openings=box.faces().sort_by(Axis.Z)[-1:], kind=Kind.INTERSECTION)


def loft_with_holes() -> Any:
    """Cone frustum with four square holes."""
    holes = [place * Rectangle(7, 7) for place in Locations((5, 5), (5, -5), (-5, 5), (-5, -5)).locations]
    frustum = loft([(Plane.XY * Circle(30)).face(), (Pos(0, 0, 100) * Circle(20)).face()])
    for hole in holes:
        frustum = frustum - extrude(hole, 100)
    return frustum


def split_cylinder() -> Any:
    """Cylinder cut off at 45 degrees."""
    return split(Rot(0, 90, 0) * Cylinder(40, 75), bisect_by=Plane((37.5, 0, 0), z_dir=(1, 0, 1)), keep=Keep.BOTTOM)


def raised_text() -> Any:
    """Letters on a plate."""
    return Box(30, 12, 3) + extrude(Pos(0, 0, 1.5) * Text("Rg", 9), 1.5)


def torus_groove() -> Any:
    """Disc with a ring groove."""
    return extrude(Circle(54.5), 20) - Pos(0, 0, 20) * Torus(32, 14)


def tangent_boss() -> Any:
    """Boss tangent to the wall of the block below."""
    return Box(20, 20, 10) + extrude(Pos(5, 0) * Circle(5), 20)


def bosses_with_rib() -> Any:
    """Two bosses and a rib between them on a plate."""
    bosses = [extrude(Pos(x, 0, 2) * Circle(5), 15) for x in (-8, 8)]
    return Box(40, 20, 4) + bosses[0] + bosses[1] + Pos(0, 0, 8) * Box(16, 2, 12)


def steinmetz() -> Any:
    """Two equal cylinders' common part."""
    return Cylinder(5, 40) & Rot(90, 0, 0) * Cylinder(5, 40)


def _rounded_cube() -> Any:
    return fillet(Box(10, 10, 10).edges().filter_by(Axis.Z), 1)


def _between(part: Any) -> Any:
    """Edges but the lowest and highest."""
    low, high = (edges[0].center().Z for edges in (part.edges().sort_by(Axis.Z), part.edges().sort_by(Axis.Z)[-1:]))
    return [edge for edge in part.edges() if low + _LEVEL < edge.center().Z < high - _LEVEL]


def _all(part: Any) -> Any:
    return part.edges()


#: Part, edges and radius in mm of each case.
_CASES: tuple[tuple[Callable[[], Any], Callable[[Any], Any], float], ...] = (
    (hollow_box, _all, 1.0),
    (loft_with_holes, lambda part: part.faces().filter_by(Axis.Z).edges(), 3.0),
    (split_cylinder, lambda part: part.edges().filter_by(Axis.Y), 4.0),
    (raised_text, lambda part: part.faces().group_by(Axis.Z)[-1].edges(), 0.2),
    (lambda: Box(10, 10, 10) + Sphere(6), _all, 0.3),
    (lambda: Box(10, 10, 10), _all, 5.0),
    (lambda: Box(50, 80, 10), lambda part: part.edges().filter_by(Axis.Z), 25.0),
    (_rounded_cube, lambda part: part.edges().group_by(Axis.Z)[0], 1.0),
    (torus_groove, lambda part: part.edges().group_by(Axis.Z)[-1], 1.0),
    (tangent_boss, _all, 1.0),
    (bosses_with_rib, _between, 1.0),
    (steinmetz, _all, 1.0),
)


def runs() -> dict[str, Callable[[], Any]]:
    """Tell what is to be done, by name; each gives a part with its attribute ``implicit``."""
    found: dict[str, Callable[[], Any]] = {}
    for number, (build, select, radius) in enumerate(_CASES, 1):
        operation = implicit_chamfer if number == 8 else safe_fillet
        found[f"{number} {operation.__name__} {radius:g}"] = lambda b=build, s=select, r=radius, o=operation: o(
            s(b()), r
        )
        found[f"{number} implicit_round {radius:g}"] = lambda b=build, r=radius: implicit_round(b(), r)
    return found
