"""What tests of features share: volumes that are known exactly, places."""

from __future__ import annotations

import math
from typing import Any


def rounded(sides: tuple[float, float, float], r: float) -> float:
    """Volume of a box whose edges and corners are rounded: the inner box, grown (Steiner's formula)."""
    a, b, c = (side - 2 * r for side in sides)
    return a * b * c + 2 * r * (a * b + b * c + c * a) + math.pi * r**2 * (a + b + c) + 4 / 3 * math.pi * r**3


def same_place(obj: Any, placement: Any) -> bool:
    """Whether an object is at a placement."""
    own = obj.Placement
    return bool(own.Base.isEqual(placement.Base, 1e-9) and own.Rotation.isSame(placement.Rotation, 1e-9))
