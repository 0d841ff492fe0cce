"""Ball-centre polish: from a rough centre of the rolling ball to the exact one.

A fillet point x belongs to the ball whose centre y is the point nearest to x among all centres at which a ball of
radius r fits outside the part. The set of centres is bounded by offset surfaces that meet in creases (the spine of a
fillet, the centre of a corner ball, the tip over a plugged hole); y is found by linearising the offsets of the
features that the ball touches and projecting x onto their half-spaces, over and over (sequential quadratic
programming). Converges quadratically for smooth features.

Not promised: a centre farther than ``_REACH`` spacings from the rough one is not found; the rough one stays.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .implicit import Evaluate, FloatArray
from .kernels import ball_steps, halfspaces

#: Half-spaces kept for each centre: three hold it; over the rim of a hole it needs some more to choose from.
_PLANES = 8

#: Longest step, in spacings and in radii. The rough centre is right within 0.07 spacings, so that a step of this length
#: cuts into the features that hold it; a shorter one leaves the linearised ones more nearly right.
_STEP_SPACING = 0.3
_STEP_RADIUS = 0.06

#: Farthest that a polished centre may be from the rough one, in spacings: where faces meet at a shallow angle, as on
#: crossing cylinders of one radius near their poles, the spine is off by more than one.
_REACH = 2.5

#: Features are looked up from this share of the radius towards them, where they alone are nearest.
_LOOK_AHEAD = 0.3

#: Normals closer than this cosine (20 degrees) belong to the same feature, seen from nearby.
_SAME_FEATURE = 0.94

#: Normals are of the same feature, seen again, if they differ by less than this, or little more than the places; rough
#: values see the facets of another contour.
_SAME_NORMAL = 1e-6
_ROUGH_SAME_NORMAL = 0.05

#: Rounds of projecting and looking: planar contacts need two, doubly curved ones five, rims of holes up to a dozen.
_ROUNDS = 12

#: A place is right if the ball there cuts into the part by less than this many spacings, and projecting anew changes
#: its distance from the point by less than …
_CUT = 1e-4

#: … this many. The facets of a curved face (tessellated to 3e-4 spacings) move the centre to and fro by 0.05 spacings
#: along its spine, which changes the distance by as little.
_CLOSE = 1e-4

#: Places that are not right, but where the ball cuts in by less than this many spacings, are better than nothing:
#: between the facets of hollow faces the rounds may go to and fro.
_FITS = 2e-3

#: The same with rough values, …
_ROUGH_CUT = 0.05
_ROUGH_CLOSE = 1e-3
_ROUGH_FITS = 0.15

#: … in so many rounds. (With 0.05 spacings for the last resort a few points of a bracket were not found, and polishing
#: those by better values took two thirds of all calls.)
_ROUGH_ROUNDS = 6

#: Looks at better values, and the move in spacings by one after which another is needed: half its square over the
#: radius is left.
_CORRECTIONS = 3
_AGAIN = 0.05

#: Largest multiple of the last move by which the secant method may extrapolate.
_FARTHEST = 10.0


def polish_centres(
    part: Evaluate,
    radius: float,
    spacing: float,
    points: FloatArray,
    centres: FloatArray,
    *,
    within: Callable[[FloatArray, float], NDArray[np.bool_]] | None = None,
    better: Evaluate | None = None,
    threads: int | None = None,
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Centres of the balls that touch a fillet nearest to given points.

    Parameters
    ----------
    part : callable
        Maps points (N, 3) to exact distances (N,), positive inside, and their gradients (N, 3); the balls lie outside.
    radius : float
        Of the ball in mm.
    spacing : float
        Rough centres are right within a small share of this, in mm.
    points : (N, 3) float64
        Points on or near the fillet.
    centres : (N, 3) float64
        Rough centres.
    within : callable, optional
        Tells whether the part comes nearer to points (N, 3) than a radius, cheaper than ``part`` would.
    better : callable, optional
        As ``part``, which is rough then: looked at only at the end, at the features that hold the centres.
    threads : int, optional
        Default: all cores.

    Returns
    -------
    centres : (N, 3) float64
    accepted : (N,) bool
        Where the polish converged; elsewhere the rough centre is returned.
    """
    problem = _Problem(part, radius, spacing, points, centres, within, better is not None, threads)
    active = np.arange(len(points))
    for _ in range(problem.rounds):
        if len(active) == 0:
            break
        with parallel.threads(threads, parallel.QUERY * len(active)):
            active = problem.advance(active)
    found = problem.settled | np.isfinite(problem.shortest)
    polished = centres + radius * problem.best
    if better is not None:
        with parallel.threads(threads, parallel.QUERY * len(points)):
            problem.correct(np.flatnonzero(found), better)
        polished = centres + radius * problem.best
        left = np.flatnonzero(~found)
        if len(left):
            polished[left], found[left] = polish_centres(
                better, radius, spacing, points[left], centres[left], threads=threads
            )
    return polished, found


