"""Parts with concave edges whose closing by a ball is known, and the errors of a mesh against it.

Where a ball of radius r touches two features its centre is at a known place: the point nearest to x on the curve, or
of the corner, that the centres of all such balls make. A point of the result lies on the blend if the ball pushed
against its nearest feature would cut into another one, and is off by its distance from that centre less r.

Left out: what lies near the open end of an edge, where a ball rolls off (a closing fades there); what a case cannot
tell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapes
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cad_implicit import Mesh, MeshDistance

Points = NDArray[np.float64]

#: Share of the radius by which a pushed ball must cut into another feature for its point to count as blend.
CUT = 1e-3


@dataclass(frozen=True)
class Case:
    """A part and its closing by a ball of radius ``radius``, in the part's own frame.

    ``outside(x)`` is the exact distance from the part in the region of interest, ``centre(x)`` the centre of the ball
    nearest to x that touches several features, ``known(x)`` tells where both hold, and ``box`` where to look for
    points of the blend.
    """

    name: str
    mesh: Mesh
    radius: float
    outside: Callable[[Points], Points]
    centre: Callable[[Points], Points]
    known: Callable[[Points], NDArray[np.bool_]]
    box: tuple[list[float], list[float]]

    def pushed_ball_cuts(self, x: Points) -> NDArray[np.bool_]:
        step = 1e-5 * self.radius
        gradient = np.stack([self.outside(x + e) - self.outside(x - e) for e in step * np.eye(3)], axis=1) / (2 * step)
        gradient /= np.maximum(np.linalg.norm(gradient, axis=1), 1e-3)[:, None]
        pushed = x + (self.radius - self.outside(x))[:, None] * gradient
        return self.outside(pushed) < self.radius * (1 - CUT)

    def blend_error(self, x: Points) -> Points:
        return np.abs(np.linalg.norm(x - self.centre(x), axis=1) - self.radius)

    def blend_samples(self, count: int = 200_000) -> Points:
        """Points on the blend, from random ones in the air beside it."""
        x = np.random.default_rng(7).uniform(*self.box, (count, 3))
        x = x[(self.outside(x) > 0) & self.known(x)]
        x = x[self.pushed_ball_cuts(x)]
        centre = self.centre(x)
        arm = x - centre
        length = np.linalg.norm(arm, axis=1)
        good = (length > 1e-3 * self.radius) & (length < 2 * self.radius)
        on = centre[good] + self.radius * arm[good] / length[good, None]
        return on[self.known(on) & (self.outside(on) > 0)]


def wedge(angle: float, r: float) -> Case:
    size = 6 * r
    half = np.radians(angle / 2)

    def outside(x: Points) -> Points:
        return np.minimum(
            x[:, 0] * np.sin(half) - x[:, 1] * np.cos(half), x[:, 0] * np.sin(half) + x[:, 1] * np.cos(half)
        )

    def centre(x: Points) -> Points:
        return np.stack([np.full(len(x), r / np.sin(half)), np.zeros(len(x)), x[:, 2]], axis=1)

    def known(x: Points) -> NDArray[np.bool_]:
        return (np.hypot(x[:, 0], x[:, 1]) < 0.45 * size) & (np.abs(x[:, 2]) < 0.75 * size - r)

    mesh = shapes.notch(angle, size)
    return Case(f"wedge {angle:g}", mesh, r, outside, centre, known, ([0, -2 * r, -2 * r], [2 * r, 2 * r, 2 * r]))


def corner(r: float) -> Case:
    size = 4 * r
    return Case(
        "corner",
        shapes.corner(size),
        r,
        lambda x: x.min(axis=1),
        lambda x: np.where((x < r) | (x == np.sort(x, axis=1)[:, :1]), r, x),
        lambda x: (x.min(axis=1) > -0.1 * r) & (x.max(axis=1) < size - r),
        ([0] * 3, [2 * r] * 3),
    )


def pocket(r: float) -> Case:
    half, depth = 3 * r, 4 * r
    low, high = np.array([r - half, r - half, r - depth]), np.array([half - r, half - r, np.inf])

    def outside(x: Points) -> Points:
        return np.minimum(half - np.abs(x[:, :2]).max(axis=1), x[:, 2] + depth)

    def known(x: Points) -> NDArray[np.bool_]:
        return (np.abs(x[:, :2]).max(axis=1) < half + 0.1 * r) & (x[:, 2] < -r) & (x[:, 2] > -depth - 0.1 * r)

    box = ([-half, -half, -depth], [half, half, -r])
    return Case("pocket", shapes.pocket(half, depth), r, outside, lambda x: np.clip(x, low, high), known, box)


def square_boss(r: float) -> Case:
    half, size, height = 2 * r, 5 * r, 3 * r

    def beside(x: Points) -> Points:
        out = np.abs(x[:, :2]) - half
        return np.linalg.norm(np.maximum(out, 0), axis=1) + np.minimum(out.max(axis=1), 0)

    def centre(x: Points) -> Points:
        foot = np.clip(x[:, :2], -half, half)
        inner = (np.abs(x[:, :2]) < half).all(axis=1)
        axis = np.abs(x[:, :2]).argmax(axis=1)
        rows = np.flatnonzero(inner)
        foot[rows, axis[rows]] = np.sign(x[rows, axis[rows]]) * half
        arm = x[:, :2] - foot
        arm[rows] = foot[rows] - x[rows, :2]
        on_edge = ~arm.any(axis=1)  # the fillet ends in a cusp on the vertical edge
        arm[on_edge] = np.sign(foot[on_edge])
        arm /= np.maximum(np.linalg.norm(arm, axis=1), 1e-300)[:, None]
        return np.column_stack([foot + r * arm, np.full(len(x), r)])

    def known(x: Points) -> NDArray[np.bool_]:
        return (np.abs(x[:, :2]).max(axis=1) < size - r) & (x[:, 2] > -0.1 * r) & (x[:, 2] < 2 * r)

    mesh = shapes.square_boss(half, size, height)
    box = ([-3 * r, -3 * r, 0], [3 * r, 3 * r, r])
    return Case("square boss", mesh, r, lambda x: np.minimum(beside(x), x[:, 2]), centre, known, box)


def cone_boss(bottom: float, top: float, r: float, segments: int = 720) -> Case:
    """Radii in units of ``r``; a cylinder if both are the same."""
    bottom, top, height, size = bottom * r, top * r, 3 * r, 5.5 * r
    slant = np.arctan2(bottom - top, height)
    circle = bottom + r / np.cos(slant) - r * np.tan(slant)

    def outside(x: Points) -> Points:
        rho = np.hypot(x[:, 0], x[:, 1])
        return np.minimum(x[:, 2], (rho - bottom) * np.cos(slant) + x[:, 2] * np.sin(slant))

    def centre(x: Points) -> Points:
        rho = np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-300)
        return np.column_stack([x[:, :2] * (circle / rho)[:, None], np.full(len(x), r)])

    def known(x: Points) -> NDArray[np.bool_]:
        rho = np.hypot(x[:, 0], x[:, 1])
        return (rho < size - r) & (rho > 0.6 * bottom) & (x[:, 2] > -0.1 * r) & (x[:, 2] < height - r)

    name = "boss" if bottom == top else f"cone {np.degrees(slant):.0f}"
    mesh = shapes.cone_boss(bottom, top, size, height, segments)
    box = ([-circle - r, -circle - r, 0], [circle + r, circle + r, 2 * r])
    return Case(name, mesh, r, outside, centre, known, box)


def blind(hole: float, r: float, segments: int = 720) -> Case:
    """Blind hole of radius ``hole`` in units of ``r``, above 1, with a flat bottom."""
    hole, depth = hole * r, 4 * r

    def outside(x: Points) -> Points:
        return np.minimum(hole - np.hypot(x[:, 0], x[:, 1]), x[:, 2] + depth)

    def centre(x: Points) -> Points:
        rho = np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-300)
        return np.column_stack([x[:, :2] * (np.minimum(rho, hole - r) / rho)[:, None], np.full(len(x), r - depth)])

    def known(x: Points) -> NDArray[np.bool_]:
        return (np.hypot(x[:, 0], x[:, 1]) < hole + 0.1 * r) & (x[:, 2] < -r) & (x[:, 2] > -depth - 0.1 * r)

    mesh = shapes.blind(hole, hole + 2 * r, depth, segments)
    return Case(f"blind {hole / r:g}", mesh, r, outside, centre, known, ([-hole, -hole, -depth], [hole, hole, -r]))


def cross(first: float, second: float, r: float, segments: int = 720) -> Case:
    """Cylinders of radii ``first >= second`` in units of ``r`` along z and x."""
    first, second, reach = first * r, second * r, first * r + 5 * r
    a, b = first + r, second + r

    def outside(x: Points) -> Points:
        return np.minimum(np.hypot(x[:, 0], x[:, 1]) - first, np.hypot(x[:, 1], x[:, 2]) - second)

    def spine(t: Points, side: Points) -> tuple[Points, Points, Points]:
        """Points, first and second derivatives by the angle around x."""
        sin, cos = np.sin(t), np.cos(t)
        root = np.sqrt(np.maximum(a**2 - b**2 * cos**2, 1e-12 * a**2))
        first_root = b**2 * cos * sin / root
        second_root = b**2 * (cos**2 - sin**2) / root - first_root**2 / root
        return (
            np.stack([side * root, b * cos, b * sin], axis=1),
            np.stack([side * first_root, -b * sin, b * cos], axis=1),
            np.stack([side * second_root, -b * cos, -b * sin], axis=1),
        )

    start = np.linspace(0, 2 * np.pi, 721)[:-1]

    def centre(x: Points) -> Points:
        side = np.where(x[:, 0] < 0, -1.0, 1.0)
        tree = cKDTree(spine(start, np.ones(len(start)))[0])
        t = start[tree.query(np.column_stack([np.abs(x[:, 0]), x[:, 1:]]))[1]]
        for _ in range(8):
            p, d1, d2 = spine(t, side)
            slope = (d1 * (p - x)).sum(axis=1)
            bend = (d1 * d1).sum(axis=1) + (d2 * (p - x)).sum(axis=1)
            t = t - np.clip(slope / np.maximum(bend, 0.1 * (d1 * d1).sum(axis=1)), -0.02, 0.02)
        return spine(t, side)[0]

    def known(x: Points) -> NDArray[np.bool_]:
        return (np.abs(x[:, [0, 2]]).max(axis=1) < reach - r) & (np.abs(x[:, 1]) < first + r)

    box = ([-first - 2 * r, -second - r, -second - 2 * r], [first + 2 * r, second + r, second + 2 * r])
    mesh = shapes.cross(first, second, reach, segments)
    return Case(f"cross {first / r:g}:{second / r:g}", mesh, r, outside, centre, known, box)


def plug(hole: float, r: float, segments: int = 720) -> Case:
    """Through hole of radius ``hole`` in units of ``r``, below 1: a ball on either rim closes it."""
    hole, thickness = hole * r, 6 * r
    size = hole + 3 * r
    top = np.sqrt(r**2 - hole**2)

    def outside(x: Points) -> Points:
        rho = np.hypot(x[:, 0], x[:, 1])
        height = np.abs(x[:, 2] + thickness / 2) - thickness / 2
        return np.where(
            rho >= hole, height, np.where(height > 0, np.hypot(hole - rho, np.maximum(height, 0)), hole - rho)
        )

    def centre(x: Points) -> Points:
        z = np.where(x[:, 2] > -thickness / 2, top, -thickness - top)
        return np.column_stack([np.zeros((len(x), 2)), z])

    def known(x: Points) -> NDArray[np.bool_]:
        beside = np.abs(x[:, 2] + thickness / 2) < thickness / 2 + r
        return beside & (np.abs(x[:, :2]).max(axis=1) < size - r)

    mesh = shapes.drilled(hole, size, thickness, segments)
    box = ([-hole, -hole, top - r], [hole, hole, 0])
    return Case(f"plug {hole / r:g}", mesh, r, outside, centre, known, box)


@dataclass(frozen=True)
class Errors:
    """Errors in spacings; NaN where there was nothing to measure."""

    blend: float
    blend_rms: float
    facets: float
    missed: float
    face: float
    sharp: float
    sharp_p999: float
    skipped: int
    samples: int


def errors(case: Case, result: Mesh, h: float) -> Errors:
    """Two-sided errors of a closing's (or, of the cavity, an opening's) mesh."""
    vertices = result.vertices[np.unique(result.faces)]
    centroids = result.vertices[result.faces].mean(axis=1)
    part = MeshDistance(case.mesh)
    mesh = MeshDistance(result)
    local, middle = ((x - shapes.SHIFT) @ shapes.TURN for x in (vertices, centroids))
    known, middle_known = case.known(local), case.known(middle)
    on_blend = known & case.pushed_ball_cuts(local)
    blend = case.blend_error(local[on_blend])
    facets = case.blend_error(middle[middle_known & case.pushed_ball_cuts(middle)])
    face = part.unsigned(vertices[known & ~case.pushed_ball_cuts(local)])
    missed = mesh.unsigned(shapes.placed(case.blend_samples()))
    sharp = mesh.unsigned(_sharp_samples(case, h))
    return Errors(
        *(float(x) / h for x in (_max(blend), _rms(blend), _max(facets), _max(missed), _max(face), _max(sharp))),
        float(np.percentile(sharp, 99.9)) / h if len(sharp) else np.nan,
        int((~known).sum()),
        len(vertices),
    )


def _sharp_samples(case: Case, h: float) -> Points:
    """Points on the sharp convex edges of the part, away from those that its closing fills."""
    faces, normals = case.mesh.faces, case.mesh.face_vectors
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort((half.max(axis=1), half.min(axis=1)))
    one, two = order[::2], order[1::2]
    a, b = case.mesh.vertices[half[one, 0]], case.mesh.vertices[half[one, 1]]
    apex = case.mesh.vertices[faces[owner[two]].sum(axis=1) - half[two].sum(axis=1)]
    sharp = (normals[owner[one]] * normals[owner[two]]).sum(axis=1) < np.cos(np.radians(30))
    convex = (normals[owner[one]] * (apex - a)).sum(axis=1) < 0
    kept, removed = (_along(a[sharp & side], b[sharp & side], 0.1 * h) for side in (convex, ~convex))
    if len(removed) == 0:
        return kept
    return kept[cKDTree(removed).query(kept)[0] > 2.5 * case.radius]


def _along(a: Points, b: Points, step: float) -> Points:
    """Points along the segments from ``a`` to ``b``."""
    count = np.maximum(np.ceil(np.linalg.norm(b - a, axis=1) / step).astype(int), 1)
    share = (np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + 0.5) / np.repeat(count, count)
    return np.asarray(np.repeat(a, count, axis=0) + share[:, None] * np.repeat(b - a, count, axis=0))


def _max(x: Points) -> float:
    return float(x.max()) if len(x) else np.nan


def _rms(x: Points) -> float:
    return float(np.sqrt((x**2).mean())) if len(x) else np.nan
