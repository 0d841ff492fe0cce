"""Which shells of a mesh bound the same solid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cad_implicit.errors import InvalidMeshError
from cad_implicit.mesh import FloatArray, Mesh

from .weld import NEAR


def solids_of(mesh: Mesh) -> list[list[NDArray[np.intp]]]:
    """Triangles of each solid of a closed mesh: those of its outer shell first, then those of its cavities.

    Shells that are flat, thinner than :data:`~.weld.NEAR` of the diagonal, are left out.

    Raises
    ------
    InvalidMeshError
        If a shell is inside out and lies in no other.
    """
    shell = mesh.component_of_face
    areas = np.bincount(shell, np.linalg.norm(mesh.face_vectors, axis=1))
    volumes = np.where(np.abs(mesh.shell_volumes) > NEAR * mesh.diagonal * areas, mesh.shell_volumes, 0.0)
    triangles = np.split(np.argsort(shell, kind="stable"), np.cumsum(np.bincount(shell))[:-1])
    outer = [number for number in np.argsort(volumes) if volumes[number] > 0]  # smallest first
    solids = {number: [triangles[number]] for number in outer}
    for cavity in np.flatnonzero(volumes < 0):
        point = mesh.vertices[mesh.faces[triangles[cavity][0], 0]]
        around = [n for n in outer if winding(mesh.vertices[mesh.faces[triangles[n]]], point) > 0.5]
        if not around:
            raise InvalidMeshError(
                f"a shell of {len(triangles[cavity]):,} triangles is inside out (volume {volumes[cavity]:.4g} mm³) and "
                "lies in no other; turn it outward"
            )
        solids[around[0]].append(triangles[cavity])
    return list(solids.values())


def winding(corners: FloatArray, point: FloatArray) -> float:
    """Winding number of triangles ``(F, 3, 3)`` around a point ``(3,)``: 1 inside, 0 outside.

    The sum of solid angles over 4 pi (Van Oosterom and Strackee, doi:10.1109/TBME.1983.325207).
    """
    a, b, c = (corners[:, i] - point for i in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    triple = (a * np.cross(b, c)).sum(axis=1)
    dots = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    return float(np.arctan2(triple, dots).sum() / (2 * np.pi))
