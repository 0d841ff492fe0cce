"""Mesh to B-rep: a solid of plane faces, flat regions merged to one face each."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cad_implicit.errors import CadImplicitError, GeometryWarning, InvalidMeshError
from cad_implicit.mesh import FloatArray, Mesh

from .flat_faces import FlatFaces, flat_faces
from .kernel import kernel
from .shells import solids_of
from .weld import NEAR, outward, parted

#: Points closer than this are one to the kernel (its ``Precision::Confusion``), in mm.
RESOLUTION = 1e-7

#: A solid of more plane faces than this is announced: from here on a STEP file is larger than 20 MB.
_MANY = 20_000
#: Cost of a plane face, written to STEP, in processor time and in the file: 0.05 to 0.1 ms to make it, 0.16 ms to write
#: it, 1.03 kB for a triangle and up to 1.2 kB for a polygon of a part.
_SECONDS, _BYTES = 2.5e-4, 1.1e3

#: Polygons are good without asking the kernel if they are wider than so many tolerances (area over outline), ...
_WIDE = 20.0
#: ... have no corner sharper than this, nor one that turns back by more than rounding, in radians.
_SHARP, _STRAIGHT = 0.01, 1e-6


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """A solid of plane faces, for a kernel to make.

    Attributes
    ----------
    points : (V, 3) float64
    low, high : (E,) int64
        Vertices at the ends of the edges, the lower number first.
    edge_off, vertex_off : (E,), (V,) float64
        Tolerances in mm.
    faces : FlatFaces
    edge : list of int
        Edge that begins at each corner of each outline, as :meth:`FlatFaces.corners` gives them.
    forward : list of bool
        Whether it runs from its lower vertex.
    shell : (F,) int64
        Shell of each triangle, from 0.
    """

    points: FloatArray
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    edge_off: FloatArray
    vertex_off: FloatArray
    faces: FlatFaces
    edge: list[int]
    forward: list[bool]
    shell: NDArray[np.int64]

    def shells(self) -> list[int]:
        """Shell of each face."""
        found: NDArray[np.int64] = np.zeros(len(self.faces.loops), np.int64)
        found[self.faces.label] = self.shell
        return [int(number) for number in found]


def facets(mesh: Mesh) -> Any:
    """Solid with the triangles of a closed mesh as its faces, those in one plane joined; a compound if several.

    First the triangles are simplified without moving the surface by more than :data:`~.weld.NEAR` of the diagonal,
    which removes those too small for the kernel; faces are joined within the same tolerance. Takes about 0.06 ms a
    face, and 1 kB in a STEP file.

    Every edge is used once by each of two faces, by construction. Wide convex polygons, triangles among them, are valid
    as they are; all others are shown to the kernel.

    Raises
    ------
    OpenMeshError
        If the mesh is not closed.
    InvalidMeshError
        If the kernel finds faces invalid, or the mesh is flat, or a shell is inside out and lies in no other.

    Warns
    -----
    GeometryWarning
        If more than 20,000 faces are to be made: how long that takes, and what to do.
    """
    simple = parted(_simplified(outward(mesh.require_closed())))
    bodies = [_body(simple, shells) for shells in solids_of(simple)]
    if not bodies:
        raise InvalidMeshError(f"the mesh of {len(mesh.faces):,} triangles is flat: it encloses {mesh.volume:.3g} mm³")
    tolerance = max(NEAR * simple.diagonal, 2 * RESOLUTION)
    found = [flat_faces(body, tolerance) for body, _ in bodies]
    _announce(sum(len(faces.loops) for faces in found))
    return kernel(None).compound([_valid(*body, faces, tolerance) for body, faces in zip(bodies, found, strict=True)])


def _simplified(mesh: Mesh) -> Mesh:
    """Mesh with fewer triangles and no tiny ones; the same mesh where it is not manifold, or without manifold3d."""
    try:
        from manifold3d import Error, Manifold, Mesh64
    except ImportError:
        return mesh
    body = Manifold(Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    if body.status() != Error.NoError:
        return mesh
    result = body.simplify(max(NEAR * mesh.diagonal, 2 * RESOLUTION)).to_mesh64()
    corners = np.asarray(result.tri_verts, np.int64)
    return Mesh(np.asarray(result.vert_properties)[:, :3], corners, None, mesh.source) if len(corners) else mesh


def _body(mesh: Mesh, shells: list[NDArray[np.intp]]) -> tuple[Mesh, NDArray[np.int64]]:
    """Mesh of one solid, and the shell of each of its triangles."""
    used, corners = np.unique(mesh.faces[np.concatenate(shells)], return_inverse=True)
    shell = np.repeat(np.arange(len(shells)), [len(own) for own in shells])
    return Mesh(mesh.vertices[used], corners.reshape(-1, 3)), shell


def _announce(count: int) -> None:
    if count > _MANY:
        warnings.warn(
            f"a solid of {count:,} plane faces takes about {count * _SECONDS:.0f} s, and {count * _BYTES / 1e6:.0f} MB "
            "as STEP: a larger tolerance (to_part(..., tolerance=), --simplify) makes fewer",
            GeometryWarning,
            stacklevel=4,
        )


def _valid(mesh: Mesh, shell: NDArray[np.int64], faces: FlatFaces, tolerance: float) -> Any:
    """Solid of flat faces; those that the kernel finds invalid fall apart to triangles again."""
    apart = np.zeros(len(mesh.faces), np.bool_)
    try:
        while True:
            solid, bad = _built(mesh, shell, faces)
            if not len(bad):
                return solid
            wrong = np.isin(faces.label, bad) & ~apart
            alone = int(np.count_nonzero(np.bincount(faces.label)[bad] == 1))
            if not wrong.any() or alone:
                reason = f"is not valid ({alone:,} of them)"
                break
            apart |= wrong
            faces = flat_faces(mesh, tolerance, apart)
    except CadImplicitError:
        raise
    except Exception as error:  # each kernel raises its own family of errors
        reason = f"cannot be made ({type(error).__name__})"
    raise InvalidMeshError(
        f"the solid of {len(mesh.faces):,} triangles {reason}: some cross each other, or are too small for the "
        f"kernel's resolution of {RESOLUTION:g} mm; write a mesh (.stl, .3mf) instead"
    )


def _built(mesh: Mesh, shell: NDArray[np.int64], faces: FlatFaces) -> tuple[Any, NDArray[np.intp]]:
    """Solid of flat faces, and the numbers of those that are not valid."""
    vertex, after, face = faces.corners()
    start, end = vertex, vertex[after]
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, first, edge = np.unique(low * len(mesh.vertices) + high, return_index=True, return_inverse=True)
    off = np.abs(((mesh.vertices[vertex] - faces.centres[face]) * faces.normals[face]).sum(axis=1))
    off = np.maximum(off, off[after]) + RESOLUTION
    edge_off, vertex_off = np.zeros(len(first)), np.zeros(len(mesh.vertices))
    np.maximum.at(edge_off, edge, off)
    np.maximum.at(vertex_off, low, edge_off[edge])
    np.maximum.at(vertex_off, high, edge_off[edge])
    ends, forward = (low[first], high[first]), (start < end).tolist()
    plan = Polyhedron(mesh.vertices, *ends, edge_off, vertex_off, faces, edge.tolist(), forward, shell)
    solid, is_good = kernel(None, "facets").polyhedron(plan)
    length = np.linalg.norm(mesh.vertices[end] - mesh.vertices[start], axis=1)
    short = np.bincount(face, length <= np.maximum(vertex_off[start], vertex_off[end])) > 0
    doubtful = np.flatnonzero(short | _doubtful(mesh.vertices, faces, vertex_off))
    bad = [n for n in doubtful.tolist() if short[n] or not is_good(n)]
    return solid, np.array(bad, np.intp)


def _doubtful(points: FloatArray, faces: FlatFaces, vertex_off: FloatArray) -> NDArray[np.bool_]:
    """Mark the faces that are not seen at once to be good: those with holes, not convex, or thin."""
    vertex, after, face = faces.corners()
    count = len(faces.loops)
    way = points[vertex[after]] - points[vertex]
    length = np.linalg.norm(way, axis=1)
    following = way[after]
    turn = np.arctan2(
        (np.cross(way, following) * faces.normals[face]).sum(axis=1), (way * following).sum(axis=1)
    )  # at the end of each side, to the left
    off = np.zeros(count)
    np.maximum.at(off, face, vertex_off[vertex])
    good = faces.areas > _WIDE * off * np.bincount(face, length, count)
    good &= np.abs(np.bincount(face, turn, count) - 2 * np.pi) < _STRAIGHT
    bent = (turn < -_STRAIGHT) | (turn > np.pi - _SHARP)
    good &= np.bincount(face, bent, count) == 0
    return np.asarray(~good | np.array([len(loops) != 1 for loops in faces.loops]))
