"""Where patches cannot be put on their surfaces: their triangles become faces of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from .blend_labels import Outward
from .mesh import Mesh
from .patches import Numbers, connected, opposite


def facetted(
    mesh: Mesh,
    labels: Numbers,
    bad: Iterable[int],
    surface: Callable[[int], Outward],
    first: int,
    limit: float,
) -> Numbers:
    """Give each triangle of some patches a label of its own, and those of neighbours from which they would gape.

    Parameters
    ----------
    mesh : Mesh
    labels : (F,) int64
        From ``first``: of triangles that are faces already; below 0: of those that shall become ones.
    bad : iterable of int
        Patches, as :func:`.patches.connected` numbers them.
    surface : callable
        Surface of a label.
    first : int
        The first label of a triangle.
    limit : float
        Edges of triangles may be so many mm away from the middle of the neighbour's surface, not more.

    Returns
    -------
    (F,) int64
    """
    own, patch = connected(mesh.faces, labels)
    apart = np.isin(patch, list(bad)) | (labels < 0) | (labels >= first)
    start, end = mesh.faces.ravel().astype(np.int64), np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    triangle = np.repeat(np.arange(len(mesh.faces)), 3)
    other = opposite(start, end, len(mesh.vertices)) // 3
    while True:
        edges = np.flatnonzero(~apart[triangle] & apart[other])
        beside = patch[triangle[edges]]
        gaping = []
        for one in np.unique(beside).tolist():
            mine = edges[beside == one]
            if _gap(mesh, start[mine], end[mine], surface(int(own[one]))) > limit:
                gaping.append(one)
        if not gaping:
            break
        apart |= np.isin(patch, gaping)
    return np.where(apart, first + np.arange(len(labels)), labels)


def _gap(mesh: Mesh, start: NDArray[np.int64], end: NDArray[np.int64], surface: Outward) -> float:
    """Largest distance in mm from the middle of edges to a surface, beyond that of their ends."""
    a, b = mesh.vertices[start], mesh.vertices[end]
    first, last, middle = (surface.value_and_normal(points)[0] for points in (a, b, (a + b) / 2))
    return float(np.abs(middle - (first + last) / 2).max())
