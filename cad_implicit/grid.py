"""Grid: a regular grid of nodes in the plane or in space.

Axes are in ``ij`` order: node ``(i, j, k)`` lies at ``origin + (i, j, k) * spacing``. Lengths in mm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import SpacingError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Grid:
    """Nodes of a regular grid; spacing may differ from axis to axis.

    Parameters
    ----------
    origin : (D,) tuple of float
        Position of the first node in mm; D is 2 or 3.
    spacing : (D,) tuple of float
        Distance between neighbouring nodes along each axis in mm.
    shape : (D,) tuple of int
        Number of nodes along each axis, at least 2.

    Raises
    ------
    SpacingError
        If a spacing is not positive and finite, or the three tuples do not fit together.
    """

    origin: tuple[float, ...]
    spacing: tuple[float, ...]
    shape: tuple[int, ...]

    def __post_init__(self) -> None:
        if not len(self.origin) == len(self.spacing) == len(self.shape) or len(self.shape) not in (2, 3):
            raise SpacingError(
                f"a grid needs origin, spacing and shape of 2 or 3 entries each, not {len(self.origin)}, "
                f"{len(self.spacing)} and {len(self.shape)}"
            )
        if not all(math.isfinite(h) and h > 0 for h in self.spacing):
            raise SpacingError(f"grid spacing must be positive and finite, not {self.spacing}")
        if not all(math.isfinite(x) for x in self.origin):
            raise SpacingError(f"grid origin must be finite, not {self.origin}")
        if not all(n >= 2 for n in self.shape):
            raise SpacingError(f"a grid needs at least 2 nodes along each axis, not {self.shape}")

    @classmethod
    def cover(
        cls,
        bounds: ArrayLike,
        spacing: float | Sequence[float] | None = None,
        *,
        shape: int | Sequence[int] | None = None,
        margin: float = 0.0,
    ) -> Grid:
        """Grid over a box, by spacing or by number of nodes.

        Parameters
        ----------
        bounds : (2, D) array_like
            Lower and upper corner in mm.
        spacing : float or sequence of D floats, optional
            Node distance; the grid is centred on the box and sticks out by less than one spacing.
        shape : int or sequence of D ints, optional
            Number of nodes instead of a spacing; first and last node lie on the box.
        margin : float
            Added around the box first, in mm.
        """
        low, high = np.asarray(bounds, np.float64)
        low, high = low - margin, high + margin
        if (spacing is None) == (shape is None):
            raise SpacingError("give either a spacing or a shape")
        if shape is not None:
            counts = np.broadcast_to(np.asarray(shape, np.int64), low.shape)
            steps = (high - low) / np.maximum(counts - 1, 1)
            origin = low
        else:
            steps = np.broadcast_to(np.asarray(spacing, np.float64), low.shape)
            if not (np.isfinite(steps).all() and (steps > 0).all()):
                raise SpacingError(f"grid spacing must be positive and finite, not {spacing}")
            counts = np.maximum(np.ceil((high - low) / steps - 1e-9).astype(np.int64) + 1, 2)
            origin = (low + high) / 2 - (counts - 1) * steps / 2
        return cls(
            tuple(float(x) for x in origin),
            tuple(float(h) for h in steps),
            tuple(int(n) for n in counts),
        )

    @property
    def dim(self) -> int:
        """Number of axes, 2 or 3."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """Number of nodes."""
        return math.prod(self.shape)

    @property
    def bounds(self) -> FloatArray:
        """First and last node, ``(2, D)`` in mm."""
        low = np.asarray(self.origin)
        return np.stack([low, low + (np.asarray(self.shape) - 1) * self.spacing])

    def axes(self) -> tuple[FloatArray, ...]:
        """Coordinates of the nodes along each axis."""
        return tuple(
            np.asarray(o + h * np.arange(n), np.float64)
            for o, h, n in zip(self.origin, self.spacing, self.shape, strict=True)
        )

    def nodes(self, start: int = 0, stop: int | None = None) -> FloatArray:
        """Positions ``(N, D)`` of the nodes of the slabs ``start:stop`` along the first axis, last axis fastest."""
        first, *rest = self.axes()
        mesh = np.meshgrid(first[start:stop], *rest, indexing="ij")
        return np.stack([m.ravel() for m in mesh], axis=1)

    def padded(self, nodes: int) -> Grid:
        """Grid with the same spacing and ``nodes`` further nodes on every side."""
        return Grid(
            tuple(o - nodes * h for o, h in zip(self.origin, self.spacing, strict=True)),
            self.spacing,
            tuple(n + 2 * nodes for n in self.shape),
        )
