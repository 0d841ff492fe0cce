"""Unions of a part's solids."""

from __future__ import annotations

from typing import Any

import numpy as np

from .kernel import kernel
from .weld import groups

#: A union is believed if its volume lies between the largest solid's and the sum of all, give or take this share.
_VOLUME_SLACK = 1e-6


def united(shape: Any) -> list[Any]:
    """Solids of a shape, those that overlap or touch fused where the kernel gets it right.

    Solids whose boxes are apart are never fused. A union that fails, is invalid, or has an impossible volume is
    dropped and its solids returned as they were: they then overlap.
    """
    own = kernel(shape)
    parts: list[Any] = own.solids(shape)
    if len(parts) == 1:
        return parts
    low, high = np.moveaxis(np.array([own.bounds(part) for part in parts]), 1, 0)
    apart = ((low[:, None] > high[None]) | (high[:, None] < low[None])).any(axis=2)
    label, first = groups(len(parts), np.argwhere(~apart))
    result: list[Any] = []
    for number in label[np.sort(first)]:
        result += _fused(own, [part for part, one in zip(parts, label, strict=True) if one == number])
    return result


def _fused(own: Any, parts: list[Any]) -> list[Any]:
    """Solids of the union, or the parts themselves if the kernel fails at it."""
    if len(parts) == 1:
        return parts
    result: list[Any] = own.fuse(parts)
    if not result or not all(own.is_valid(solid) for solid in result):
        return parts
    before, after = [own.volume(part) for part in parts], sum(own.volume(solid) for solid in result)
    low, high = max(before) * (1 - _VOLUME_SLACK), sum(before) * (1 + _VOLUME_SLACK)
    return result if low <= after <= high else parts
