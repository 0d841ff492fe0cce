"""Ball-centre polish: from a rough centre of the rolling ball to the exact one.

A fillet point x belongs to the ball whose centre y is the point nearest to x among all centres at which a ball of
radius r fits outside the part. The set of centres is bounded by offset surfaces that meet in creases (the spine of a
fillet, the centre of a corner ball, the tip over a plugged hole); y is found by linearising the offsets of the
features that the ball touches and projecting x onto their half-spaces, over and over (sequential quadratic
programming). Converges quadratically for smooth features.
"""

from __future__ import annotations

import numpy as np

from . import parallel
from .implicit import FloatArray, Implicit
from .kernels import halfspaces

#: Half-spaces kept for each centre: three hold it, the others keep it from creeping back into a feature met before.
_PLANES = 6

#: Normals closer than this cosine (20 degrees) belong to the same feature.
_SAME_FEATURE = 0.94

#: Features are looked up from this share of the radius towards them, where they alone are nearest.
_LOOK_AHEAD = 0.3

#: Rounds of projecting and linearising anew; planar contacts need one, doubly curved ones three.
_ROUNDS = 6

#: A centre is right when its distance from the part is the radius within this share of it.
_CONVERGED = 1e-8

#: A polished centre is accepted if the ball there cuts into the part by less than this share of the radius.
_ACCEPTED = 1e-5


def polish_centres(
    part: Implicit, radius: float, points: FloatArray, centres: FloatArray, *, threads: int | None = None
) -> tuple[FloatArray, np.ndarray]:
    """Centres of the balls that touch a fillet nearest to given points.

    Parameters
    ----------
    part : Implicit
        Exact distance, positive inside; the balls lie outside.
    radius : float
        Of the ball in mm.
    points : (N, 3) float64
        Points on or near the fillet.
    centres : (N, 3) float64
        Rough centres, right within about a grid spacing.
    threads : int, optional
        Default: all cores.

    Returns
    -------
    centres : (N, 3) float64
    accepted : (N,) bool
        Where the polish converged; elsewhere the rough centre is returned.
    """
    problem = _Problem(part, radius, points, threads)
    everything = np.ones(len(points), bool)
    problem.add(centres, everything)
    first = problem.normals[:, 0]
    problem.add(points + (problem.offsets[:, 0] - (first * points).sum(axis=1))[:, None] * first, everything)
    active = everything
    for _ in range(_ROUNDS):
        problem.project()
        problem.look_again(active)
        problem.project()
        gap = problem.add(problem.centres, active, only_violated=True)
        active = active & ~(np.abs(gap) <= _CONVERGED * radius)
        if not active.any():
            break
    problem.project()
    cut = radius + part(problem.centres)
    accepted = (problem.mask > 0) & (cut <= _ACCEPTED * radius)
    return np.where(accepted[:, None], problem.centres, centres), accepted


class _Problem:
    """One projection onto half-spaces for each point, batched."""

    def __init__(self, part: Implicit, radius: float, points: FloatArray, threads: int | None) -> None:
        self.part, self.radius, self.points, self.threads = part, radius, points, threads
        self.normals, self.offsets = np.zeros((len(points), _PLANES, 3)), np.zeros((len(points), _PLANES))
        self.counts = np.zeros(len(points), np.int64)
        self.centres = points.copy()
        self.mask = np.zeros(len(points), np.int64)

    def project(self) -> None:
        """Centres from the half-spaces."""
        with parallel.threads(self.threads):
            halfspaces.nearest_feasible_many(
                self.points, self.normals, self.offsets, self.counts, self.centres, self.mask
            )

    def add(self, places: FloatArray, wanted: np.ndarray, *, only_violated: bool = False) -> FloatArray:
        """Add the half-space of the feature nearest to each wanted place; returns distance from it less the radius."""
        gap = np.zeros(len(places))
        normal = np.zeros_like(places)
        offset = np.zeros(len(places))
        value, gradient = self.part.value_and_gradient(places[wanted])
        normal[wanted] = -gradient
        foot = places[wanted] - value[:, None] * gradient
        offset[wanted] = self.radius - (gradient * foot).sum(axis=1)
        gap[wanted] = -value - self.radius
        take = wanted & (gap < -_CONVERGED * self.radius) if only_violated else wanted
        with parallel.threads(self.threads):
            halfspaces.add_plane(
                self.normals, self.offsets, self.counts, normal, offset, take, _SAME_FEATURE, self.centres
            )
        return gap

    def look_again(self, active: np.ndarray) -> None:
        """Linearise the half-spaces that hold each active centre anew, seen from nearby."""
        for plane in range(_PLANES):
            which = np.flatnonzero(active & (self.mask > 0) & ((self.mask >> plane) & 1 == 1))
            if len(which) == 0:
                continue
            normal = self.normals[which, plane]
            place = self.centres[which] - _LOOK_AHEAD * self.radius * normal
            value, gradient = self.part.value_and_gradient(place)
            same = (-gradient * normal).sum(axis=1) > _SAME_FEATURE
            foot = place - value[:, None] * gradient
            which, gradient, foot = which[same], gradient[same], foot[same]
            self.normals[which, plane] = -gradient
            self.offsets[which, plane] = self.radius - (gradient * foot).sum(axis=1)
