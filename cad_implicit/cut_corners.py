"""Where a contour cuts corners: edges whose middle is off the surface are split, and the new vertices put onto it.

Dual contours lose what is smaller than a cell: the end of a blend whose angle fades out, a tip where acute creases
meet, a shallow crease that no cell saw. Such places are few, but of 31 closings eight were off by 0.09 to 0.2 spacings
there. What is off is seen at the middles of edges, whatever the reason; it is mended one edge at a time, as far as no
triangle folds or runs through another.

What is left then are dents, for instance where a tip was taken back into its cell so that no triangles run through each
other; those are closed by cones (:mod:`cad_implicit.dents`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .creases import Edges, split_edges
from .dents import without_dents
from .implicit import Evaluate, FloatArray
from .kernels.edges import bent_sides
from .kernels.intersections import intersecting
from .mesh import Mesh
from .missed_creases import beside_ends, edges_of, next_crease, onto_crease, snapped, unfolded

#: Edges are split if their middle is farther than this from the surface, in spacings; vertices that are move.
FAR = 0.05

#: Middles are looked at if the triangles beside the edge turn by more than 3 degrees (cosine).
_FLAT = 0.9986

#: Between faces whose normals differ by more than 10 degrees (cosine) there is a crease: what is off is no facet.
_SHARP = 0.985

#: New vertices are nearer than this to the surface, in spacings, and nearer to the middle than this share of the edge;
#: vertices move by less than so many spacings. (Where surfaces nearly touch, Newton's steps may go far.)
_ON = 5e-3
_AWAY = 0.75

#: A new vertex that is nearer than this to an end, or to the vertices across, in spacings, is of no use.
_APART = 0.1

#: A split leaves shorter edges that may be off, too. Of 300 edges of a gear six were left after six passes.
_PASSES = 6

#: Where an edge is split: next to one end, next to the other, midway.
_WAYS = 3

#: Triangles nearer than so many spacings to what is off, at least, are looked at.
_AROUND = 3.0

#: Newton's steps onto the surface, and from there onto the exact one.
_NEWTON, _POLISH = 4, 2

#: Tries without what makes triangles run through each other.
_TRIES = 6


def mend_corners(
    mesh: Mesh, rough: Evaluate, look: Evaluate, spacing: float, threads: int | None = None, far: float = FAR
) -> Mesh:
    """Split edges whose middles are off the surface, and move vertices that are.

    Parameters
    ----------
    mesh : Mesh
        Closed: the contour of a function.
    rough, look : callable
        Map points (N, 3) to values (N,) and gradients (N, 3): quickly, and exactly.
    spacing : float
        Of the contour's grid in mm.
    threads : int, optional
        Default: all cores.
    far : float
        Distance from the surface, in spacings, that the middle of an edge may have.

    Returns
    -------
    Mesh
        Closed; no triangles run through each other that did not.
    """
    run = _Run(rough, look, spacing, threads, far)
    edges = run.off(mesh, _bent(mesh))
    if len(edges.ends) == 0:
        return mesh
    around = around_places(mesh.vertices, mesh.vertices[edges.ends].mean(axis=1), _AROUND * spacing)
    own = around[mesh.faces].any(axis=1)
    patch = Mesh(mesh.vertices, mesh.faces[own])
    edges, stuck = _same(edges, _bent(patch)), 0
    for number in range(_PASSES):
        before = patch
        patch = run.split(run.raised(patch, edges), edges, number % _WAYS)
        stuck = stuck + 1 if patch is before else 0
        edges = run.off(patch, _bent(patch)) if stuck == 0 else edges
        if len(edges.ends) == 0 or stuck == _WAYS:
            break
    patch = without_dents(patch, edges.ends, rough, look, spacing, far * spacing, run.tangled)
    return Mesh(patch.vertices, np.concatenate([mesh.faces[~own], patch.faces]))


def around_places(points: FloatArray, places: FloatArray, reach: float) -> NDArray[np.bool_]:
    """Points (N, 3) in the cells, ``reach`` mm wide, of places and next to them: all that are nearer, and some more."""
    low = (np.floor(points.min(axis=0) / reach) - 2) * reach  # the same cells whatever else there is
    size = ((points.max(axis=0) - low) / reach).astype(np.int64) + 3
    cells, own = (((x - low) / reach).astype(np.int64) for x in (points, places))
    shifts = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), axis=-1).reshape(-1, 3)
    around = np.unique((own[:, None] + shifts).reshape(-1, 3) @ [size[1] * size[2], size[2], 1])
    return np.isin(cells @ [size[1] * size[2], size[2], 1], around)


def _bent(mesh: Mesh) -> Edges:
    """Edges whose triangles turn."""
    return edges_of(bent_sides(mesh.vertices, mesh.faces, _FLAT), mesh)


def _same(edges: Edges, others: Edges) -> Edges:
    """Those others that have the same ends as one of the edges."""
    own, theirs = (np.sort(one.ends, axis=1) @ [1 << 32, 1] for one in (edges, others))
    return others.some(np.isin(theirs, own))


@dataclass(frozen=True, eq=False)
class _Run:
    """The surface, and at which spacing it was contoured."""

    rough: Evaluate
    look: Evaluate
    spacing: float
    threads: int | None
    far: float

    def off(self, mesh: Mesh, edges: Edges) -> Edges:
        """Those edges whose middle is far off the surface."""
        edges = edges.some(self._far(mesh.vertices[edges.ends].mean(axis=1), self.rough, self.far))
        return edges.some(self._far(mesh.vertices[edges.ends].mean(axis=1), self.look, self.far))

    def _far(self, points: FloatArray, look: Evaluate, limit: float) -> NDArray[np.bool_]:
        value, gradient = look(points)
        return np.asarray(np.abs(value) > limit * self.spacing * np.linalg.norm(gradient, axis=1))

    def _onto(self, points: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Points (N, 3) moved onto the surface by Newton's steps, and whether they were on it before the last one."""
        for number in range(_NEWTON + _POLISH):
            value, gradient = (self.rough if number < _NEWTON else self.look)(points)
            square = np.maximum((gradient * gradient).sum(axis=1), 1e-12)
            points = points - (value / square)[:, None] * gradient
        return points, np.asarray(np.abs(value) < _ON * self.spacing * np.sqrt(square))

    def raised(self, mesh: Mesh, edges: Edges) -> Mesh:
        """Vertices at the ends of edges that are off the surface moved onto it, unless triangles meet."""
        which = np.unique(edges.ends)
        which = which[self._far(mesh.vertices[which], self.look, self.far)]
        if len(which) == 0:
            return mesh
        point, on = self._onto(mesh.vertices[which])
        good = on & (np.linalg.norm(point - mesh.vertices[which], axis=1) < _AWAY * self.spacing)
        which, point = which[good], point[good]
        while len(which):
            moved = snapped(mesh, which, point)
            bad = self.tangled(moved)[which]
            if not bad.any():
                return moved
            which, point = which[~bad], point[~bad]
        return mesh

    def split(self, mesh: Mesh, edges: Edges, way: int) -> Mesh:
        """Split edges as far as nothing folds or meets: at the crease next to one or the other end, or midway."""
        point, good = self._new_vertices(mesh.vertices[edges.ends], way)
        across = mesh.faces[edges.triangle, (edges.corner + 2) % 3]
        away = np.linalg.norm(point[:, None] - mesh.vertices[across], axis=2).min(axis=1)
        good &= away > _APART * self.spacing
        edges, point = edges.some(good), point[good]
        for _ in range(_TRIES):
            rows = np.flatnonzero(unfolded(mesh, edges, np.arange(len(point)), point, self.rough))
            edges, point = edges.some(rows), point[rows]
            if len(rows) == 0:
                break
            faces = split_edges(mesh.faces, edges, np.arange(len(rows)), len(mesh.vertices))
            result = Mesh(np.concatenate([mesh.vertices, point]), faces)
            tangled = self.tangled(result)
            bad: NDArray[np.bool_] = tangled[len(mesh.vertices) :]
            if not bad.any():
                bad = np.asarray(tangled[edges.ends].any(axis=1))
            if not bad.any():
                return result
            edges, point = edges.some(~bad), point[~bad]
        return mesh

    def _usable(self, points: FloatArray, ends: FloatArray) -> NDArray[np.bool_]:
        """Whether points (E, 3) are near the middles of edges, and not too near their ends."""
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        from_middle = np.linalg.norm(points - ends.mean(axis=1), axis=1)
        from_ends = np.linalg.norm(points[:, None] - ends, axis=2).min(axis=1)
        return np.asarray(
            (from_middle < _AWAY * np.maximum(length, self.spacing)) & (from_ends > _APART * self.spacing)
        )

    def _new_vertices(self, ends: FloatArray, way: int) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Points (E, 3) of the surface between ends (E, 2, 3), and whether they are usable.

        They are on the crease that is there, if it is not at an end.
        """
        ends = ends[:, ::-1] if way == 1 else ends
        place, slopes = next_crease(ends, beside_ends(ends, self.rough), self.rough, _SHARP)
        sharp = np.flatnonzero((slopes[:, 0] * slopes[:, 1]).sum(axis=1) < (_SHARP if way < _WAYS - 1 else -1.0))
        point = ends.mean(axis=1)
        if len(sharp):
            point = np.concatenate([point, onto_crease(place[sharp], ends[sharp], self.rough, self.spacing)])
        point, good = self._onto(point)
        good &= self._usable(point, np.concatenate([ends, ends[sharp]]))
        better = good[len(ends) :]
        point[sharp[better]] = point[len(ends) :][better]
        good[sharp[better]] = True
        return point[: len(ends)], good[: len(ends)]

    def tangled(self, mesh: Mesh) -> NDArray[np.bool_]:
        """Vertices (V,) of triangles that run through others."""
        found = np.zeros(len(mesh.vertices), np.bool_)
        with parallel.threads(self.threads, len(mesh.faces)):
            found[mesh.faces[intersecting(mesh.vertices, mesh.faces, self.spacing)]] = True
        return found
