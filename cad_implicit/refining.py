"""More triangles where a contour's own miss curved faces and curved creases."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

import numpy as np
from numpy.typing import NDArray

from .creases import refined_creases
from .facets import refined_facets
from .implicit import FloatArray
from .kernels.intersections import intersecting
from .kernels.slivers import FIXED
from .projecting import Projector

Faces = NDArray[np.int32]

#: Tries to split only where no triangles run through others for it; then nothing is split. Not tuned.
_TRIES = 6


def refine(
    vertices: FloatArray,
    faces: Faces,
    normals: FloatArray,
    rank: NDArray[np.int8],
    projector: Projector,
    radius: float | None,
    threads: Callable[[int], AbstractContextManager[None]],
) -> tuple[FloatArray, Faces]:
    """Split edges that miss the surface, first on smooth faces, then on creases.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int32
        Of a mesh, closed but at a region's border.
    normals : (V, 3) float64
        Outward unit normals of vertices on smooth faces, zero for others.
    rank : (V,) int8
        1 for vertices on smooth faces, more for those on creases, ``slivers.FIXED`` for those off the surface.
    projector : Projector
        Moves points onto the surface and its creases.
    radius : float or None
        Of the shape's blends in mm; facets of shapes without blends stay.
    threads : callable
        Gives the context of parallel kernels over so many items.

    Returns
    -------
    vertices : (N, 3) float64
        The given ones come first.
    faces : (M, 3) int32
        Closed too, and no triangle runs through another that did not before: nothing is split around those.
    """
    h = projector.spacing
    for _ in range(_TRIES):
        points, triangles = vertices, faces
        if radius is not None:
            points, triangles = refined_facets(vertices, faces, normals, rank, projector, radius)
        sharp = np.zeros(len(points), np.bool_)
        sharp[: len(rank)] = (rank > 1) & (rank < FIXED)
        points, triangles = refined_creases(points, triangles, sharp, projector.onto_crease, h)
        if len(points) == len(vertices):
            return vertices, faces
        with threads(len(triangles)):
            tangled = intersecting(points, triangles, h)
        new = np.zeros(len(points), np.bool_)
        new[triangles[tangled]] = True
        new[: len(vertices)] = False
        if not new.any():
            return points, triangles
        around = triangles[new[triangles].any(axis=1)]
        rank = rank.copy()
        rank[around[around < len(vertices)]] = FIXED
    return vertices, faces
