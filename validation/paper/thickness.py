"""Thickness of walls, measured on the mesh of the result: from points of one side to the nearest of the other.

Both sides of a true wall are at half its thickness from its middle, so the distance from any point of one to the other
is the thickness itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import cad_implicit as ci
from cad_implicit.comparison import surface_samples
from cad_implicit.distance import Surface
from cad_implicit.field import Field
from cad_implicit.implicit import Implicit
from cad_implicit.mesh import Mesh
from cad_implicit.shelling import carved
from cad_implicit.sizing import Engine

from .examples import SHELL

Array = NDArray[np.float64]

#: On which side of its wall a face lies, from its middle and its unit normal: 1 and -1, or 0 if it counts for neither.
Side = Callable[[Array, Array], NDArray[np.integer]]

POINTS = 1000

ENGINES: tuple[Engine, ...] = ("exact", "reinit")


@dataclass(frozen=True)
class Thickness:
    """Measured thickness of one wall, in spacings off the one asked for."""

    label: str
    flat: bool
    asked: float
    spacing: float
    worst: float
    mean: float

    @property
    def limit(self) -> float:
        """How much is allowed, in spacings."""
        return 0.1 if self.flat else 0.2


def measured(label: str, flat: bool, mesh: Mesh, spacing: float, asked: float, side: Side) -> Thickness:
    """Measure from 1,000 points of the faces of side 1 to those of side -1."""
    unit = mesh.face_vectors / np.maximum(np.linalg.norm(mesh.face_vectors, axis=1), 1e-300)[:, None]
    sides = side(mesh.vertices[mesh.faces].mean(axis=1), unit)
    here, there = (Mesh(mesh.vertices, mesh.faces[sides == number]) for number in (1, -1))
    points, _ = surface_samples(here, POINTS)
    off = np.abs(Surface(there).closest(points)[0] - asked) / spacing
    return Thickness(label, flat, asked, spacing, float(off.max()), float(off.mean()))


def all_walls(jaw: Field) -> list[Thickness]:
    """Shells by both engines, and lattices; ``jaw`` is the distance to the jaw bone."""
    return [*_shells(jaw), *_lattices(), *_rods()]


def _shells(jaw: Field) -> list[Thickness]:
    h, size = 0.04, np.array([1.6, 1.2, 1.0])
    frame = ci.box(size).turned((1, 2, 3), 25)
    torus = ci.torus(0.7, 0.3).turned((1, 2, 3), 25)

    def flat(middles: Array, normals: Array) -> NDArray[np.integer]:
        """Leave out what is nearer than two spacings to an edge of the hollow: edges are no planes."""
        local = np.abs(middles @ frame.matrix)
        below = np.sort(size / 2 - local, axis=1)
        return np.where(below[:, 0] < SHELL / 2, -1, np.where(below[:, 1] > SHELL + 2 * h, 1, 0))

    found = []
    for engine in ENGINES:
        for name, shape, side in (("turned box", frame, flat), ("torus", torus, _inner(torus, SHELL / 2))):
            mesh = ci.contour(ci.shell(shape, SHELL, spacing=h, engine=engine))
            found.append(measured(f"shell of a {name}, {engine}", side is flat, mesh, h, SHELL, side))
    h = jaw.grid.spacing[0]
    fine = ci.contour(ci.shell(ci.contour(jaw), SHELL, spacing=h / 2))
    side = _inner(jaw, SHELL / 2)
    found.append(measured("shell of the jaw bone, exact", False, fine, h / 2, SHELL, side))
    found.append(measured("shell of the jaw bone, reinit", False, ci.contour(carved(jaw, SHELL)), h, SHELL, side))
    return found


def _inner(shape: Implicit, depth: float) -> Side:
    """Faces of the hollow, at a depth below the surface, are 1, those of the outside -1."""
    return lambda middles, normals: np.where(shape(middles) > depth, 1, -1)


def _lattices() -> list[Thickness]:
    wall, cell, h = 0.15, 1.0, 0.05
    ball = ci.sphere(1.5)
    found = []
    for engine in ENGINES:
        lattice = ci.infill(ball, cell, wall, kind="gyroid", skin=0.0, spacing=h, engine=engine)
        found.append(measured(f"gyroid, {engine}", False, ci.contour(lattice), h, wall, _gyroid(ball, lambda x: cell)))
        slabs = ci.infill(ball, cell, wall, kind="cells", skin=0.0, spacing=h, engine=engine)
        found.append(measured(f"slabs, {engine}", True, ci.contour(slabs), h, wall, _slabs(ball, cell, wall)))
    ramp = ci.graded(ball, 0.8, 1.2, 1.5)
    lattice = ci.infill(ball, ramp, wall, kind="gyroid", skin=0.0, spacing=h, engine="exact")
    found.append(measured("gyroid with graded cells, exact", False, ci.contour(lattice), h, wall, _gyroid(ball, ramp)))
    return found


def _gyroid(part: Implicit, cell: Callable[[Array], object]) -> Side:
    """Sides of a gyroid by its function; deep enough in the part, so that the other side is there too."""

    def side(middles: Array, normals: Array) -> NDArray[np.integer]:
        phase = 2 * np.pi * middles / np.reshape(cell(middles), (-1, 1))
        x, y, z = phase.T
        value = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
        depth = part(middles)
        return np.where(value > 0, np.where(depth > 0.25, 1, 0), np.where(depth > 0.05, -1, 0))

    return side


def _slabs(part: Implicit, cell: float, wall: float) -> Side:
    """Faces across x of the slabs: 1 above, -1 below their middles; deep in the part and away from the other slabs."""

    def side(middles: Array, normals: Array) -> NDArray[np.integer]:
        offset = middles - cell * np.round(middles / cell)
        across = (np.abs(normals[:, 0]) > 0.9) & (np.abs(offset[:, 0]) < wall)
        clear = (np.abs(offset[:, 1:]) > wall).all(axis=1)
        depth = part(middles)
        above = offset[:, 0] > 0
        return np.where(above & across & clear & (depth > 0.25), 1, np.where(~above & across & (depth > 0.05), -1, 0))

    return side


def _rods() -> list[Thickness]:
    """Rods of a lattice as the jaw's, in a ball: between their flat faces across x, away from their ends."""
    ball, cell, change, rod, h = ci.sphere(1.5), 0.5, 0.75, 0.15, 0.05
    lattice = ci.slab_lattice(2 * cell, rod) | (ci.slab_lattice(cell, rod) - ci.sphere(1.5 - change))

    def side(middles: Array, normals: Array) -> NDArray[np.integer]:
        offset = middles[:, 0] - cell * np.round(middles[:, 0] / cell)
        across = (np.abs(normals[:, 0]) > 0.99) & (np.abs(offset) < rod)
        depth = ball(middles)
        whole = (depth > 1.5 * rod) & (np.abs(depth - change) > 1.5 * rod)
        return np.where((offset > 0) & across & whole, 1, np.where((offset < 0) & across, -1, 0))

    found = []
    for engine in ENGINES:
        mesh = ci.contour(ci.infill(ball, cell, rod, kind=lattice, skin=0.0, spacing=h, engine=engine))
        found.append(measured(f"rods denser near the surface, {engine}", True, mesh, h, rod, side))
    return found
