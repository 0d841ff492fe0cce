"""Figures 1 to 8 of the paper, and the plane: PNGs of the examples' fields."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cad_implicit import contour
from cad_implicit.field import Field
from cad_implicit.shelling import carved

from .distance_errors import Curve
from .examples import BOXES_RADIUS, COARSE_DEPTH, PART_RADIUS, SHELL, Result, exact_microstructure
from .models import mechanical_part, two_boxes
from .planar import operations
from .scenes import BONE, Panel, Vector, render
from .slices import draw_errors, draw_planar, draw_slices

#: The jaw from the front right, and cut through the body below the teeth, from above.
_JAW_VIEW: Vector = (0.75, -1.5, 0.75)
_CUT_VIEW: Vector = (0.35, -0.9, 1.25)
_CUT_HEIGHT = -0.445

#: A slice of the body, x and y.
_JAW_SLICE = (2, _CUT_HEIGHT)


def jaw_figures(example: Result, folder: Path) -> list[tuple[str, str]]:
    """Write Figures 1 to 4; file names and captions."""
    raw, phi, filled = (example.fields[name] for name in ("sampled", "distance", "microstructure"))
    h = phi.grid.spacing[0]
    bone = contour(phi)
    hollow = carved(phi, SHELL)
    shell = contour(hollow)
    lattice = contour(exact_microstructure(phi))
    axis, place = _JAW_SLICE
    cut: tuple[Vector, Vector] = ((0.0, 0.0, place), (0.0, 0.0, 1.0))
    low: Vector = (0.0, 0.1, -0.62)
    front = Panel(bone, "the zero level", _JAW_VIEW, colour=BONE, shape=phi)
    render(
        [
            front,
            Panel(bone, "from the side", (1.0, -0.25, 0.18), colour=BONE, shape=phi),
            Panel(bone, "from the front", (0.0, -1.0, 0.2), colour=BONE, shape=phi),
        ],
        folder / "figure1_jaw.png",
        size=(520, 470),
    )
    box = (-1.73, 1.73, -1.7, 1.76)
    draw_slices(
        [
            (raw, axis, place, f"convolution field, z = {place:g}", None),
            (_clipped(phi, 0.7), axis, place, f"distance, z = {place:g}: a line each 0.05", 0.05),
        ],
        folder / "figure1_2_slices.png",
        box=box,
    )
    draw_slices(
        [
            (_clipped(hollow, 0.2), axis, place, "shell of 0.1: a line each 0.025", 0.025),
            (_clipped(filled, 0.2), axis, place, "shell and lattice", 0.025),
        ],
        folder / "figure3_4_slices.png",
        box=(0.1, 1.5, -1.35, 0.35),
    )
    render(
        [
            Panel(shell, "shell, cut below the teeth", _CUT_VIEW, colour=BONE, cut=cut, zoom=1.25, focus=low),
            Panel(lattice, "shell and lattice", _CUT_VIEW, colour=BONE, cut=cut, zoom=1.25, focus=low),
            Panel(
                lattice,
                "close-up of the chin",
                (0.55, -0.75, 0.85),
                colour=BONE,
                cut=cut,
                zoom=4.0,
                focus=(0.15, -0.95, place),
            ),
        ],
        folder / "figure3_4_jaw.png",
        size=(520, 470),
    )
    return [
        ("figure1_jaw.png", f"Figure 1 a: the jaw bone, a convolution surface of line segments, contoured at {h:.3f}."),
        (
            "figure1_2_slices.png",
            "Figures 1 b and 2 b: the defining function on a slice through the body, far from a distance; and the "
            "distance from it, whose lines are evenly spaced as far as it was asked for, three spacings past 0.1.",
        ),
        (
            "figure3_4_jaw.png",
            "Figures 3 a and 4: the shell of 0.1; the shell with its lattice by the exact engine at half the spacing.",
        ),
        (
            "figure3_4_slices.png",
            "Figures 3 b and 4: the fields of the shell, and of the shell with its lattice, which is twice as dense "
            f"within {COARSE_DEPTH:g} of the surface.",
        ),
    ]


def _clipped(field: Field, below: float) -> Field:
    """Field whose values far outside are all alike, so that the lines show what matters."""
    return Field(field.grid, np.maximum(field.values, -below), field.bounds)


def smoothing_figures(boxes: Result, part: Result, folder: Path) -> list[tuple[str, str]]:
    """Write Figures 5 to 7; file names and captions."""
    raw, smooth = boxes.fields["sampled"], boxes.fields["smoothed"]
    before, after = contour(two_boxes(), raw.grid.spacing[0]), contour(smooth)
    corner: Vector = (0.02, -0.09, -0.06)
    view: Vector = (1.0, -1.5, 1.1)
    render(
        [
            Panel(before, "union of two boxes", view),
            Panel(after, f"smoothed, r = {BOXES_RADIUS:g}", view, shape=smooth),
            Panel(after, "close-up", view, zoom=3.2, focus=corner, shape=smooth),
        ],
        folder / "figure5_boxes.png",
        size=(520, 470),
    )
    raw, phi = part.fields["sampled"], part.fields["distance"]
    draw_slices(
        [
            (_clipped(raw, 0.03), 1, 0.2, "defining function inside, y = 0.2", 0.03),
            (raw, 1, 0.2, "inside and outside, y = 0.2", 0.25),
            (phi, 1, 0.2, "distance, y = 0.2", 0.1),
        ],
        folder / "figure6_slices.png",
    )
    before, after = contour(mechanical_part(), phi.grid.spacing[0]), contour(part.fields["smoothed"])
    spot: Vector = (0.55, -0.35, -0.55)
    render(
        [
            Panel(before, "mechanical part"),
            Panel(after, f"smoothed, r = {PART_RADIUS:g}", shape=part.fields["smoothed"]),
        ],
        folder / "figure7_part.png",
    )
    render(
        [
            Panel(before, "close-up before", zoom=3.0, focus=spot),
            Panel(after, "close-up after", zoom=3.0, focus=spot, shape=part.fields["smoothed"]),
        ],
        folder / "figure7_close.png",
    )
    return [
        ("figure5_boxes.png", "Figure 5: all edges and corners are smoothed, the rest of the surface stays."),
        ("figure6_slices.png", "Figure 6 b: the defining function is no distance, the computed field is."),
        ("figure7_part.png", "Figures 6 a and 7 a, b: the part, and smoothed."),
        ("figure7_close.png", "Figure 7 c, d: convex edges are rounded, concave ones filleted."),
    ]


def other_figures(curves: list[Curve], folder: Path) -> list[tuple[str, str]]:
    """Write Figure 8 and the plane; file names and captions."""
    draw_errors(curves, folder / "figure8_errors.png")
    before, results = operations()
    draw_planar(before, results, folder / "plane.png")
    return [
        ("figure8_errors.png", "Figure 8: error of the distance to the unit sphere, on 128³ nodes."),
        (
            "plane.png",
            "The plane, k = 2: results (filled) of an angle made by R-functions (dashed), with lines of the fields.",
        ),
    ]