class _Problem:
    """One projection onto half-spaces for each point, batched; lengths in radii, from the rough centre."""

    def __init__(
        self,
        part: Evaluate,
        radius: float,
        spacing: float,
        points: FloatArray,
        centres: FloatArray,
        within: Callable[[FloatArray, float], NDArray[np.bool_]] | None,
        rough: bool,
        threads: int | None,
    ) -> None:
        count = len(points)
        self.part, self.within, self.radius, self.origin, self.threads = part, within, radius, centres, threads
        self.target = (points - centres) / radius
        self.step = min(_STEP_SPACING * spacing / radius, _STEP_RADIUS)
        self.reach = _REACH * spacing / radius
        unit = spacing / radius
        #: By how much the ball may cut into the part, and how far the last projection may move it.
        self.cut = (_ROUGH_CUT if rough else _CUT) * unit
        self.close = (_ROUGH_CLOSE if rough else _CLOSE) * unit
        self.same_normal = _ROUGH_SAME_NORMAL if rough else _SAME_NORMAL
        self.rounds = _ROUGH_ROUNDS if rough else _ROUNDS
        self.fits = (_ROUGH_FITS if rough else _FITS) * unit
        self.again = _AGAIN * unit
        self.normals, self.offsets = np.zeros((count, _PLANES, 3)), np.zeros((count, _PLANES))
        self.seen_from = np.zeros((count, _PLANES, 3))
        self.counts = np.zeros(count, np.int64)
        #: Where to look next, how far that is from the part less the radius, and where to look from there.
        self.place, self.gap, self.goal = np.zeros((count, 3)), np.zeros(count), np.zeros((count, 3))
        #: From where steps are measured: a place that cuts into nothing new.
        self.base = np.zeros((count, 3))
        #: Last place, its projection, and the half-spaces that held it.
        self.before, self.before_goal = np.zeros((count, 3)), np.zeros((count, 3))
        self.held = np.full(count, -1, np.int64)
        self.settled = np.zeros(count, bool)
        #: The nearest place that fits, for those that do not settle.
        self.best, self.shortest = np.zeros((count, 3)), np.full(count, np.inf)
        #: … and the half-spaces that hold it.
        self.best_normals, self.best_offsets = np.zeros((count, 3, 3)), np.zeros((count, 3))
        self.best_count = np.zeros(count, np.int64)
        self._look(np.arange(count), centres, np.ones(count, np.bool_))

    def advance(self, which: NDArray[np.intp]) -> NDArray[np.intp]:
        """Step towards the goals and look; returns what is not settled yet.

        Places that have arrived should fit; that they do is all that need be known.
        """
        near, arrived, points = ball_steps.step(
            which, self.base, self.goal, self.step, self.reach, self.origin, self.radius, self.place
        )
        if not near.all():
            which, arrived, points = which[near], arrived[near], points[near]
        looks = np.ones(len(which), np.bool_)
        if self.within is not None and arrived.any():
            looks[arrived] = self.within(points[arrived], self.radius * (1 - self.cut))
        mask = self._look(which, points, looks)
        self._refine(which[arrived], mask[arrived])
        return which[~self.settled[which]]

    def _look(self, which: NDArray[np.intp], points: FloatArray, looks: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Measure how far balls are from the part, add the features that they cut into, and project.

        Returns the bit masks of the planes that hold them.
        """
        row = np.where(looks, np.cumsum(looks) - 1, -1)
        value, gradient = self.part(points[looks]) if looks.any() else (np.zeros(0), np.zeros((0, 3)))
        with parallel.threads(self.threads, len(which)):
            mask: NDArray[np.int64] = ball_steps.look(
                which, row, value, gradient, self.radius, self.cut, self.same_normal, self.target, self.normals,
                self.offsets, self.seen_from, self.counts, self.held, self.place, self.base, self.gap, self.goal,
            )  # fmt: skip
        return mask

    def _refine(self, which: NDArray[np.intp], mask: NDArray[np.int64]) -> None:
        """Linearise what holds the centres anew and project again; settles those that this does not move.

        Projections alone converge linearly where a spine is curved, because the half-spaces are flat. The secant
        method for fixed points (Anderson 1965, DOI 10.1145/321296.321305) makes up for it.
        """
        query, plane, points = ball_steps.holding(
            which, mask, self.normals, self.place, self.origin, self.radius, _LOOK_AHEAD
        )
        if len(query):
            ball_steps.linearize(
                query, plane, *self.part(points), self.radius, _LOOK_AHEAD, _SAME_FEATURE, self.normals, self.offsets,
                self.seen_from, self.place,
            )  # fmt: skip
        with parallel.threads(self.threads, len(which)):
            ball_steps.settle(
                which, self.cut, self.close, self.fits, _FARTHEST, self.target, self.normals, self.offsets, self.counts,
                self.place, self.gap, self.goal, self.before, self.before_goal, self.held, self.settled, self.best,
                self.shortest, self.best_normals, self.best_offsets, self.best_count,
            )  # fmt: skip

    def correct(self, which: NDArray[np.intp], better: Evaluate) -> None:
        """Linearise what holds the centres by better values and project anew."""
        for _ in range(_CORRECTIONS):
            which = which[self.best_count[which] > 0]
            if len(which) == 0:
                break
            row, slot = np.nonzero(np.arange(3) < self.best_count[which, None])
            query = which[row]
            old = self.best_normals[query, slot]
            normal, offset = self._half_spaces(query, self.best[query] - _LOOK_AHEAD * old, better)
            same = (normal * old).sum(axis=1) > _SAME_FEATURE
            query, slot = query[same], slot[same]
            self.best_normals[query, slot], self.best_offsets[query, slot] = normal[same], offset[same]
            before = self.best[which]
            with parallel.threads(self.threads, len(which)):
                self.best[which], _ = halfspaces.nearest_feasible_many(
                    which, self.target, self.best_normals, self.best_offsets, self.best_count, self.best
                )
            which = which[np.linalg.norm(self.best[which] - before, axis=1) > self.again]

    def _half_spaces(
        self, which: NDArray[np.intp], places: FloatArray, look: Evaluate
    ) -> tuple[FloatArray, FloatArray]:
        """Give normals and offsets of the features nearest to some places."""
        value, gradient = look(self.origin[which] + self.radius * places)
        normal = -gradient
        return normal, 1 + value / self.radius + (normal * places).sum(axis=1)
