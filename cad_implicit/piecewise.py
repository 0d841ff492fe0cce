"""Operations on large parts, a tile at a time (:mod:`cad_implicit.tiles`): which, and with how much memory.

The mesh is the one that contouring the whole result gives. Of global fillets, rounds, smoothings and offsets by the
exact engine, and not yet of shells and infills.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from . import exact, ops, sizing
from .distance import MeshDistance
from .errors import EmptyResultError
from .implicit import Affine, FloatArray, Implicit, polished
from .inscribed import nothing_left
from .mesh import Mesh
from .parallel import Progress, no_progress
from .tiles import Make, contour_in_tiles, tiles_over

#: Operations that can be done in tiles.
PIECEWISE = ("fillet", "round", "smooth", "offset")

#: Parts with more cells of surface than this are done in tiles even if memory allows the whole: centres of the ball are
#: then made around blends only. Not tuned.
_LARGE = 1_000_000


class Later(Implicit):
    """Result of an operation on the whole part that is only made if it is asked for values.

    Raises MemoryLimitError then if it is too large.
    """

    lipschitz = 1.0
    rough = True

    def __init__(
        self, part: MeshDistance, operation: str, amount: float, spacing: float, bounds: ArrayLike, threads: int | None
    ) -> None:
        self.spacing = spacing
        self.radius = None if operation == "offset" else amount
        self.bounds = np.asarray(bounds, np.float64)
        self._call = part, operation, amount, threads

    @cached_property
    def _shape(self) -> Implicit:
        part, operation, amount, threads = self._call
        function = ops.offset if operation == "offset" else ops.BLENDS[operation]
        return function(part, amount, spacing=self.spacing, threads=threads)

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self._shape(points)

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` and gradients ``(N, 3)``."""
        return self._shape.value_and_gradient(points)

    def polished(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values and gradients, as exact as the result knows them."""
        return polished(self._shape, points)

    def affine_within(self, points: FloatArray, radius: float, tolerance: float) -> Affine:
        """Where the result is linear."""
        return self._shape.affine_within(points, radius, tolerance)


def is_large(area: float, spacing: float) -> bool:
    """Whether a part with so much surface in mm² is better done in tiles at a spacing in mm."""
    return area / spacing**2 > _LARGE or sizing.estimate_surface(area, spacing) > sizing.available_memory()


def in_tiles(
    part: MeshDistance,
    operation: str,
    amount: float,
    spacing: float,
    *,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> tuple[Implicit, Mesh]:
    """Do an operation; gives the result and its contour.

    Parameters
    ----------
    part : MeshDistance
    operation : "fillet", "round", "smooth" or "offset"
    amount, spacing : float
        In mm.
    threads : int, optional
        Default: all cores.
    progress : callable
        Called with the stages of each tile, and as ``progress("tiles", fraction)``; may raise to cancel.

    Raises
    ------
    MemoryLimitError
        If the result alone is too large.
    RadiusError, SpacingError, EmptyResultError
        As the operation itself.
    """
    most = sizing.bricks_in_a_tile(part.mesh.area, spacing)
    make, bounded = _maker(part, operation, amount, spacing, threads, progress)
    tiles = tiles_over(bounded, spacing, most)
    try:
        mesh = contour_in_tiles(make, tiles, bounded, spacing, threads=threads, progress=progress)
    except EmptyResultError:
        raise nothing_left(part, abs(amount)) from None
    return Later(part, operation, amount, spacing, bounded.bounds, threads), mesh


def _maker(
    part: MeshDistance, operation: str, amount: float, spacing: float, threads: int | None, progress: Progress
) -> tuple[Make, Implicit]:
    """Give what makes the result in a region, and a shape with its bounds, after the checks of the operation."""
    size = abs(amount)
    inward = operation in ("round", "smooth") or amount < 0
    outward = operation in ("fillet", "smooth") or (operation == "offset" and amount > 0)
    call = ops.Call(
        part, size, size if outward else 0.0, inward, spacing, None, "exact", threads, progress, in_tiles=True
    )
    sides: dict[ops.Side, bool] = {"inside": inward, "outside": outward}
    distance = call.distance(tuple(side for side, matters in sides.items() if matters))
    if operation == "offset":
        moved = exact.surface_of(exact.offset(distance, amount, spacing, threads=threads))
        return lambda region: moved, moved
    functions: dict[str, Callable[..., Implicit]] = {
        "fillet": exact.Closing,
        "round": exact.opening,
        "smooth": exact.smoothing,
    }
    function = functions[operation]
    return lambda region: function(distance, size, spacing, threads=threads, progress=progress, region=region), distance
