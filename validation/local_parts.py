"""Parts, edges and radii on which the exact kernel's blends are planes, cylinders, tori and spheres; lengths in mm.

Each is turned by other angles, see :func:`turned_by`; edges are chosen before. A choice is a selector, or points: the
edges whose centres they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cadquery as cq
import numpy as np
from scipy.spatial.transform import Rotation

from cad_implicit.cad.edges import Edge, selected
from cad_implicit.cad.exact_blends import Blend, Size

from .parts import bracket, solid

B = cq.Workplane
Points = Sequence[tuple[float, float, float]]
Chosen = str | Points

#: Centres of mass within this many mm of a point are there.
_THERE = 1e-3


@dataclass(frozen=True)
class Triple:
    """A part, some of its edges, and their radii.

    Attributes
    ----------
    name : str
    build : callable
        Gives the part.
    choices : tuple of (selector or points, radius)
        Later ones win.
    change : float or None
        What the blends must add to the volume in mm³, where a formula tells it.
    blend : "fillet" or "chamfer"
    cells : float
        Radius over the spacing that meshes it.
    """

    name: str
    build: Callable[[], cq.Workplane]
    choices: tuple[tuple[Chosen, Size], ...]
    change: float | None = None
    blend: Blend = "fillet"
    cells: float = 5.0


def sizes_of(triple: Triple, edges: Sequence[Edge]) -> dict[int, Size]:
    """Radius by the number of the edge."""
    sizes: dict[int, Size] = {}
    for chosen, size in triple.choices:
        for edge in chosen_edges(chosen, edges):
            sizes[edge.number] = size
    return sizes


def chosen_edges(chosen: Chosen, edges: Sequence[Edge]) -> list[Edge]:
    """Edges that a selector chooses, or whose centres are at some points."""
    if isinstance(chosen, str):
        return list(selected(edges, chosen))
    found = []
    for point in chosen:
        own = [edge for edge in edges if np.linalg.norm(edge.centre - point) < _THERE]
        if len(own) != 1:
            raise ValueError(f"{len(own)} edges have their centre at {point}")
        found += own
    return found


def turned_by(part: cq.Workplane, number: int) -> cq.Shape:
    """Solid of a part, turned and shifted in a way that depends on a number."""
    random = np.random.default_rng(1000 + number)
    vector = Rotation.random(random_state=number).as_rotvec()
    angle = float(np.linalg.norm(vector))
    turned = solid(part).rotate(cq.Vector(), cq.Vector(*(vector / angle)), float(np.degrees(angle)))
    return turned.translate(cq.Vector(*random.uniform(-5, 5, 3).tolist()))


def box() -> cq.Workplane:
    """Box with a corner at (20, 24, 28)."""
    return B().box(20, 24, 28, centered=False)


def thin_plate() -> cq.Workplane:
    """Plate 3 thick."""
    return B().box(40, 30, 3)


def l_part(length: float = 50.0) -> cq.Workplane:
    """L of legs 14 thick, 46 wide, with the concave edge at x = z = 14."""
    points = [(0, 0), (length, 0), (length, 14), (14, 14), (14, 50), (0, 50)]
    return B("XZ").polyline(points).close().extrude(-46)


def l_cut(about_x: float, about_z: float) -> cq.Workplane:
    """Return the L with its front end cut off at an angle."""
    tool = B().box(200, 100, 200).translate((0, -50, 0))
    return l_part().cut(tool.rotate((0, 0, 0), (1, 0, 0), about_x).rotate((0, 0, 0), (0, 0, 1), about_z))


def l_round_end() -> cq.Workplane:
    """Return the L with its far end on a cylinder."""
    return l_part().intersect(B().circle(60).extrude(300, both=True).translate((20, -20, 0)))


def l_hollow_end() -> cq.Workplane:
    """Return the L with its far end on a hole's wall."""
    return l_part().cut(B().circle(30).extrude(300, both=True).translate((20, 50, 0)))


def l_filleted() -> cq.Workplane:
    """Return the L with a fillet of 4 there already."""
    part = l_part()
    return part.newObject([part.val()]).edges(cq.selectors.BoxSelector((13.9, -1, 13.9), (14.1, 60, 14.1))).fillet(4)


def square_boss() -> cq.Workplane:
    """Square boss of 20 on a plate; base at z = 5, top at z = 20."""
    return B().box(50, 50, 10).faces(">Z").workplane().rect(20, 20).extrude(15)


def round_boss() -> cq.Workplane:
    """Round boss on a plate."""
    return B().box(40, 40, 10).faces(">Z").workplane().circle(10).extrude(12)


def rib_at_wall() -> cq.Workplane:
    """Rib 8 x 40 x 20 on a wall."""
    wall = B().box(50, 10, 40, centered=(True, False, False))
    return wall.union(B().box(8, 40, 20, centered=(True, False, False)).translate((0, 10, 5)))


def plate_with_boss(depth: float) -> cq.Workplane:
    """Plate with a boss across its side."""
    return B().box(60, 40, 10).union(B().circle(12).extrude(40).translate((0, depth, -5)))


def slot() -> cq.Workplane:
    """Block with a slot."""
    return B().box(60, 40, 20).faces(">Z").workplane().slot2D(30, 12).cutBlind(-8)


