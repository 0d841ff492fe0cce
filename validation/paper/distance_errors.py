"""Figure 8: the error of the distance to the unit sphere, by iterations, over the domain and near the surface.

The error is ||d - phi|| / ||d|| over the nodes, with the exact distance d, on [-2, 2]³; near the surface over those at
most 0.1 from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cad_implicit import contour
from cad_implicit import sphere as exact_sphere
from cad_implicit.distance import MeshDistance
from cad_implicit.field import Field, sample
from cad_implicit.redistancing import redistance

from .examples import sampled

#: Half the width of the band of Figure 8 b.
BAND = 0.1

#: Iterations at which the paper's scheme is looked at; a front from the surface reaches the corners after 195.
_PAPER = (*range(13), 14, 16, 20, 25, 30, 40, 60, 80, 100, 130, 160, 200, 240, 280)
_SECOND = (2, 4, 6, 8, 10, 15, 20, 40, 80, 120, 160, 200, 240)
_SWEEPS = (1, 2, 3, 4, 6, 8, 12, 16, 24)
_DEAR_SWEEPS = (1, 2, 4, 8, 16, 24)

#: Schemes: label, options of :func:`redistance`, iterations.
SCHEMES: tuple[tuple[str, dict[str, object], tuple[int, ...]], ...] = (
    ("upwind, Euler, with the sub-cell fix", {}, _PAPER),
    ("upwind, Euler, without it, ε = 1", {"subcell": False, "epsilon": 1.0}, _PAPER),
    ("upwind, Runge-Kutta", {"time": "rk2"}, _SECOND),
    ("upwind, Gauss-Seidel", {"time": "gauss-seidel"}, _SWEEPS),
    ("ENO2, Gauss-Seidel", {"scheme": "eno2", "time": "gauss-seidel"}, _DEAR_SWEEPS),
    ("WENO5, Gauss-Seidel", {"scheme": "weno5", "time": "gauss-seidel"}, _DEAR_SWEEPS),
)


@dataclass(frozen=True)
class Curve:
    """Errors of one scheme: iterations (none if it does not iterate), over the domain, and near the surface."""

    label: str
    iterations: tuple[int, ...]
    domain: tuple[float, ...]
    near: tuple[float, ...]

    @property
    def least_near(self) -> float:
        """Smallest error near the surface."""
        return min(self.near)


def curves(nodes: int, *, dear: bool = True) -> list[Curve]:
    """Give the curves of Figure 8 for so many nodes; ``dear`` says whether to run the schemes of high order too."""
    start = sampled("sphere", nodes)
    distance = _exact(start)
    found = []
    for label, options, counts in SCHEMES if dear else SCHEMES[:4]:
        fields = (redistance(start, iterations=count, **options) for count in counts)  # type: ignore[arg-type]
        found.append(_curve(label, counts, fields, distance))
    for label, field in (("fast marching", redistance(start, scheme="fmm")), ("exact engine", _engine(start))):
        found.append(_curve(label, (), [field], distance))
    return found


def _exact(field: Field) -> np.ndarray:
    return 1 - np.linalg.norm(field.grid.nodes(), axis=1)


def _engine(field: Field) -> Field:
    """Distance to the contour of the sphere, at half the spacing."""
    mesh = contour(exact_sphere(1.0), min(field.grid.spacing) / 2)
    return sample(MeshDistance(mesh), field.grid, dtype=np.float64)


def _curve(label: str, counts: tuple[int, ...], fields: object, distance: np.ndarray) -> Curve:
    band = np.abs(distance) <= BAND
    domain, near = [], []
    for field in fields:  # type: ignore[attr-defined]
        off = field.values.ravel() - distance
        domain.append(float(np.linalg.norm(off) / np.linalg.norm(distance)))
        near.append(float(np.linalg.norm(off[band]) / np.linalg.norm(distance[band])))
    return Curve(label, counts, tuple(domain), tuple(near))
