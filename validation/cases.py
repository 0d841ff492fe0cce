"""Parts at which the exact kernel fails, and a set of runs over them and more; lengths in mm.

Each case ends before its failing fillet. With OCCT 7.9 that fillet crashes the process, raises, or returns an invalid
solid without a word; what it does is in ``exact_kernel``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import cadquery as cq
import numpy as np
from scipy.spatial.transform import Rotation

from .parts import PARTS

Edges = Literal["all", "convex", "concave"]

#: Euler angles in degrees and shift in mm that take a part off the axes of the grid.
TURN = (23.0, 37.0, 11.0)
SHIFT = (0.1371, -7.3713, 3.2187)


@dataclass(frozen=True)
class Case:
    """A part and the fillet that fails on it.

    Attributes
    ----------
    number : int
    build : callable
        Gives the part.
    radius : float
        Of the failing fillet in mm.
    edges : "all", "convex" or "concave"
        What kind of edges it rounds or fillets; by selection, these may be some of them only.
    exact_kernel : str
        What becomes of it.
    opened, closed : float or None
        Volume after opening and closing with that radius over the volume before, to 1 %, where known; 0 if nothing
        is left, as the part is thinner than the ball.
    """

    number: int
    build: Callable[[], cq.Workplane]
    radius: float
    edges: Edges
    exact_kernel: str
    opened: float | None = None
    closed: float | None = None


def hollow_box() -> cq.Workplane:
    """Box open at the top, walls 1 thick; all edges."""
    return cq.Workplane().box(50, 50, 20).faces("+Z").shell(-1, kind="intersection")


def loft_with_holes() -> cq.Workplane:
    """Cone frustum with four square holes down from its smaller end; the edges along Z."""
    frustum = cq.Workplane().circle(30).workplane(offset=100).circle(20).loft(combine=True)
    return frustum.faces(">Z").rect(10, 10, forConstruction=True).vertices().rect(7, 7).cutThruAll()


def split_cylinder() -> cq.Workplane:
    """Cylinder cut off at 45 degrees; the elliptic edge."""
    cylinder = cq.Workplane("YZ").cylinder(75, 40)
    return cylinder.faces(">X").workplane().transformed(rotate=(-45, 0, 0)).split(keepBottom=True)


def raised_text() -> cq.Workplane:
    """Letters on a plate; their top edges and the plate's."""
    return cq.Workplane().box(30, 12, 3).faces(">Z").workplane().text("Rg", 9, 1.5, combine=True)


def leaking_union() -> cq.Workplane:
    """Cube and sphere whose union is an invalid solid that leaks; all edges."""
    return cq.Workplane().box(10, 10, 10).union(cq.Workplane().sphere(6))


def cube_to_sphere() -> cq.Workplane:
    """Cube as wide as the ball; all edges."""
    return cq.Workplane().box(10, 10, 10)


def stadium() -> cq.Workplane:
    """Plate as wide as the fillet along Z is round."""
    return cq.Workplane().box(50, 80, 10)


def tall_stadium() -> cq.Workplane:
    """Block as wide as the ball: what is left is a stadium wherever it is cut along the plane."""
    return cq.Workplane().box(50, 80, 60)


def chamfered_bottom() -> cq.Workplane:
    """Cube with four round edges and a chamfer of the same size below, which comes to points."""
    return cq.Workplane().box(10, 10, 10).edges("|Z").fillet(1)


def torus_groove() -> cq.Workplane:
    """Disc with a ring groove; the edges on top."""
    torus = cq.Workplane(obj=cq.Solid.makeTorus(32, 14, cq.Vector(0, 0, 20), cq.Vector(0, 0, 1)))
    return cq.Workplane().circle(54.5).extrude(20).cut(torus)


def tangent_boss() -> cq.Workplane:
    """Boss tangent to the wall of the block below; all edges."""
    return cq.Workplane().box(20, 20, 10).union(cq.Workplane().center(5, 0).circle(5).extrude(20))


def bosses_with_rib() -> cq.Workplane:
    """Two bosses and a rib between them on a plate; the edges but the lowest and highest."""
    bosses = cq.Workplane().box(40, 20, 4).faces(">Z").workplane().pushPoints([(-8, 0), (8, 0)]).circle(5).extrude(15)
    return bosses.union(cq.Workplane().box(16, 2, 12).translate((0, 0, 8)))


def steinmetz() -> cq.Workplane:
    """Two equal cylinders' common part; its edges, which cross."""
    other = cq.Workplane("XZ").circle(5).extrude(20, both=True)
    return cq.Workplane().circle(5).extrude(20, both=True).intersect(other)


