"""The charts of a validation as PNGs: histogram, slices, convergence by matplotlib, the part in 3-D by pyvista."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from .measuring import REGIONS
from .page import cut, place_of_slices, scale_of_colours
from .validation import Validation

#: Dots per inch of the charts, and pixels of the picture in 3-D.
_DPI = 120
_WINDOW = (1100, 900)


def write_pictures(result: Validation, folder: Path) -> list[Path]:
    """Write ``histogram.png``, ``slices.png``, ``convergence.png`` and ``solids.png`` into a folder, as far as known.

    Nothing without a result; what matplotlib and pyvista draw only where they are installed.
    """
    if result.outcome is None or result.measured is None:
        return []
    paths = []
    if find_spec("matplotlib") is not None:
        drawn = {"histogram.png": _histogram, "slices.png": _slices}
        if result.levels:
            drawn["convergence.png"] = _convergence
        for name, draw in drawn.items():
            draw(result).savefig(folder / name, dpi=_DPI)
            paths.append(folder / name)
    if find_spec("pyvista") is not None:
        _solids(result, folder / "solids.png")
        paths.append(folder / "solids.png")
    return paths


def _figure(columns: int, width: float) -> tuple[Any, Any]:
    """Figure without a window."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, 4.0), layout="constrained")
    return figure, np.atleast_1d(figure.subplots(1, columns))


def _histogram(result: Validation) -> Any:
    assert result.measured is not None
    figure, (axes,) = _figure(1, 8.0)
    for number, region in enumerate(REGIONS):
        own = result.measured.errors[result.measured.regions == number]
        if len(own):
            axes.hist(own, bins=80, alpha=0.6, label=region)
    axes.set(xlabel="error in mm", ylabel="samples", yscale="log")
    axes.legend()
    return figure


def _slices(result: Validation) -> Any:
    assert result.outcome is not None
    assert result.measured is not None
    from matplotlib.collections import LineCollection

    place = place_of_slices(result)
    figure, all_axes = _figure(3, 13.0)
    exact = result.measured.exact
    others = [(result.outcome.mesh, "result", "#c2410c")]
    others.append((exact or result.outcome.before, "exact kernel" if exact else "part before", "#1d4ed8"))
    for axis, axes in enumerate(all_axes):
        across = [a for a in range(3) if a != axis]
        for mesh, name, colour in others:
            ends = cut(mesh, axis, float(place[axis]))[:, :, across]
            axes.add_collection(LineCollection(list(ends), colors=colour, linewidths=0.9, label=name))
        axes.set(title=f"{'xyz'[axis]} = {place[axis]:.4g} mm", xlabel=f"{'xyz'[across[0]]} in mm")
        axes.set_aspect("equal")
        axes.autoscale_view()
    all_axes[0].legend(loc="upper left")
    return figure


def _convergence(result: Validation) -> Any:
    figure, (axes,) = _figure(1, 8.0)
    for engine in dict.fromkeys(level.engine for level in result.levels):
        own = [level for level in result.levels if level.engine == engine]
        h, order = [level.spacing for level in own], result.order.get(engine)
        name = engine if order is None else f"{engine}, order {order:.2f}"
        (line,) = axes.loglog(h, [level.max for level in own], "o-", label=f"{name}: max")
        axes.loglog(h, [level.rms for level in own], "o:", color=line.get_color(), label=f"{engine}: RMS")
    axes.set(xlabel="spacing in mm", ylabel="error in mm")
    axes.legend()
    return figure


def _solids(result: Validation, path: Path) -> None:
    import pyvista

    assert result.outcome is not None
    assert result.measured is not None
    mesh, errors = result.outcome.mesh, result.measured.at_vertices
    top = scale_of_colours(errors)
    pyvista.vtk_verbosity("off")  # without a display VTK complains, then renders off screen
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=_WINDOW, border=False)
    plotter.set_background("white")
    surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)
    surface.point_data["error in mm"] = errors
    bar = {"title": "error in mm", "color": "black", "fmt": "%.2g", "vertical": True, "position_x": 0.88}
    plotter.add_mesh(
        surface, scalars="error in mm", cmap="RdBu_r", clim=(-top, top), nan_color="#9aa3ad", scalar_bar_args=bar
    )
    plotter.view_vector((1.0, -1.6, 1.1), (0, 0, 1))
    plotter.enable_parallel_projection()
    plotter.reset_camera()
    plotter.screenshot(str(path))
    plotter.close()
