"""Accuracy of the exact engine against analytic fillets, rounds and plugs, off the axes.

Run as ``python -m validation.accuracy [spacings to the radius …]``; 3, 5, 10 and 20 by default, some minutes.
Curved faces are tessellated by 720 segments (0.0005 spacings for a boss of radius 40 spacings).
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import exact_cases as cases
import shapes

import cad_implicit as ci

R = 2.0
CASES: list[Callable[[], cases.Case]] = [
    *(lambda angle=angle: cases.wedge(angle, R) for angle in (60, 90, 120)),
    lambda: cases.corner(R),
    lambda: cases.pocket(R),
    lambda: cases.square_boss(R),
    lambda: cases.cone_boss(2, 2, R),
    lambda: cases.cone_boss(2.5, 1.5, R),
    lambda: cases.cone_boss(1.5, 2.2, R),
    lambda: cases.cross(2, 1.5, R),
    lambda: cases.cross(2, 2, R),
    *(lambda hole=hole: cases.blind(hole, R) for hole in (1.1, 2)),
    *(lambda hole=hole: cases.plug(hole, R) for hole in (0.1, 0.3, 0.6, 0.9, 0.99)),
]


def nested(part: ci.Mesh, h: float) -> ci.Implicit:
    """Six operations that leave the concave edges with a fillet of R."""
    shape = ci.offset(ci.offset(ci.fillet(part, R, spacing=h), 0.35 * R, spacing=h), -0.35 * R, spacing=h)
    shape = ci.round(ci.fillet(shape, R, spacing=h), 0.5 * R, spacing=h)
    return ci.fillet(shape, 0.75 * R, spacing=h)


OPERATIONS: dict[str, Callable[[ci.Mesh, float], ci.Implicit]] = {
    "fillet": lambda part, h: ci.fillet(part, R, spacing=h),
    "round": lambda part, h: ci.round(shapes.cavity(part, 2.5 * R), R, spacing=h),
    "smooth": lambda part, h: ci.smooth(part, R, spacing=h),
    "smooth'": lambda part, h: ci.smooth(part, R, first="fillet", spacing=h),
    "six": nested,
}


def line(make: Callable[[], cases.Case], operation: str, cells: float) -> None:
    """Print the errors of one part, in spacings; facets and missed in spacings² / radius."""
    case, h = make(), R / cells
    e = cases.errors(case, ci.contour(OPERATIONS[operation](case.mesh, h)), h)
    sharp = f"{e.sharp_p999:10.1e}{e.sharp:10.1e}" if operation == "fillet" else 20 * " "  # else rounded, or unknown
    print(
        f"{case.name:13s}{operation:8s}{cells:5g}{e.blend:10.1e}{e.blend_rms:10.1e}{e.facets * cells:8.2f}"
        f"{e.missed * cells:8.2f}{e.face:10.1e}{sharp}{e.skipped:9d} /{e.samples:8d}",
        flush=True,
    )


def main(counts: list[float]) -> None:
    """Print one line for each part, operation and radius; rounds are those of cavities: of crosses, crossing bores."""
    warnings.simplefilter("ignore", ci.errors.GeometryWarning)
    print(
        "part         op        r/h  blend max       rms  facets  missed      face sharp 99.9       max left out /  of"
    )
    for make in CASES:
        for cells in counts:
            line(make, "fillet", cells)
    for operation in ("round", "smooth", "smooth'", "six"):
        for make in (CASES[1], CASES[3], CASES[6], CASES[9], CASES[10]) if operation != "six" else (CASES[3], CASES[6]):
            line(make, operation, 5)


if __name__ == "__main__":
    main([float(count) for count in sys.argv[1:]] or [3, 5, 10, 20])
