"""Every error and warning that a caller of cad_implicit may meet.

All errors derive from :class:`CadImplicitError`, so one ``except`` catches them; each message says what was
wrong, with the figures, and what to do.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable
from pathlib import Path

_PACKAGE = str(Path(__file__).parent)


class CadImplicitError(Exception):
    """Base class of all errors raised on purpose by this package."""


class FileFormatError(CadImplicitError):
    """A file is missing, empty, corrupt, or of a kind that is not supported."""


class MissingHostError(CadImplicitError):
    """A B-rep part needs CadQuery or build123d (for OCP) and neither is installed."""


class NoSolidError(CadImplicitError):
    """The part holds no solid, so it has no inside."""


class OpenMeshError(CadImplicitError):
    """The mesh is not closed, so inside and outside are not defined.

    Attributes
    ----------
    open_edges : int
        Number of edges that do not have exactly one neighbour on each side.
    """

    def __init__(self, message: str, open_edges: int = 0) -> None:
        super().__init__(message)
        self.open_edges = open_edges


class InvalidMeshError(CadImplicitError):
    """Vertices or faces are of the wrong shape, not finite, or point to nothing."""


class RadiusError(CadImplicitError):
    """A radius or distance is not a positive finite number, or does not fit the part.

    Attributes
    ----------
    edges : tuple of int
        Numbers of the edges at which it does not fit, if it is chosen edges that it is for.
    """

    def __init__(self, message: str, edges: Iterable[int] = ()) -> None:
        super().__init__(message)
        self.edges = tuple(edges)


class SpacingError(CadImplicitError):
    """A grid spacing or tolerance is not a positive finite number, or does not fit the part."""


class SelectorError(CadImplicitError):
    """A selector of edges or faces cannot be read, or selects nothing."""


class MemoryLimitError(CadImplicitError):
    """The work would need more memory than there is; the message names the spacing that fits."""


class RefusedError(CadImplicitError):
    """The result is very probably not what was wanted; the caller may force it."""


class EmptyResultError(CadImplicitError):
    """Nothing is left of the part (an opening deletes whatever is thinner than twice the radius)."""


class ForkedError(CadImplicitError):
    """Kernels cannot run in a process that was forked from one in which they ran."""


class ClusterError(CadImplicitError):
    """A cluster cannot be reached, or dask.distributed is not installed."""


class GeometryWarning(UserWarning):
    """The result is valid but differs from what a user may expect (lost volume, plugged holes …)."""


def tell(message: str) -> None:
    """Give a GeometryWarning at the line that called the package."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, GeometryWarning, stacklevel=level)
