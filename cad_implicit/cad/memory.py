"""What plans of one solid have in common: curves of borders, surfaces of blends, and curves on faces.

A solid is planned again and again, each time with some more triangles as faces; most of its borders stay as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import NamedTuple

from cad_implicit.implicit import FloatArray
from cad_implicit.outlines import Border

from .geometry import Look, Span, Spline, Surface, curve_through, flattened
from .plans import Topology


class Laid(NamedTuple):
    """The surface of a blend, whether its normal points outwards, its look, and the place (2,) in the middle of it."""

    surface: Surface
    forward: bool
    look: Look
    place: FloatArray


class Memory:
    """Tells again what was told before; all its keys stand for the same content."""

    def __init__(self) -> None:
        self._spans: dict[Hashable, Span] = {}
        self._flat: dict[Hashable, tuple[Spline, float]] = {}
        self._laid: dict[Hashable, Laid] = {}

    def span(self, border: Border, own: Topology) -> Span:
        """Curve of a border."""
        key = (border.place, border.edge, border.knots.tobytes())
        if key not in self._spans:
            self._spans[key] = _span(border, own)
        return self._spans[key]

    def flattened(self, span: Span, look: Look, centre: FloatArray) -> tuple[Spline, float]:
        """Curve on a surface; see :func:`cad_implicit.cad.geometry.flattened`."""
        key = (span, look, centre.tobytes() if any(look.closed) else b"")
        if key not in self._flat:
            self._flat[key] = flattened(span, look, centre)
        return self._flat[key]

    def laid(self, key: Hashable, make: Callable[[], Laid]) -> Laid:
        """Surface of a blend."""
        if key not in self._laid:
            self._laid[key] = make()
        return self._laid[key]


def _span(border: Border, own: Topology) -> Span:
    if border.edge >= 0:
        low, high = sorted(border.knots.tolist())
        return Span(own.edges[border.edge], low, high)
    place = border.place
    assert place is not None
    if border.knots[0] > border.knots[-1]:
        return curve_through(lambda ways: place(-ways), -border.knots)
    return curve_through(place, border.knots)