def pocket() -> cq.Workplane:
    """Block with a pocket."""
    return B().box(60, 40, 20).faces(">Z").workplane().rect(30, 20).cutBlind(-8)


def l_pocket() -> cq.Workplane:
    """Block with an L-shaped pocket, floor at z = 0."""
    outline = [(-20, -20), (20, -20), (20, 0), (0, 0), (0, 20), (-20, 20)]
    return B().box(60, 60, 20).cut(B().polyline(outline).close().extrude(20))


def rounded_box() -> cq.Workplane:
    """Box with one vertical edge rounded by 6."""
    return B().box(40, 30, 20).edges("|Z and >X and >Y").fillet(6)


def top_rounded() -> cq.Workplane:
    """Box with one top edge rounded by 3."""
    return B().box(40, 30, 20).edges(">X and >Z").fillet(3)


def hole() -> cq.Workplane:
    """Block with a blind hole."""
    return B().box(30, 30, 30).faces(">Z").workplane().hole(10, 20)


def through_hole() -> cq.Workplane:
    """Block with a hole through it."""
    return B().box(40, 40, 20).faces(">Z").workplane().hole(20)


def rod() -> cq.Workplane:
    """Cylinder."""
    return B().circle(5).extrude(20)


def shaft() -> cq.Workplane:
    """Shaft with three steps and a cone."""
    profile = [(0, 0), (12, 0), (12, 6), (8, 6), (8, 16), (10, 22), (10, 28), (5, 28), (5, 36), (0, 36)]
    return B("XZ").polyline(profile).close().revolve(360, (0, 0, 0), (0, 1, 0))


def cone_boss() -> cq.Workplane:
    """Frustum on a plate."""
    cone = B(obj=cq.Solid.makeCone(11, 6, 16, cq.Vector(0, 0, 3)))
    return B().box(40, 40, 8).union(cone)


def dome() -> cq.Workplane:
    """Part of a sphere on a plate."""
    return (
        B()
        .box(40, 40, 8)
        .union(B().sphere(12).translate((0, 0, 5)))
        .intersect(B().box(60, 60, 60).translate((0, 0, 26)))
    )


def acute_prism() -> cq.Workplane:
    """Prism with angles of 72, 45 and 63 degrees."""
    return B().polyline([(0, 0), (40, 0), (10, 30)]).close().extrude(20)


def drafted() -> cq.Workplane:
    """Block with drafted sides."""
    return B().rect(40, 30).extrude(20, taper=12)


def dovetail() -> cq.Workplane:
    """Slide with a dovetail groove, its edges acute."""
    points = [(-30, 0), (30, 0), (30, 20), (8, 20), (14, 9), (-14, 9), (-8, 20), (-30, 20)]
    return B("XZ").polyline(points).close().extrude(-40)


def star() -> cq.Workplane:
    """Prism over a star with five points."""
    angles = np.pi / 5 * np.arange(10)
    radii = np.where(np.arange(10) % 2, 13.0, 22.0)
    return B().polyline(list(zip(radii * np.cos(angles), radii * np.sin(angles), strict=True))).close().extrude(12)


def channel() -> cq.Workplane:
    """U profile."""
    points = [(-20, 0), (20, 0), (20, 25), (13, 25), (13, 7), (-13, 7), (-13, 25), (-20, 25)]
    return B("XZ").polyline(points).close().extrude(-50)


def half_rod() -> cq.Workplane:
    """Half cylinder: arcs that end at a plane."""
    return B().circle(14).extrude(30).cut(B().box(60, 60, 100, centered=(True, False, True)))


def tetrahedron() -> cq.Workplane:
    """Pyramid over a triangle."""
    corners = [cq.Vector(*p) for p in ((-20, -15, 0), (20, -12, 0), (3, 22, 0), (2, 1, 25))]
    faces = [(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 1, 2)]
    wires = [cq.Wire.makePolygon([corners[i] for i in face], close=True) for face in faces]
    return B(obj=cq.Solid.makeSolid(cq.Shell.makeShell([cq.Face.makeFromWires(wire) for wire in wires])))


def prism_with_hexagon() -> cq.Workplane:
    """Hexagonal boss on a round flange."""
    return B().circle(25).extrude(8).faces(">Z").workplane().polygon(6, 28).extrude(14)


def stepped_slab() -> cq.Workplane:
    """Three steps."""
    points = [(0, 0), (45, 0), (45, 8), (30, 8), (30, 17), (15, 17), (15, 28), (0, 28)]
    return B("XZ").polyline(points).close().extrude(-25)


#: Edges of the parts above, by their centres.
E1, E2 = (32, 0, 14), (14, 0, 32)
BOSS_SIDES = tuple((x, y, 12.5) for x in (-10, 10) for y in (-10, 10))
RIB_TOP = ((-4, 30, 25), (4, 30, 25))
RIB_ROOT = ((-4, 10, 15), (4, 10, 15), (0, 10, 5), (0, 10, 25))
POCKET_SIDES = tuple((x, y, 6) for x in (-15, 15) for y in (-10, 10))

__all__ = [
    "BOSS_SIDES",
    "E1",
    "E2",
    "POCKET_SIDES",
    "RIB_ROOT",
    "RIB_TOP",
    "Triple",
    "bracket",
    "sizes_of",
    "turned_by",
]
