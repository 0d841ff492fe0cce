"""Pictures of fields on slices, with contour lines, and the charts of Figure 8 (matplotlib)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cad_implicit import contour_curves
from cad_implicit.field import Field

from .distance_errors import BAND, Curve
from .scenes import slim

#: Dots per inch of the PNGs.
_DPI = 110


def _figure(columns: int, width: float = 5.2, height: float = 4.3) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width * columns, height), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, np.atleast_1d(figure.subplots(1, columns))


def cut(field: Field, axis: int, place: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.floating]]:
    """Coordinates along the two other axes, and the values on the slice nearest to a place, first axis across."""
    axes = field.grid.axes()
    index = int(np.abs(axes[axis] - place).argmin())
    rest = [axes[n] for n in range(3) if n != axis]
    return rest[0], rest[1], np.take(field.values, index, axis).T


def draw_slices(
    slices: Sequence[tuple[Field, int, float, str, float | None]], path: Path, *, box: Sequence[float] | None = None
) -> None:
    """Write a PNG of slices: each a field, the axis across it, the place, a title, and the distance between its lines.

    Without a distance between the lines they are spread over the values. The surface is black. ``box`` is the part
    shown, (left, right, bottom, top).
    """
    from matplotlib.colors import TwoSlopeNorm

    figure, places = _figure(len(slices))
    for (field, axis, place, title, step), plot in zip(slices, places, strict=True):
        x, y, values = cut(field, axis, place)
        if step is None:
            levels = np.linspace(float(values.min()), float(values.max()), 30)
        else:
            levels = step * np.arange(np.floor(values.min() / step), np.ceil(values.max() / step) + 1)
        middle = TwoSlopeNorm(0.0, min(float(levels[0]), -1e-6), max(float(levels[-1]), 1e-6))
        shown = plot.contourf(x, y, values, levels=levels, cmap="RdBu", norm=middle, extend="both")
        plot.contour(x, y, values, levels=levels, colors="#00000060", linewidths=0.5, linestyles="solid")
        plot.contour(x, y, values, levels=[0.0], colors="black", linewidths=2.0)
        plot.set_aspect("equal")
        plot.set_title(title, fontsize=10)
        plot.set_xlabel("xyz".replace("xyz"[axis], "")[0])
        plot.set_ylabel("xyz".replace("xyz"[axis], "")[1])
        if box is not None:
            plot.set_xlim(box[0], box[1])
            plot.set_ylim(box[2], box[3])
        figure.colorbar(shown, ax=plot, shrink=0.85)
    figure.savefig(path)
    slim(path)


def draw_errors(curves: Sequence[Curve], path: Path) -> None:
    """Write Figure 8, both charts."""
    figure, (left, right) = _figure(2, 6.4, 5.0)
    last = max(max(curve.iterations, default=0) for curve in curves)
    for number, curve in enumerate(curves):
        for plot, values in ((left, curve.domain), (right, curve.near)):
            percent = 100 * np.asarray(values)
            if curve.iterations:
                style = {"marker": ".", "linewidth": 1.6, "color": f"C{number}"}
                plot.plot(curve.iterations, percent, label=curve.label, **style)
            else:
                plot.plot([0, last], [percent[0]] * 2, label=curve.label, linestyle="--", color=f"C{number}")
    for plot, title in (
        (left, "(a) over the domain [-2, 2]³"),
        (right, f"(b) within {BAND:g} of the surface"),
    ):
        plot.set_yscale("log")
        plot.set_title(title, fontsize=11)
        plot.set_xlabel("iterations")
        plot.set_ylabel("relative L² error, %")
        plot.grid(alpha=0.3, which="both")
    right.set_xscale("symlog", linthresh=10)
    right.set_xlim(-0.5, 330)
    right.set_xticks([0, 5, 10, 20, 50, 100, 200], ["0", "5", "10", "20", "50", "100", "200"])
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    figure.savefig(path)
    slim(path)


def draw_planar(before: Field, operations: Sequence[tuple[str, Field]], path: Path) -> None:
    """Write a PNG of planar results over the shape they came from, with the lines of their fields."""
    figure, places = _figure(len(operations), 4.4, 4.2)
    x, y = before.grid.axes()
    for (title, after), plot in zip(operations, places, strict=True):
        lines = 0.1 * np.arange(-12, 13)
        plot.contour(x, y, after.values.T, levels=lines, colors="#9db2cc", linewidths=0.5, linestyles="solid")
        for curve in sorted(contour_curves(after), key=_area, reverse=True):
            plot.fill(*curve.T, facecolor="#b7c6d8" if _area(curve) > 0 else "white", edgecolor="none")
        for curve in contour_curves(after):
            plot.plot(*curve.T, color="#203050", linewidth=1.8)
        for curve in contour_curves(before):
            plot.plot(*curve.T, color="#c0504d", linewidth=1.0, linestyle="--")
        plot.set_aspect("equal")
        plot.set_title(title, fontsize=10)
        plot.set_xticks([])
        plot.set_yticks([])
    figure.savefig(path)
    slim(path)


def _area(curve: NDArray[np.float64]) -> float:
    """Area of a closed curve; that of a hole is negative."""
    x, y = curve.T
    return float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2)
