"""The ``exact`` engine: closing and opening of an exact distance, exact wherever nothing changes.

The closing of a part by a ball is what the ball cannot reach from outside. With S the surface of all positions of its
centre next to the part (the offset by r), the exact distance to the closing is::

    phi                where phi <= -r, or where the ball pushed against the nearest point of the part fits
    distance(S) - r    elsewhere

so unchanged faces stay on the original, and the result is an exact distance again: operations nest. The opening is
the closing of the complement, the offset by r the closing moved by r, smoothing one after the other.

S is contoured with its creases (:mod:`cad_implicit.dual`), and only unsigned distances to it are used: signs always
come from the part. At the points of the result the ball's centre is polished (:mod:`cad_implicit.polish`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .distance import MeshDistance
from .dual import dual_contour
from .implicit import FloatArray, Implicit
from .parallel import Progress, no_progress
from .polish import polish_centres

#: A pushed ball fits if nothing of the part is deeper in it than this share of the radius …
_FIT_RADIUS = 1e-6

#: … and this share of the spacing.
_FIT_SPACING = 1e-5

#: The distance to S counts only if it differs from the part's own by this share of the spacing.
_CHANGED = 1e-7


class Shifted(Implicit):
    """A shape grown by ``amount`` mm; an exact distance only outside it, but with the exact surface."""

    def __init__(self, parent: Implicit, amount: float) -> None:
        self.parent = parent
        self.amount = amount
        self.lipschitz = parent.lipschitz
        self.bounds = parent.bounds + [[-amount], [amount]]

    def __call__(self, points: ArrayLike) -> FloatArray:
        return np.asarray(self.parent(points) + self.amount)

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        value, gradient = self.parent.value_and_gradient(points)
        return value + self.amount, gradient


class Complement(Implicit):
    """Everything outside a shape."""

    def __init__(self, parent: Implicit) -> None:
        self.parent = parent
        self.lipschitz = parent.lipschitz
        self.bounds = parent.bounds

    def __call__(self, points: ArrayLike) -> FloatArray:
        return -self.parent(points)

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        value, gradient = self.parent.value_and_gradient(points)
        return -value, -gradient

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients, polished if the parent can."""
        value, gradient = polished(self.parent, points)
        return -value, -gradient


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
    """

    lipschitz = 1.0

    def __init__(
        self,
        parent: Implicit,
        radius: float,
        spacing: float,
        *,
        threads: int | None = None,
        progress: Progress = no_progress,
    ) -> None:
        self.parent = parent
        self.radius = radius
        self.bounds = parent.bounds
        self._threads = threads
        self._slack = _FIT_RADIUS * radius + _FIT_SPACING * spacing
        self._changed = _CHANGED * spacing
        centres = dual_contour(Shifted(parent, radius), spacing, threads=threads, progress=progress)
        self._centres = MeshDistance(centres, sign="pseudonormal", threads=threads)

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        value, gradient, _, _ = self._evaluate(np.asarray(points, np.float64))
        return value, gradient

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients from polished ball centres: for points of the result."""
        value, gradient, which, centre = self._evaluate(points)
        if len(which):
            x = points[which]
            centre, _ = polish_centres(self.parent, self.radius, x, centre, threads=self._threads)
            arm = x - centre
            length = np.linalg.norm(arm, axis=1)
            value[which] = length - self.radius
            gradient[which] = arm / length[:, None]
        return value, gradient

    def _evaluate(self, x: FloatArray) -> tuple[FloatArray, FloatArray, np.ndarray, FloatArray]:
        """Values, gradients, and for the points that the closing changes their numbers and rough ball centres."""
        value, gradient = self.parent.value_and_gradient(x)
        value, gradient = value.copy(), gradient.copy()
        which = np.flatnonzero(value > -self.radius)
        pushed = x[which] - (value[which] + self.radius)[:, None] * gradient[which]
        which = which[self.parent.within(pushed, self.radius - self._slack)]
        nearest = self._centres.closest(x[which])
        changed = nearest.distance - self.radius > value[which] + self._changed
        which, distance, centre = which[changed], nearest.distance[changed], nearest.point[changed]
        value[which] = distance - self.radius
        gradient[which] = (x[which] - centre) / distance[:, None]
        return value, gradient, which, centre


def polished(shape: Implicit, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values and gradients, as exact as the shape knows them."""
    better = getattr(shape, "polished", shape.value_and_gradient)
    value, gradient = better(points)
    return value, gradient
