"""Shells with open faces: the wall is what is near the faces that are kept.

Within the part everything farther than the wall's thickness from all kept faces is carved out, up to the open ones and
through them. The rims of the wall lie in the open faces.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .cad.mesh_faces import triangles_of
from .distance import MeshDistance, Surface
from .errors import SelectorError
from .implicit import FloatArray, Implicit
from .mesh import Mesh


class Near(Implicit):
    """Everything nearer to a surface than a thickness in mm; the surface may be open."""

    lipschitz = 1.0

    def __init__(self, surface: Mesh, thickness: float, *, threads: int | None = None) -> None:
        self._surface = Surface(surface, threads=threads)
        self._thickness = thickness
        self.bounds = surface.bounds + [[-thickness], [thickness]]

    def __call__(self, points: ArrayLike) -> FloatArray:
        return np.asarray(self._thickness - self._surface.closest(points)[0])

    def value_and_gradient(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Values ``(N,)`` in mm and gradients ``(N, 3)``."""
        x = np.asarray(points, np.float64)
        distance, place = self._surface.closest(x)
        return self._thickness - distance, (place - x) / np.where(distance > 0, distance, 1.0)[:, None]

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients ``(N, 3)``."""
        return self.value_and_gradient(points)[1]


def near_kept_faces(part: Implicit, selector: str, thickness: float, *, threads: int | None = None) -> Near:
    """Everything within a thickness in mm of the faces of a part that a selector does not open.

    Raises
    ------
    SelectorError
        If the part has no faces, or the selector cannot be read, opens nothing or opens everything.
    """
    if not isinstance(part, MeshDistance):
        raise SelectorError(
            f"{selector!r} chooses faces, which only B-rep parts have; give a STEP file or a CAD object"
        )
    mesh = part.mesh
    opened = triangles_of(mesh, selector)
    if opened.all():
        raise SelectorError(f"{selector!r} opens every face of the part; leave one at least")
    return Near(Mesh(mesh.vertices, mesh.faces[~opened]), thickness, threads=threads)
