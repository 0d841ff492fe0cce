"""Adding features to a document, and making solids of meshes and meshes of solids of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from . import properties
from .feature import CLASSES, is_mesh_feature


def make(
    document: Any,
    operation: str,
    source: Any,
    names: Sequence[str] = (),
    *,
    tool: Any = None,
    result: str = "Solid",
    own_radii: Mapping[str, float] | None = None,
    **values: Any,
) -> Any:
    """Add a feature to a document; nothing is computed until the document is.

    Parameters
    ----------
    document : App.Document
    operation : str
        "fillet", "round", "smooth", "chamfer", "offset", "shell", "infill" or "boolean".
    source, tool : App.DocumentObject
    names : sequence of str
        Chosen edges or faces of the source, ``Edge3``.
    result : "Solid" or "Mesh"
    own_radii : mapping, optional
        Radii in mm by the name of the edge.
    **values
        Other properties, ``Radius=2``.
    """
    proxy = CLASSES[operation]
    obj = document.addObject(f"{'Mesh' if result == 'Mesh' else 'Part'}::FeaturePython", proxy.__name__)
    proxy(obj)
    obj.Result = result
    obj.Base = (source, [])
    if names:
        obj.Proxy.set_elements(obj, names, own_radii)
    if tool is not None:
        obj.Tool = tool
    for name, value in values.items():
        setattr(obj, name, value)
    group = source.getParentGeoFeatureGroup()
    if group is not None and group.isDerivedFrom("App::Part"):
        group.addObject(obj)
    return obj


def retyped(obj: Any) -> Any:
    """Give a feature of the type that its property Result asks for: itself, or another in its place.

    Those that use the old one use the new one then, but for expressions.
    """
    wanted = obj.Result
    if (wanted == "Mesh") == is_mesh_feature(obj):
        return obj
    proxy = obj.Proxy
    inputs = properties.inputs_of(proxy.operation) - {"Base", "OwnRadii", "Result"}
    values = {name: getattr(obj, name) for name in inputs}
    new = make(obj.Document, proxy.operation, proxy.source(obj), result=wanted, **values)
    proxy._store(new, proxy.elements(obj), proxy.own_radii(obj), obj.References)
    for user in obj.InList:
        _redirect(user, obj, new)
    label = obj.Label
    obj.Document.removeObject(obj.Name)
    new.Label = label
    return new


def _redirect(user: Any, old: Any, new: Any) -> None:
    """Let links of an object to another point to a third."""
    for name in user.PropertiesList:
        value = getattr(user, name)
        kind = user.getTypeIdOfProperty(name)
        if kind == "App::PropertyLink" and value is old:
            setattr(user, name, new)
        elif kind == "App::PropertyLinkSub" and value and value[0] is old:
            setattr(user, name, (new, []))
        elif kind == "App::PropertyLinkList" and old in value:
            setattr(user, name, [new if item is old else item for item in value])
