"""Small parts built by script with CadQuery, for tests and figures; lengths in mm.

``python -m validation.parts DIR`` writes all of them as STEP.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import cadquery as cq

from cad_implicit.cad import occ_files


def bracket() -> cq.Workplane:
    """Bracket of 80.3 x 60.7 x 50.9: plate with four holes, wall, boss with a bore, gusset, and a pocket.

    The exact kernel fillets all its concave edges at once with a radius of 2 and less.
    """
    length, width, height = 80.3, 60.7, 50.9
    plate, wall = 9.1, 10.3
    holes = [(x, y) for x in (21.7, 71.9) for y in (-22.6, 22.6)]
    body = cq.Workplane().box(length, width, plate, centered=(False, True, False))
    body = body.union(cq.Workplane().box(wall, width, height, centered=(False, True, False)))
    gusset = (
        cq.Workplane("XZ")
        .polyline(
            [
                (0.5 * wall, 0.5 * plate),
                (39.7, 0.5 * plate),
                (39.7, plate + 4.3),
                (wall + 4.7, 44.3),
                (0.5 * wall, 44.3),
            ]
        )
        .close()
        .extrude(3.35, both=True)
    )
    body = body.union(gusset)
    boss = cq.Workplane().center(59.3, 0).circle(11.15).extrude(plate + 14.3)
    body = body.union(boss)
    body = body.faces("<Z").workplane(origin=(0, 0, 0)).center(59.3, 0).circle(5.95).cutThruAll()
    body = body.cut(cq.Workplane().pushPoints(holes).circle(3.17).extrude(plate))
    pocket = cq.Workplane("YZ").center(0, 27.9).rect(37.3, 23.9).extrude(4.7)
    return body.cut(pocket)


def cube() -> cq.Workplane:
    """Cube of 20."""
    return cq.Workplane().box(20, 20, 20)


def plate_with_hole() -> cq.Workplane:
    """Plate of 40.3 x 30.7 x 8.1 with a hole of 12.7."""
    return cq.Workplane().box(40.3, 30.7, 8.1).faces(">Z").workplane().hole(12.7)


def boss_on_plate() -> cq.Workplane:
    """Round boss on a square plate: one concave circle."""
    return cq.Workplane().box(40.3, 40.3, 8.1).faces(">Z").workplane().circle(9.7).extrude(12.3)


def l_profile() -> cq.Workplane:
    """L profile: one concave straight edge."""
    points = [(0, 0), (30.1, 0), (30.1, 8.3), (9.7, 8.3), (9.7, 24.9), (0, 24.9)]
    return cq.Workplane("XZ").polyline(points).close().extrude(35.9)


def crossing_cylinders() -> cq.Workplane:
    """Two cylinders of different radius that cross at right angles."""
    one = cq.Workplane().circle(8.3).extrude(25.7, both=True)
    return one.union(cq.Workplane("XZ").circle(6.1).extrude(25.7, both=True))


def cone_on_plate() -> cq.Workplane:
    """Cone with its apex on a plate's normal."""
    cone = cq.Workplane(obj=cq.Solid.makeCone(11.3, 0, 17.9, cq.Vector(0, 0, 3)))
    return cq.Workplane().box(40.3, 40.3, 8.1).union(cone)


def torus_boss() -> cq.Workplane:
    """Half-sunk torus on a plate."""
    torus = cq.Workplane(obj=cq.Solid.makeTorus(13.1, 4.3, cq.Vector(0, 0, 5.1), cq.Vector(0, 0, 1)))
    return cq.Workplane().box(40.3, 40.3, 8.1).union(torus)


def sphere_and_box() -> cq.Workplane:
    """Sphere and box whose surfaces cross."""
    return cq.Workplane().box(20.3, 20.3, 20.3).union(cq.Workplane().sphere(9.7).translate((6.1, 4.3, 7.9)))


def thin_fin() -> cq.Workplane:
    """Block with a fin 1.1 thick: an opening with a radius above 0.55 deletes the fin."""
    fin = cq.Workplane().box(30.1, 1.1, 25.3).translate((0, 0, 12.65))
    return cq.Workplane().box(40.3, 30.7, 10.9).union(fin)


def two_blocks() -> cq.Workplane:
    """Two blocks apart from each other."""
    return cq.Workplane().box(10.1, 20.3, 15.7).add(cq.Workplane().box(8.3, 8.3, 8.3).translate((25, 0, 0))).combine()


def solid(workplane: cq.Workplane) -> cq.Shape:
    """Only solid of a workplane, without the compound around it; the compound if there are several."""
    shape = workplane.val()
    found = shape.Solids()
    return found[0] if len(found) == 1 else shape


#: All parts by name.
PARTS: dict[str, Callable[[], cq.Workplane]] = {
    build.__name__: build
    for build in (
        bracket,
        cube,
        plate_with_hole,
        boss_on_plate,
        l_profile,
        crossing_cylinders,
        cone_on_plate,
        torus_boss,
        sphere_and_box,
        thin_fin,
        two_blocks,
    )
}


def concave_edges(solid: cq.Shape, angle: float = 5.0) -> list[cq.Edge]:
    """Edges where the material's angle exceeds 180 by more than ``angle`` degrees at the middle."""
    return [edge for edge, bend in _bends(solid) if bend < -angle]


def convex_edges(solid: cq.Shape, angle: float = 5.0) -> list[cq.Edge]:
    """Edges where the material's angle falls short of 180 by more than ``angle`` degrees at the middle."""
    return [edge for edge, bend in _bends(solid) if bend > angle]


def _bends(solid: cq.Shape) -> list[tuple[cq.Edge, float]]:
    """Edges between two faces with the angle in degrees between their normals, negative where concave."""
    found: dict[cq.Edge, list[tuple[cq.Edge, cq.Face]]] = {}
    for face in solid.Faces():
        for wire in face.Wires():
            for edge in wire.Edges():
                found.setdefault(edge, []).append((edge, face))
    result = []
    forward = cq.Solid.makeBox(1, 1, 1).wrapped.Orientation()
    for edge, uses in found.items():
        if len(uses) != 2:
            continue  # the seam of a closed face, or its pole
        (oriented, face), (_, other) = uses
        middle = oriented.positionAt(0.5)
        first, second = face.normalAt(middle), other.normalAt(middle)
        # along the edge as the first face's boundary runs: counter-clockwise seen from outside
        along = first.cross(second).dot(oriented.tangentAt(0.5)) * (
            1 if oriented.wrapped.Orientation() == forward else -1
        )
        result.append((edge, math.degrees(math.copysign(first.getAngle(second), along))))
    return result


def write_step(shape: cq.Shape, path: Path, name: str) -> None:
    """Write a STEP file with a fixed time stamp, so that the same part gives the same file."""
    occ_files.write(shape.wrapped, path, name, "2000-01-01T00:00:00")


def main() -> None:
    """Write all parts as STEP files."""
    parser = argparse.ArgumentParser(description="Write all parts as STEP files.")
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for name, build in PARTS.items():
        write_step(solid(build()), folder / f"{name}.step", name)
        print(folder / f"{name}.step")


if __name__ == "__main__":
    main()