#: The twelve cases.
CASES: tuple[Case, ...] = (
    Case(1, hollow_box, 1.0, "all", "crashes the process", opened=0.0),
    Case(2, loft_with_holes, 3.0, "all", "crashes the process", opened=0.946),
    Case(3, split_cylinder, 4.0, "convex", "invalid, of negative volume", opened=0.995),
    Case(4, raised_text, 0.2, "convex", "invalid, mesh open"),
    Case(5, leaking_union, 0.3, "all", "the part itself is invalid and leaks"),
    Case(6, cube_to_sphere, 5.0, "convex", "not done", opened=523.599 / 1000),
    Case(7, stadium, 25.0, "convex", "not done", opened=0.0),
    Case(8, chamfered_bottom, 1.0, "convex", "not done", opened=0.984),
    Case(9, torus_groove, 1.0, "convex", "not done", opened=0.992),
    Case(10, tangent_boss, 1.0, "all", "not done", opened=0.989, closed=1.002),
    Case(11, bosses_with_rib, 1.0, "all", "not done", opened=0.989),
    Case(12, steinmetz, 1.0, "convex", "not done", opened=0.990),
)


def ribbed_plate() -> cq.Workplane:
    """Plate with a grid of crossing ribs."""
    plate = cq.Workplane().box(36.3, 24.7, 3.1)
    for x in (-12.1, -1.3, 10.9):
        plate = plate.union(cq.Workplane().box(1.9, 24.7, 6.3).translate((x, 0, 4.6)))
    return plate.union(cq.Workplane().box(36.3, 1.7, 4.9).translate((0, 2.3, 3.9)))


def slanted_bores() -> cq.Workplane:
    """Block with two bores that cross inside it at a skew angle."""
    block = cq.Workplane().box(30.3, 26.1, 22.7)
    for angle in (17, 71):
        bore = cq.Workplane().circle(4.3).extrude(40, both=True).rotate((0, 0, 0), (1, 0.3, 0), angle)
        block = block.cut(bore)
    return block


def sphere_in_corner() -> cq.Workplane:
    """Corner of three walls with a sphere sunk into it."""
    walls = cq.Workplane().box(20, 20, 20).cut(cq.Workplane().box(20, 20, 20).translate((4.3, 5.1, 3.7)))
    return walls.union(cq.Workplane().sphere(5.3).translate((-3.1, -2.3, -4.7)))


def twisted_prism() -> cq.Workplane:
    """Square prism twisted by 80 degrees over its height."""
    return cq.Workplane().rect(11.3, 11.3).twistExtrude(21.7, 80)


def revolved_vase() -> cq.Workplane:
    """Return a turned part with sharp inner and outer rims."""
    profile = [(0, 0), (9.1, 0), (9.1, 2.3), (4.7, 5.9), (4.7, 14.1), (10.3, 18.7), (10.3, 21.1), (0, 21.1)]
    return cq.Workplane("XZ").polyline(profile).close().revolve(360, (0, 0, 0), (0, 1, 0))


def gear() -> cq.Workplane:
    """Disc with 13 straight teeth and a hub."""
    outline = []
    for tooth in range(13):
        for part, radius in ((0.0, 9.1), (0.2, 12.7), (0.45, 12.7), (0.65, 9.1)):
            angle = 2 * np.pi * (tooth + part) / 13
            outline.append((radius * np.cos(angle), radius * np.sin(angle)))
    disc = cq.Workplane().polyline(outline).close().extrude(5.3)
    return disc.faces(">Z").workplane().circle(5.1).extrude(4.1).faces(">Z").workplane().hole(4.7)


#: All parts by name: those of the cases, those of :mod:`validation.parts`, and more.
ALL_PARTS: dict[str, Callable[[], cq.Workplane]] = {
    **PARTS,
    **{case.build.__name__: case.build for case in CASES},
    **{
        build.__name__: build
        for build in (tall_stadium, ribbed_plate, slanted_bores, sphere_in_corner, twisted_prism, revolved_vase, gear)
    },
}


@dataclass(frozen=True)
class Run:
    """One operation on one part off the axes.

    Attributes
    ----------
    part : str
        Name in ``ALL_PARTS``.
    operation : str
        As in :func:`cad_implicit.run`.
    amount : float
        Radius or signed distance in mm.
    cells : int
        Grid cells along the part's longest side.
    expected : float or None
        Volume after over volume before; 0 if the right answer is an error.
    case : int
        Number of the case, or 0.
    """

    part: str
    operation: str
    amount: float
    cells: int
    expected: float | None = None
    case: int = 0


def _runs_of(case: Case) -> list[Run]:
    name, r = case.build.__name__, case.radius
    cells = 160 if case.number in (4, 11) else 96
    found = [Run(name, "round", r, cells, case.opened, case.number)]
    if case.edges != "convex":
        found.append(Run(name, "fillet", r, cells, case.closed, case.number))
        found.append(Run(name, "smooth", r, cells, 0.0 if case.opened == 0.0 else None, case.number))
    return found


