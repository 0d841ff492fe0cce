"""The examples of sections 5.1 and 5.2 on a grid, step by step as the paper describes them, each step timed."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from cad_implicit import contour, infill, reinit, sample, slab_lattice
from cad_implicit.field import Field
from cad_implicit.grid import Grid
from cad_implicit.implicit import Implicit
from cad_implicit.shelling import carved

from .jaw import jaw
from .models import mechanical_part, sphere, two_boxes

#: Thickness of the jaw's shell, and the radii of the two smoothed shapes.
SHELL, BOXES_RADIUS, PART_RADIUS = 0.1, 0.025, 0.15

#: The jaw's lattice: cells near the surface and, twice as large, in the middle; the depth where they change; the rods.
FINE_CELL, COARSE_DEPTH, ROD = 0.12, 0.16, 0.05

#: Half the side of each example's cube: on 128 nodes ⌈r / time step⌉ is the paper's 10.
HALF_SIDE = {"sphere": 2.0, "jaw": 1.73, "boxes": 0.397, "part": 2.4}

#: The shapes by name.
SHAPES: dict[str, Callable[[int | None], Implicit]] = {
    "sphere": sphere,
    "jaw": jaw,
    "boxes": two_boxes,
    "part": mechanical_part,
}


@dataclass
class Result:
    """What an example gives: its fields by name, and seconds by step."""

    fields: dict[str, Field] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    def add(self, name: str, make: Callable[[], Field]) -> Field:
        """Run a step on the clock."""
        start = time.perf_counter()
        made = make()
        self.seconds[name] = time.perf_counter() - start
        self.fields[name] = made
        return made

    @property
    def total(self) -> float:
        """Seconds of all steps."""
        return sum(self.seconds.values())


def cube(name: str, nodes: int, shape: Implicit) -> Grid:
    """Grid of an example over its cube."""
    middle, half = shape.bounds.mean(axis=0), HALF_SIDE[name]
    return Grid.cover([middle - half, middle + half], shape=nodes)


def sampled(name: str, nodes: int, threads: int | None = None) -> Field:
    """Field of a shape before anything is done to it."""
    shape = SHAPES[name](threads)
    return sample(shape, cube(name, nodes, shape))


def jaw_lattice(depth: Field) -> Implicit:
    """Slabs twice as frequent near the surface as in the middle: rods where two of them cross."""
    fine, coarse = slab_lattice(FINE_CELL, ROD), slab_lattice(2 * FINE_CELL, ROD)
    return coarse | (fine - depth.shifted(-COARSE_DEPTH))


def microstructure(nodes: int, threads: int | None = None) -> Result:
    """Distance to the jaw bone, and its shell filled with a lattice that is denser near the surface (section 5.1)."""
    result = Result()
    shape = jaw(threads)
    start = result.add("sampled", lambda: sample(shape, cube("jaw", nodes, shape)))
    phi = result.add("distance", lambda: _distance(start, SHELL, threads))
    result.add("microstructure", lambda: carved(phi, SHELL, filling=jaw_lattice(phi)))
    return result


def exact_microstructure(phi: Field) -> Implicit:
    """Make the same by the exact engine at half the spacing, for a clear picture: the rods are two spacings thin."""
    bone = contour(phi)
    h = phi.grid.spacing[0] / 2
    return infill(bone, FINE_CELL, ROD, kind=jaw_lattice(phi), skin=SHELL, spacing=h)


def smoothed(name: str, radius: float, nodes: int, threads: int | None = None) -> Result:
    """Smooth a shape: three distances, three offsets (section 4.4)."""
    result = Result()
    shape = SHAPES[name](threads)
    start = result.add("sampled", lambda: sample(shape, cube(name, nodes, shape)))
    phi = result.add("distance", lambda: _distance(start, radius, threads))
    result.add("smoothed", lambda: reinit.smoothing(phi, radius, threads=threads))
    return result


def _distance(start: Field, radius: float, threads: int | None) -> Field:
    """Distance as far as an operation of a radius needs it, as the engine computes it."""
    return reinit.distance_field(start, start.grid, radius, threads=threads)


def iterations(name: str, radius: float, nodes: int) -> int:
    """Give ⌈r / time step⌉ of an example."""
    step = 0.4 * 2 * HALF_SIDE[name] / (nodes - 1)
    return int(np.ceil(radius / step - 1e-9))
