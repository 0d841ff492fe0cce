"""Mesh to B-rep: a solid of plane faces, flat regions merged to one face each."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.Geom import Geom_Line, Geom_Plane
from OCP.gp import gp_Dir, gp_Pnt
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire

from cad_implicit.errors import CadImplicitError, GeometryWarning, InvalidMeshError
from cad_implicit.mesh import FloatArray, Mesh

from .flat_faces import FlatFaces, flat_faces
from .occ import Shape, compound, silence
from .shells import solids_of
from .weld import NEAR, outward, parted

#: Points closer than this are one to the kernel (its ``Precision::Confusion``), in mm.
_RESOLUTION = 1e-7

#: A solid of more plane faces than this is announced: from here on a STEP file is larger than 20 MB.
_MANY = 20_000
#: Cost of a plane face, written to STEP, in processor time and in the file: 0.05 to 0.1 ms to make it, 0.16 ms to write
#: it, 1.03 kB for a triangle and up to 1.2 kB for a polygon of a part.
_SECONDS, _BYTES = 2.5e-4, 1.1e3

#: Polygons are good without asking the kernel if they are wider than so many tolerances (area over outline), ...
_WIDE = 20.0
#: ... have no corner sharper than this, nor one that turns back by more than rounding, in radians.
_SHARP, _STRAIGHT = 0.01, 1e-6


def facets(mesh: Mesh) -> Shape:
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
    tolerance = max(NEAR * simple.diagonal, 2 * _RESOLUTION)
    found = [flat_faces(body, tolerance) for body, _ in bodies]
    _announce(sum(len(faces.loops) for faces in found))
    return compound([_valid(*body, faces, tolerance) for body, faces in zip(bodies, found, strict=True)])


def _simplified(mesh: Mesh) -> Mesh:
    """Mesh with fewer triangles and no tiny ones; the same mesh where it is not manifold."""
    from manifold3d import Error, Manifold, Mesh64

    body = Manifold(Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    if body.status() != Error.NoError:
        return mesh
    result = body.simplify(max(NEAR * mesh.diagonal, 2 * _RESOLUTION)).to_mesh64()
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


def _valid(mesh: Mesh, shell: NDArray[np.int64], faces: FlatFaces, tolerance: float) -> Shape:
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
    except Exception as error:  # OCP raises its own family of errors, which differs between versions
        reason = f"cannot be made ({type(error).__name__})"
    raise InvalidMeshError(
        f"the solid of {len(mesh.faces):,} triangles {reason}: some cross each other, or are too small for the "
        f"kernel's resolution of {_RESOLUTION:g} mm; write a mesh (.stl, .3mf) instead"
    )


def _built(mesh: Mesh, shell: NDArray[np.int64], faces: FlatFaces) -> tuple[Shape, NDArray[np.intp]]:
    """Solid of flat faces, and the numbers of those that are not valid."""
    vertex, after, face = faces.corners()
    start, end = vertex, vertex[after]
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, first, edge = np.unique(low * len(mesh.vertices) + high, return_index=True, return_inverse=True)
    off = np.abs(((mesh.vertices[vertex] - faces.centres[face]) * faces.normals[face]).sum(axis=1))
    off = np.maximum(off, off[after]) + _RESOLUTION
    edge_off, vertex_off = np.zeros(len(first)), np.zeros(len(mesh.vertices))
    np.maximum.at(edge_off, edge, off)
    np.maximum.at(vertex_off, low, edge_off[edge])
    np.maximum.at(vertex_off, high, edge_off[edge])
    edges = _edges(mesh.vertices, low[first], high[first], edge_off, vertex_off)
    made = _faces(faces, edges, edge.tolist(), (start < end).tolist())
    shells: NDArray[np.int64] = np.zeros(len(made), np.int64)
    shells[faces.label] = shell
    length = np.linalg.norm(mesh.vertices[end] - mesh.vertices[start], axis=1)
    short = np.bincount(face, length <= np.maximum(vertex_off[start], vertex_off[end])) > 0
    doubtful = np.flatnonzero(short | _doubtful(mesh.vertices, faces, vertex_off))
    bad = [n for n in doubtful.tolist() if short[n] or not _is_good(made[n])]
    return _solid(made, shells.tolist()), np.array(bad, np.intp)


def _edges(
    points: FloatArray, low: NDArray[np.int64], high: NDArray[np.int64], edge_off: FloatArray, vertex_off: FloatArray
) -> list[tuple[Shape, Shape]]:
    """Straight edges forward and reversed, between shared vertices."""
    builder = BRep_Builder()
    place = points.tolist()
    corners: dict[int, tuple[gp_Pnt, Shape, Shape]] = {}
    for number in np.unique(np.concatenate([low, high])).tolist():
        point, vertex = gp_Pnt(*place[number]), TopoDS_Vertex()
        builder.MakeVertex(vertex, point, float(vertex_off[number]))
        corners[number] = point, vertex, vertex.Reversed()
    way = points[high] - points[low]
    length = np.linalg.norm(way, axis=1).tolist()
    edges = []
    for a, b, direction, far, off in zip(
        low.tolist(), high.tolist(), way.tolist(), length, edge_off.tolist(), strict=True
    ):
        edge = TopoDS_Edge()
        builder.MakeEdge(edge, Geom_Line(corners[a][0], gp_Dir(*direction)), off)
        builder.Add(edge, corners[a][1])
        builder.Add(edge, corners[b][2])
        builder.Range(edge, 0.0, far)
        edges.append((edge, edge.Reversed()))
    return edges


def _faces(
    faces: FlatFaces, edges: list[tuple[Shape, Shape]], edge: list[int], forward: list[bool]
) -> list[TopoDS_Face]:
    builder = BRep_Builder()
    made, corner = [], 0
    for loops, centre, normal in zip(faces.loops, faces.centres.tolist(), faces.normals.tolist(), strict=True):
        face = TopoDS_Face()
        builder.MakeFace(face, Geom_Plane(gp_Pnt(*centre), gp_Dir(*normal)), _RESOLUTION)
        for loop in loops:
            wire = TopoDS_Wire()
            builder.MakeWire(wire)
            for _ in loop:
                builder.Add(wire, edges[edge[corner]][0 if forward[corner] else 1])
                corner += 1
            wire.Closed(True)
            builder.Add(face, wire)
        made.append(face)
    return made


def _solid(faces: list[TopoDS_Face], shell_of: list[int]) -> Shape:
    """Solid of faces, each in the shell of its number."""
    builder, solid = BRep_Builder(), TopoDS_Solid()
    builder.MakeSolid(solid)
    shells = []
    for _ in range(max(shell_of) + 1):
        shell = TopoDS_Shell()
        builder.MakeShell(shell)
        shells.append(shell)
    for face, number in zip(faces, shell_of, strict=True):
        builder.Add(shells[number], face)
    for shell in shells:
        shell.Closed(True)
        builder.Add(solid, shell)
    return solid


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


def _is_good(face: TopoDS_Face) -> bool:
    with silence():
        return bool(BRepCheck_Analyzer(face).IsValid())
