"""The sections of the page: tables beside the paper's figures, and why they differ."""

from __future__ import annotations

from collections.abc import Sequence

from validation.table1 import DOMAIN, PAPER, errors, fits

from .distance_errors import BAND, Curve
from .page import Page
from .planar import RADIUS, SPACING, corner_error
from .thickness import Thickness
from .timing import PAPER_EXAMPLE, PAPER_ITERATION, Example, machine

#: What the shapes are called on the page.
NAMES = {"sphere": "sphere", "jaw": "jaw bone", "boxes": "union of boxes", "part": "mechanical part"}

#: Limits in percent after the paper's Figure 8 b, whose figures the text does not give: the least error near the
#: surface, and where the curve stays.
PAPER_LEAST, PAPER_FLOOR = 0.5, 1.2


def table_1(page: Page, resolutions: Sequence[int]) -> None:
    """Error of the distance at 10,000 points of the unit sphere."""
    rows = []
    for n in resolutions:
        ours, nodal = errors(n, DOMAIN)
        paper = PAPER.get(n)
        for name, which in (("maximum", 0), ("average", 1)):
            quoted = "-" if paper is None else f"{paper[which]:.4f}"
            verdict: object = "-" if paper is None else fits(ours, paper)
            rows.append([f"{name}, {n}³", quoted, f"{ours[which]:.5f}", f"{nodal[which]:.5f}", verdict])
    head = ("", "paper", "ours", "exact distances at the nodes", "at or below the paper")
    page.heading("Table 1: distance at 10,000 points of the unit sphere")
    page.table("Deviation from zero, f = 1 - x² - y² - z² on [-2, 2]³", head, rows)
    page.text(
        "The paper prints one digit; ours are compared rounded to as many. Most of the error is that of the trilinear "
        "interpolation between nodes, which exact distances at the nodes have too (third column)."
    )


def figure_8(page: Page, curves: Sequence[Curve], nodes: int) -> None:
    """Minimum and floor of the errors near the surface."""
    rows = []
    for curve in curves:
        count = str(curve.iterations[-1]) if curve.iterations else "-"
        least = curve.least_near
        when = str(curve.iterations[curve.near.index(least)]) if curve.iterations else "-"
        cells = (f"{100 * x:.3f}" for x in (curve.domain[-1], least, curve.near[-1]))
        domain, lowest, floor = cells
        rows.append([curve.label, domain, f"{lowest} (iteration {when})" if when != "-" else lowest, floor, count])
    rows.insert(0, ["limits after the paper's curve", "-", f"{PAPER_LEAST}", f"{PAPER_FLOOR}", "-"])
    page.heading("Figure 8: error of the distance by iterations")
    head = ("scheme", "domain, at the end", f"within {BAND:g}, least", f"within {BAND:g}, at the end", "iterations")
    page.table(f"Relative L² error in percent, {nodes}³ nodes on [-2, 2]³", head, rows)
    page.text(
        "Over the domain the error falls as long as the front has not reached the corners (195 iterations), then "
        "stays. The limits stand for a curve that dips to a minimum near the surface, then rises to a floor. With the "
        "sub-cell fix there is no dip: the nodes next to the surface are held, the error falls to the floor of the "
        "first-order scheme and stays there, above the first limit and below the second; from exact distances it rises "
        "to 0.61 %. Without the fix, and with ε of the size of f in (3.5), the curve dips below the first limit, is at "
        "1.12 % after 200 iterations, and rises on: the surface itself drifts. Schemes of second and fifth order "
        "with the surface as end point of their differences go on falling; their sweeps are shown as far as the "
        "neighbourhood of the surface needs them, so their error over the domain is that of nodes not yet reached, as "
        "for every Gauss-Seidel curve that ends early. Fast marching starts from a first-order front. The exact "
        "engine's only error is the chord of its triangles, half a spacing wide; it has no iterations."
    )


def table_2(page: Page, seconds: dict[str, list[float]], resolutions: Sequence[int]) -> None:
    """Seconds of one iteration."""
    rows = []
    for name, ours in seconds.items():
        cells = []
        for n, found in zip(resolutions, ours, strict=True):
            quoted = dict(zip((32, 64, 128), PAPER_ITERATION[name], strict=True)).get(n)
            cells += ["-" if quoted is None else f"{quoted:g}", f"{found:.2g}"]
        rows.append([NAMES[name], *cells])
    page.heading("Table 2: seconds for one iteration, one thread")
    head = ["", *(label for n in resolutions for label in (f"{n}³ paper", f"{n}³ ours"))]
    page.table(machine(), head, rows)
    page.text(
        "The paper's machine was a low-end desktop of its time with 3 GHz; one iteration is the same arithmetic, here "
        "in vector instructions and single precision. As in the paper the shape does not matter."
    )


def table_3(page: Page, examples: dict[str, Example], nodes: int) -> None:
    """Seconds of the three examples."""
    rows = []
    for name, example in examples.items():
        one, four = PAPER_EXAMPLE[name]
        steps = ", ".join(f"{step} {seconds:.3f}" for step, seconds in example.one.seconds.items())
        ratio = one / example.one.total
        rows.append(
            [NAMES[name], one, f"{example.one.total:.2f}", f"{ratio:.0f}", ratio >= 5, four,
             f"{example.two.total:.2f}", steps]
        )  # fmt: skip
    page.heading("Table 3: seconds for the examples")
    head = ("", "1 thread, paper", "ours", "times as fast", "five or more", "4 threads, paper", "2, ours", "steps, 1")
    page.table(f"From the function to the result on {nodes}³ nodes; kernels compiled; {machine()}", head, rows)
    page.text(
        "As in the paper, sampling the convolution surface is the dearest step of the jaw: 93 segments at 2 million "
        "nodes. The functions are our own, so the times of sampling compare only roughly. The distance is computed a "
        "little further than the paper's ⌈r / time step⌉ = 10 iterations, as fronts from a narrow band arrive smeared."
    )


def walls(page: Page, found: Sequence[Thickness]) -> None:
    """Wall thickness measured on the results."""
    rows = [
        [wall.label, f"{wall.asked:g}", f"{wall.spacing:.4f}", f"{wall.worst:.3f}", f"{wall.mean:.4f}", wall.limit,
         wall.worst <= wall.limit]
        for wall in found
    ]  # fmt: skip
    page.heading("Thickness of the walls, measured on the results")
    head = ("wall", "asked", "spacing h", "worst, in h", "mean, in h", "allowed, in h", "within")
    page.table(
        "Distance between the two sides of a wall at 1,000 points of one, less the thickness asked for", head, rows
    )
    page.text(
        "The exact engine is within the limits everywhere. So is the paper's scheme on planes and where level sets "
        "bend gently. Below the edges of the jaw and between its teeth, with radii of two to four spacings, a "
        "first-order distance falls short by up to a spacing, and so does the wall that is cut at it; the mean is what "
        "a finer grid or the exact engine (here at half the spacing) makes small. The jaw's own rods are two "
        "spacings thin and short; lattices are measured in a ball, where there is room for flat and whole walls."
    )


def plane(page: Page) -> None:
    """Say what the figure of the plane shows."""
    page.heading("The plane, k = 2")
    page.text(
        f"The same functions work on planar curves: spacing {SPACING:g}, radius {RADIUS:g}. The corners of a rectangle "
        f"rounded with radius 0.5 are within {corner_error():.2f} spacings of true quarter circles. "
        "The paper shows no example in the plane."
    )
