"""Which edges of which parts are blended with which radii, to be compared with the exact kernel."""

from __future__ import annotations

import math
from itertools import cycle

from . import local_parts as parts
from .local_parts import BOSS_SIDES, E1, E2, POCKET_SIDES, RIB_ROOT, RIB_TOP, Triple

#: Area of the section that a fillet of radius 1 adds at a right angle.
FIN = 1 - math.pi / 4
#: What two of them that meet at a right angle have in common; their first moment from the edge is half of it.
MITRE = 1 - math.pi / 2 + 2 / 3

_X, _Y, _Z = "|X and >Y and >Z", "|Y and >X and >Z", "|Z and >X and >Y"
_FLOOR_2 = ((10, 0, 0), (0, 10, 0))
_INNER = ((0, 0, 5),)


def _l55() -> parts.cq.Workplane:
    return parts.l_part(55)


#: The volumes that decide between rules: cuts at the ends, and mitres.
NAMED: tuple[Triple, ...] = (
    Triple("boss, one base edge", parts.square_boss, ((((0, 10, 5),), 2.0),), 17.17),
    Triple("rib, top edge at the wall", parts.rib_at_wall, ((RIB_TOP[1:], 2.0),), -34.34),
    Triple("L, one end edge", parts.l_part, (((E1,), 2.0),), -30.90),
    Triple("L, two end edges", _l55, ((((34.5, 0, 14), (14, 0, 32)), 2.0),), -4 * FIN * 77 - 8 * MITRE),
    Triple("L, 41 and 41", lambda: _l41(), ((((34.5, 0, 14), (14, 0, 34.5)), 2.0),), -71.156),
    Triple("boss, four base edges", parts.square_boss, (("concave", 2.0),), 71.740),
)


def _l41() -> parts.cq.Workplane:
    points = [(0, 0), (55, 0), (55, 14), (14, 14), (14, 55), (0, 55)]
    return parts.B("XZ").polyline(points).close().extrude(-46)


