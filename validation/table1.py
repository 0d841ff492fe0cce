"""The paper's Table 1: error of the distance at 10,000 points of the unit sphere, f = 1 - x² - y² - z².

``python -m validation.table1`` prints the paper's figures, ours, and those of exact distances at the nodes, which are
the error of the trilinear interpolation alone. The paper names [-2, 2]³ in the same section; of the domains and the
two readings of "32³" (nodes or cells) tried here, its figures fit the nodal ones on that domain only.
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from cad_implicit.field import Field
from cad_implicit.grid import Grid
from cad_implicit.redistancing import redistance

#: Table 1 of the paper: maximum and average by resolution.
PAPER = {32: (0.004, 0.003), 64: (0.001, 0.0007), 128: (0.0002, 0.0002)}

#: Domain of section 5.3.
DOMAIN = 2.0

Errors = tuple[float, float]


def samples(count: int = 10_000) -> NDArray[np.float64]:
    """Points spread uniformly at random over the unit sphere."""
    x = np.random.default_rng(0).normal(size=(count, 3))
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def errors(nodes: int, half: float) -> tuple[Errors, Errors]:
    """Maximum and mean at the samples, of our distance and of exact nodal distances, on [-half, half]³."""
    grid = Grid.cover([[-half] * 3, [half] * 3], shape=nodes)
    x, y, z = np.meshgrid(*grid.axes(), indexing="ij", sparse=True)
    square = x**2 + y**2 + z**2
    ours = redistance(Field(grid, (1 - square).astype(np.float32)), distance=0.2)
    exact = Field(grid, 1 - np.sqrt(square))
    found = []
    for field in (ours, exact):
        deviation = np.abs(field(samples()))
        found.append((float(deviation.max()), float(deviation.mean())))
    return found[0], found[1]


def fits(ours: Errors, paper: Errors) -> bool:
    """Whether figures are at or below the paper's when rounded to as many digits."""
    digits = [4 if p < 0.001 else 3 for p in paper]
    return all(round(o, d) <= p for o, p, d in zip(ours, paper, digits, strict=True))


def report(half: float, extra: int, resolutions: tuple[int, ...]) -> None:
    """Print the rows of one domain and one reading of the resolution."""
    for n in resolutions:
        ours, exact = errors(n + extra, half)
        paper = PAPER.get(n)
        quoted = f"{paper[0]:.4f} / {paper[1]:.4f}" if paper else f"{'-':^15}"
        verdict = "" if paper is None else ("at or below" if fits(ours, paper) else "ABOVE")
        print(
            f"[-{half}, {half}]³ {n + extra:>4}³ {quoted}   {ours[0]:.5f} / {ours[1]:.5f}   "
            f"{exact[0]:.5f} / {exact[1]:.5f}   {verdict}"
        )


def main() -> None:
    """Print the table of the paper's domain, then of others."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--small", action="store_true", help="leave out 256³ and the other domains")
    small = parser.parse_args().small
    print(f"{'domain':<16} nodes {'paper max/mean':<15}   {'ours':<17}   exact at nodes")
    report(DOMAIN, 0, (32, 64, 128) if small else (32, 64, 128, 256))
    if not small:
        report(DOMAIN, 1, (32, 64, 128))
        for half in (1.5, 1.2, 1.1):
            report(half, 0, (32, 64, 128))


if __name__ == "__main__":
    main()
