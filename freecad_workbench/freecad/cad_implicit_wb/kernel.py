"""FreeCAD's own fillets, chamfers and booleans, tried first if the user wishes; in the child, for they can crash.

"No exception" is not success: a result counts if it is valid, and its volume positive and
changed in the right direction.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import FreeCAD as App
import Part

#: Volumes that differ by less than this share are the same.
_SAME = 1e-9


def exact(shape: Any, operation: str, edges: Mapping[int, float] | None, options: Mapping[str, Any]) -> dict[str, Any]:
    """Answer of FreeCAD's own kernel as a dict, or one with only the ``reason`` why there is none."""
    if shape is None or (edges is None and operation != "boolean"):
        return {"reason": "it takes solids with chosen edges only"}
    try:
        result = _boolean(shape, options) if operation == "boolean" else _blend(shape, operation, edges or {}, options)
    except Exception as error:  # the kernel's own classes
        return {"reason": f"{type(error).__name__}: {error}"}
    reason = _wrong(shape, result, operation, options)
    if reason:
        return {"reason": reason}
    answer = dict.fromkeys(("vertices", "faces", "error", "spacing"))
    return answer | {
        "brep": result.exportBrepToString(),
        "error_bound": result.getTolerance(1),
        "exact_share": 1.0,
        "engine": "FreeCAD's own kernel",
        "warnings": [],
        "volume_before": shape.Volume,
        "volume_after": result.Volume,
    }


def _blend(shape: Any, operation: str, edges: Mapping[int, float], options: Mapping[str, Any]) -> Any:
    """Fillet or chamfer by a Part feature: its edges have radii of their own."""
    document = App.newDocument("kernel", hidden=True, temp=True)
    try:
        base = document.addObject("Part::Feature", "Base")
        base.Shape = shape
        chamfer = operation == "chamfer"
        feature = document.addObject("Part::Chamfer" if chamfer else "Part::Fillet", "Blend")
        feature.Base = base
        feature.Edges = [(n, r, options.get("second", r) if chamfer else r) for n, r in edges.items()]
        document.recompute()
        if not feature.isValid():
            raise ValueError("; ".join(feature.State) or "not done")
        return feature.Shape.copy()
    finally:
        App.closeDocument(document.Name)


def _boolean(shape: Any, options: Mapping[str, Any]) -> Any:
    tool = Part.Shape()
    tool.importBrepFromString(options["tool_brep"])
    function = {"union": shape.fuse, "difference": shape.cut, "intersection": shape.common}[options["kind"]]
    return function(tool).removeSplitter()


def _wrong(shape: Any, result: Any, operation: str, options: Mapping[str, Any]) -> str:
    """Tell what is wrong with a result; nothing if it is sound."""
    if result.isNull() or not result.Solids:
        return "there is no solid"
    if not result.isValid():
        return "the result is invalid"
    if result.Volume <= 0:
        return f"the result's volume is {result.Volume:.6g} mm³"
    if operation == "boolean":
        return ""
    change = result.Volume - shape.Volume
    if abs(change) <= _SAME * shape.Volume:
        return "it changed nothing"
    if operation == "round" and change > 0:
        return f"rounding added {change:.6g} mm³"
    return ""