#: The runs of the cases, then others over radii, operations and spacings.
RUNS: tuple[Run, ...] = (
    *(run for case in CASES for run in _runs_of(case)),
    Run("hollow_box", "round", 0.4, 160, case=1),
    Run("hollow_box", "fillet", 3.0, 96, case=1),
    Run("loft_with_holes", "fillet", 1.0, 96, case=2),
    Run("split_cylinder", "smooth", 4.0, 64, case=3),
    Run("raised_text", "fillet", 0.2, 160, case=4),
    Run("raised_text", "smooth", 0.2, 200, case=4),
    Run("cube_to_sphere", "round", 4.999, 96, 0.524, case=6),
    Run("cube_to_sphere", "round", 2.5, 64, case=6),
    Run("stadium", "round", 4.9, 96, case=7),
    Run("stadium", "round", 5.0, 96, 0.929, case=7),
    Run("tall_stadium", "round", 25.0, 96, 0.6625, case=7),
    Run("tall_stadium", "round", 24.99, 96, 0.6625, case=7),
    Run("stadium", "offset", -4.9, 96, case=7),
    Run("torus_groove", "smooth", 3.0, 96, case=9),
    Run("torus_groove", "offset", 2.0, 96, case=9),
    Run("tangent_boss", "round", 3.0, 96, case=10),
    Run("bosses_with_rib", "fillet", 2.0, 96, case=11),
    Run("bosses_with_rib", "offset", 0.7, 96, case=11),
    Run("bosses_with_rib", "offset", -0.7, 128, case=11),
    Run("steinmetz", "round", 3.0, 64, case=12),
    Run("steinmetz", "offset", -1.5, 64, case=12),
    Run("bracket", "fillet", 3.0, 128),
    Run("bracket", "round", 2.0, 128),
    Run("bracket", "smooth", 1.5, 128),
    Run("bracket", "offset", 2.0, 96),
    Run("bracket", "offset", -1.0, 96),
    Run("boss_on_plate", "fillet", 3.0, 64),
    Run("boss_on_plate", "smooth", 2.0, 64),
    Run("plate_with_hole", "fillet", 5.0, 64),
    Run("plate_with_hole", "fillet", 6.5, 64),
    Run("plate_with_hole", "round", 3.9, 64),
    Run("l_profile", "smooth", 3.0, 64),
    Run("crossing_cylinders", "fillet", 2.0, 64),
    Run("crossing_cylinders", "smooth", 2.0, 96),
    Run("cone_on_plate", "round", 1.5, 64),
    Run("cone_on_plate", "smooth", 1.5, 96),
    Run("torus_boss", "fillet", 2.0, 64),
    Run("torus_boss", "smooth", 1.0, 96),
    Run("sphere_and_box", "smooth", 1.5, 64),
    Run("sphere_and_box", "offset", 1.5, 64),
    Run("thin_fin", "fillet", 2.0, 64),
    Run("thin_fin", "round", 1.0, 96),
    Run("thin_fin", "round", 0.5, 128),
    Run("two_blocks", "smooth", 2.0, 64),
    Run("two_blocks", "offset", 9.0, 96),
    Run("ribbed_plate", "fillet", 1.5, 96),
    Run("ribbed_plate", "round", 0.7, 128),
    Run("ribbed_plate", "smooth", 0.8, 128),
    Run("slanted_bores", "fillet", 2.0, 96),
    Run("slanted_bores", "round", 1.0, 96),
    Run("sphere_in_corner", "fillet", 2.5, 96),
    Run("sphere_in_corner", "smooth", 1.5, 96),
    Run("twisted_prism", "round", 2.0, 64),
    Run("twisted_prism", "offset", -3.0, 64),
    Run("revolved_vase", "smooth", 2.0, 64),
    Run("revolved_vase", "offset", -3.0, 96),
    Run("gear", "fillet", 1.0, 96),
    Run("gear", "smooth", 0.6, 128),
)


def turned(part: cq.Workplane) -> cq.Shape:
    """Shape of a part turned by ``TURN`` and shifted by ``SHIFT``."""
    shapes = [shape for shape in part.vals() if shape.Solids()] or [part.findSolid()]
    shape = shapes[0] if len(shapes) == 1 else cq.Compound.makeCompound(shapes)
    vector = Rotation.from_euler("xyz", TURN, degrees=True).as_rotvec(degrees=True)
    angle = float(np.linalg.norm(vector))
    return shape.rotate(cq.Vector(), cq.Vector(*(vector / angle)), angle).translate(cq.Vector(*SHIFT))
