"""Curves and surfaces that solids are made of, as arrays: lines, circles and splines, primitives, spline strips.

Each kernel makes its own geometry of them; nothing here asks one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cad_implicit.blend_surfaces import across
from cad_implicit.errors import InvalidMeshError
from cad_implicit.implicit import FloatArray
from cad_implicit.primitives import Primitive

Counts = NDArray[np.int64]

#: Points within so many mm of a line or circle make one: the kernel's own resolution is 1e-7.
STRAIGHT = 2e-7

#: Splines go through points of a curve until they are within so many mm of it between them.
_SPLINE = 1e-6
_FIRST, _MOST = 9, 600

#: A curve that needs points nearer to each other than this share of its length jumps.
_JUMP = 1e-5

#: Axes of a sphere that are tried.
_AXES = 12

#: Pieces of a surface go on smoothly if that moves it by less than so many mm.
_SMOOTH = 1e-7

#: Curves of so many mm are lines whatever their points.
_SHORT = 1e-4


#: Points along an edge by which its curves on faces are made, or the knots of its own curve; more where these are not
#: within so many mm of it, up to a number.
_ALONG = 12
_PARAMETERS = 200
_FINE = 1e-6

#: Places in each piece of such a curve at which it is measured in the end. In the middles alone a curve around a letter
#: was 1.14e-6 mm from its edge, and 1.76e-6 mm elsewhere: the kernel believes no tolerance that does not cover that.
_BETWEEN = 8


class Curve(Protocol):
    """A curve of the part, or a new one."""

    def at(self, ways: FloatArray) -> FloatArray:
        """Points (N, 3) at parameters (N,)."""


@dataclass(frozen=True, eq=False)
class Line:
    """A line through a point (3,) along a unit direction (3,), by mm."""

    point: FloatArray
    direction: FloatArray

    def at(self, ways: FloatArray) -> FloatArray:
        return self.point + np.outer(ways, self.direction)


@dataclass(frozen=True, eq=False)
class Circle:
    """A circle by its centre, unit normal, unit direction (3,) to its start, and radius; by radians."""

    centre: FloatArray
    normal: FloatArray
    start: FloatArray
    radius: float

    def at(self, ways: FloatArray) -> FloatArray:
        side = np.cross(self.normal, self.start)
        turned = np.outer(np.cos(ways), self.start) + np.outer(np.sin(ways), side)
        return np.asarray(self.centre + self.radius * turned)


@dataclass(frozen=True, eq=False)
class Spline:
    """A B-spline, not rational: distinct knots (K,), how often each counts (K,), poles (P, 3) or (P, 2), degree."""

    knots: FloatArray
    counts: Counts
    poles: FloatArray
    degree: int

    def at(self, ways: FloatArray) -> FloatArray:
        from scipy.interpolate import BSpline

        return np.asarray(BSpline(np.repeat(self.knots, self.counts), self.poles, self.degree)(ways))


@dataclass(frozen=True, eq=False)
class Span:
    """A curve between two parameters."""

    curve: Curve
    low: float
    high: float

    def at(self, ways: FloatArray) -> FloatArray:
        """Points (N, 3) at parameters (N,)."""
        return self.curve.at(ways)


@dataclass(frozen=True, eq=False)
class Framed:
    """A primitive in a frame: unit axis (3,) and unit direction (3,) at which its angles begin.

    A cone's origin is its apex. A plane has its normal for an axis.
    """

    primitive: Primitive
    axis: FloatArray
    start: FloatArray


@dataclass(frozen=True, eq=False)
class SplinePatch:
    """A B-spline surface, not rational: poles (M, N, 3), and for u and v distinct knots, their counts, and degrees."""

    poles: FloatArray
    knots: tuple[FloatArray, FloatArray]
    counts: tuple[Counts, Counts]
    degrees: tuple[int, int]


Surface = Framed | SplinePatch


class Look(Protocol):
    """A surface of a kernel, to look places up on it.

    Attributes
    ----------
    plane : bool
    bounds : (2, 2) float64
        Lowest and highest parameters along u, and along v.
    closed : tuple of bool
        Whether it closes along u, and along v.
    """

    plane: bool
    bounds: FloatArray
    closed: tuple[bool, bool]

    def places(self, points: FloatArray) -> FloatArray:
        """Parameters (N, 2) of the nearest places to points (N, 3) of a curve."""

    def at(self, places: FloatArray) -> FloatArray:
        """Points (N, 3) at places (N, 2)."""

    def normal(self, place: FloatArray) -> FloatArray:
        """Vector (3,) across the surface at a place (2,), by the turn from u to v."""


def curve_through(place: Callable[[FloatArray], FloatArray], knots: FloatArray) -> Span:
    """Line, circle or spline along a curve.

    Parameters
    ----------
    place : callable
        Points (N, 3) at parameters (N,).
    knots : (N,) float64
        Ascending parameters, at which the curve may bend differently.
    """
    fractions = np.unique(np.concatenate([knots, np.linspace(knots[0], knots[-1], _FIRST)]))
    points = place(fractions)
    fine = place((fractions[1:] + fractions[:-1]) / 2)
    everything = np.concatenate([points, fine])
    chord = points[-1] - points[0]
    length = float(np.linalg.norm(chord))
    if length > 0:
        off = everything - points[0] - np.outer((everything - points[0]) @ chord / length**2, chord)
        if length < _SHORT or float(np.linalg.norm(off, axis=1).max()) < STRAIGHT:
            return Span(Line(points[0], chord / length), 0.0, length)
    circle = _circle(points, everything)
    return circle if circle is not None else _spline(place, fractions)


def _circle(points: FloatArray, everything: FloatArray) -> Span | None:
    first, middle, last = points[0], points[len(points) // 2], points[-1]
    if float(np.linalg.norm(first - last)) < _SHORT:
        last = points[len(points) // 4]
        first, middle, last = first, last, middle
    a, b = middle - first, last - first
    normal = np.cross(a, b)
    square = float(normal @ normal)
    if square <= 1e-12 * float(a @ a) * float(b @ b):
        return None
    to_centre = (np.cross(normal, a) * (b @ b) + np.cross(b, normal) * (a @ a)) / (2 * square)
    centre, radius = first + to_centre, float(np.linalg.norm(to_centre))
    normal /= np.sqrt(square)
    away = everything - centre
    if max(np.abs(away @ normal).max(), np.abs(np.linalg.norm(away, axis=1) - radius).max()) > STRAIGHT * (1 + radius):
        return None
    x = (points[0] - centre) / radius
    y = np.cross(normal, x)
    turns = np.unwrap(np.arctan2((points - centre) @ y, (points - centre) @ x))
    if turns[-1] < 0:
        normal, turns = -normal, -turns
    high = float(turns[-1])
    if abs(high) < 1e-9:
        high = 2 * np.pi
    return Span(Circle(centre, normal, x, radius), 0.0, min(high, 2 * np.pi))


def _spline(place: Callable[[FloatArray], FloatArray], fractions: FloatArray) -> Span:
    from scipy.interpolate import make_interp_spline

    while True:
        points = place(fractions)
        spline = make_interp_spline(fractions, points, k=3)
        middle = (fractions[1:] + fractions[:-1]) / 2
        off = np.linalg.norm(spline(middle) - place(middle), axis=1)
        rough = (off > _SPLINE) & (np.diff(fractions) > _JUMP * (fractions[-1] - fractions[0]))
        if not rough.any() or len(fractions) > _MOST:
            break
        fractions = np.sort(np.concatenate([fractions, middle[rough]]))
    knots, counts = np.unique(spline.t, return_counts=True)
    return Span(Spline(knots, counts, spline.c, 3), float(fractions[0]), float(fractions[-1]))


def flat_curve(parameters: FloatArray, places: FloatArray) -> Spline:
    """Spline through places (N, 2) of a surface at parameters (N,)."""
    if len(places) < 4:
        return straight_curve(parameters, places)
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(parameters, places, k=3)
    knots, counts = np.unique(spline.t, return_counts=True)
    return Spline(knots, counts, spline.c, 3)


def straight_curve(parameters: FloatArray, places: FloatArray) -> Spline:
    """Line from the first to the last of places (N, 2) of a surface at parameters (N,)."""
    return Spline(parameters[[0, -1]], np.array([2, 2]), places[[0, -1]], 1)


def away_from(span: Span, surface: Look, parameters: FloatArray, found: FloatArray) -> float:
    """Largest distance between a curve and places (N, 2) of a surface."""
    return float(np.linalg.norm(surface.at(found) - span.at(parameters), axis=1).max())


def unwrap(found: FloatArray, surface: Look, centre: FloatArray) -> None:
    """Make places (N, 2) along an edge continuous where the surface is closed, in place."""
    middle = len(found) // 2
    for axis, (low, high) in enumerate(surface.bounds.tolist()):
        if not surface.closed[axis]:
            continue
        period, column = high - low, found[:, axis]
        steps = np.diff(column)
        steps -= np.round(steps / period) * period
        column[middle + 1 :] = column[middle] + np.cumsum(steps[middle:])
        column[:middle] = column[middle] - np.cumsum(steps[:middle][::-1])[::-1]
        column -= np.round((column[middle] - centre[axis]) / period) * period


def flattened(span: Span, look: Look, centre: FloatArray) -> tuple[Spline, float]:
    """Curve on a surface, around a place (2,) where that is closed, and how far in mm it is from another curve."""
    parameters = np.linspace(span.low, span.high, _ALONG)
    if isinstance(span.curve, Spline):
        knots = span.curve.knots[:: max(1, len(span.curve.knots) // _PARAMETERS)]
        inner = knots[(knots > span.low) & (knots < span.high)]
        parameters = np.unique(np.concatenate([parameters[[0, -1]], inner])) if len(inner) > _ALONG else parameters
    while True:
        found = look.places(span.at(parameters))
        unwrap(found, look, centre)
        middle = (parameters[1:] + parameters[:-1]) / 2
        flat = straight_curve(parameters, found)  # areas and volumes by the kernel are best beside lines
        away = away_from(span, look, middle, flat.at(middle))
        if away < STRAIGHT:
            return flat, away
        flat = flat_curve(parameters, found)
        off = np.linalg.norm(look.at(flat.at(middle)) - span.at(middle), axis=1)
        rough = off > _FINE
        if not rough.any() or len(parameters) >= _PARAMETERS:
            count = _BETWEEN * (len(parameters) - 1) + 1
            fine = np.interp(np.linspace(0, len(parameters) - 1, count), np.arange(len(parameters)), parameters)
            return flat, away_from(span, look, fine, flat.at(fine))
        parameters = np.sort(np.concatenate([parameters, middle[rough]]))


class Stretch(Protocol):
    """A curve from a lowest to a highest parameter."""

    low: float
    high: float

    def at(self, ways: FloatArray) -> FloatArray:
        """Points (N, 3) at parameters (N,)."""


def past_seam(surface: Look, seam: Stretch, points: FloatArray) -> FloatArray:
    """How far (N,) points of a surface are past a seam, in turns from -0.5 to 0.5."""
    on_seam = surface.places(seam.at(np.linspace(seam.low, seam.high, 5)[1:-1]))
    flat = np.ptp(on_seam, axis=0)
    axis = 0 if flat[0] < flat[1] or not surface.closed[1] else 1
    low, high = surface.bounds[axis]
    turns = (surface.places(points)[:, axis] - on_seam[0, axis]) / (high - low)
    return np.asarray(turns - np.round(turns))


def flat_surface(a: FloatArray, b: FloatArray, c: FloatArray) -> Framed:
    """Plane of a triangle, its normal by the turn of the corners."""
    normal = np.cross(b - a, c - a)
    size = float(np.linalg.norm(normal))
    if size == 0:
        raise InvalidMeshError("a triangle has no area")
    return _framed(Primitive("plane", a, normal / size), b - a)


def primitive_surface(primitive: Primitive, towards: FloatArray, border: FloatArray) -> Framed:
    """Surface of a primitive whose seam lies opposite of a point (3,), and the poles far from a border (N, 3)."""
    return _framed(primitive, primitive.point - towards, border)


def _framed(primitive: Primitive, start: FloatArray, border: FloatArray | None = None) -> Framed:
    axis = primitive.axis / np.linalg.norm(primitive.axis)
    if primitive.kind == "sphere" and border is not None:
        axis = _free_axis(-start, border - primitive.point)
    across_axis = start - (start @ axis) * axis
    if float(np.linalg.norm(across_axis)) < 1e-9:
        across_axis = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    return Framed(primitive, axis, across_axis / np.linalg.norm(across_axis))


def _free_axis(towards: FloatArray, border: FloatArray) -> FloatArray:
    """Axis (3,) at a right angle to a direction, whose poles are as far from a border (N, 3) on a sphere as can be."""
    direction = towards / np.linalg.norm(towards)
    x = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    x /= np.linalg.norm(x)
    turns = np.linspace(0.0, np.pi, _AXES, endpoint=False)
    axes = np.outer(np.cos(turns), x) + np.outer(np.sin(turns), np.cross(direction, x))
    sizes = np.linalg.norm(border, axis=1)
    return np.asarray(axes[np.abs(border @ axes.T / sizes[:, None]).max(axis=0).argmin()])


def strip_surface(ways: FloatArray, points: FloatArray, between: FloatArray) -> SplinePatch:
    """Spline surface of a grid: cubic pieces along (M) with inner control points (M - 1, 2), one polynomial across (K).

    Where the pieces before and after a way go on smoothly they share a knot of multiplicity 2, else one of 3.
    """
    count = points.shape[1]
    shares = across()
    basis = _bernstein(count - 1, (shares - shares[0]) / (shares[-1] - shares[0]))

    def poles(grid: FloatArray) -> FloatArray:
        flat = np.moveaxis(grid, -2, 0)
        solved = np.asarray(np.linalg.solve(basis, flat.reshape(count, -1)), np.float64)
        return np.moveaxis(solved.reshape(flat.shape), 0, -2)

    knots, inner = poles(points), poles(between)
    spans = np.diff(ways)
    share = (spans[:-1] / (spans[:-1] + spans[1:]))[:, None, None]
    middle = (1 - share) * inner[:-1, 1] + share * inner[1:, 0]
    smooth = np.abs(middle - knots[1:-1]).max(axis=(1, 2)) < _SMOOTH
    rows = [knots[0], inner[0, 0]]
    for number, good in enumerate(smooth.tolist()):
        rows += [inner[number, 1], *([] if good else [knots[number + 1]]), inner[number + 1, 0]]
    table = np.stack([*rows, inner[-1, 1], knots[-1]])
    along = np.concatenate([[4], np.where(smooth, 2, 3), [4]])
    ends = np.array([count, count])
    return SplinePatch(table, (ways, np.array([0.0, 1.0])), (along, ends), (3, count - 1))


def _bernstein(degree: int, at: FloatArray) -> FloatArray:
    from scipy.special import comb

    k = np.arange(degree + 1)
    return np.asarray(comb(degree, k) * at[:, None] ** k * (1 - at[:, None]) ** (degree - k))
