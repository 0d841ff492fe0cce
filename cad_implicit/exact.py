"""The ``exact`` engine: closing and opening of an exact distance, exact wherever nothing changes.

The closing of a part by a ball is what the ball cannot reach from outside. With S the surface of all positions of its
centre next to the part (the offset by r), the exact distance to the closing is::

    phi                where phi <= -r, or where the ball pushed against the nearest point of the part fits
    distance(S) - r    elsewhere

so unchanged faces stay on the original, and the result is an exact distance again: operations nest. The opening is
the closing of the complement, the offset by r the closing moved by r, smoothing one after the other.

S is contoured with its creases (:mod:`cad_implicit.dual`), and only unsigned distances to it are used: signs always
come from the part. At the points of the result the ball's centre is polished (:mod:`cad_implicit.blends`).
"""

from __future__ import annotations

from functools import cached_property, partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .blend_zone import Zoned, blend_zone
from .blends import blended
from .centres import Centres
from .distance import MeshDistance, Surface
from .dual import dual_contour
from .errors import EmptyResultError
from .implicit import Affine, FloatArray, Implicit, polished
from .inscribed import nothing_left
from .parallel import Progress, no_progress
from .regions import Region

#: Largest distance between result and truth: facets of vertices that lie on a blend miss it by their sagitta, this many
#: spacings² / radius where they could not be split (elsewhere an eighth of that) …
SAGITTA = 0.35

#: … and sharp edges that remain are off by this many spacings (99.9 % of their length).
SHARP_EDGE = 0.02

#: A pushed ball fits if nothing of the part is deeper in it than this share of the radius …
_FIT_RADIUS = 1e-6

#: … and this share of the spacing; what that leaves out is less than 1e-3 spacings deep. The facets of holes stay below
#: (a ball pushed against one cuts into its neighbours), so that they do not take the errors of S, 0.04 spacings, which
#: bent the surface of centres of the next operation by 0.3. Tests with room to spare end sooner, too.
_FIT_SPACING = 0.02

#: The distance to S counts only if it differs from the part's own by this share of the spacing.
_CHANGED = 1e-7

#: Centres are needed within the radius and so many spacings of a region: bricks of 8 cells are sampled if their middles
#: are within 7.8 of the surface, and two bricks at the border of what is contoured are missing.
AROUND = 26.0

#: The plane that a pushed ball touches is the one it was pushed against if both agree within so many tolerances, …
_SAME_PLANE = 3.0

#: … and this cosine.
_SAME_DIRECTION = 0.999


