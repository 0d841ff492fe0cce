"""What the workbench itself draws in the 3-D view: previews, chosen edges and faces, errors in colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from pivy import coin

#: Cosine of the angle up to which neighbouring triangles are shaded as one smooth surface; 0.5 rad as in Part.
_CREASE = 0.5

#: The preview's colour (orange, as what the icons make) and transparency.
_PREVIEW_COLOUR = (0.95, 0.54, 0.12)
_PREVIEW_TRANSPARENCY = 0.35

#: Chosen edges are drawn so wide, in pixels, and to this share of the part's diagonal.
_LINE_WIDTH = 5
_DEFLECTION = 1e-3

#: Colours from no error to the largest: the viridis map at 0, ¼, ½, ¾ and 1. It reads in grey and for the colour-blind.
SCALE = np.array(
    [(0.267, 0.005, 0.329), (0.229, 0.322, 0.546), (0.127, 0.566, 0.551), (0.369, 0.789, 0.383), (0.993, 0.906, 0.144)]
)


#: What is not known is grey.
_UNKNOWN = (0.6, 0.6, 0.6)


def colours_of(values: np.ndarray, largest: float) -> np.ndarray:
    """Colours (N, 3) of values (N,) on the scale from 0 to ``largest``; NaN is grey."""
    known = np.isfinite(values)
    places = np.clip(np.where(known, values, 0) / (largest or 1.0), 0, 1)
    stops = np.linspace(0, 1, len(SCALE))
    colours = np.stack([np.interp(places, stops, SCALE[:, i]) for i in range(3)], axis=1)
    return np.where(known[:, None], colours, _UNKNOWN)


def mesh_node(vertices: np.ndarray, faces: np.ndarray, colours: np.ndarray | None = None) -> coin.SoSeparator:
    """Scene of a mesh: in the preview's colour, or with a colour for each vertex.

    Parameters
    ----------
    vertices : (V, 3) array in mm
    faces : (F, 3) array of vertex numbers
    colours : (V, 3) array, optional
        Red, green and blue from 0 to 1.
    """
    root = coin.SoSeparator()
    hints = coin.SoShapeHints()
    hints.vertexOrdering = coin.SoShapeHints.COUNTERCLOCKWISE
    hints.creaseAngle = _CREASE
    root.addChild(hints)
    material = coin.SoMaterial()
    if colours is None:
        material.diffuseColor = _PREVIEW_COLOUR
        material.transparency = _PREVIEW_TRANSPARENCY
        root.addChild(material)
    else:
        material.diffuseColor.setValues(0, len(colours), _rows(colours))
        binding = coin.SoMaterialBinding()
        binding.value = coin.SoMaterialBinding.PER_VERTEX_INDEXED
        root.addChild(material)
        root.addChild(binding)
    points = coin.SoCoordinate3()
    points.point.setValues(0, len(vertices), _rows(vertices))
    root.addChild(points)
    root.addChild(_faces(faces))
    return root


def _rows(array: np.ndarray) -> Sequence[Sequence[float]]:
    """Return an array as lists: pivy takes those twenty times faster (50 000 points in 1.2 ms)."""
    return np.asarray(array, np.float64).tolist()


def _faces(faces: np.ndarray) -> coin.SoIndexedFaceSet:
    numbers = np.full((len(faces), 4), -1, np.int32)
    numbers[:, :3] = faces
    node = coin.SoIndexedFaceSet()
    node.coordIndex.setValues(0, numbers.size, numbers.ravel().tolist())
    return node


class Overlay:
    """Things over the 3-D view that no document knows of; clicks go through them to the part.

    Parameters
    ----------
    view : FreeCAD's 3-D view
    placement : FreeCAD.Placement
        From the frame of what is drawn to the document's.
    """

    def __init__(self, view: Any, placement: Any) -> None:
        self._scene = view.getSceneGraph()
        self._root = coin.SoSeparator()
        unpicked = coin.SoPickStyle()
        unpicked.style = coin.SoPickStyle.UNPICKABLE
        self._root.addChild(unpicked)
        frame = coin.SoMatrixTransform()
        frame.matrix.setValue(*placement.toMatrix().transposed().A)  # Coin multiplies from the left
        self._root.addChild(frame)
        self._preview, self._marks = coin.SoSeparator(), coin.SoSeparator()
        self._root.addChild(self._preview)
        self._root.addChild(self._marks)
        self._scene.addChild(self._root)

    @property
    def previewed(self) -> bool:
        """Whether a preview is shown."""
        return self._preview.getNumChildren() > 0

    def preview(self, vertices: np.ndarray, faces: np.ndarray, colours: np.ndarray | None = None) -> None:
        """Show a mesh in place of the one before, in the preview's colour or with one for each vertex."""
        self.hide_preview()
        self._preview.addChild(mesh_node(vertices, faces, colours))

    def hide_preview(self) -> None:
        """Show no mesh."""
        self._preview.removeAllChildren()

    def mark(self, shape: Any, names: Sequence[str]) -> None:
        """Draw chosen edges and faces of a shape in colour, in place of those before."""
        self._marks.removeAllChildren()
        for name in names:
            element = shape.getElement(name)
            if name.startswith("Edge"):
                self._marks.addChild(_line(element.discretize(Deflection=_DEFLECTION * shape.BoundBox.DiagonalLength)))
            else:
                points, triangles = element.tessellate(_DEFLECTION * shape.BoundBox.DiagonalLength)
                self._marks.addChild(mesh_node(np.array([tuple(p) for p in points]), np.array(triangles)))

    def clear(self) -> None:
        """Take everything out of the view."""
        if self._scene.findChild(self._root) >= 0:
            self._scene.removeChild(self._root)


def _line(points: Sequence[Any]) -> coin.SoSeparator:
    root = coin.SoSeparator()
    colour = coin.SoBaseColor()
    colour.rgb = _PREVIEW_COLOUR
    unlit = coin.SoLightModel()
    unlit.model = coin.SoLightModel.BASE_COLOR
    style = coin.SoDrawStyle()
    style.lineWidth = _LINE_WIDTH
    places = coin.SoCoordinate3()
    places.point.setValues(0, len(points), [tuple(p) for p in points])
    for node in (colour, unlit, style, places, coin.SoLineSet()):
        root.addChild(node)
    return root
