"""The operations as the user meets them: names, tooltips, icons, which elements and values they take."""

from __future__ import annotations

from dataclasses import dataclass

from .qt import translate


@dataclass(frozen=True)
class Operation:
    """One operation.

    Attributes
    ----------
    name, tip : str
        Translated.
    icon : str
        ``implicit_<icon>.svg``.
    values : tuple of str
        Properties that the panel asks for, beside those of :data:`ACCURACY`.
    elements : tuple of str
        Kinds of elements that can be chosen: "Edge" (a face stands for its edges), "Face".
    radii : bool
        Whether every edge may have its own radius.
    """

    name: str
    tip: str
    icon: str
    values: tuple[str, ...]
    elements: tuple[str, ...] = ()
    radii: bool = False


#: Properties behind the arrow of the panel, as far as a feature has them.
ACCURACY = ("Tolerance", "Spacing", "Engine", "Force")

OPERATIONS = {
    "fillet": Operation(
        translate("Fillet"),
        translate("Fill concave edges, or those that you choose, with a rolling ball's surface"),
        "fillet",
        ("Radius", "Tangent", "ExactFirst"),
        ("Edge", "Face"),
        radii=True,
    ),
    "round": Operation(
        translate("Round"),
        translate("Round convex edges, or those that you choose"),
        "round",
        ("Radius", "Tangent", "ExactFirst"),
        ("Edge", "Face"),
        radii=True,
    ),
    "smooth": Operation(
        translate("Smooth"),
        translate("Fillet and round: concave and convex edges"),
        "smooth",
        ("Radius", "Tangent", "ExactFirst"),
        ("Edge", "Face"),
        radii=True,
    ),
    "chamfer": Operation(
        translate("Chamfer"),
        translate("Cut chosen edges off by a plane, or fill them"),
        "chamfer",
        ("Length", "Length2", "Tangent", "ExactFirst"),
        ("Edge", "Face"),
    ),
    "offset": Operation(translate("Offset"), translate("Grow or shrink a part by a distance"), "offset", ("Distance",)),
    "shell": Operation(
        translate("Shell"),
        translate("Hollow a part out, with faces left open"),
        "shell",
        ("Thickness", "Direction"),
        ("Face",),
    ),
    "infill": Operation(
        translate("Infill"),
        translate("Fill a part with a lattice behind a skin"),
        "infill",
        ("Wall", "Cell", "Skin", "Kind"),
    ),
    "boolean": Operation(
        translate("Boolean"),
        translate("Unite, cut or intersect two parts or meshes, with a fillet between them"),
        "boolean",
        ("Kind", "Radius", "ExactFirst"),
    ),
}