def _triples() -> list[Triple]:
    box, l_part, boss, rib = parts.box, parts.l_part, parts.square_boss, parts.rib_at_wall
    return [
        Triple("box, one edge", box, ((_X, 2.0),), -4 * FIN * 20),
        Triple("box, two edges", box, ((_X, 2.0), (_Y, 2.0)), -4 * FIN * 44 + 8 * MITRE),
        Triple("box, three edges", box, ((_X, 2.0), (_Y, 2.0), (_Z, 2.0))),
        Triple("box, two radii at two edges", box, ((_X, 2.0), (_Y, 3.0))),
        Triple("box, 2, 2 and 3", box, ((_X, 2.0), (_Y, 2.0), (_Z, 3.0)), -90.14192),
        Triple("box, all", box, (("all", 2.0),)),
        Triple("box, all 4", box, (("all", 4.0),)),
        Triple("box, top", box, ((">Z", 2.0),), -4 * FIN * 88 + 32 * MITRE),
        Triple("box, top 2 sides 3", box, ((">Z", 2.0), ("|Z", 3.0))),
        Triple("box, top 3 sides 3", box, ((">Z", 3.0), ("|Z", 3.0))),
        Triple("thin plate, corners 10", parts.thin_plate, (("|Z", 10.0),), -1200 * FIN),
        *[Triple(f"L, one end edge {r:g}", l_part, (((E1,), r),), -r * r * FIN * 36) for r in (1.0, 3.0)],
        Triple("L, end edges 2 and 3", l_part, (((E1,), 2.0), ((E2,), 3.0)), -101.80913),
        Triple("L, concave", l_part, (("concave", 3.0),), 9 * FIN * 46),
        Triple("L, convex", l_part, (("convex", 2.0),), -528.93821),
        Triple("L, all", l_part, (("all", 2.0),), -487.64856),
        Triple("L, convex 2 concave 4", l_part, (("convex", 2.0), ("concave", 4.0)), -367.71462),
        Triple("L, convex 4 concave 2", l_part, (("convex", 4.0), ("concave", 2.0)), -2020.30406),
        Triple("L, front", l_part, (("<Y", 2.0),), -168.61362),
        Triple("L, front and concave", l_part, (("<Y", 2.0), ("concave", 2.0)), -128.22543),
        Triple("L, end edges and concave", l_part, (((E1, E2), 2.0), ("concave", 2.0)), -22.18410),
        Triple("L, end edges 3 and concave 1", l_part, (((E1, E2), 3.0), ("concave", 1.0)), -130.39434),
        Triple("boss, two base edges", boss, ((((0, 10, 5), (10, 0, 5)), 2.0),), 35.10326),
        Triple("boss, sides", boss, ((BOSS_SIDES, 2.0),), -4 * FIN * 60),
        Triple("boss, base and sides", boss, (("concave", 2.0), (BOSS_SIDES, 2.0)), 16.63018),
        Triple("boss, base 3 and sides 2", boss, (("concave", 3.0), (BOSS_SIDES, 2.0)), 104.50912),
        Triple("boss, base 2 and sides 3", boss, (("concave", 2.0), (BOSS_SIDES, 3.0)), -49.22410),
        Triple("boss, base, sides and top", boss, (("concave", 2.0), (BOSS_SIDES, 2.0), (">Z", 2.0)), -46.68547),
        Triple("rib, both top edges", rib, ((RIB_TOP, 2.0),), -8 * FIN * 40),
        Triple("rib, root", rib, ((RIB_ROOT, 2.0),), 51.13866),
        Triple("rib, one side of the root", rib, ((RIB_ROOT[:1], 2.0),), 4 * FIN * 20),
        Triple("rib, one top edge and root", rib, ((RIB_TOP[1:], 2.0), (RIB_ROOT, 2.0)), 15.90091),
        Triple("cut L, concave", lambda: parts.l_cut(0, 30), (("concave", 2.0),), 32.32690),
        Triple("cut L, concave 3", lambda: parts.l_cut(30, 20), (("concave", 3.0),)),
        Triple("cut L, convex", lambda: parts.l_cut(-35, 25), (("|Y", 2.0),)),
        Triple("L on a cylinder, concave", parts.l_round_end, (("concave", 2.0),), 34.11228),
        Triple("L at a hole, concave", parts.l_hollow_end, (("concave", 2.0),), 17.61518),
        Triple("plate at a boss", lambda: parts.plate_with_boss(14), ((((20.19615, 20, 5),), 2.0),), -16.62782),
        Triple("plate at an outer boss", lambda: parts.plate_with_boss(26), ((((20.19615, 20, 5),), 2.0),), -17.07285),
        Triple("slot, floor", parts.slot, (("concave exc |Z", 2.0),), 60.85437),
        Triple("slot, one arc of the floor", parts.slot, ((((12.8197, 0, 2),), 2.0),), 60.85437),
        Triple("slot, floor 5.9", parts.slot, (("concave", 5.9),), 488.69655),
        Triple("pocket, sides", parts.pocket, ((POCKET_SIDES, 2.0),), 4 * FIN * 32),
        Triple("pocket, floor", parts.pocket, (("concave exc |Z", 2.0),), 82.77288),
        Triple("pocket, all", parts.pocket, (("concave", 2.0),), 107.95283),
        Triple("pocket, floor 2 sides 3", parts.pocket, (("concave", 2.0), (POCKET_SIDES, 3.0)), 140.81540),
        Triple("L pocket, floor", parts.l_pocket, (("concave exc |Z", 2.0),), 134.27732),
        Triple("L pocket, two floor edges and inner", parts.l_pocket, ((_FLOOR_2, 2.0), (_INNER, 2.0)), 25.61773),
        Triple("L pocket, all and inner", parts.l_pocket, (("concave", 2.0), (_INNER, 2.0)), 164.85081),
        Triple("rounded box, top edge", parts.rounded_box, ((((-3, 15, 10),), 2.0),), -57.27555),
        Triple("rounded box, top edge 5.9", parts.rounded_box, ((((-3, 15, 10),), 5.9),), -488.21834),
        Triple("rounded box, top edge 6", parts.rounded_box, ((((-3, 15, 10),), 6.0),), -504.63730),
        Triple("filleted L, front", parts.l_filleted, ((((34, 0, 14),), 2.0),), -60.93397),
        Triple("rounded top, across", parts.top_rounded, ((((-1.5, 15, 10),), 2.0),), -49.79677),
        Triple("blind hole, floor", parts.hole, (("concave", 2.0),)),
        Triple("blind hole, floor 5", parts.hole, (("concave", 5.0),), 125 * math.pi / 3),
        Triple("blind hole, rim", parts.hole, (("%circle and >Z", 3.0),)),
        Triple("hole, both rims", parts.through_hole, (("%circle", 3.0),)),
        Triple("rod, rim", parts.rod, (("%circle and >Z", 2.0),)),
        Triple("rod, rim 5", parts.rod, (("%circle and >Z", 5.0),), -125 * math.pi / 3),
        Triple("rod, both rims", parts.rod, (("%circle", 3.0),)),
        Triple("round boss, base", parts.round_boss, (("concave", 4.0),)),
        Triple("round boss, base and rim", parts.round_boss, (("%circle", 3.0),)),
        Triple("shaft, concave", parts.shaft, (("concave", 1.5),)),
        Triple("shaft, all", parts.shaft, (("convex", 1.0), ("concave", 1.5))),
        Triple("cone on a plate", parts.cone_boss, (("concave", 3.0),)),
        Triple("cone on a plate, rim", parts.cone_boss, (("%circle and >Z", 2.0),)),
        Triple("dome on a plate", parts.dome, (("concave", 3.0),)),
        Triple("acute prism, sides", parts.acute_prism, (("|Z", 2.0),)),
        Triple("acute prism, all", parts.acute_prism, (("all", 2.0),)),
        Triple("drafted block, all", parts.drafted, (("all", 2.5),)),
        Triple("drafted block, top", parts.drafted, ((">Z", 2.0),)),
        Triple("dovetail, concave", parts.dovetail, (("concave", 1.5),)),
        Triple("dovetail, all", parts.dovetail, (("all", 1.0),)),
        Triple("star, convex", parts.star, (("convex", 1.0),)),
        Triple("star, concave", parts.star, (("concave", 3.0),)),
        Triple("star, all", parts.star, (("all", 1.0),)),
        Triple("channel, all", parts.channel, (("all", 2.0),)),
        Triple("channel, front", parts.channel, (("<Y", 2.0),)),
        Triple("half rod, arc", parts.half_rod, (("%circle and >Z", 2.0),)),
        Triple("half rod, all", parts.half_rod, (("all", 2.0),)),
        Triple("tetrahedron, all", parts.tetrahedron, (("all", 1.0),), -103.31842),
        Triple("hexagon on a flange, base", parts.prism_with_hexagon, (("concave", 2.0),)),
        Triple("hexagon on a flange, convex", parts.prism_with_hexagon, (("convex", 1.5),)),
        Triple("steps, all", parts.stepped_slab, (("all", 1.5),)),
        Triple("bracket, concave", parts.bracket, (("concave", 2.0),)),
        Triple("box, chamfer of one edge", box, ((_X, 2.0),), -40.0, "chamfer"),
        Triple("box, chamfer of two lengths", box, ((_X, (1.0, 3.0)),), -30.0, "chamfer"),
        Triple("box, chamfer of three edges", box, ((_X, 2.0), (_Y, 2.0), (_Z, 2.0)), -138.66667, "chamfer"),
        Triple("box, chamfer of two edges", box, ((_X, 2.0), (_Y, 3.0)), -143.33333, "chamfer"),
        Triple("box, chamfer of all", box, (("all", 2.0),), -533.33333, "chamfer"),
        Triple("boss, chamfer of the base", boss, (("concave", 2.0),), 170.66667, "chamfer"),
        Triple("L, chamfer of end edges", l_part, (((E1, E2), 2.0),), -146.66667, "chamfer"),
        Triple("rod, chamfer of the rim", parts.rod, (("%circle and >Z", 2.0),), None, "chamfer"),
        Triple("round boss, chamfer of the base", parts.round_boss, (("concave", 2.0),), None, "chamfer"),
    ]


def _meshed(triples: list[Triple]) -> tuple[Triple, ...]:
    """With spacings from half a radius to a twentieth of it."""
    counts = cycle((3.0, 8.0, 2.0, 5.0, 12.0, 4.0, 20.0))
    return tuple(
        Triple(t.name, t.build, t.choices, t.change, t.blend, cells) for t, cells in zip(triples, counts, strict=False)
    )


#: All triples.
TRIPLES = _meshed(_triples())
