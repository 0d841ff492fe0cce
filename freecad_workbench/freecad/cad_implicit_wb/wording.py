"""Words for properties and their choices, in the user's language."""

from __future__ import annotations

from .qt import marked, translate_collected

_LABELS = {
    "Radius": marked("Radius"),
    "Length": marked("Length"),
    "Length2": marked("Second length"),
    "Distance": marked("Distance"),
    "Thickness": marked("Thickness"),
    "Direction": marked("Wall lies"),
    "Wall": marked("Walls of the lattice"),
    "Cell": marked("Cell size"),
    "Skin": marked("Skin"),
    "Kind": marked("Kind"),
    "Tangent": marked("Follow smooth edges"),
    "ExactFirst": marked("FreeCAD's kernel first"),
    "Engine": marked("Engine"),
    "Tolerance": marked("Tolerance"),
    "Spacing": marked("Grid spacing"),
    "Force": marked("Force"),
}

_CHOICES = {
    "exact": marked("exact distance"),
    "reinit": marked("regular grid"),
    "inward": marked("inside"),
    "outward": marked("outside"),
    "both": marked("on both sides"),
    "union": marked("union"),
    "difference": marked("difference"),
    "intersection": marked("intersection"),
}

_STAGES = {
    "waiting": marked("Waiting for another computation …"),
    "starting": marked("Starting the computing process …"),
    "compiling": marked("First use: compiling for this computer (once) …"),
    "read": marked("Reading the part …"),
    "mesh": marked("Meshing …"),
    "contour": marked("Building the surface …"),
    "check": marked("Checking …"),
    "solid": marked("Building the solid …"),
}

#: Stages whose names tell only their makers something.
_ANY_STAGE = marked("Computing …")


def label_of(name: str) -> str:
    """Label of a property."""
    return translate_collected(_LABELS[name])


def tip_of(text: str) -> str:
    """Tooltip of a property, from the description that its feature gives it."""
    return translate_collected(text)


def choice_in_words(key: str) -> str:
    """Name of a choice; lattices are called as they are everywhere."""
    return translate_collected(_CHOICES[key]) if key in _CHOICES else key.replace("_", " ")


def stage_in_words(stage: str) -> str:
    """Return a stage of the computation in words."""
    return translate_collected(_STAGES.get(stage, _ANY_STAGE))
