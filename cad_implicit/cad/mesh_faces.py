"""Faces of a part by selectors, from its triangles: each triangle of a B-rep's mesh knows its face.

Not promised: types other than "plane" and "curved".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cad_implicit.errors import SelectorError
from cad_implicit.mesh import Mesh

from .selectors import Candidates, select

#: A face is plane if the normals of its triangles differ by less than this length.
_PLANE = 1e-6


def triangles_of(mesh: Mesh, selector: str) -> NDArray[np.bool_]:
    """Which triangles ``(F,)`` belong to the faces that a selector chooses, such as ``">Z"``.

    Parameters
    ----------
    mesh : Mesh
        With ``face_ids``, as those of B-rep parts have.
    selector : str
        See :mod:`cad_implicit.cad.selectors`; faces are numbered from 1, as in FreeCAD.

    Raises
    ------
    SelectorError
        If the mesh has no faces, or the selector cannot be read or chooses nothing.
    """
    if mesh.face_ids is None:
        raise SelectorError(
            f"{selector!r} chooses faces, and a mesh has only triangles; give a STEP or BREP file, or a CAD object"
        )
    numbers, which = np.unique(mesh.face_ids, return_inverse=True)
    area = np.linalg.norm(mesh.face_vectors, axis=1)
    whole = np.maximum(np.bincount(which, area), np.finfo(np.float64).tiny)[:, None]
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    centres = np.stack([np.bincount(which, area * x) for x in middles.T], axis=1) / whole
    normals = np.stack([np.bincount(which, x) for x in mesh.face_vectors.T], axis=1) / whole
    # the mean of unit vectors is shorter than one by half the square of their spread
    plane = np.linalg.norm(normals, axis=1) > 1 - _PLANE**2 / 2 - 1e-14
    types = ["plane" if flat else "curved" for flat in plane]
    directions = np.where(plane[:, None], normals, np.nan)
    chosen = select(selector, Candidates("face", numbers.astype(np.int64) + 1, centres, directions, types))
    return np.isin(which, chosen)
