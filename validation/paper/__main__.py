"""Run the paper's tables, figures and examples, and write them on one page beside its own figures.

``python -m validation.paper -o DIR`` writes ``paper.html``, self-contained, and the PNGs.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from cad_implicit import redistance

from . import sections
from .distance_errors import curves
from .examples import BOXES_RADIUS, PART_RADIUS, microstructure, sampled, smoothed
from .figures import jaw_figures, other_figures, smoothing_figures
from .page import Page
from .thickness import all_walls
from .timing import examples, iteration


def build(
    folder: Path, *, nodes: int = 128, resolutions: tuple[int, ...] = (32, 64, 128, 256), dear: bool = True
) -> Path:
    """Run everything and write the page.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    nodes : int
        Of the examples along each axis; 128 in the paper.
    resolutions : tuple of int
        Of Tables 1 and 2, which has the first three.
    dear : bool
        Whether to run the schemes of high order.

    Returns
    -------
    Path
        The page.
    """
    start = time.perf_counter()
    folder.mkdir(parents=True, exist_ok=True)
    page = Page("Rounding, filleting and smoothing of implicit surfaces: the paper and this project")
    page.text(
        "Every table, figure and example of section 5 of the paper, run anew. Its figures are quoted as numbers; where "
        "ours differ, a sentence says why. Lengths are in the paper's units."
    )
    _say("compiling", start)
    redistance(sampled("sphere", 16), iterations=1)
    _say("Tables 2 and 3", start)
    seconds, timed = iteration(resolutions[:3]), examples(nodes)
    _say("Table 1", start)
    sections.table_1(page, resolutions)
    _say("Figure 8", start)
    found = curves(nodes, dear=dear)
    sections.figure_8(page, found, nodes)
    eighth, planar = other_figures(found, folder)
    page.figure(folder / eighth[0], eighth[1])
    sections.table_2(page, seconds, resolutions[:3])
    sections.table_3(page, timed, nodes)
    _say("examples", start)
    jaw = microstructure(nodes)
    page.heading("Section 5.1: shelling and microstructures")
    for name, caption in jaw_figures(jaw, folder):
        page.figure(folder / name, caption)
    page.heading("Section 5.2: smoothing")
    boxes, part = smoothed("boxes", BOXES_RADIUS, nodes), smoothed("part", PART_RADIUS, nodes)
    for name, caption in smoothing_figures(boxes, part, folder):
        page.figure(folder / name, caption)
    _say("walls", start)
    sections.walls(page, all_walls(jaw.fields["distance"]))
    sections.plane(page)
    page.figure(folder / planar[0], planar[1])
    page.text(
        f"All this took {time.perf_counter() - start:.0f} s, the compilation of kernels included where it was due."
    )
    target = folder / "paper.html"
    page.write(target)
    _say(str(target), start)
    return target


def _say(what: str, start: float) -> None:
    print(f"{time.perf_counter() - start:6.1f} s  {what}", flush=True)


def main() -> None:
    """Read the arguments and build the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("paper"), help="folder for the page (default: paper)")
    build(parser.parse_args().output)


if __name__ == "__main__":
    main()
