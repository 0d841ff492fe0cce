"""Which shells of a mesh bound the same solid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cad_implicit.mesh import FloatArray, Mesh


def solids_of(mesh: Mesh) -> list[list[NDArray[np.intp]]]:
    """Triangles of each solid of a closed mesh: those of its outer shell first, then those of its cavities."""
    shell = mesh.component_of_face
    volumes = mesh.shell_volumes
    triangles = np.split(np.argsort(shell, kind="stable"), np.cumsum(np.bincount(shell))[:-1])
    outer = [number for number in np.argsort(volumes) if volumes[number] > 0]  # smallest first
    solids = {number: [triangles[number]] for number in outer}
    for cavity in np.flatnonzero(volumes <= 0):
        point = mesh.vertices[mesh.faces[triangles[cavity][0], 0]]
        around = [n for n in outer if winding(mesh.vertices[mesh.faces[triangles[n]]], point) > 0.5]
        if around:
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
