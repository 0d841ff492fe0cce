"""Lattices without end: crossing slabs, and struts between the nodes of a crystal. Intersect them with a part.

Slabs as periodic functions, with a frequency that may follow the distance to a surface: A. Pasko, O. Fryazinov,
T. Vilbrandt, P.-A. Fayolle, V. Adzhiev, "Procedural function-based modelling of volumetric microstructures", Graphical
Models 73 (2011), doi:10.1016/j.gmod.2011.03.001. Here values are distances in mm, not sines, so that walls and struts
have the thickness that is asked for.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .grading import Length, Size, as_length, constant
from .implicit import FloatArray, Implicit
from .minimal import Phased
from .walls import Feet, Level, Nearest, Wall

Crystal = Literal["cubic", "bcc", "fcc", "octet"]

#: Ends of the struts in the eighth of the unit cell next to a node, in halves of the cell: mirrored at its faces they
#: give the whole crystal.
_STRUTS: dict[Crystal, list[tuple[tuple[int, int, int], tuple[int, int, int]]]] = {
    "cubic": [((0, 0, 0), (1, 0, 0)), ((0, 0, 0), (0, 1, 0)), ((0, 0, 0), (0, 0, 1))],
    "bcc": [((0, 0, 0), (1, 1, 1))],
    "fcc": [((0, 0, 0), (1, 1, 0)), ((0, 0, 0), (1, 0, 1)), ((0, 0, 0), (0, 1, 1))],
}
_STRUTS["octet"] = [*_STRUTS["fcc"], ((1, 1, 0), (1, 0, 1)), ((1, 0, 1), (0, 1, 1)), ((0, 1, 1), (1, 1, 0))]

#: Distance in cells up to which the middle of a slab of varying cells is sought: beyond, the next one is nearer.
_SLAB_REACH = 0.45


def slab_lattice(cell: Size | Length, wall: Size | Length, *, closed: bool = False) -> Implicit:
    """Lattice of three families of parallel slabs, across x, y and z.

    Parameters
    ----------
    cell : float or callable
        Distance in mm from slab to slab; a callable of points, such as :func:`cad_implicit.graded`, makes the lattice
        denser in places. Slabs lie where a coordinate is a whole number of cells.
    wall : float or callable
        Thickness of the slabs in mm.
    closed : bool
        The slabs themselves, which enclose cells; else what lies in two of them, square rods along all three axes.

    Returns
    -------
    Implicit
        Without end: intersect it with a part. Outside edges values are smaller than the distance.

    Examples
    --------
    >>> rods = slab_lattice(5.0, 1.0)
    >>> rods([[2.5, 0, 0], [2.5, 2.5, 0]])  # in the middle of a rod, and of an opening
    array([ 0.5, -2. ])
    """
    return SlabLattice(as_length("the cell", cell), as_length("the wall", wall), closed)


def strut_lattice(kind: Crystal, cell: ArrayLike, strut: Size | Length) -> Implicit:
    """Lattice of round struts between the nodes of a crystal.

    Parameters
    ----------
    kind : "cubic", "bcc", "fcc" or "octet"
        Struts along the edges, the space diagonals, the face diagonals, and those with the edges of the octahedron.
    cell : float or (3,) array_like
        Period in mm, for all axes or for each.
    strut : float or callable
        Diameter in mm; a callable of points, such as :func:`cad_implicit.graded`, grades it.

    Returns
    -------
    Implicit
        Without end: intersect it with a part. Distances outside are exact, if the diameter is constant.

    Examples
    --------
    >>> lattice = strut_lattice("bcc", 4.0, 1.0)
    >>> lattice([[1, 1, 1], [2, 0, 0]]).round(3)
    array([ 0.5  , -1.133])
    """
    if kind not in _STRUTS:
        raise ValueError(f"kind must be one of {', '.join(_STRUTS)}, not {kind!r}")
    sizes = [as_length("the cell", size) for size in np.broadcast_to(np.asarray(cell, np.float64), (3,)).tolist()]
    diameter = as_length("the strut", strut)
    lattice = Wall(_Struts(kind, np.array([constant(size) for size in sizes])), diameter)
    lattice.exact_outside = constant(diameter) is not None
    return lattice


class SlabLattice(Implicit):
    """Crossing slabs; :func:`slab_lattice` makes it."""

    def __init__(self, cell: Length, wall: Length, closed: bool) -> None:
        size = constant(cell)
        self._families = [Wall(_slabs(axis, cell, size), wall) for axis in range(3)]
        self._rank = -1 if closed else -2
        self.bounds, self.lipschitz = self._families[0].bounds, self._families[0].lipschitz

    def __call__(self, points: ArrayLike) -> FloatArray:
        values = np.stack([family(points) for family in self._families])
        return np.asarray(np.sort(values, axis=0)[self._rank])

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, 3)``."""
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` in mm and gradients ``(N, 3)``."""
        looks = [family.value_and_gradient(points) for family in self._families]
        values, gradients = np.stack([v for v, _ in looks]), np.stack([g for _, g in looks])
        which = np.argsort(values, axis=0)[self._rank]
        each = np.arange(len(which))
        return values[which, each], gradients[which, each]


class _Planes:
    """Distances from the planes where a coordinate is a whole number of cells."""

    def __init__(self, axis: int, cell: float) -> None:
        self._axis, self._cell = axis, cell

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        away = np.zeros_like(points)
        height = points[:, self._axis] - self._cell * np.round(points[:, self._axis] / self._cell)
        away[:, self._axis] = np.where(height < 0, -1.0, 1.0)
        return np.abs(height), away


class _Struts:
    """Distances from the middles of the struts of a crystal.

    Faces and middles of the cells are mirrors, and mirroring brings no point nearer to one on its own side: the
    nearest strut of a point folded into one eighth of the cell is there too.
    """

    def __init__(self, kind: Crystal, cell: FloatArray) -> None:
        self._cell = cell
        self._ends = np.array(_STRUTS[kind], np.float64) * cell / 2

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        offset = points - self._cell * np.round(points / self._cell)
        folded = np.abs(offset)
        square, arm = np.full(len(points), np.inf), np.zeros_like(points)
        for start, end in self._ends:
            along = end - start
            share = np.clip((folded - start) @ along / (along @ along), 0.0, 1.0)
            to = folded - start - share[:, None] * along
            length = (to * to).sum(axis=1)
            nearer = length < square
            square[nearer], arm[nearer] = length[nearer], to[nearer]
        distance = np.sqrt(square)
        on_middle = distance == 0
        arm[on_middle, 0] = 1.0
        away = arm / np.where(on_middle, 1.0, distance)[:, None]
        return distance, np.where(offset < 0, -away, away)


def _slabs(axis: int, cell: Length, size: float | None) -> Nearest:
    """Distances from the middles of the slabs across an axis."""
    if size is not None:
        return _Planes(axis, size)
    return Feet(Phased(_wave(axis), cell), cell, _SLAB_REACH)


def _wave(axis: int) -> Level:
    """Give a function whose zero level are the planes where a coordinate is a multiple of 2 pi."""

    def level(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        gradient = np.zeros_like(points)
        gradient[:, axis] = np.cos(points[:, axis] / 2) / 2
        return np.sin(points[:, axis] / 2), gradient

    return level
