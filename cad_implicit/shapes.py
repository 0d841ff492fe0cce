"""Shapes: analytic primitives as Implicits, so that a part is one readable expression.

>>> part = box((4, 2, 1)) - cylinder(0.5, 3).moved((1, 0, 0)) | sphere(1)
>>> part([[1, 0.2, 0], [0, 0, 0.9]]).round(3)
array([-0.02,  0.1 ])

Every primitive is centred on the origin, its axis is z; ``moved``, ``turned``, ``scaled`` and ``mirrored`` place it
(:mod:`cad_implicit.transforms`). All but the ellipsoid and the superquadric are exact signed distances in mm. Planes
and slabs go on for ever: intersect them with something before they are contoured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .errors import RadiusError
from .implicit import Axis, FloatArray, Implicit
from .profiles import Ball, Box, Extrusion, HalfSpace, Polygon, Revolution, Slab, Superquadric
from .transforms import direction


def sphere(radius: float) -> Implicit:
    """Ball of a radius in mm around the origin."""
    return Ball(_length("radius", radius), 3)


def box(size: Sequence[float] | FloatArray) -> Implicit:
    """Cuboid of ``size`` (3,) in mm, centred on the origin.

    Examples
    --------
    >>> box((4, 2, 1))([[0, 0, 0], [5, 5, 0]])
    array([ 0.5, -5. ])
    """
    return Box(_sizes(size, 3))


def cylinder(radius: float, height: float) -> Implicit:
    """Cylinder along z, centred on the origin; lengths in mm."""
    return Extrusion(Ball(_length("radius", radius), 2), _length("height", height))


def cone(bottom: float, height: float, top: float = 0.0) -> Implicit:
    """Cone along z with the radius ``bottom`` at ``-height/2``; truncated if ``top`` is not zero. Lengths in mm."""
    h = _length("height", height) / 2
    low, high = (_length(name, r) if r != 0 else 0.0 for name, r in (("bottom", bottom), ("top", top)))
    if low == high == 0:
        raise RadiusError("a cone needs a radius at one end at least")
    corners = [(low, -h), (high, h), (-high, h), (-low, -h)]
    return Revolution(Polygon(np.array(list(dict.fromkeys((x + 0.0, z) for x, z in corners)))))


def torus(ring: float, tube: float) -> Implicit:
    """Torus around z: a tube of radius ``tube`` whose centre runs on a circle of radius ``ring``, in mm."""
    major, minor = _length("ring", ring), _length("tube", tube)
    if minor >= major:
        raise RadiusError(f"the tube of a torus ({minor:g} mm) must be thinner than its ring ({major:g} mm)")
    return Revolution(Ball(minor, 2).moved((major, 0)))


def plane(normal: Axis, point: ArrayLike = (0.0, 0.0, 0.0)) -> Implicit:
    """Half-space behind a plane: the normal points out of it.

    Parameters
    ----------
    normal : "x", "y", "z" or (3,) array_like
    point : (3,) array_like
        A point of the plane in mm.

    Examples
    --------
    >>> half = sphere(1) & plane("z")
    >>> half.bounds[1]
    array([1., 1., 0.])
    """
    n = direction(normal)
    return HalfSpace(n, float(n @ np.asarray(point, np.float64)))


def slab(thickness: float, normal: Axis = "z") -> Implicit:
    """Everything between two planes ``thickness`` mm apart, centred on the origin."""
    return Slab(direction(normal), _length("thickness", thickness))


def ellipsoid(semi_axes: Sequence[float] | FloatArray) -> Implicit:
    """Ellipsoid with semi-axes (3,) in mm; its values are smaller than the distance, with Lipschitz constant 1."""
    return Superquadric(_sizes(semi_axes, 3), 1.0, 1.0)


def superquadric(semi_axes: Sequence[float] | FloatArray, north_south: float = 1.0, east_west: float = 1.0) -> Implicit:
    """Superellipsoid (Barr 1981, DOI 10.1109/MCG.1981.1673799): from box to octahedron.

    Parameters
    ----------
    semi_axes : (3,) array_like
        In mm.
    north_south, east_west : float
        Exponents above 0 and at most 2: near 0 square, 1 round, 2 pointed; of the sections through z, and across it.
    """
    for name, exponent in (("north_south", north_south), ("east_west", east_west)):
        if not 0 < exponent <= 2:
            raise ValueError(f"{name} must be above 0 and at most 2, not {exponent:g}")
    return Superquadric(_sizes(semi_axes, 3), float(north_south), float(east_west))


def circle(radius: float) -> Implicit:
    """Disc in the plane, around the origin."""
    return Ball(_length("radius", radius), 2)


def rectangle(size: Sequence[float] | FloatArray) -> Implicit:
    """Rectangle of ``size`` (2,) in mm in the plane, centred on the origin."""
    return Box(_sizes(size, 2))


def polygon(corners: ArrayLike) -> Implicit:
    """Polygon in the plane, any way round; it must not cross itself.

    Parameters
    ----------
    corners : (M, 2) array_like
        At least three, in mm.
    """
    points = np.array(corners, np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3 or not np.isfinite(points).all():
        raise ValueError(f"a polygon needs at least three corners (M, 2), not an array of shape {points.shape}")
    return Polygon(points)


def extruded(profile: Implicit, height: float) -> Implicit:
    """Prism over any shape in the plane, from ``-height/2`` to ``height/2``; exact if the profile is.

    Examples
    --------
    >>> wedge = extruded(polygon([(0, 0), (4, 0), (0, 3)]), 2)
    >>> wedge([[1, 1, 0], [-3, 1, 5]])
    array([ 1., -5.])
    """
    if profile.dim != 2:
        raise ValueError("a profile is a shape in the plane")
    return Extrusion(profile, _length("height", height))


def revolved(profile: Implicit) -> Implicit:
    """Solid of revolution around z of any shape in the plane, whose points are (distance from the axis, z).

    Exact if the profile is, and lies off the axis or is symmetric about it.
    """
    if profile.dim != 2:
        raise ValueError("a profile is a shape in the plane")
    return Revolution(profile)


def _length(name: str, value: float) -> float:
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise RadiusError(f"{name} must be a positive number of mm, not {number:g}")
    return number


def _sizes(value: Sequence[float] | FloatArray, dim: int) -> FloatArray:
    sizes = np.array(value, np.float64)
    if sizes.shape != (dim,) or not (np.isfinite(sizes).all() and (sizes > 0).all()):
        raise RadiusError(f"a size is {dim} positive numbers of mm, not {value!r}")
    return sizes
