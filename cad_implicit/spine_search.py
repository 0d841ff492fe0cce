"""Which piece of a spine is nearest to points, and how far it is at least."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .guides import hermite
from .implicit import FloatArray

#: Points along a spine that tell the nearest piece, in radii: where a ball goes around a slot that is hardly wider,
#: there and back are nearly in one place; and the most of them in a piece.
_FINE = 0.02
_MOST = 5000

#: Points that tell what is farther off than a strip reaches, in reaches: among the fine ones a point on the axis of a
#: ring has all as candidates (the rounds of a flange took 60 s of processor time so, and 15 s in this way).
_COARSE = 0.2

#: More points than this are looked up by several threads.
_MANY = 5000


class SpineSearch:
    """Nearest pieces of a spine.

    Parameters
    ----------
    origins, tangents : (N, 3) float64
        Of the pieces, which are cubics of Hermite.
    spans : (N - 1,) float64
        Their lengths in mm.
    radius, reach : float
        Smallest of its balls, and how far a strip along it reaches, in mm.
    """

    def __init__(
        self, origins: FloatArray, tangents: FloatArray, spans: FloatArray, radius: float, reach: float
    ) -> None:
        self._origins, self._tangents, self._spans = origins, tangents, spans
        self._radius, self._reach = radius, reach

    def nearest(self, points: FloatArray, most: float = np.inf) -> tuple[FloatArray, NDArray[np.int64]]:
        """Distances (N,) to the spine, nearly, and pieces (N,) of it to start looking from; inf and any beyond most."""
        tree, pieces = self._fine
        away, sample = tree.query(points, distance_upper_bound=most, workers=_workers(points))
        return away, pieces[np.minimum(sample, len(pieces) - 1)]

    def at_least(self, points: FloatArray) -> FloatArray:
        """Distances (N,) to the spine that are not too large, and too small by a fraction of the reach."""
        tree, gap = self._coarse
        away, _ = tree.query(points, workers=_workers(points))
        return np.asarray(away - gap)

    @cached_property
    def _fine(self) -> tuple[cKDTree, NDArray[np.int64]]:
        """Points all along the spine, and the pieces they are of."""
        counts = np.ceil(self._spans / (_FINE * self._radius)).astype(np.int64).clip(1, _MOST)
        piece = np.repeat(np.arange(len(counts)), counts)
        t = (np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[piece]
        p, q = self._origins[piece], self._origins[piece + 1]
        v, w = (self._spans[piece][:, None] * self._tangents[piece + i] for i in (0, 1))
        return cKDTree(hermite(p, q, v, w, t[:, None])), piece

    @cached_property
    def _coarse(self) -> tuple[cKDTree, float]:
        """Fewer points all along the spine, and how much nearer than they the spine may be."""
        tree, piece = self._fine
        ways = np.cumsum((self._spans / np.bincount(piece))[piece])
        rows = np.unique(np.searchsorted(ways, np.arange(0.0, ways[-1], _COARSE * self._reach)))
        rows = np.unique(np.append(rows[rows < len(piece)], len(piece) - 1))
        return cKDTree(tree.data[rows]), float(np.diff(ways[rows], prepend=0.0).max())


def _workers(points: FloatArray) -> int:
    return -1 if len(points) > _MANY else 1
