"""How far meshes are from exact solids, with what a local blend is allowed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cad_implicit.distance import MeshDistance
from cad_implicit.mesh import Mesh
from cad_implicit.report.exact_surfaces import Mask, Surfaces


@dataclass(frozen=True)
class Errors:
    """How far a mesh is from an exact solid; lengths in spacings.

    Attributes
    ----------
    vertices : float
        Farthest vertex from the surface.
    place : (3,) tuple
        Where that is, in mm.
    face : str
        Kind of the face that is nearest there.
    planes : float
        Farthest vertex of those on plane faces that are not blends.
    back : float
        Farthest sample of a blend from the triangles.
    chord : float
        What of that may be the triangles' sagitta: chords of two spacings across the blend.
    volume : float
        Relative difference.
    volume_limit : float
        Largest one allowed.
    """

    vertices: float
    place: tuple[float, float, float]
    face: str
    planes: float
    back: float
    chord: float
    volume: float
    volume_limit: float

    @property
    def faults(self) -> list[str]:
        """What exceeds its limit."""
        limits = {
            "vertices": (self.vertices, 0.02),
            "planes": (self.planes, 0.001),
            "back": (self.back, 0.02 + self.chord),
            "volume": (abs(self.volume), self.volume_limit),
        }
        return [f"{name} {value:.2g} > {limit:.2g}" for name, (value, limit) in limits.items() if not value <= limit]


def errors(mesh: Mesh, surfaces: Surfaces, blend: Mask, spacing: float, radius: float, volume: float) -> Errors:
    """Compare a mesh with an exact solid.

    Parameters
    ----------
    mesh : Mesh
    surfaces : Surfaces
        Of the exact solid.
    blend : (F,) bool
        Which of its faces are blends.
    spacing, radius : float
        In mm; the smallest radius.
    volume : float
        Exact, in mm³.
    """
    points = mesh.vertices[np.unique(mesh.faces)]
    distance, nearest = surfaces.nearest(points)
    worst = int(distance.argmax())
    away = MeshDistance(surfaces.part(blend), sign="pseudonormal").unsigned(points) > spacing / 2
    flat = away & (surfaces.names[nearest] == "plane") & ~blend[nearest]
    back = MeshDistance(mesh, sign="pseudonormal").unsigned(surfaces.samples(blend, 20_000)[0])
    x, y, z = points[worst].tolist()
    bend = surfaces.bend(np.ones(len(blend), np.bool_))
    return Errors(
        vertices=float(distance[worst]) / spacing,
        place=(x, y, z),
        face=str(surfaces.names[nearest[worst]]),
        planes=float(distance[flat].max()) / spacing if flat.any() else 0.0,
        back=float(back.max()) / spacing,
        chord=0.5 * spacing / radius,
        volume=mesh.volume / volume - 1,
        volume_limit=1e-4 + 0.2 * spacing**2 * bend / volume,
    )
