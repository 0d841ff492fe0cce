"""Images of grid nodes joined as the nodes are: pieces of a surface from its points nearest to the nodes beside it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .implicit import FloatArray
from .mesh import IntArray, Mesh

#: Pieces between images have edges up to this many spacings.
_LONGEST = 1.5

#: Images closer together than this many spacings are one.
_SAME = 0.01


def joined_images(
    nodes: IntArray,
    image: FloatArray,
    new: NDArray[np.bool_],
    spacing: float,
    fits: Callable[[FloatArray], NDArray[np.bool_]],
) -> Mesh:
    """Images of those faces, edges and nodes of the grid that have a new corner.

    Parameters
    ----------
    nodes : (N, 3) int32
    image : (N, 3) float64
        In mm.
    new : (N,) bool
    spacing : float
        Of the grid in mm.
    fits : callable
        Whether a piece is right, by the mean of its corners.
    """
    keys = _keys(nodes, nodes.min(axis=0) - 1, nodes.max(axis=0) + 2)
    order = np.argsort(keys)
    nodes, image, new, keys = nodes[order], image[order], new[order], keys[order]
    low, high = nodes.min(axis=0) - 1, nodes.max(axis=0) + 2

    def neighbour(*steps: int) -> NDArray[np.intp]:
        """Numbers of the nodes some unit steps further; -1 where there is none."""
        offset = np.zeros(3, np.int32)
        for axis in steps:
            offset[axis] += 1
        key = _keys(nodes + offset, low, high)
        at = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
        return np.where(keys[at] == key, at, -1)

    every = np.arange(len(nodes))
    edges = np.concatenate([np.stack([every, neighbour(axis)], axis=1) for axis in range(3)])
    quads = np.concatenate(
        [np.stack([every, neighbour(a), neighbour(a, b), neighbour(b)], axis=1) for a, b in ((0, 1), (0, 2), (1, 2))]
    )
    pieces = []
    for corners in (quads, edges):
        corners = corners[(corners >= 0).all(axis=1)]
        corners = corners[new[corners].any(axis=1)]
        side = np.linalg.norm(image[corners] - image[np.roll(corners, -1, axis=1)], axis=2)
        corners = corners[side.max(axis=1, initial=0.0) <= _LONGEST * spacing]
        corners = corners[fits(image[corners].mean(axis=1))]
        pieces.append(corners)
    a, b, c, d = pieces[0].T
    faces = [
        np.stack([a, b, c], axis=1),
        np.stack([a, c, d], axis=1),
        pieces[1][:, [0, 1, 1]],
        np.repeat(np.flatnonzero(new)[:, None], 3, axis=1),
    ]
    return _simplest(image, np.concatenate(faces), _SAME * spacing)


def _keys(nodes: IntArray, low: IntArray, high: IntArray) -> NDArray[np.int64]:
    """Count the nodes of the box from ``low`` to ``high`` before each one."""
    size = (high - low).astype(np.int64)
    place = (nodes - low).astype(np.int64)
    return np.asarray((place[:, 0] * size[1] + place[:, 1]) * size[2] + place[:, 2])


def nodes_of(blocks: IntArray) -> IntArray:
    """Nodes (N, 3) of blocks of two, and of those around them."""
    around = np.stack(np.meshgrid(*[[-1, 0, 1, 2]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = (2 * blocks[:, None] + around).reshape(-1, 3)
    return np.unique(nodes, axis=0).astype(np.int32)


def _simplest(vertices: FloatArray, faces: NDArray[np.intp], same: float) -> Mesh:
    """Triangles with vertices that are close together made one, and without those that are part of others."""
    _, first, number = np.unique(np.round(vertices / same), axis=0, return_index=True, return_inverse=True)
    faces = np.unique(np.sort(number.ravel()[faces], axis=1), axis=0)
    used = (np.diff(faces, axis=1) != 0).sum(axis=1) + 1  # different corners
    full, flat, points = (faces[used == count] for count in (3, 2, 1))
    flat = np.unique(flat[:, [0, 2]], axis=0)
    sides = full[:, [[0, 1], [0, 2], [1, 2]]].reshape(-1, 2)
    flat = flat[~_among(flat, sides, len(first))]
    points = points[~np.isin(points[:, 0], np.concatenate([full.ravel(), flat.ravel()]))]
    return Mesh(vertices[first], np.concatenate([full, flat[:, [0, 1, 1]], points]))


def _among(pairs: NDArray[np.intp], others: NDArray[np.intp], count: int) -> NDArray[np.bool_]:
    """Which pairs of numbers below ``count`` are among other pairs."""
    return np.isin(pairs[:, 0] * count + pairs[:, 1], others[:, 0] * count + others[:, 1])
