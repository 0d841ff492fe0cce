"""Simplify: fewer triangles within a stated tolerance, flat regions merged (manifold3d)."""

from __future__ import annotations

import numpy as np

from .errors import CadImplicitError, SpacingError, tell
from .mesh import Mesh
from .sizing import positive


def has_manifold() -> bool:
    """Whether manifold3d is installed; some hosts come without it."""
    try:
        import manifold3d  # noqa: F401
    except ImportError:
        return False
    return True


def simplify(mesh: Mesh, tolerance: float) -> Mesh:
    """Collapse edges of a closed mesh as long as no surface moves by more than a tolerance.

    Parameters
    ----------
    mesh : Mesh
        Closed.
    tolerance : float
        In mm. Flat regions lose nearly all their triangles at any tolerance.

    Returns
    -------
    Mesh
        Closed; B-rep faces of triangles are forgotten. The same mesh where manifold3d is not installed.

    Raises
    ------
    OpenMeshError
        If the mesh is not closed.
    SpacingError
        If the tolerance is not positive and finite.
    CadImplicitError
        If manifold3d does not take the mesh.

    Warns
    -----
    GeometryWarning
        If manifold3d is not installed.
    """
    limit = positive("tolerance", tolerance, SpacingError)
    mesh.require_closed()
    try:
        import manifold3d
    except ImportError:
        tell("the mesh is not simplified, for want of manifold3d: pip install manifold3d")
        return mesh
    raw = manifold3d.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64))
    solid = manifold3d.Manifold(raw)
    if solid.status() != manifold3d.Error.NoError:
        raise CadImplicitError(f"the mesh cannot be simplified: manifold3d says {solid.status().name}")
    result = solid.simplify(limit).to_mesh64()
    return Mesh(result.vert_properties[:, :3], result.tri_verts.astype(np.int64), source=mesh.source)
