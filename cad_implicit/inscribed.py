"""The largest ball inside a shape: what to say where an opening leaves nothing."""

from __future__ import annotations

import math

import numpy as np

from .errors import EmptyResultError
from .implicit import Implicit

#: Blocks that are looked at together and their last size relative to the part.
_BEAM = 2000
_PRECISE = 1e-7

#: Half the diagonal of a cube over its side.
_HALF = math.sqrt(3) / 2


def largest_ball(shape: Implicit) -> tuple[float, tuple[float, float, float]]:
    """Radius in mm and centre of the largest ball inside a bounded shape of exact distances.

    Blocks are halved; those are kept that may hold a larger ball than the largest found, at most ``_BEAM``.
    """
    low, high = shape.bounds
    side = float((high - low).max())
    blocks = np.asarray((low + high) / 2)[None]
    best, centre = -math.inf, blocks[0]
    corners = np.stack(np.meshgrid(*[[-0.25, 0.25]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    while True:
        depth = shape(blocks)
        deepest = int(depth.argmax())
        if depth[deepest] > best:
            best, centre = float(depth[deepest]), blocks[deepest]
        hope = depth + _HALF * side
        keep = np.argsort(-hope, kind="stable")[:_BEAM]
        keep = keep[hope[keep] > best]
        if side < _PRECISE * float((high - low).max()) or len(keep) == 0:
            x, y, z = centre.tolist()
            return best, (x, y, z)
        blocks = (blocks[keep, None] + side * corners).reshape(-1, 3)
        side /= 2


def nothing_left(part: Implicit, radius: float) -> EmptyResultError:
    """Error that says that no ball of a radius in mm fits inside a part, and which one does."""
    fits, centre = largest_ball(part)
    place = ", ".join(f"{x:.4g}" for x in centre)
    return EmptyResultError(
        f"nothing is left: the part is nowhere {2 * radius:g} mm thick, so no ball of radius {radius:g} mm fits "
        f"inside; the largest that does has a radius of {fits:.6g} mm, around ({place}) mm: use a smaller one"
    )
