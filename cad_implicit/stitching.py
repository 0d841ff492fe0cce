"""Stitch: cut small shapes off a mesh, or join them to it, and leave all its other triangles as they are.

Only the small shapes are contoured. Their facets are joined to those of the part by exact booleans (manifold3d); then
the vertices at which facets cross move to where the surfaces cross, and slivers go.

Not promised: a shape thinner than about two spacings keeps its edges only roughly. So where a shape sticks out of the
part's surface, let it do so by two spacings, or give it a smaller ``spacing`` of its own. Everything of the part that
a removed shape reaches is cut off, also across a gap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .cut_corners import FAR, around_places
from .distance import MeshDistance
from .dual import dual_contour
from .errors import CadImplicitError, EmptyResultError, SpacingError
from .implicit import Evaluate, FloatArray, Implicit, polished
from .kernels import seams, slivers
from .kernels.intersections import intersecting
from .mesh import Mesh
from .missed_creases import split_at_creases
from .parallel import Progress, no_progress
from .seam_polish import Facets, polish_seams
from .sizing import positive

#: Shapes that fall between the nodes are contoured again at half the spacing, so many times.
_HALVINGS = 4

#: Farthest that the surface may shift where slivers go, length of edges that go in any case, and of those that stay, in
#: spacings. Fans of large faces are slivers, too: without the last, a straight blend lost its vertices beside them.
_SHIFT = 5e-4
_TINY = 1e-3
_SHORT = 0.25

#: The same where polished seams ran over vertices of the shapes, in spacings: these lie on the surface as the seams do.
_FOLD = 0.05

#: Share of the shifts and of the first of the lengths that are left where even so triangles run through each other, as
#: between faces that touch along a line; vertices are where facets cross then. If that does not help, the second:
#: where a shape's facets lie in those of the part, the boolean leaves flaps, 2e-3 spacings wide and next to nothing
#: thick, that less tidying keeps. Within so many spacings at first, and around what is left then; at last everywhere.
_LESS = 2e-3
_MORE = 10.0
_CALM = (2.0, 6.0)

#: Shapes are shrunk by so many spacings for the boolean, and moved by a smaller vector: faces that lie in faces of the
#: part, for instance where a blend ends, would meet them in rounding errors. (With 0, 3 of 900 joints held triangles
#: that overlap in one plane.)
_SHRINK = 1e-6
_NUDGE = (1.7e-7, -2.3e-7, 1.1e-7)

#: New shells thinner than this many spacings (volume over half the area) are left over between facets that nearly
#: coincide; the thickest seen had 0.02.
_CRUMB = 0.05

#: Edges of rounds farther off than this, in spacings, are split. (With 0.05 some errors were half as large, but where
#: two cylinders of one radius cross the seams missed the blends' surfaces, and the solid was made of facets.)
_FAR = 0.1

#: Rounds in which vertices that make triangles run through each other go back to where facets cross.
_ROUNDS = 6


def stitched(
    part: Mesh,
    added: Sequence[Implicit],
    removed: Sequence[Implicit],
    spacing: float,
    *,
    shape: Implicit | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Mesh:
    """Part with some shapes and without others: ``(part | added) - removed``, each with the union of them.

    Parameters
    ----------
    part : Mesh
        Closed.
    added, removed : sequence of Implicit
        Each is contoured within its own bounds, at its own ``spacing`` if it has one. They may overlap.
    spacing : float
        Width of the cells in mm.
    shape : Implicit, optional
        The surface that the part's triangles stand for: vertices where it is cut are put onto it. By default
        the triangles are the surface, as they are with the distance to the part.
    threads : int, optional
        Default: all cores.
    progress : callable
        Called as ``progress(stage, fraction)`` with the stages "contour", "join" and "polish"; may raise to cancel.

    Returns
    -------
    Mesh
        Closed. Vertices and triangles of the part that no shape touches are the same, bit for bit. ``face_ids`` are
        those of the part, and -1 on the surfaces of the shapes; none if the part has none.

    Raises
    ------
    OpenMeshError
        If the part is not closed.
    EmptyResultError
        If nothing is left of the part, or a shape is so small that no node of the grid falls into it.
    SpacingError
        If the spacing is not positive and finite.
    CadImplicitError
        If manifold3d is not installed, or does not take the mesh.
    """
    h = positive("spacing", spacing, SpacingError)
    part.require_closed()
    shapes = [*added, *removed]
    if not shapes:
        return part
    pieces = []
    for number, piece in enumerate(shapes):
        progress("contour", number / len(shapes))
        pieces.append(_contoured(piece, h, threads))
    progress("join", 0.0)
    joint = _joined(part, pieces[: len(added)], pieces[len(added) :], h)
    progress("polish", 0.0)
    behind = None if isinstance(shape, MeshDistance) and shape.mesh is part else shape
    result = _Seams(joint, h, threads).mended([None if behind is None else _look(behind), *map(_look, shapes)])
    progress("polish", 1.0)
    return result


def _contoured(shape: Implicit, spacing: float, threads: int | None) -> Mesh:
    """Contour of a shape with all of its creases, finer if it is smaller than the cells."""
    own = min(spacing, shape.spacing or spacing)
    far = FAR if shape.radius is None else _FAR
    contour = partial(dual_contour, shape, threads=threads, polish=getattr(shape, "polished", None), far=far)
    for halving in range(_HALVINGS + 1):
        try:
            return split_at_creases(contour(own), _look(shape), own, threads)
        except EmptyResultError:
            if halving == _HALVINGS:
                raise
            own /= 2
    raise AssertionError


def _look(shape: Implicit) -> Evaluate:
    return partial(polished, shape)


@dataclass(frozen=True, eq=False)
class _Joint:
    """What a boolean made.

    Attributes
    ----------
    meshes : list of Mesh
        Of the part, and of the shapes.
    vertices : (V, 3) float64
    origin : (V,) int64
        Mesh that each vertex is from; -1 where facets cross.
    faces : (F, 3) int32
    surface, facet : (F,) int64
        Mesh and triangle of it that each triangle came from.
    facing : (F, 4) float64
        Unit normal outward of the result, and B-rep face of the triangle; -1 for none, less on shapes.
    added : int
        How many of the shapes are added; these come first.
    """

    meshes: list[Mesh]
    vertices: FloatArray
    origin: NDArray[np.int64]
    faces: NDArray[np.int32]
    surface: NDArray[np.int64]
    facet: NDArray[np.int64]
    facing: FloatArray
    added: int


def _joined(part: Mesh, added: list[Mesh], removed: list[Mesh], spacing: float) -> _Joint:
    """Join and cut off, and tell where each triangle came from."""
    try:
        import manifold3d
    except ImportError:
        raise CadImplicitError("joining meshes needs manifold3d: pip install manifold3d") from None
    meshes = [part, *added, *removed]
    first = manifold3d.Manifold.reserve_ids(len(meshes))
    shrunk = [mesh.vertices if number == 0 else _shrunk(mesh, spacing) for number, mesh in enumerate(meshes)]
    solids = [_solid(manifold3d, v, m.faces, first + n) for n, (v, m) in enumerate(zip(shrunk, meshes, strict=True))]
    result, rest = solids[0], solids[1:]
    for some, operation in ((rest[: len(added)], "Add"), (rest[len(added) :], "Subtract")):
        if some:
            result = manifold3d.Manifold.batch_boolean([result, *some], getattr(manifold3d.OpType, operation))
    if result.status() != manifold3d.Error.NoError:
        raise CadImplicitError(f"the shapes cannot be joined to the mesh: manifold3d says {result.status().name}")
    if result.is_empty():
        raise EmptyResultError("nothing is left of the part")
    raw = result.to_mesh64()
    vertices, origin = _known(np.array(raw.vert_properties[:, :3], np.float64), shrunk, meshes)
    faces = np.array(raw.tri_verts, np.int32)
    starts = np.asarray(raw.run_index, np.int64) // 3
    surface = np.repeat(np.asarray(raw.run_original_id, np.int64) - first, starts[1:] - starts[:-1])
    facet = np.asarray(raw.face_id, np.int64)
    facing = np.zeros((len(faces), 4))
    for number, mesh in enumerate(meshes):
        rows = np.flatnonzero(surface == number)
        normal = mesh.face_vectors[facet[rows]]
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        facing[rows, :3] = normal / np.where(size > 0, size, 1.0) * (-1 if number > len(added) else 1)
        ids = part.face_ids if number == 0 else None
        facing[rows, 3] = -1 - number if ids is None else ids[facet[rows]]
    whole = _without_crumbs(vertices, faces, surface == 0, spacing)
    return _Joint(meshes, vertices, origin, faces[whole], surface[whole], facet[whole], facing[whole], len(added))


def _shrunk(mesh: Mesh, spacing: float) -> FloatArray:
    """Vertices of a mesh that is a trifle smaller, and elsewhere."""
    low, high = mesh.bounds
    scale = _SHRINK * spacing / float((high - low).max() / 2)
    return np.asarray(mesh.vertices + scale * ((low + high) / 2 - mesh.vertices) + spacing * np.array(_NUDGE))


def _known(vertices: FloatArray, shrunk: list[FloatArray], meshes: list[Mesh]) -> tuple[FloatArray, NDArray[np.int64]]:
    """Vertices (V, 3) where they are in the meshes they are from, and the numbers (V,) of these or -1."""
    keys, origin = vertex_keys(vertices), np.full(len(vertices), -1, np.int64)
    for number, (there, mesh) in enumerate(zip(shrunk, meshes, strict=True)):
        known = vertex_keys(there)
        order = np.argsort(known)
        at = order[np.minimum(np.searchsorted(known, keys, sorter=order), len(order) - 1)]
        found = known[at] == keys
        vertices[found], origin[found] = mesh.vertices[at[found]], number
    return vertices, origin


def _solid(manifold3d: Any, vertices: FloatArray, faces: NDArray[np.int32], number: int) -> Any:
    """Give manifold3d a mesh; results tell its number and those of its triangles."""
    raw = manifold3d.Mesh64(
        vertices.copy(),
        faces.astype(np.uint64),
        run_index=np.array([0, 3 * len(faces)], np.uint64),
        run_original_id=np.array([number], np.uint32),
        face_id=np.arange(len(faces), dtype=np.uint64),
    )
    solid = manifold3d.Manifold(raw)
    if solid.status() != manifold3d.Error.NoError:
        raise CadImplicitError(f"the mesh cannot be joined to others: manifold3d says {solid.status().name}")
    return solid


def _without_crumbs(
    vertices: FloatArray, faces: NDArray[np.int32], old: NDArray[np.bool_], spacing: float
) -> NDArray[np.bool_]:
    """Triangles of shells that are as large as to be wanted, or of old triangles (F,) only."""
    mesh = Mesh(vertices, faces)
    area = np.bincount(mesh.component_of_face, np.linalg.norm(mesh.face_vectors, axis=1))
    good = np.abs(mesh.shell_volumes) > _CRUMB * spacing * area / 2
    good |= np.bincount(mesh.component_of_face, ~old) == 0
    return np.asarray(good[mesh.component_of_face])


class _Seams:
    """Vertices that a boolean made, and how they are polished and mended."""

    def __init__(self, joint: _Joint, spacing: float, threads: int | None) -> None:
        self.joint = joint
        self.spacing = spacing
        self.threads = threads
        self.loose = joint.origin != 0
        self.made = np.flatnonzero(joint.origin < 0)

    def mended(self, surfaces: list[Evaluate | None]) -> Mesh:
        """Mesh with polished seams, as far as no triangles run through each other."""
        joint = self.joint
        points = joint.vertices
        target = polish_seams(points[self.made], self._facets(), joint.meshes, surfaces, self.spacing)
        moves = np.zeros_like(points)
        moves[self.made] = target - points[self.made]
        for number in range(_ROUNDS):
            faces, facing, bad = self._tidied(points + moves, np.zeros(len(points), np.bool_))
            if len(bad) == 0:
                return self._result(points + moves, faces, facing)
            back = bad[moves[bad].any(axis=1)]
            if len(back) == 0:
                break
            if number > 1:
                back = np.unique(joint.faces[np.isin(joint.faces, back).any(axis=1)])
            moves[back] = self._shorter(back.astype(np.int64), surfaces) if number == 0 else 0.0
        return self._calmed(moves, bad)

    def _calmed(self, moves: FloatArray, bad: NDArray[np.int32]) -> Mesh:
        """Mesh with seams that are not polished, and hardly tidied, around vertices of triangles that stay tangled."""
        points, calm = self.joint.vertices, np.zeros(len(moves), np.bool_)
        for reach in _CALM:
            calm |= around_places(points, points[bad], reach * self.spacing)
            moves[calm] = 0.0
            for share in (_LESS, _MORE):
                faces, facing, bad = self._tidied(points + moves, calm, share)
                if len(bad) == 0:
                    return self._result(points + moves, faces, facing)
        faces, facing, _ = self._tidied(points, np.ones(len(points), np.bool_))
        return self._result(points, faces, facing)

    def _shorter(self, vertices: NDArray[np.int64], surfaces: list[Evaluate | None]) -> FloatArray:
        """Find moves (N, 3) of vertices onto that one of two shapes which decides, where the other does not afterwards.

        Where one is added and the other removed, and they nearly touch, the way to where they cross is long.
        """
        joint = self.joint
        moves = np.zeros((len(vertices), 3))
        near = np.isin(joint.faces, vertices).any(axis=1)
        faces, surface, facet = joint.faces[near], joint.surface[near], joint.facet[near]
        for row, vertex in enumerate(vertices):
            around = (faces == vertex).any(axis=1)
            both = np.unique(surface[around])
            if len(both) != 2 or not 0 < both[0] <= joint.added < both[1]:
                continue
            point = joint.vertices[vertex][None]
            before = self._inside(surfaces, both, point)
            decides = both[int(np.argmin(before))]
            rows = np.unique(facet[around & (surface == decides)])
            facets = Facets(np.zeros_like(rows), np.full_like(rows, decides), rows)
            there = polish_seams(point, facets, joint.meshes, surfaces, self.spacing)
            if abs(min(self._inside(surfaces, both, there))) < abs(min(before)):
                moves[row] = (there - point)[0]
        return moves

    def _inside(self, surfaces: list[Evaluate | None], numbers: NDArray[np.int64], point: FloatArray) -> list[float]:
        """How far a point (1, 3) is inside of shapes that are added, or outside of those removed."""
        looks = [(surfaces[number], 1.0 if number <= self.joint.added else -1.0) for number in numbers]
        return [sign * float(look(point)[0][0]) for look, sign in looks if look is not None]

    def _facets(self) -> Facets:
        """Which facets the vertices that the boolean made lie on."""
        joint = self.joint
        number = np.full(len(joint.vertices), -1, np.int64)
        number[self.made] = np.arange(len(self.made))
        row, corner = np.nonzero(number[joint.faces] >= 0)
        table = np.stack([number[joint.faces[row, corner]], joint.surface[row], joint.facet[row]])
        return Facets(*np.unique(table, axis=1))

    def _tidied(
        self, position: FloatArray, calm: NDArray[np.bool_], share: float = _LESS
    ) -> tuple[NDArray[np.int32], FloatArray, NDArray[np.int32]]:
        """Triangles, what they face, and vertices of those still tangled; for ``calm`` (V,) a share of the limits."""
        faces, facing = self.joint.faces.copy(), self.joint.facing.copy()
        loose = self.loose.astype(np.int8)
        loose[self.made] = 2
        for own, part in ((~calm, 1.0), (calm, share)):
            if own.any():
                limits = self.spacing * np.array([part * _SHIFT, part * _TINY, _SHORT, min(part, 1.0) * _FOLD])
                kept = seams.tidy(position, faces, facing, np.where(own, loose, np.int8(0)), *limits)
                faces, facing = faces[kept], facing[kept]
        return faces, facing, np.unique(faces[self._tangled(position, faces, facing)])

    def _tangled(self, position: FloatArray, faces: NDArray[np.int32], facing: FloatArray) -> NDArray[np.intp]:
        """Triangles at loose vertices that run through each other, or face the wrong way."""
        near = np.flatnonzero(self.loose[faces].any(axis=1))
        vertices, some, _ = slivers.compact(position, faces[near])
        with parallel.threads(self.threads, len(near)):
            bad = intersecting(vertices, some, self.spacing)
        return np.asarray(near[bad | seams.wrong_way(vertices, some, facing[near])])

    def _result(self, position: FloatArray, faces: NDArray[np.int32], facing: FloatArray) -> Mesh:
        part = self.joint.meshes[0]
        vertices, faces, _ = slivers.compact(position, faces)
        ids = None if part.face_ids is None else np.maximum(facing[:, 3], -1).astype(np.int32)
        return Mesh(vertices, faces, ids, part.source)


def vertex_keys(points: FloatArray) -> NDArray[np.bytes_]:
    """Give each point (N, 3) one value to compare."""
    rows = np.ascontiguousarray(points + 0.0)
    return np.frombuffer(rows.tobytes(), "S24")
