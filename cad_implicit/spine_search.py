"""Samples along a spine, in groups, that tell which piece of it is nearest to a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .guides import hermite
from .implicit import FloatArray

#: Points along a spine that tell the nearest piece, in radii: where a ball goes around a slot that is hardly wider,
#: there and back are nearly in one place; and the most of them in a piece.
_FINE = 0.02
_MOST = 5000

#: Length of a group of them, in reaches.
_COARSE = 0.2


@dataclass(frozen=True, eq=False)
class SpineSamples:
    """What :func:`~cad_implicit.kernels.spine_samples.nearest_sample` needs.

    Attributes
    ----------
    middles : (G, 3) float64
    members : (G + 1,) int64
    points : (M, 3) float64
    pieces : (M,) int64
        Piece of the spine that each point is of.
    gap : float
    """

    middles: FloatArray
    members: NDArray[np.int64]
    points: FloatArray
    pieces: NDArray[np.int64]
    gap: float


def spine_samples(
    origins: FloatArray, tangents: FloatArray, spans: FloatArray, radius: float, reach: float
) -> SpineSamples:
    """Find samples of a spine.

    Parameters
    ----------
    origins, tangents : (N, 3) float64
        Of the pieces, which are cubics of Hermite.
    spans : (N - 1,) float64
        Their lengths in mm.
    radius, reach : float
        Smallest of its balls, and how far a strip along it reaches, in mm.
    """
    counts = np.ceil(spans / (_FINE * radius)).astype(np.int64).clip(1, _MOST)
    piece = np.repeat(np.arange(len(counts)), counts)
    t = (np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[piece]
    v, w = (spans[piece][:, None] * tangents[piece + i] for i in (0, 1))
    points = hermite(origins[piece], origins[piece + 1], v, w, t[:, None])
    ways = np.cumsum((spans / counts)[piece])
    group = (ways / (_COARSE * reach)).astype(np.int64)
    first = np.flatnonzero(np.diff(group, prepend=-1))
    members = np.append(first, len(piece))
    middle = (members[:-1] + members[1:] - 1) // 2
    before = np.concatenate([[0.0], ways])
    gap = np.maximum(before[members[1:]] - before[middle], before[middle + 1] - before[members[:-1]])
    return SpineSamples(points[middle], members, points, piece, float(gap.max()))
