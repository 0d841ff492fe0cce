"""Curves and surfaces of FreeCAD's kernel: points on them, and the places nearest to points."""

from __future__ import annotations

from typing import Any

import numpy as np
import Part
from scipy.spatial import cKDTree

from cad_implicit.implicit import FloatArray

from .brep_text import Brep, Child, surface_text
from .freecad import Shape, vector
from .geometry import Surface

#: Surfaces whose nearest places the kernel has in closed form; of others it needs 2.5 ms for each point.
_CLOSED_FORM = ("Plane", "Cylinder", "Cone", "Sphere", "Toroid")

#: Free-form surfaces are sampled so often between two knots, and at least so often, along u and v; curves the same.
_BETWEEN, _LEAST = 4, 24

#: Newton's method stops at steps below this share of the range of parameters, after which the error is its square, or
#: after so many steps.
_STEP, _STEPS = 1e-9, 20


class SurfaceLook:
    """A surface of the kernel; see :class:`cad_implicit.cad.geometry.Look`.

    Parameters
    ----------
    surface : Part surface
    window : (2, 2) float64
        Lowest and highest parameters along u and along v between which it is looked at.
    """

    def __init__(self, surface: Any, window: FloatArray) -> None:
        self.surface = surface
        self.plane = type(surface).__name__ == "Plane"
        self.bounds = np.array(surface.bounds()).reshape(2, 2)
        self.closed = (bool(surface.isUClosed()), bool(surface.isVClosed()))
        self._window = np.where(np.abs(self.bounds) < 1e50, self.bounds, window)
        self._direct = type(surface).__name__ in _CLOSED_FORM
        self._samples: tuple[FloatArray, cKDTree] | None = None

    def places(self, points: FloatArray) -> FloatArray:
        if self._direct:
            return np.array([self.surface.parameter(vector(point)) for point in points]).reshape(-1, 2)
        if self._samples is None:
            self._samples = self._sampled()
        places, tree = self._samples
        near = places[tree.query(points)[1]]
        return np.array([self._refined(*pair) for pair in zip(near, points, strict=True)]).reshape(-1, 2)

    def at(self, places: FloatArray) -> FloatArray:
        value = self.surface.value
        return np.array([tuple(value(u, v)) for u, v in places.tolist()]).reshape(-1, 3)

    def normal(self, place: FloatArray) -> FloatArray:
        du, dv = self._slopes(*place.tolist())
        return np.cross(du, dv)

    def _slopes(self, u: float, v: float) -> tuple[FloatArray, FloatArray]:
        derivative = self.surface.getDN
        return np.array(tuple(derivative(u, v, 1, 0))), np.array(tuple(derivative(u, v, 0, 1)))

    def _sampled(self) -> tuple[FloatArray, cKDTree]:
        counts = [getattr(self.surface, name, 0) for name in ("NbUKnots", "NbVKnots")]
        (low_u, high_u), (low_v, high_v) = self._window.tolist()
        u, v = (
            np.linspace(low, high, max(_LEAST, _BETWEEN * count))
            for low, high, count in zip((low_u, low_v), (high_u, high_v), counts, strict=True)
        )
        places = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
        return places, cKDTree(self.at(places))

    def _refined(self, place: FloatArray, point: FloatArray) -> tuple[float, float]:
        """Nearest place to a point (3,), from one near it, by Gauss and Newton; in plain numbers, which is fastest."""
        surface, target = self.surface, vector(point)
        (low_u, high_u), (low_v, high_v) = self.bounds.tolist()
        size_u, size_v = np.ptp(self._window, axis=1).tolist()
        u, v = place.tolist()
        for _ in range(_STEPS):
            off, du, dv = target - surface.value(u, v), surface.getDN(u, v, 1, 0), surface.getDN(u, v, 0, 1)
            a, b, c, d, e = du.dot(du), du.dot(dv), dv.dot(dv), du.dot(off), dv.dot(off)
            area = a * c - b * b
            if area <= 0:
                break
            step_u = min(max((c * d - b * e) / area, -0.1 * size_u), 0.1 * size_u)
            step_v = min(max((a * e - b * d) / area, -0.1 * size_v), 0.1 * size_v)
            before = u, v
            u = _within(u + step_u, low_u, high_u, self.closed[0])
            v = _within(v + step_v, low_v, high_v, self.closed[1])
            if abs(u - before[0]) <= _STEP * size_u and abs(v - before[1]) <= _STEP * size_v:
                break
        return u, v


def _within(parameter: float, low: float, high: float, closed: bool) -> float:
    """Parameter within its bounds: moved by a turn where the surface is closed, else to the nearest end."""
    if low <= parameter <= high:
        return parameter
    return low + (parameter - low) % (high - low) if closed else min(max(parameter, low), high)


class CurveLook:
    """A curve of the kernel between two parameters, to look ways up on it."""

    def __init__(self, curve: Any, low: float, high: float) -> None:
        self.curve, self.low, self.high = curve, low, high
        count = max(_LEAST, _BETWEEN * int(getattr(curve, "NbKnots", 0)))
        self._ways = np.linspace(low, high, count)
        self._tree = cKDTree(self.at(self._ways))

    def at(self, ways: FloatArray) -> FloatArray:
        """Points (N, 3) at parameters (N,)."""
        value = self.curve.value
        return np.array([tuple(value(way)) for way in np.atleast_1d(ways).tolist()]).reshape(-1, 3)

    def way(self, points: FloatArray) -> FloatArray:
        """Parameters (N,) of the nearest points to points (N, 3)."""
        near = self._ways[self._tree.query(points)[1]]
        return np.array([self._refined(float(way), point) for way, point in zip(near, points, strict=True)])

    def _refined(self, way: float, point: FloatArray) -> float:
        size = self.high - self.low
        for _ in range(_STEPS):
            place, slope = self.curve.value(way), np.array(tuple(self.curve.getD1(way)[1]))
            square = float(slope @ slope)
            if square == 0:
                break
            step = float(slope @ (point - np.array(tuple(place)))) / square
            moved = min(max(way + min(max(step, -0.1 * size), 0.1 * size), self.low), self.high)
            done, way = abs(moved - way) <= _STEP * size, moved
            if done:
                break
        return way


def surface_of(surface: Surface) -> Any:
    """Surface of the kernel."""
    brep = Brep()
    number = brep.add("Surfaces", surface_text(surface))
    brep.root = Child("+", brep.record("Fa", [f"1  1e-07 {number} 0"]), ())
    return read(brep.text()).Faces[0].Surface


def read(text: str) -> Shape:
    """Shape of the text of a BREP file."""
    shape = Part.Shape()
    shape.importBrepFromString(text)
    return shape
