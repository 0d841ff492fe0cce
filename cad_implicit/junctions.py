"""Where borders meet: the exact places of vertices, and vertices of the mesh that are two in truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .blend_curves import Curve
from .blend_labels import Outward
from .implicit import FloatArray

#: Rounds towards where curves and surfaces meet.
_ROUNDS = 60


@dataclass(frozen=True, eq=False)
class Meeting:
    """Curves and surfaces that pass through one vertex."""

    curves: Sequence[Curve]
    surfaces: Sequence[Outward]

    def place(self, near: FloatArray, still: float) -> FloatArray:
        """Place (3,) where all meet, near a point: the last move towards each of them was less than ``still`` mm."""
        x = near[None].copy()
        for _ in range(_ROUNDS):
            before = x.copy()
            for surface in self.surfaces:
                value, normal = surface.value_and_normal(x)
                x = x - value[:, None] * normal
            for curve in self.curves:
                x = curve.at(curve.way(x))
            if float(np.abs(x - before).max()) < still:
                break
        return np.asarray(x[0])

    def off(self, point: FloatArray) -> float:
        """Largest distance in mm of a point (3,) from them."""
        x = point[None]
        away = [float(np.abs(surface.value_and_normal(x)[0][0])) for surface in self.surfaces]
        away += [float(np.linalg.norm(curve.at(curve.way(x)) - x)) for curve in self.curves]
        return max(away, default=0.0)


def pairings(sides: Sequence[tuple[int, int]]) -> list[tuple[tuple[int, int], tuple[int, int], tuple[int, int]]]:
    """Ways in which a vertex of four chains may be two vertices of two, with a short border between these.

    Parameters
    ----------
    sides : sequence of (int, int)
        Patches beside each chain.

    Returns
    -------
    list of tuples
        Positions of both chains of the one vertex and of the other, and the patches beside the border; none unless
        four patches go around the vertex.
    """
    patches = sorted({patch for both in sides for patch in both})
    if len(sides) != 4 or len(patches) != 4:
        return []
    found = []
    for other in patches[1:]:
        one = patches[0]
        first = [n for n, both in enumerate(sides) if one in both]
        second = [n for n, both in enumerate(sides) if other in both]
        if len(first) == len(second) == 2 and not set(first) & set(second):
            rest = [patch for patch in patches if patch not in (one, other)]
            found.append(((first[0], first[1]), (second[0], second[1]), (rest[0], rest[1])))
            between = [n for n, both in enumerate(sides) if rest[0] in both]
            beyond = [n for n, both in enumerate(sides) if rest[1] in both]
            found.append(((between[0], between[1]), (beyond[0], beyond[1]), (one, other)))
    return found
