"""Results as parts: solids that CadQuery, build123d and STEP take."""

from __future__ import annotations

from typing import Any

from .cad.solids import SolidPart, solid_of
from .contouring import contour
from .implicit import Implicit
from .mesh import Mesh
from .parallel import Progress, no_progress
from .simplifying import simplify


def to_part(
    result: Mesh | Implicit | Any,
    *,
    name: str | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> SolidPart:
    """Solid of a result, to go on with in CAD.

    Parameters
    ----------
    result : Mesh or Implicit
        An Implicit is contoured first.
    name : str, optional
        By default that of the part it came from.
    tolerance : float, optional
        Triangles are simplified within so many mm first; by default only as far as the kernel needs it.
    threads : int, optional
    progress : callable
        Called as ``progress(stage, fraction)``; may raise to cancel.

    Returns
    -------
    SolidPart
        Its ``wrapped`` is the TopoDS_Shape; it says how much of its area is exact.

    Raises
    ------
    MissingHostError
        If neither host is installed.
    OpenMeshError, InvalidMeshError
        If no solid can be made.
    """
    mesh = result if isinstance(result, Mesh) else contour(result, threads=threads, progress=progress)
    if tolerance is not None:
        mesh = simplify(mesh, tolerance)
    return solid_of(mesh, name=name, progress=progress)
