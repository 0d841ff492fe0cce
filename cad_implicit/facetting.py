"""Where patches cannot be put on their surfaces, triangles become faces of their own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .blend_labels import Outward
from .creases import cut
from .implicit import FloatArray
from .mesh import Mesh
from .patches import Numbers, connected, opposite

#: Edges beside round neighbours are halved so many times at most: each time they lie four times nearer. Chords of a
#: sixth of the radius, 0.0035 radii from an arc, need one or two at a radius of a millimetre, five at one of 100.
_HALVINGS = 7

#: Unless the surface is farther from the middle of an edge than this share of its length, more than a sixth of a circle
#: is: there it jumps.
_STEEPEST = 0.134

#: Steps of Newton's method that put the middle of an edge onto a surface.
_STEPS = 3


def facetted(
    mesh: Mesh,
    labels: Numbers,
    surface: Callable[[int], Outward],
    first: int,
    limit: float,
) -> tuple[Mesh, Numbers]:
    """Give each triangle that is on no surface a label of its own.

    Their edges beside round neighbours are halved until these lie on them; neighbours that would gape all the same
    become triangles, too.

    Parameters
    ----------
    mesh : Mesh
    labels : (F,) int64
        From ``first``: of triangles that are faces already; below 0: of those that shall become ones.
    surface : callable
        Surface of a label.
    first : int
        The first label of a triangle.
    limit : float
        Edges of triangles may be so many mm away from the middle of the neighbour's surface, not more.

    Returns
    -------
    mesh : Mesh
    labels : (G,) int64
        Of its triangles.
    """
    labels = np.where(labels >= first, -1, labels)
    while True:
        mesh, labels = _halved(mesh, labels, surface, limit)
        _, patch = connected(mesh.faces, labels)
        edges, _, gap = _beside(mesh, labels, surface)
        gaping = np.unique(patch[edges[gap > limit] // 3])
        if len(gaping) == 0:
            break
        labels[np.isin(patch, gaping)] = -1
    return mesh, np.where(labels < 0, first + np.arange(len(labels)), labels)


def _halved(mesh: Mesh, labels: Numbers, surface: Callable[[int], Outward], limit: float) -> tuple[Mesh, Numbers]:
    """Halve edges of triangles that are faces until they lie on the surfaces of their neighbours."""
    for _ in range(_HALVINGS):
        edges, middle, gap = _beside(mesh, labels, surface)
        ends = mesh.vertices[mesh.faces[edges // 3, (edges + 1) % 3]] - mesh.vertices[mesh.faces[edges // 3, edges % 3]]
        far = (gap > limit) & (gap < _STEEPEST * np.linalg.norm(ends, axis=1))
        if not far.any():
            break
        edges, middle = edges[far], middle[far]
        between = np.full(3 * len(mesh.faces), -1, np.int32)
        between[edges] = len(mesh.vertices) + np.arange(len(edges))
        between[_twins(mesh)[edges]] = between[edges]
        faces, origin = cut(mesh.faces, between.reshape(-1, 3))
        mesh, labels = Mesh(np.concatenate([mesh.vertices, middle]), faces), labels[origin]
    return mesh, labels


def _beside(
    mesh: Mesh, labels: Numbers, surface: Callable[[int], Outward]
) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
    """Edges of patches beside triangles that are faces.

    Returns
    -------
    edges : (E,) int64
        3 to a triangle.
    middle : (E, 3) float64
        Places of the patch's surface nearest to their middles.
    gap : (E,) float64
        How far in mm their middles are from it, beyond the distance of their ends.
    """
    apart = labels < 0
    edges = np.flatnonzero(np.repeat(~apart, 3) & apart[_twins(mesh) // 3])
    own = labels[edges // 3]
    a, b = mesh.vertices[mesh.faces[edges // 3, edges % 3]], mesh.vertices[mesh.faces[edges // 3, (edges + 1) % 3]]
    middle, gap = (a + b) / 2, np.zeros(len(edges))
    for label in np.unique(own).tolist():
        here, along = own == label, surface(label)
        first, last, off = (along.value_and_normal(points[here])[0] for points in (a, b, middle))
        gap[here] = np.abs(off - (first + last) / 2)
        for _ in range(_STEPS):
            value, normal = along.value_and_normal(middle[here])
            middle[here] -= value[:, None] * normal
    return edges, middle, gap


def _twins(mesh: Mesh) -> Numbers:
    """Positions (3 F,) of the opposite of each directed edge."""
    start, end = mesh.faces.ravel().astype(np.int64), np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    return opposite(start, end, len(mesh.vertices))
