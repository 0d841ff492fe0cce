"""Health of a mesh: closed, manifold, free of slivers and self-intersections."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from cad_implicit.implicit import FloatArray
from cad_implicit.kernels.intersections import intersecting
from cad_implicit.mesh import Mesh

#: Triangles whose smallest angle is below this many degrees are slivers.
SLIVER_DEGREES = 1.0


@dataclass(frozen=True)
class Health:
    """State of a mesh.

    Attributes
    ----------
    closed : bool
    open_edges : int
    manifold : str
        What manifold3d says of it: "NoError", or why not.
    components, genus : int
    slivers : int
        Triangles with an angle below :data:`SLIVER_DEGREES`; allowed, but some programs mind.
    self_intersections : int
        Triangles that run through others.
    """

    closed: bool
    open_edges: int
    manifold: str
    components: int
    genus: int
    slivers: int
    self_intersections: int

    @property
    def sound(self) -> bool:
        """Whether it encloses a volume."""
        return self.closed and self.manifold in ("NoError", "not asked") and self.self_intersections == 0

    def as_dict(self) -> dict[str, object]:
        """All figures by name."""
        return asdict(self)


def health(mesh: Mesh, spacing: float) -> Health:
    """Look a mesh over.

    Parameters
    ----------
    mesh : Mesh
    spacing : float
        In mm: about the size of its triangles.
    """
    return Health(
        closed=mesh.is_watertight,
        open_edges=mesh.open_edges,
        manifold=_manifold(mesh),
        components=mesh.components,
        genus=mesh.genus if mesh.is_watertight else 0,
        slivers=int((_smallest_angles(mesh) < np.radians(SLIVER_DEGREES)).sum()),
        self_intersections=int(intersecting(mesh.vertices, mesh.faces, 4 * spacing).sum()),
    )


def _manifold(mesh: Mesh) -> str:
    try:
        from manifold3d import Manifold, Mesh64
    except ImportError:
        return "not asked"
    return str(Manifold(Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64))).status().name)


def _smallest_angles(mesh: Mesh) -> FloatArray:
    corners = mesh.vertices[mesh.faces]
    sides = corners[:, [1, 2, 0]] - corners
    length = np.maximum(np.linalg.norm(sides, axis=2), 1e-300)
    cosines = -(sides * sides[:, [2, 0, 1]]).sum(axis=2) / (length * length[:, [2, 0, 1]])
    return np.asarray(np.arccos(np.clip(cosines, -1, 1)).min(axis=1))