class Shifted(Implicit):
    """A shape grown by ``amount`` mm: the right surface, and exact distances on its far side only."""

    def __init__(self, parent: Implicit, amount: float) -> None:
        self.parent = parent
        self.amount = amount
        self.lipschitz = parent.lipschitz
        self.spacing, self.rough = parent.spacing, parent.rough
        self.bounded = parent.bounded
        growth = max(amount if parent.bounded else -amount, 0.0)
        self.bounds = parent.bounds + [[-growth], [growth]]

    def __call__(self, points: ArrayLike) -> FloatArray:
        return np.asarray(self.parent(points) + self.amount)

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        value, gradient = self.parent.value_and_gradient(points)
        return value + self.amount, gradient

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients, as exact as the parent knows them."""
        value, gradient = polished(self.parent, points)
        return value + self.amount, gradient

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where the parent is linear."""
        value, gradient, holds = self.parent.affine_within(points, radius, tolerance)
        return value + self.amount, gradient, holds

    def roughly(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Bounds ``(N,)`` of the values."""
        low, high = self.parent.roughly(points)
        return low + self.amount, high + self.amount


class Complement(Implicit):
    """Everything outside a shape; :func:`complement` makes it."""

    def __init__(self, parent: Implicit) -> None:
        self.parent = parent
        self.lipschitz = parent.lipschitz
        self.exact_inside, self.exact_outside = parent.exact_outside, parent.exact_inside
        self.spacing, self.radius, self.rough = parent.spacing, parent.radius, parent.rough
        self.bounds, self.bounded = parent.bounds, not parent.bounded

    def __call__(self, points: ArrayLike) -> FloatArray:
        return -self.parent(points)

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        value, gradient = self.parent.value_and_gradient(points)
        return -value, -gradient

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients, as exact as the parent knows them."""
        value, gradient = polished(self.parent, points)
        return -value, -gradient

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where the parent is linear."""
        value, gradient, holds = self.parent.affine_within(points, radius, tolerance)
        return -value, -gradient, holds

    def roughly(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Bounds ``(N,)`` of the values."""
        low, high = self.parent.roughly(points)
        return -high, -low

    def within(self, points: ArrayLike, radius: ArrayLike) -> NDArray[np.bool_]:
        """Whether the surface comes nearer to points than a radius."""
        return self.parent.within(points, radius)


class Closing(Implicit):
    """Exact distance to the closing of a part by a ball.

    Parameters
    ----------
    parent : Implicit
        Exact distance to the part in mm.
    radius : float
        In mm.
    spacing : float
        Grid spacing in mm at which the surface of ball centres is contoured.
    threads : int, optional
        Default: all cores.
    progress : callable
        May raise to cancel.
    region : Region, optional
        Where values are needed; by default everywhere.
    zoned : bool
        Whether in a region only values near the surface are needed.

    Raises
    ------
    EmptyResultError
        If there is no position for the ball.
    """

    lipschitz = 1.0
    exact_inside = exact_outside = rough = True
    spacing: float
    radius: float

    def __init__(
        self,
        parent: Implicit,
        radius: float,
        spacing: float,
        *,
        threads: int | None = None,
        progress: Progress = no_progress,
        region: Region | None = None,
        zoned: bool = True,
    ) -> None:
        self.parent = parent
        self.radius = radius
        self.spacing = spacing
        self.bounds, self.bounded = parent.bounds, parent.bounded
        self._threads = threads
        self._slack = _FIT_RADIUS * radius + _FIT_SPACING * spacing
        self._changed = _CHANGED * spacing
        offset = Shifted(parent, radius) if parent.bounded else Shifted(complement(parent), -radius)
        make = partial(Centres, parent, offset, radius, spacing, threads=threads, progress=progress)
        self._centres: Centres | Zoned
        self._surface: Surface
        if region is None:
            self._centres = make()
            self._surface = self._centres.surface
        else:
            zone = blend_zone(parent, radius, spacing, region, self.affine_within, progress) if zoned else region
            self._centres = self._surface = Zoned(
                zone, lambda around: make(region=around.grown(radius + AROUND * spacing))
            )

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        x = np.asarray(points, np.float64)
        value, gradient = (array.copy() for array in self.parent.value_and_gradient(x))
        which, distance, centre = self._candidates(x, value, gradient)
        changed = distance - self.radius > value[which] + self._changed
        self._set(x, value, gradient, which[changed], centre[changed])
        return value, gradient

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients from polished ball centres: for points of the result."""
        value, gradient = blended(self.parent, self._surface, self.radius, self.spacing, points, threads=self._threads)
        self._centres.fill_tight(points, value, gradient)
        return value, gradient

    def roughly(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Bounds ``(N,)`` of the values: a closing raises those of the parent by the radius at most."""
        low, high = self.parent.roughly(points)
        return low, high + self.radius

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where the parent is linear, and around the pushed ball's centre too, so that the ball fits."""
        value, gradient, holds = self.parent.affine_within(points, radius, tolerance)
        which = np.flatnonzero(holds & (value + radius > -self.radius))
        pushed = self._pushed(points, value, gradient, which)
        there, direction, fits = self.parent.affine_within(pushed, radius, tolerance)
        fits &= np.abs(there + self.radius) <= _SAME_PLANE * tolerance
        fits &= (direction * gradient[which]).sum(axis=1) > _SAME_DIRECTION
        holds[which] = fits
        return value, gradient, holds

    def within(self, points: ArrayLike, radius: ArrayLike) -> NDArray[np.bool_]:
        """Whether the surface comes nearer to points than a radius, to 0.02 spacings or so."""
        x = np.asarray(points, np.float64)
        radii = np.broadcast_to(np.asarray(radius, np.float64), len(x))
        # Farther than the ball's radius from the part nothing changes outside, and grows inside.
        near = self.parent.within(x, np.maximum(radii, self.radius - self._slack))
        near[near] = np.abs(self(x[near])) < radii[near]
        return near

    def _pushed(self, x: FloatArray, value: FloatArray, gradient: FloatArray, which: NDArray[np.intp]) -> FloatArray:
        """Centres of the balls pushed against the part's points nearest to some of the points."""
        return np.asarray(x[which] - (value[which] + self.radius)[:, None] * gradient[which])

    def _candidates(
        self, x: FloatArray, value: FloatArray, gradient: FloatArray
    ) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """Numbers of the points that the closing may change, their distances from S and the nearest points of S."""
        which = np.flatnonzero(value > -self.radius)
        which = which[self.parent.within(self._pushed(x, value, gradient, which), self.radius - self._slack)]
        distance, centre = self._surface.closest(x[which])
        return which, distance, centre

    def _set(
        self, x: FloatArray, value: FloatArray, gradient: FloatArray, which: NDArray[np.intp], centre: FloatArray
    ) -> None:
        """Set values and gradients by the nearest ball centres, where they differ from the part's."""
        arm = x[which] - centre
        length = np.linalg.norm(arm, axis=1)
        filled = length - self.radius > value[which]
        which, arm, length = which[filled], arm[filled], length[filled]
        value[which] = length - self.radius
        gradient[which] = arm / length[:, None]


class Dilation(Implicit):
    """Exact distance to a part grown by ``amount`` mm: its closing, moved by as much.

    The surface itself needs no closing, so that is made only when distances are asked for.
    """

    lipschitz = 1.0
    exact_inside = exact_outside = rough = True

    def __init__(self, parent: Implicit, amount: float, spacing: float, *, threads: int | None = None) -> None:
        self.surface = Shifted(parent, amount)
        self.spacing = spacing
        self.bounds, self.bounded = self.surface.bounds, parent.bounded
        self._threads = threads

    @cached_property
    def _distance(self) -> Shifted:
        parent, amount = self.surface.parent, self.surface.amount
        assert self.spacing is not None
        return Shifted(Closing(parent, amount, self.spacing, threads=self._threads), amount)

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self._distance(points)

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        return self._distance.value_and_gradient(points)

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients, as exact as the closing knows them."""
        return self._distance.polished(points)

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where the closing is linear."""
        return self._distance.affine_within(points, radius, tolerance)


def complement(shape: Implicit) -> Implicit:
    """Everything outside a shape."""
    return shape.parent if isinstance(shape, Complement) else Complement(shape)


def surface_of(shape: Implicit) -> Implicit:
    """Give the cheapest bounded shape with the same surface."""
    if isinstance(shape, Complement) and isinstance(shape.parent, Dilation):
        outer = shape.parent.surface
        return Shifted(complement(outer.parent), -outer.amount)
    return shape.surface if isinstance(shape, Dilation) else shape


def distance_to(
    shape: Implicit,
    spacing: float,
    side: Literal["inside", "outside", "both"] = "both",
    *,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Implicit:
    """Exact distance to a shape on the side where it matters.

    The shape itself if it knows it, else the distance to its contour at ``spacing`` mm. A closing needs distances
    outside, an opening inside.
    """
    if {"outside": shape.exact_outside, "inside": shape.exact_inside, "both": shape.exact}[side]:
        return shape
    mesh = dual_contour(shape, spacing, threads=threads, progress=progress)
    return MeshDistance(mesh, sign="pseudonormal", threads=threads)


def opening(
    part: Implicit,
    radius: float,
    spacing: float,
    *,
    threads: int | None = None,
    progress: Progress = no_progress,
    region: Region | None = None,
    zoned: bool = True,
) -> Implicit:
    """Round of radius ``radius`` mm: the closing of the complement."""
    try:
        outside = Closing(
            complement(part), radius, spacing, threads=threads, progress=progress, region=region, zoned=zoned
        )
        return complement(outside)
    except EmptyResultError:
        raise nothing_left(part, radius) from None


def smoothing(
    part: Implicit,
    radius: float,
    spacing: float,
    *,
    first: Literal["round", "fillet"] = "round",
    threads: int | None = None,
    progress: Progress = no_progress,
    region: Region | None = None,
) -> Implicit:
    """Round and fillet of radius ``radius`` mm, one after the other."""
    one, other = (opening, Closing) if first == "round" else (Closing, opening)
    # Values are asked for around the second one's centres, and where these are pushed to.
    around = None if region is None else region.grown(2 * (radius + AROUND * spacing))
    rounded = one(part, radius, spacing, threads=threads, progress=progress, region=around, zoned=False)
    return other(rounded, radius, spacing, threads=threads, progress=progress, region=region)


def offset(part: Implicit, distance: float, spacing: float, *, threads: int | None = None) -> Implicit:
    """Offset by ``distance`` mm: positive grows."""
    if distance > 0:
        return Dilation(part, distance, spacing, threads=threads)
    return complement(Dilation(complement(part), -distance, spacing, threads=threads))
