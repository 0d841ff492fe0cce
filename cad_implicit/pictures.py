"""Meshes in a window or as pictures, rendered off screen (needs the extra ``reports``)."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from cad_implicit.errors import CadImplicitError
from cad_implicit.mesh import Mesh

#: Seen from the front right, from above: the view in which mechanical drawings show a part.
_VIEW = (1.0, -1.6, 1.1)
_PART_COLOUR = "#b9c4d0"
_FEATURE_DEGREES = 25.0
#: Width and height of a window in pixels.
_WINDOW = (1000, 800)


def render(
    meshes: Sequence[Mesh],
    titles: Sequence[str],
    path: Path,
    *,
    view: Sequence[float] = _VIEW,
    zoom: float = 1.0,
    focus: Sequence[float] | None = None,
    size: tuple[int, int] = (700, 560),
) -> None:
    """Write a PNG of meshes side by side, all from the same direction and at the same scale.

    Parameters
    ----------
    meshes : sequence of Mesh
    titles : sequence of str
        One for each mesh.
    path : Path
        The PNG.
    view : (3,) sequence
        Direction from the part to the eye; +z is up.
    zoom, focus : float and (3,) sequence, optional
        Close-up of a place in mm.
    size : (int, int)
        Width and height in pixels of each picture.

    Raises
    ------
    CadImplicitError
        If pyvista is not installed.
    """
    plotter = _plotter(meshes, titles, view=view, zoom=zoom, focus=focus, size=size, off_screen=True)
    plotter.screenshot(str(path))
    plotter.close()


def show(mesh: Mesh, screenshot: str | Path | None = None) -> None:
    """Open a window with a mesh, or render it to a PNG; see :meth:`cad_implicit.Mesh.show`."""
    if screenshot is not None:
        render([mesh], [_title(mesh)], Path(screenshot))
        return
    plotter = _plotter([mesh], [_title(mesh)], size=_WINDOW, off_screen=False)
    plotter.show()


def png(mesh: Mesh) -> bytes | None:
    """Picture of a mesh as a PNG; None if pyvista is not installed."""
    if find_spec("pyvista") is None:
        return None
    with TemporaryDirectory() as folder:
        path = Path(folder, "mesh.png")
        render([mesh], [_title(mesh)], path)
        return path.read_bytes()


def _title(mesh: Mesh) -> str:
    return str(mesh.source.get("name", ""))


def _plotter(
    meshes: Sequence[Mesh],
    titles: Sequence[str],
    *,
    view: Sequence[float] = _VIEW,
    zoom: float = 1.0,
    focus: Sequence[float] | None = None,
    size: tuple[int, int],
    off_screen: bool,
) -> Any:
    """Scene of meshes side by side, as :func:`render` shows them."""
    try:
        import pyvista
    except ImportError:
        raise CadImplicitError('pictures need pyvista: pip install "cad_implicit[reports]"') from None
    pyvista.vtk_verbosity("off")  # without a display VTK complains, then renders off screen
    plotter: Any = pyvista.Plotter(
        off_screen=off_screen, shape=(1, len(meshes)), window_size=(size[0] * len(meshes), size[1]), border=False
    )
    for column, (mesh, title) in enumerate(zip(meshes, titles, strict=True)):
        plotter.subplot(0, column)
        plotter.set_background("white")
        plotter.enable_anti_aliasing("ssaa")
        surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)
        shaded = surface.compute_normals(feature_angle=_FEATURE_DEGREES, split_vertices=True)
        plotter.add_mesh(
            shaded, color=mesh.source.get("colour", _PART_COLOUR), smooth_shading=True, specular=0.25, specular_power=12
        )
        edges = surface.extract_feature_edges(
            feature_angle=40.0, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
        )
        if edges.n_cells:
            plotter.add_mesh(edges, color="#303840", line_width=1.2)
        plotter.add_text(title, font_size=11, color="black")
        centre = np.asarray(focus if focus is not None else meshes[0].bounds.mean(axis=0))
        eye = centre + np.asarray(view) / np.linalg.norm(view) * 3 * meshes[0].diagonal
        plotter.camera_position = [tuple(eye), tuple(centre), (0, 0, 1)]
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = 0.48 * meshes[0].diagonal / zoom
    return plotter
