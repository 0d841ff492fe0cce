"""Thirty varied solids, all of whose edges of one convexity are blended; lengths in mm."""

from __future__ import annotations

from collections.abc import Callable

import cadquery as cq

from . import cases, parts
from . import local_parts as own

B = cq.Workplane


def flange() -> cq.Workplane:
    """Round flange with a neck, a bore and six holes."""
    disc = B().circle(35).extrude(8).faces(">Z").workplane().circle(18).extrude(17)
    bored = disc.faces(">Z").workplane().hole(22)
    return bored.faces("<Z").workplane().polarArray(27, 0, 360, 6).hole(6.5)


def gusset_corner() -> cq.Workplane:
    """Angle bracket with a triangular rib in its corner."""
    angle = B().box(50, 30, 8, centered=(False, True, False)).union(B().box(8, 30, 45, centered=(False, True, False)))
    rib = B("XZ").polyline([(7, 7), (38, 7), (7, 36)]).close().extrude(3, both=True)
    return angle.union(rib)


def counterbore() -> cq.Workplane:
    """Block with two counterbored holes."""
    return B().box(50, 30, 20).faces(">Z").workplane().pushPoints([(-12, 0), (12, 0)]).cboreHole(7, 14, 6)


def keyed_shaft() -> cq.Workplane:
    """Shaft with a step and a keyway."""
    shaft = B().circle(12).extrude(30).faces(">Z").workplane().circle(8).extrude(25)
    return shaft.cut(B().box(5, 16, 6).translate((0, 2, 9 + 30 - 6)).translate((0, 0, 10)))


def lofted() -> cq.Workplane:
    """Duct from a square to a smaller one turned by 30 degrees."""
    return B().rect(36, 36).workplane(offset=28).transformed(rotate=(0, 0, 30)).rect(20, 24).loft(combine=True)


def wedge() -> cq.Workplane:
    """Wedge with an angle of 28 degrees, with a groove."""
    wedge = B("XZ").polyline([(0, 0), (45, 0), (0, 24)]).close().extrude(-30)
    return wedge.cut(B().box(8, 60, 12).translate((12, 15, 0)))


def oblique_boss() -> cq.Workplane:
    """Plate with a boss that leans by 25 degrees."""
    boss = B().circle(8).extrude(40).rotate((0, 0, 0), (1, 0, 0), 25)
    return B().box(50, 50, 10).union(boss.intersect(B().box(90, 90, 30, centered=(True, True, False))))


def housing() -> cq.Workplane:
    """Open box with walls 4 thick and four posts in its corners."""
    box = B().box(60, 44, 24).faces(">Z").workplane().rect(52, 36).cutBlind(-19)
    return box.union(B().workplane(offset=-9).rect(44, 28, forConstruction=True).vertices().circle(5.5).extrude(16))


def clevis() -> cq.Workplane:
    """Fork with round ends and a cross bore."""
    block = B().box(44, 24, 24).edges("|Y and >X").fillet(11.9)
    fork = block.cut(B().box(30, 9, 30).translate((12, 0, 0)))
    return fork.cut(B("XZ").center(10, 0).circle(5).extrude(40, both=True))


#: The solids by name.
SOLIDS: dict[str, Callable[[], cq.Workplane]] = {
    build.__name__: build
    for build in (
        parts.bracket,
        parts.plate_with_hole,
        parts.boss_on_plate,
        parts.crossing_cylinders,
        parts.thin_fin,
        flange,
        gusset_corner,
        counterbore,
        keyed_shaft,
        lofted,
        wedge,
        oblique_boss,
        housing,
        clevis,
        own.l_part,
        own.rib_at_wall,
        own.slot,
        own.l_pocket,
        own.shaft,
        own.cone_boss,
        own.dome,
        own.acute_prism,
        own.drafted,
        own.dovetail,
        own.star,
        own.half_rod,
        own.tetrahedron,
        own.prism_with_hexagon,
        cases.sphere_in_corner,
        cases.slanted_bores,
    )
}
