"""Products of STEP files: parts with names, colours and places, in the kernel's document for them (XCAF)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.Quantity import Quantity_Color, Quantity_ColorRGBA, Quantity_TOC_sRGB
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFDoc import XCAFDoc_ColorGen, XCAFDoc_ColorSurf, XCAFDoc_ColorTool, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from .occ import Shape

try:  # OCP 7.9
    from OCP.TDF import TDF_LabelSequence as _Labels
except ImportError:  # OCP 8.0
    from OCP.collections import Sequence_TDF_Label as _Labels

#: Red, green and blue in sRGB, from 0 to 1.
Colour = tuple[float, float, float]

#: What the kernel calls products that have no name.
_NAMELESS = ("Open CASCADE", "SOLID", "COMPOUND", "SHELL")


@dataclass(frozen=True, eq=False)
class Part:
    """One part of a product, in its own coordinates.

    Attributes
    ----------
    label : TDF_Label
    name : str
        Empty if it has none.
    colour : Colour or None
        None if it has none, or several.
    shape : TopoDS_Shape
    uses : int
        In how many places it is.
    """

    label: Any
    name: str
    colour: Colour | None
    shape: Shape
    uses: int


class Product:
    """What a file is about: one shape, and the tree of parts that it consists of.

    Parameters
    ----------
    shape : TopoDS_Shape or None
        All parts in their places.
    document : TDocStd_Document, optional
        Absent for BREP files, which know no parts.
    """

    def __init__(self, shape: Shape | None, document: Any = None) -> None:
        self.shape, self.document = shape, document

    def parts(self) -> list[Part]:
        """Distinct parts, in the order of the tree."""
        if self.document is None:
            return []
        found: dict[str, list[Any]] = {}
        for label in self._leaves(_free(self._tool)):
            found.setdefault(_entry(label), []).append(label)
        return [
            Part(own[0], _name(own[0]), _colour(own[0]), self._tool.GetShape_s(own[0]), len(own))
            for own in found.values()
        ]

    def replace(self, part: Part, shape: Shape) -> None:
        """Give a part another shape, in all its places; colours of single faces become one colour, or none."""
        for label in _sequence(XCAFDoc_ShapeTool.GetSubShapes_s, part.label):
            label.ForgetAllAttributes(True)
        self._tool.SetShape(part.label, shape)
        _paint(self.document, part.label, part.colour)

    def finish(self) -> None:
        """Bring all places up to date after parts were replaced."""
        self._tool.UpdateAssemblies()

    @property
    def _tool(self) -> Any:
        return XCAFDoc_DocumentTool.ShapeTool_s(self.document.Main())

    def _leaves(self, labels: list[Any]) -> Iterator[Any]:
        for label in labels:
            if XCAFDoc_ShapeTool.IsReference_s(label):
                target = TDF_Label()
                XCAFDoc_ShapeTool.GetReferredShape_s(label, target)
                yield from self._leaves([target])
            elif XCAFDoc_ShapeTool.IsAssembly_s(label):
                yield from self._leaves(_sequence(XCAFDoc_ShapeTool.GetComponents_s, label))
            else:
                yield label


def new_document() -> Any:
    """Empty document, in mm."""
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    XCAFDoc_DocumentTool.SetLengthUnit_s(document, 1e-3)
    return document


def single(shape: Shape, name: str, colour: Colour | None) -> Product:
    """Product of one part."""
    document = new_document()
    place = shape.Location()
    if not place.IsIdentity():  # else it would become an assembly of one part
        shape = BRepBuilderAPI_Transform(shape.Located(TopLoc_Location()), place.Transformation(), True).Shape()
    label = XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).AddShape(shape, False)
    TDataStd_Name.Set_s(label, TCollection_ExtendedString(name, True))  # UTF-8
    _paint(document, label, colour)
    return Product(shape, document)


def _paint(document: Any, label: Any, colour: Colour | None) -> None:
    if colour is not None:
        tool = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
        tool.SetColor(label, Quantity_Color(*colour, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)


def _free(tool: Any) -> list[Any]:
    labels = _Labels()
    tool.GetFreeShapes(labels)
    return [labels.Value(number) for number in range(1, labels.Length() + 1)]


def _sequence(function: Any, label: Any) -> list[Any]:
    labels = _Labels()
    function(label, labels)
    return [labels.Value(number) for number in range(1, labels.Length() + 1)]


def _entry(label: Any) -> str:
    """Address of a label in its document."""
    tags = []
    while not label.IsRoot():
        tags.append(str(label.Tag()))
        label = label.Father()
    return ":".join(tags)


def _name(label: Any) -> str:
    attribute = TDataStd_Name()
    if not label.FindAttribute(TDataStd_Name.GetID_s(), attribute):
        return ""
    name = str(attribute.Get().ToExtString())
    return "" if name.startswith(_NAMELESS) else name


def _colour(label: Any) -> Colour | None:
    """Colour of a part: its own, or the one that all its coloured faces and solids share."""
    own = _own_colour(label)
    if own is not None:
        return own
    below = {_own_colour(sub) for sub in _sequence(XCAFDoc_ShapeTool.GetSubShapes_s, label)} - {None}
    return below.pop() if len(below) == 1 else None


def _own_colour(label: Any) -> Colour | None:
    found = Quantity_ColorRGBA()
    for kind in (XCAFDoc_ColorSurf, XCAFDoc_ColorGen):
        if XCAFDoc_ColorTool.GetColor_s(label, kind, found):
            red, green, blue = found.GetRGB().Values(Quantity_TOC_sRGB)
            return (round(red, 6), round(green, 6), round(blue, 6))
    return None
