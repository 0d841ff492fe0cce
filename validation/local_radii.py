"""Radii measured on meshes of local blends, and what they leave alone: ``python -m validation.local_radii``.

Two edges of a part get radii of 2 and 3: everything farther off than the blends reach must be exactly as it was. Along
straight edges with varying radii a cone, or a canal with a parabola as its radius, is fitted at stations to the
vertices around them; its radius there is compared with the law. Exits with 1 if anything is off.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass

import cadquery as cq
import numpy as np
from scipy.optimize import least_squares

from cad_implicit.cad import OpenPart
from cad_implicit.cad.edges import Edge, part_edges
from cad_implicit.cad.parts import open_part
from cad_implicit.distance import MeshDistance
from cad_implicit.implicit import FloatArray
from cad_implicit.local_blend import blend_edges
from cad_implicit.rails import Radius

from . import local_parts as parts
from .local_parts import Chosen, chosen_edges, turned_by
from .runs import manifold_status

#: Largest relative error of a radius, and distance in mm below which a point is where it was.
_RADIUS, _SAME = 0.01, 1e-12
#: Spacings in the smallest radius.
_CELLS = 5.0
#: Stations along an edge, as fractions of its length.
_STATIONS = np.linspace(0.06, 0.94, 12)
#: Half the length of a station in mm.
_AROUND = 1.5
#: Where edges are looked at, as fractions of their length.
_FINE = np.linspace(0, 1, 101)


@dataclass(frozen=True)
class Varying:
    """A straight edge with a radius that varies along it."""

    name: str
    build: Callable[[], cq.Workplane]
    edge: Chosen
    radius: Radius
    law: Callable[[float], float]


def _box() -> cq.Workplane:
    return cq.Workplane().box(40, 30, 20)


def _wave(fraction: float) -> float:
    return 2.0 + math.sin(2 * math.pi * fraction)


def _linear(fraction: float) -> float:
    return 1.0 + 3.0 * fraction


_TOP = ((0.0, 15.0, 10.0),)

VARYING = (
    Varying("box, 1 to 4", _box, _TOP, (1.0, 4.0), _linear),
    Varying("box, 4 to 1", _box, _TOP, (4.0, 1.0), lambda f: 4.0 - 3.0 * f),
    Varying("box, linear function", _box, _TOP, _linear, _linear),
    Varying("box, 2 + sin", _box, _TOP, _wave, _wave),
    Varying("L, concave, 1 to 4", parts.l_part, ((14.0, 23.0, 14.0),), (1.0, 4.0), _linear),
    Varying("L, concave, 2 + sin", parts.l_part, ((14.0, 23.0, 14.0),), _wave, _wave),
    Varying("acute prism, 1 to 4", parts.acute_prism, ((20.0, 0.0, 20.0),), (1.0, 4.0), _linear),
)


def measured(points: FloatArray, edge: Edge, at: float) -> float:
    """Radius at a position on a straight edge between planes, fitted to points of its blend."""
    direction = (edge.points[-1] - edge.points[0]) / edge.length
    sign = -1.0 if edge.convexity == "convex" else 1.0
    normals = sign * edge.normals[0]
    out = np.linalg.solve(np.stack([*normals, direction]), [1.0, 1.0, 0.0])
    ways = np.linspace(-3 * _AROUND, 3 * _AROUND, 181)
    place = edge.points[0] + (at + ways)[:, None] * direction

    def gap(shape: FloatArray) -> FloatArray:
        radii = shape[0] + shape[1] * ways + shape[2] * ways**2
        value = np.linalg.norm(points[:, None] - (place + radii[:, None] * out), axis=2) - radii
        least = np.clip(value.argmin(axis=1), 1, len(ways) - 2)
        before, here, after = (np.take_along_axis(value, (least + k)[:, None], 1)[:, 0] for k in (-1, 0, 1))
        bend = np.maximum(before - 2 * here + after, 1e-12)
        return np.asarray(here - (after - before) ** 2 / (8 * bend))

    best = least_squares(gap, [2.0, 0.0, 0.0], loss="soft_l1", f_scale=0.01)
    best = least_squares(gap, best.x, loss="soft_l1", f_scale=1e-3)
    return float(best.x[0])


def along(task: Varying, number: int) -> bool:
    """Measure one varying radius and print it."""
    plain = part_edges(open_part(task.build().val()))
    own = chosen_edges(task.edge, plain)[0].number
    part = open_part(turned_by(task.build(), number))
    edge = next(edge for edge in part_edges(part) if edge.number == own)
    blend = blend_edges(part, None, {own: task.radius}, spacing=1.0 / _CELLS)
    mesh = blend.mesh()
    centred = mesh.vertices[np.unique(mesh.faces)]
    off = np.abs(MeshDistance(part.mesh(0.01))(centred)) > 1e-3
    points = centred[off]
    way = (points - edge.points[0]) @ ((edge.points[-1] - edge.points[0]) / edge.length)
    worst, where, radii = 0.0, 0.0, []
    for fraction in _STATIONS.tolist():
        near = points[np.abs(way - fraction * edge.length) < _AROUND]
        found = measured(near, edge, fraction * edge.length)
        radii.append(found)
        error = abs(found / task.law(fraction) - 1)
        if error > worst:
            worst, where = error, fraction
    sound = worst <= _RADIUS and mesh.is_watertight and manifold_status(mesh) == "NoError"
    print(
        f"{task.name:28s}{len(mesh.faces):8d} faces  radii {' '.join(f'{r:.3f}' for r in radii)}  worst {worst:.1e} at "
        f"{where:.2f}" + ("" if sound else "  FAULT"),
        flush=True,
    )
    return sound


def untouched(name: str, part: OpenPart, sizes: dict[int, float]) -> bool:
    """Blend some edges and look whether the rest is as it was."""
    found = {edge.number: edge for edge in part_edges(part)}
    blend = blend_edges(part, None, sizes, spacing=0.4)
    mesh, before = blend.mesh(), blend.parent.mesh
    clear = np.full(len(before.vertices), True)
    for number, radius in sizes.items():
        edge = found[number]
        span = edge.points[-1] - edge.points[0]
        share = np.clip((before.vertices - edge.points[0]) @ span / (span @ span), 0, 1)
        away = np.linalg.norm(before.vertices - edge.points[0] - share[:, None] * span, axis=1)
        clear &= away > 1.5 * radius
    kept = {tuple(p) for p in mesh.vertices.tolist()}
    lost = sum(tuple(p) not in kept for p in before.vertices[clear].tolist())
    others = [edge for edge in found.values() if not set(edge.ends) & {v for n in sizes for v in found[n].ends}]
    samples = np.concatenate([a + (b - a) * t for e in others for a, b in [(e.points[0], e.points[-1])] for t in _FINE])
    samples = samples.reshape(-1, 3)
    off = float(np.abs(MeshDistance(mesh, sign="pseudonormal").unsigned(samples)).max())
    outside = max(-float(MeshDistance(before, sign="pseudonormal")(mesh.vertices).min()), 0.0)
    change = mesh.volume - before.volume
    expected = -sum((1 - math.pi / 4) * r * r * found[n].length for n, r in sizes.items())
    sound = lost == 0 and off < _SAME * 100 and mesh.is_watertight
    print(
        f"{name:28s}{len(mesh.faces):8d} faces  {lost} of {int(clear.sum())} old vertices lost, edges left alone off "
        f"by {off:.1e} mm, vertices at most {outside:.1e} mm outside, change {change:.4f} ({expected:.4f})"
        + ("" if sound else "  FAULT")
    )
    return sound


def main() -> int:
    """Print the table; return 1 if anything is off."""
    sound = True
    for name, build, selector in (
        ("box, two of four", _box, "|Z"),
        ("boss, two of four", parts.square_boss, None),
    ):
        plain = part_edges(open_part(build().val()))
        chosen = chosen_edges(selector or parts.BOSS_SIDES, plain)
        part = open_part(turned_by(build(), 7))
        sound &= untouched(name, part, {chosen[0].number: 2.0, chosen[-1].number: 3.0})
    for number, task in enumerate(VARYING):
        sound &= along(task, number)
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
