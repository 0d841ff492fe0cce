"""Patches: the parts of a closed mesh whose triangles carry one label, and the chains of edges that bound them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from .mesh import IntArray, Mesh

Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Chain:
    """Edges of the mesh between two patches, from one junction to the next.

    Attributes
    ----------
    vertices : (N,) int64
        Of the mesh; the first is the last where the chain is closed.
    left, right : int
        Patches on either side, seen from outside; they may be the same.
    """

    vertices: Numbers
    left: int
    right: int


@dataclass(frozen=True, eq=False)
class Patches:
    """A mesh divided by labels.

    Attributes
    ----------
    labels : (P,) int64
        Of the patches.
    of_triangle : (F,) int64
        Patch of each triangle.
    chains : list of Chain
    loops : list of list of list of (int, bool)
        For each patch its closed borders: chains in order, and whether each runs forward; the patch is on the left.
    """

    labels: Numbers
    of_triangle: Numbers
    chains: list[Chain]
    loops: list[list[list[tuple[int, bool]]]]


def connected(faces: IntArray, labels: Numbers) -> tuple[Numbers, Numbers]:
    """Label of each patch (P,), and the patch of each triangle (F,): those that share edges and a label."""
    count = int(faces.max()) + 1
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    triangle = np.repeat(np.arange(len(faces)), 3)
    other = opposite(start, end, count) // 3
    same = labels[triangle] == labels[other]
    graph = coo_matrix((np.ones(int(same.sum()), np.int8), (triangle[same], other[same])), (len(faces), len(faces)))
    patch = connected_components(graph, directed=False)[1].astype(np.int64)
    _, first = np.unique(patch, return_index=True)
    return labels[first], patch


def opposite(start: Numbers, end: Numbers, count: int) -> Numbers:
    """Positions (E,) of the opposite of each directed edge of a closed mesh."""
    key = start * count + end
    order = np.argsort(key)
    return np.asarray(order[np.searchsorted(key, end * count + start, sorter=order)])


def divide(mesh: Mesh, labels: Numbers, junctions: Numbers) -> Patches:
    """Divide a closed mesh into patches.

    Parameters
    ----------
    mesh : Mesh
    labels : (F,) int64
    junctions : (J,) int64
        Vertices at which chains end in any case, if they lie on any.
    """
    own, patch = connected(mesh.faces, labels)
    count = len(mesh.vertices)
    start = mesh.faces.ravel().astype(np.int64)
    end = np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    back = opposite(start, end, count)
    left, right = np.repeat(patch, 3), patch[back // 3]
    border = np.flatnonzero(left != right)
    after = _next_border(border, left != right, back)
    stops = _stops(border, start, end, left, right, after, count)
    stops[junctions] = True
    return Patches(own, patch, *_walked(border, start, end, left, right, after, back, stops, len(own)))


def _next_border(border: Numbers, is_border: NDArray[np.bool_], back: Numbers) -> dict[int, int]:
    """Next edge of the same patch's border, for each."""
    after = {}
    for edge in border.tolist():
        other = edge - 2 if edge % 3 == 2 else edge + 1
        while not is_border[other]:
            twin = int(back[other])
            other = twin - 2 if twin % 3 == 2 else twin + 1
        after[edge] = other
    return after


def _stops(
    border: Numbers,
    start: Numbers,
    end: Numbers,
    left: Numbers,
    right: Numbers,
    after: dict[int, int],
    count: int,
) -> NDArray[np.bool_]:
    """Vertices (V,) where other than two patches meet, or two meet more than once."""
    stops = np.asarray(np.bincount(start[border], minlength=count) != 2)
    stops[np.bincount(start[border], minlength=count) == 0] = False
    following = np.array([after[edge] for edge in border.tolist()], np.int64)
    changes = right[border] != right[following]
    stops[end[border[changes]]] = True
    return stops


def _walked(
    border: Numbers,
    start: Numbers,
    end: Numbers,
    left: Numbers,
    right: Numbers,
    after: dict[int, int],
    back: Numbers,
    stops: NDArray[np.bool_],
    patches: int,
) -> tuple[list[Chain], list[list[list[tuple[int, bool]]]]]:
    chains: list[Chain] = []
    of_edge: dict[int, tuple[int, bool]] = {}
    loops: list[list[list[tuple[int, bool]]]] = [[] for _ in range(patches)]
    seen: set[int] = set()
    for first in border.tolist():
        if first in seen:
            continue
        loop = [first]
        while (edge := after[loop[-1]]) != first:
            loop.append(edge)
        seen.update(loop)
        at = next((i for i, edge in enumerate(loop) if stops[start[edge]]), None)
        if at is None:  # a closed chain: whoever comes first says where it starts
            twin = next((of_edge[int(back[edge])] for edge in loop if int(back[edge]) in of_edge), None)
            where = int(start[loop[0]] if twin is None else chains[twin[0]].vertices[0])
            at = next(i for i, edge in enumerate(loop) if start[edge] == where)
            stops[where] = True
        loop = loop[at:] + loop[:at]
        found: list[tuple[int, bool]] = []
        cuts = [i for i, edge in enumerate(loop) if stops[start[edge]]] + [len(loop)]
        for low, high in pairwise(cuts):
            run = loop[low:high]
            known = of_edge.get(int(back[run[0]]))
            if known is None:
                vertices = np.append(start[run], end[run[-1]])
                for edge in run:
                    of_edge[edge] = (len(chains), True)
                found.append((len(chains), True))
                chains.append(Chain(vertices, int(left[run[0]]), int(right[run[0]])))
            else:
                found.append((known[0], False))
        loops[int(left[first])].append(found)
    return chains, loops
