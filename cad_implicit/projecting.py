"""Vertices of a contour moved onto the surface: smooth ones by Newton's steps, sharp ones onto creases and corners.

A sharp vertex is looked at a little beside the crease, once on each face; it moves to where their tangent planes meet.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .implicit import Evaluate, FloatArray
from .kernels import projection

#: A smooth vertex that moved by less, in spacings, is on the surface: Newton's error is about half the square of
#: the step over the radius of curvature.
_SMOOTH_TOLERANCE = 0.01
_SMOOTH_ROUNDS = 4

#: A sharp vertex that moved by less, in spacings, is on its crease: straight ones at the first step, curved ones after
#: another look from nearby.
_SHARP_TOLERANCE = 1e-5
_SHARP_ROUNDS = 6

#: Looks at sharp vertices with polished values, from where rough ones have moved them.
_POLISH_ROUNDS = 2

#: A sharp vertex farther than this from the surface, in spacings, is moved onto it: on the ridge of a fillet around a
#: corner of 90 degrees they were off by up to 0.024 spacings.
_SHARP_OFF = 5e-4

#: Most looks at points of smooth faces, which are off by the fourth power of a facet's size at first. Where the last
#: step is so many times longer than would be enough the surface is not smooth.
_FACE_ROUNDS = 2
_LONG = 2.5

#: Farthest that a vertex may be moved, in spacings.
_REACH = 0.5


@dataclass(frozen=True, eq=False)
class Projector:
    """Moves vertices onto a surface.

    Attributes
    ----------
    rough, exact : callable
        Map points (N, 3) to values (N,) and gradients (N, 3); the same one where there is no better one.
    spacing : float
        Of the grid in mm.
    kernels : callable
        Gives the context of parallel kernels over so many items.
    distances : bool
        Whether values are true distances, so that one step leads onto the surface.
    evaluate : callable
        Called with points, one of the two, a stage and its done fraction for the progress; does the work in batches.
    """

    rough: Evaluate
    exact: Evaluate
    spacing: float
    kernels: Callable[[int], AbstractContextManager[None]]
    distances: bool
    evaluate: Callable[[FloatArray, Evaluate, str, float], tuple[FloatArray, FloatArray]]

    def onto_creases(
        self,
        position: FloatArray,
        mass: FloatArray,
        rank: NDArray[np.int8],
        planes: NDArray[np.int32],
        foot: FloatArray,
        normal: FloatArray,
        looks: Sequence[Evaluate] = (),
    ) -> None:
        """Move sharp vertices (rank above 1) onto their creases in place; those that are not sharp become smooth.

        Looks roughly first and then exactly, or as told.
        """
        h = self.spacing
        for look in looks or ((self.rough,) if self.exact == self.rough else (self.rough, self.exact)):
            start, last_step = position.copy(), np.full(len(position), np.inf)
            pending = np.flatnonzero(rank > 1)
            for number in range(_SHARP_ROUNDS if look == self.rough else _POLISH_ROUNDS):
                if len(pending) == 0:
                    break
                with self.kernels(len(pending)):
                    probes = projection.probe_points(pending, position, rank, planes, foot, normal, last_step, h)
                used = np.ones((len(pending), 3), np.bool_)
                used[:, 2] = rank[pending] == 3
                f, gradient = np.zeros((len(pending), 3)), np.zeros((len(pending), 3, 3))
                f[used], gradient[used] = self.evaluate(probes[used], look, "vertices", 0.05 * number)
                with self.kernels(len(pending)):
                    outcome = projection.step_sharp(
                        pending, probes, f, gradient, start, _REACH * h, _SHARP_TOLERANCE * h, rank, last_step, position
                    )
                blunt = pending[outcome == 2]
                rank[blunt], position[blunt] = 1, mass[blunt]
                pending = pending[outcome == 1]

    def settle(self, position: FloatArray, vertices: NDArray[np.intp]) -> None:
        """Move sharp vertices that are not on the surface there: narrow ridges look sharp, but are round."""
        h = self.spacing
        start, ignored = position.copy(), np.zeros_like(position)
        for _ in range(_SMOOTH_ROUNDS):
            f, gradient = self.evaluate(position[vertices], self.exact, "vertices", 0.45)
            off = np.flatnonzero(np.abs(f) > _SHARP_OFF * h)
            if len(off) == 0:
                break
            vertices, reach = vertices[off], _REACH * h
            points = position[vertices]
            with self.kernels(len(off)):
                projection.step_smooth(vertices, points, f[off], gradient[off], start, reach, h, position, ignored)

    def smooth(
        self,
        position: FloatArray,
        mass: FloatArray,
        rank: NDArray[np.int8],
        is_flat: NDArray[np.bool_],
        directions: FloatArray,
    ) -> None:
        """Newton steps onto the surface; ``directions`` gets the normals of the smooth vertices."""
        h = self.spacing
        start = position.copy()
        pending = np.flatnonzero((rank == 1) & ~is_flat)
        for number in range(_SMOOTH_ROUNDS):
            if len(pending) == 0:
                break
            points = position[pending]
            f, gradient = self.evaluate(points, self.exact, "vertices", 0.5 + 0.1 * number)
            with self.kernels(len(pending)):
                again = projection.step_smooth(
                    pending, points, f, gradient, start, _REACH * h, _SMOOTH_TOLERANCE * h, position, directions
                )
            pending = pending[again]

    def misses(self, points: FloatArray) -> FloatArray:
        """Distances (N,) of points (N, 3) near the surface from it."""
        f, gradient = self.evaluate(points, self.exact, "vertices", 0.9)
        return np.asarray(np.abs(f) / np.maximum(np.linalg.norm(gradient, axis=1), 1e-6))

    def onto_face(self, points: FloatArray, enough: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Move points (N, 3) onto the smooth face they are near to, until steps are shorter than ``enough`` (N,) mm.

        Returns them, outward unit normals (N, 3), and whether they arrived (N,).
        """
        moved, normal, step = points.copy(), np.zeros_like(points), np.zeros(len(points))
        pending = np.arange(len(points))
        for _ in range(1 if self.distances else _FACE_ROUNDS):
            f, gradient = self.evaluate(moved[pending], self.exact, "vertices", 0.9)
            square = np.maximum((gradient * gradient).sum(axis=1), 1e-12)
            moved[pending] -= (f / square)[:, None] * gradient
            normal[pending] = -gradient / np.sqrt(square)[:, None]
            step[pending] = np.abs(f) / np.sqrt(square)
            pending = np.flatnonzero(step > enough)
            if len(pending) == 0:
                break
        return moved, normal, (step < _LONG * enough) | self.distances

    def onto_crease(
        self, points: FloatArray, normals: FloatArray, exactly: bool
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Move points onto the crease between faces of given normals (N, 2, 3); tell which ones could be."""
        moved, rank = points.copy(), np.full(len(points), 2, np.int8)
        planes = np.arange(2 * len(points), dtype=np.int32).reshape(-1, 2)
        looks = (self.exact if exactly else self.rough,)
        self.onto_creases(moved, points, rank, planes, points, normals.reshape(-1, 3), looks)
        if exactly:
            self.settle(moved, np.flatnonzero(rank == 2))
        return moved, rank == 2
