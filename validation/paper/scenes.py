"""Pictures of surfaces, rendered off screen: panels side by side, lit from three sides, cut open if asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cad_implicit.implicit import Implicit
from cad_implicit.mesh import Mesh

Vector = tuple[float, float, float]

BONE, STEEL, CUT = "#e9d8b4", "#a9bbd0", "#b5654f"


@dataclass(frozen=True)
class Panel:
    """One view of a mesh.

    Attributes
    ----------
    mesh : Mesh
    title : str
    view : (3,) tuple
        Direction from the part to the eye; +z is up.
    zoom : float
        1 shows the whole part.
    focus : (3,) tuple, optional
        What is in the middle; that of the part's box by default.
    cut : pair of (3,) tuples, optional
        A point of a plane and its normal: what lies on the normal's side is taken away.
    colour : str
    shape : Implicit, optional
        Gives the normals, for surfaces without sharp edges; by default those of the triangles, split at edges.
    """

    mesh: Mesh
    title: str
    view: Vector = (1.0, -1.6, 1.1)
    zoom: float = 1.0
    focus: Vector | None = None
    cut: tuple[Vector, Vector] | None = None
    colour: str = STEEL
    shape: Implicit | None = None


def render(panels: Sequence[Panel], path: Path, *, size: tuple[int, int] = (620, 520)) -> None:
    """Write a PNG of panels side by side."""
    import pyvista

    pyvista.vtk_verbosity("off")  # without a display VTK complains, then renders off screen
    plotter: Any = pyvista.Plotter(
        off_screen=True,
        shape=(1, len(panels)),
        window_size=(size[0] * len(panels), size[1]),
        border=False,
        lighting="none",
    )
    for column, panel in enumerate(panels):
        plotter.subplot(0, column)
        plotter.set_background("white")
        plotter.enable_anti_aliasing("ssaa")
        _add(plotter, panel)
        low, high = panel.mesh.bounds
        centre = np.asarray(panel.focus if panel.focus is not None else (low + high) / 2)
        eye = np.asarray(panel.view) / np.linalg.norm(panel.view)
        side = np.cross((0, 0, 1), eye)
        key, fill, back = eye + 0.5 * side + (0, 0, 0.7), eye - side, -eye + (0, 0, 1.5)
        for direction, strength in ((key, 0.8), (fill, 0.3), (back, 0.2)):
            place = tuple(centre + 10 * direction)
            light = pyvista.Light(position=place, focal_point=tuple(centre), intensity=strength)
            plotter.add_light(light, only_active=True)
        title = plotter.add_text(panel.title, font_size=10, color="black")
        title.prop.background_color, title.prop.background_opacity = "white", 0.75
        plotter.camera_position = [tuple(centre + eye * 3 * panel.mesh.diagonal), tuple(centre), (0, 0, 1)]
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = 0.45 * panel.mesh.diagonal / panel.zoom
        plotter.camera.clipping_range = (0.1 * panel.mesh.diagonal, 10 * panel.mesh.diagonal)
    plotter.screenshot(str(path))
    plotter.close()
    slim(path)


def slim(path: Path) -> None:
    """Write a PNG anew with 128 colours: a third of the size, and no difference to the eye."""
    from PIL import Image

    with Image.open(path) as picture:
        few = picture.convert("RGB").quantize(128, dither=Image.Dither.NONE)
    few.save(path, optimize=True)


def _add(plotter: Any, panel: Panel) -> None:
    """Add a mesh, whole or cut open, the cut in a colour of its own."""
    import pyvista

    light: dict[str, Any] = {"smooth_shading": True, "ambient": 0.12, "diffuse": 0.85, "specular": 0.12}
    surface = pyvista.PolyData.from_regular_faces(panel.mesh.vertices, panel.mesh.faces)
    if panel.cut is not None:
        point, normal = panel.cut
        away = -np.asarray(normal)
        section = surface.slice(normal=normal, origin=point)
        rest = surface.clip(normal=normal, origin=point, invert=True)
        plotter.add_mesh(rest.compute_normals(feature_angle=40.0, split_vertices=True), color=panel.colour, **light)
        plotter.add_mesh(section, color="#402020", line_width=1.5)
        filled = surface.clip_closed_surface(normal=tuple(away), origin=point)
        cells = filled.compute_normals(cell_normals=True, point_normals=False)
        middles = cells.cell_centers().points
        on_plane = np.abs((middles - np.asarray(point)) @ np.asarray(normal)) < 1e-6 * panel.mesh.diagonal
        lid = cells.extract_cells(np.flatnonzero(on_plane))
        if lid.n_cells:
            plotter.add_mesh(lid, color=CUT, lighting=False)
        return
    if panel.shape is not None:
        slope = -panel.shape.gradient(panel.mesh.vertices)
        surface.point_data["Normals"] = slope / np.maximum(np.linalg.norm(slope, axis=1), 1e-300)[:, None]
        surface.point_data.active_normals_name = "Normals"
        plotter.add_mesh(surface, color=panel.colour, **light)
        return
    plotter.add_mesh(surface.compute_normals(feature_angle=25.0, split_vertices=True), color=panel.colour, **light)
    edges = surface.extract_feature_edges(
        feature_angle=40.0, boundary_edges=False, non_manifold_edges=False, manifold_edges=False
    )
    if edges.n_cells:
        plotter.add_mesh(edges, color="#303840", line_width=1.2)
