"""Words for properties and their choices, in the user's language."""

from __future__ import annotations

from .qt import translate, translate_collected

_LABELS = {
    "Radius": translate("Radius"),
    "Length": translate("Length"),
    "Length2": translate("Second length"),
    "Distance": translate("Distance"),
    "Thickness": translate("Thickness"),
    "Direction": translate("Wall lies"),
    "Wall": translate("Walls of the lattice"),
    "Cell": translate("Cell size"),
    "Skin": translate("Skin"),
    "Kind": translate("Kind"),
    "Tangent": translate("Follow smooth edges"),
    "ExactFirst": translate("FreeCAD's kernel first"),
    "Engine": translate("Engine"),
    "Tolerance": translate("Tolerance"),
    "Spacing": translate("Grid spacing"),
    "Force": translate("Force"),
}

_CHOICES = {
    "exact": translate("exact distance"),
    "reinit": translate("regular grid"),
    "inward": translate("inside"),
    "outward": translate("outside"),
    "both": translate("on both sides"),
    "union": translate("union"),
    "difference": translate("difference"),
    "intersection": translate("intersection"),
}

_STAGES = {
    "waiting": translate("Waiting for another computation …"),
    "starting": translate("Starting the computing process …"),
    "compiling": translate("First use: compiling for this computer (once) …"),
    "read": translate("Reading the part …"),
    "mesh": translate("Meshing …"),
    "contour": translate("Building the surface …"),
    "check": translate("Checking …"),
    "solid": translate("Building the solid …"),
}


def label_of(name: str) -> str:
    """Label of a property."""
    return _LABELS[name]


def tip_of(text: str) -> str:
    """Tooltip of a property, from the description that its feature gives it."""
    return translate_collected(text)


def choice_in_words(key: str) -> str:
    """Name of a choice; lattices are called as they are everywhere."""
    return _CHOICES.get(key, key.replace("_", " "))


def stage_in_words(stage: str) -> str:
    """Return a stage of the computation in words."""
    return _STAGES.get(stage, translate("Computing ({}) …").format(stage))
