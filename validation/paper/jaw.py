"""A human lower jaw of convolution surfaces: bone and teeth as skeletons of line segments.

The skeleton is laid out in mm of an adult's jaw: x to the side, the chin towards -y, z up, the lower border of the
body at z = 0. :func:`jaw` scales it so that the paper's wall of 0.1 is the compact bone of 3.6 mm.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cad_implicit import convolution, r_union
from cad_implicit.implicit import Implicit

#: Units of the model per mm: the jaw is 3.4 wide, and the offset of 0.1 needs ten iterations on 128 nodes.
SCALE = 1 / 36

#: Middle of the body's lower border and of the tooth row, from the chin to the angle: x, y, z.
_LOWER = [(0, -45, 6), (11, -43.5, 5.5), (20, -37, 5.5), (27, -26, 6), (33, -13, 6.5), (39, 2, 8), (45, 21, 15)]
_MIDDLE = [(0, -43, 15), (10, -41.5, 15), (19, -35, 15), (25.5, -24.5, 15), (30.5, -12, 16), (37, 1, 18), (44, 15, 24)]
_UPPER = [(0, -42, 24), (9, -40.5, 24), (17.5, -34, 24), (22.5, -24, 24), (26, -12, 25), (31, 0, 27), (41, 9, 36)]

#: The plate of the ramus: lines from the angle up to the notch, back to front.
_RAMUS = [
    [(46, 28, 19), (48, 31, 32), (50, 34, 50)],
    [(45.5, 21, 17), (47, 25, 30), (48.5, 28, 46)],
    [(45, 15, 26), (46.5, 19, 34), (48, 21, 43)],
    [(42, 9, 34), (45, 11, 40), (47, 13, 45)],
]

#: The condyle's neck and head, and the coronoid process.
_CONDYLE = [[(50, 34, 50), (50.5, 35, 58)], [(43, 34, 62.5), (50, 35, 64)], [(50, 35, 64), (58, 36.5, 62.5)]]
_CORONOID = [[(46, 9.5, 43), (48, 6, 61)], [(48, 16.5, 44), (48, 6, 61)]]

#: The chin's protuberance.
_CHIN = [[(-7, -49.5, 5), (7, -49.5, 5)]]

#: Teeth from the middle backward, four cusps for a molar: place along the row in mm, radius, half the distance of the
#: cusps across the row and along it, lower and upper end.
_TEETH = [
    (2.7, 2.5, 0.0, 0.0, 27.0, 35.0),
    (8.3, 2.6, 0.0, 0.0, 27.0, 35.0),
    (14.5, 3.0, 0.0, 0.0, 27.0, 35.5),
    (21.6, 3.2, 1.4, 0.0, 28.0, 33.5),
    (29.0, 3.2, 1.6, 0.0, 28.0, 33.5),
    (37.9, 2.6, 2.6, 2.2, 29.0, 33.5),
    (48.5, 2.6, 2.6, 2.2, 30.0, 34.0),
]

#: Radius and width in mm of the bone's kernels, and width of the teeth's.
_BONE_RADIUS, _BONE_WIDTH, _TOOTH_WIDTH = 7.0, 7.0, 1.5


def _chain(points: list[tuple[float, float, float]]) -> list[list[tuple[float, float, float]]]:
    return [[a, b] for a, b in pairwise(points)]


def _bone() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Segments (M, 2, 3) in mm of both halves, and their weights (M,)."""
    half: list[list[tuple[float, float, float]]] = []
    weights: list[float] = []
    for chains, weight in (
        ([_LOWER, _MIDDLE, _UPPER], 0.58),
        (_RAMUS, 0.33),
        (_CONDYLE, 0.62),
        (_CORONOID, 0.32),
    ):
        for chain in chains:
            half += _chain(chain)
            weights += [weight] * (len(chain) - 1)
    right = np.array(half, np.float64)
    segments = np.concatenate([right, right * [-1, 1, 1], np.array(_CHIN, np.float64)])
    return segments, np.array([*weights, *weights, 0.3])


def _teeth() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Segments (M, 2, 3) in mm of the crowns of both halves, and their radii (M,)."""
    row = np.array(_UPPER, np.float64)[:, :2]
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(row, axis=0), axis=1))])
    bars, radii = [], []
    for place, radius, across, along, low, high in _TEETH:
        here, ahead = (np.array([np.interp(place + step, length, axis) for axis in row.T]) for step in (0.0, 0.5))
        forward = (ahead - here) / np.linalg.norm(ahead - here)
        sideward = np.array([forward[1], -forward[0]])
        for step in {-along, along}:
            for shift in {-across, across}:
                foot = here + step * forward + shift * sideward
                bars.append([(*foot, low), (*foot, high)])
                radii.append(radius)
    right, thick = np.array(bars), np.array(radii)
    return np.concatenate([right, right * [-1, 1, 1]]), np.concatenate([thick, thick])


def jaw(threads: int | None = None) -> Implicit:
    """Lower jaw, about 3.4 wide, 2.4 long and 1.9 high, centred on the origin."""
    centre = np.array([0.0, -8.0, 33.0])
    segments, weights = _bone()
    bone = convolution(
        (segments - centre) * SCALE, _BONE_RADIUS * SCALE, weights=weights, width=_BONE_WIDTH * SCALE, threads=threads
    )
    bars, radii = _teeth()
    thickest = float(radii.max())
    lighter = ((1 + (radii / _TOOTH_WIDTH) ** 2) / (1 + (thickest / _TOOTH_WIDTH) ** 2)) ** 1.5
    teeth = convolution(
        (bars - centre) * SCALE, thickest * SCALE, weights=1.2 * lighter, width=_TOOTH_WIDTH * SCALE, threads=threads
    )
    return r_union(bone, teeth)
