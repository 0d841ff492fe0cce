"""Mesh to B-rep: a solid of plane faces, flat regions merged to one face each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeShapeOnMesh
from OCP.gp import gp_Pnt
from OCP.Poly import Poly_Triangle, Poly_Triangulation
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.TopAbs import TopAbs_FACE
from OCP.TopoDS import TopoDS_Shell, TopoDS_Solid

from cad_implicit.errors import InvalidMeshError
from cad_implicit.mesh import Mesh

from .occ import Shape, compound, explore, is_valid, silence, volume
from .shells import solids_of
from .weld import NEAR

#: Largest difference in volume between the triangles and the solid made of them, as a share.
_VOLUME_SLACK = 1e-6


def facets(mesh: Mesh) -> Shape:
    """Solid with the triangles of a closed mesh as its faces; a compound if there are several.

    First the triangles are simplified without moving the surface by more than :data:`~.weld.NEAR` of the diagonal,
    which removes those too small for the kernel; at last, faces in one plane are merged where that leaves the solid
    valid. Takes 0.2 to 0.4 ms a triangle that is left, and about 1.5 kB in a STEP file.

    Raises
    ------
    OpenMeshError
        If the mesh is not closed.
    InvalidMeshError
        If the kernel finds the solid invalid (the mesh overlaps itself).
    """
    simple = _simplified(mesh.require_closed())
    return compound([_solid(simple, shells) for shells in solids_of(simple)])


def _simplified(mesh: Mesh) -> Mesh:
    """Mesh with fewer triangles and no tiny ones; the same mesh where it is not manifold."""
    from manifold3d import Error, Manifold, Mesh64

    body = Manifold(Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    if body.status() != Error.NoError:
        return mesh
    result = body.simplify(NEAR * mesh.diagonal).to_mesh64()
    return Mesh(np.asarray(result.vert_properties)[:, :3], np.asarray(result.tri_verts, np.int64), None, mesh.source)


def _solid(mesh: Mesh, shells: list[NDArray[np.intp]]) -> Shape:
    """Solid of an outer shell and its cavities, each given by its triangles' numbers."""
    expected = 0.0
    solid, builder = TopoDS_Solid(), BRep_Builder()
    builder.MakeSolid(solid)
    for triangles in shells:
        part = Mesh(mesh.vertices, mesh.faces[triangles])
        expected += part.volume
        shell = TopoDS_Shell()
        builder.MakeShell(shell)
        for face in explore(_faces(part), TopAbs_FACE):
            builder.Add(shell, face)
        shell.Closed(True)
        builder.Add(solid, shell)
    merged = _merged(solid)
    for result in (merged, solid):
        if result is not None and is_valid(result) and abs(volume(result) - expected) <= _VOLUME_SLACK * expected:
            return result
    count = sum(map(len, shells))
    raise InvalidMeshError(
        f"the B-rep kernel finds the solid of {count:,} triangles invalid, probably because they cross each other; "
        "write a mesh (.stl, .3mf) instead"
    )


def _faces(mesh: Mesh) -> Shape:
    used, corners = np.unique(mesh.faces, return_inverse=True)
    triangulation = Poly_Triangulation(len(used), len(mesh.faces), False)
    for number, point in enumerate(mesh.vertices[used].tolist(), 1):
        triangulation.SetNode(number, gp_Pnt(*point))
    for number, triangle in enumerate((corners.reshape(-1, 3) + 1).tolist(), 1):
        triangulation.SetTriangle(number, Poly_Triangle(*triangle))
    maker = BRepBuilderAPI_MakeShapeOnMesh(triangulation)
    maker.Build()
    return maker.Shape()


def _merged(solid: Shape) -> Shape | None:
    """Solid with the faces in one plane merged; None if the kernel fails at it."""
    unify = ShapeUpgrade_UnifySameDomain(solid, True, True, False)
    try:
        with silence():
            unify.Build()
    except Exception:  # OCP raises its own family of errors, which differs between versions
        return None
    return unify.Shape()
