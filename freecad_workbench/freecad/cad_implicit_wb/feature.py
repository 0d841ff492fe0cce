"""Parametric features: what their properties ask for is computed when FreeCAD recomputes them, never on load.

A feature works on its source in the source's own frame and is placed with it, so that moving the source computes
nothing. It lies beside its source in the tree, never within a body of PartDesign: a body as the source gives its tip.
Solids are ``Part::FeaturePython``, meshes ``Mesh::FeaturePython``;
:func:`~making.retyped` makes one of the other. What fails
marks the feature, and its last good result stays.

Files store ``module.Class`` of the proxies: never rename them. Nothing here imports the GUI; it sets :data:`waiting`.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import FreeCAD as App

from . import client, estimates, preferences, properties, references, sources
from .errors import WorkbenchError

#: Version of the properties; features of later ones are left alone.
SCHEMA_VERSION = 1

#: Called as ``waiting(task, label)`` while a feature is recomputed, to wait until the task is done; the GUI sets it, so
#: that its window lives on. By default this thread sleeps.
waiting: Callable[[client.Task, str], None] | None = None

#: Answers that somebody has already, by :func:`client.key` of their request.
_answers: OrderedDict[str, client.Answer] = OrderedDict()
_KEPT = 4


class Operation:
    """Proxy of a feature; what its classes do follows from their properties.

    Attributes
    ----------
    operation : str
        What a Request names it.
    elements_kind : str
        "Edge" or "Face" if some can be chosen, else "".
    """

    operation = ""
    elements_kind = ""

    def __init__(self, obj: Any) -> None:
        self._busy = True
        properties.add(obj, self.operation)
        obj.SchemaVersion = SCHEMA_VERSION
        obj.Proxy = self
        self._busy = False

    def source(self, obj: Any) -> Any:
        """Give the source; None if there is none."""
        return obj.Base[0] if obj.Base else None

    def elements(self, obj: Any) -> list[str]:
        """Names of the chosen edges or faces."""
        return [name for name in obj.Base[1] if name] if obj.Base else []

    def own_radii(self, obj: Any) -> dict[str, float]:
        """Radii in mm of the edges that have one of their own."""
        return {name: r for name, r in zip(self.elements(obj), obj.OwnRadii, strict=False) if r > 0}

    def set_elements(self, obj: Any, names: Sequence[str], own_radii: Mapping[str, float] | None = None) -> None:
        """Choose edges or faces of the source, as they are now.

        Raises
        ------
        BrokenReferenceError
            If the source has no such element.
        WorkbenchError
            If it has no shape.
        """
        self._store(obj, list(names), own_radii or {}, self._described(obj, names))

    def request(self, obj: Any, *, draft: bool = False, error: bool = False) -> client.Request:
        """Give what is to be computed: the result, a coarse mesh for a preview, or a mesh with its errors.

        Raises
        ------
        WorkbenchError
            If the source has nothing to work on, chosen edges are lost, or a preview would take long.
        """
        request = self._request(obj, draft, error)[0]
        seconds = client.estimate(request)["seconds"] if draft else 0.0
        if seconds > estimates.DRAFT_SECONDS:
            raise WorkbenchError(f"no preview: on a source of this size it would take about {seconds:.0f} s")
        return request

    def execute(self, obj: Any) -> None:
        """Compute, unless nothing changed but the place. FreeCAD marks the feature if it raises."""
        if obj.SchemaVersion > SCHEMA_VERSION:
            raise WorkbenchError(
                f"{obj.Label} was made by a later version of this workbench (schema {obj.SchemaVersion}, known is "
                f"{SCHEMA_VERSION}): it is shown as it was; update the workbench to change it"
            )
        request, placement = self._request(obj, False, False)
        name = client.key(request)
        if name != obj.Fingerprint or _is_empty(obj):
            self._take(obj, answered(request, obj.Label))
            obj.Fingerprint = name
        obj.Placement = placement
        obj.Stale = False

    def onChanged(self, obj: Any, name: str) -> None:  # noqa: N802 (FreeCAD's name)
        """Note that a result is stale, and where newly chosen elements are."""
        if getattr(self, "_busy", True) or "Restore" in obj.State or getattr(obj, "SchemaVersion", 0) > SCHEMA_VERSION:
            return
        if name in properties.inputs_of(self.operation) and hasattr(obj, "Stale"):
            obj.Stale = True
        # recomputes find elements again; undo and redo bring what was stored of them, too
        if name == "Base" and not (obj.Document.Recomputing or obj.Document.Transacting):
            self._busy = True
            names = self.elements(obj)
            before = [references.Element.from_text(text).name for text in obj.References]
            radii = dict(zip(before, obj.OwnRadii, strict=False))
            obj.OwnRadii = [radii.get(name, 0.0) for name in names]
            try:
                obj.References = self._described(obj, names)
            except WorkbenchError:  # no shape yet: they are described when it is computed first
                obj.References = []
            finally:
                self._busy = False

    def onDocumentRestored(self, obj: Any) -> None:  # noqa: N802 (FreeCAD's name)
        """Go on after loading: nothing is computed; what was added to the properties since is added."""
        self._busy = True
        if obj.SchemaVersion <= SCHEMA_VERSION:
            properties.add(obj, self.operation)
            source = self.source(obj)
            if source is not None and "Touched" in source.State:
                obj.Stale = True
        self._busy = False

    def dumps(self) -> None:
        """Store nothing: all is in the properties."""

    def loads(self, _state: None) -> None:
        """Restore nothing."""

    __getstate__ = dumps
    __setstate__ = loads

    def amount(self, obj: Any) -> float:
        """Amount of a Request in mm."""
        return float(getattr(obj, properties.OPERATIONS[self.operation][0].name))

    def options(self, obj: Any) -> dict[str, Any]:
        """Give options that only this operation has."""
        return {}

    def _request(self, obj: Any, draft: bool, error: bool) -> tuple[client.Request, Any]:
        """Request and placement of the source."""
        source = self.source(obj)
        if source is None:
            raise WorkbenchError(f"{obj.Label} has no source any more; choose one in its property Base")
        options: dict[str, Any] = {
            "spacing": float(obj.Spacing) or None,
            "tolerance": float(obj.Tolerance) or None,
            "engine": getattr(obj, "Engine", None),
            "force": obj.Force or None,
            "result": "mesh" if draft or error or is_mesh_feature(obj) else "solid",
            "draft": draft or None,
            "error": error or None,
            "exact_first": (getattr(obj, "ExactFirst", False) and not (draft or error)) or None,
        }
        options |= self.options(obj) | preferences.limits()
        if sources.is_mesh(source):
            if self.elements(obj):
                raise WorkbenchError(f"{source.Label} is a mesh: it has no edges to choose; choose all of it")
            arrays, placement = sources.located_mesh(source)
            return client.Request(None, arrays, self.operation, self.amount(obj), None, options), placement
        shape, placement, brep = sources.texts.of(source)
        names = self._found(obj, shape, source.Label)
        edges = None
        if names and self.elements_kind == "Edge":
            edges = self._edges(obj, shape, names)
            options["tangent"] = obj.Tangent
        elif names:
            options["open"] = [references.split(name)[1] for name in names]
        return client.Request(brep, None, self.operation, self.amount(obj), edges, options), placement

    def _found(self, obj: Any, shape: Any, label: str) -> list[str]:
        """Names that the chosen elements have now; they are stored where they changed."""
        names = self.elements(obj)
        if not names:
            return []
        old = [references.Element.from_text(text) for text in obj.References]
        if len(old) != len(names):
            old = references.describe(shape, names)
        found = references.found(old, shape, label)
        radii = dict(zip(found, obj.OwnRadii, strict=False))
        if found != names or len(obj.References) != len(found):
            texts = [element.to_text() for element in references.describe(shape, found)]
            self._store(obj, found, radii, texts)
        return found

    def _edges(self, obj: Any, shape: Any, names: Sequence[str]) -> dict[int, float]:
        """Radii in mm by numbers of edges; a face stands for its edges."""
        own, edges, all_edges = self.own_radii(obj), {}, shape.Edges
        for name in names:
            kind, number = references.split(name)
            radius = own.get(name, self.amount(obj))
            if kind == "Edge":
                edges[number] = radius
            else:
                border = shape.Faces[number - 1].Edges
                for n, edge in enumerate(all_edges):
                    if any(edge.isSame(other) for other in border):
                        edges.setdefault(n + 1, radius)
        return edges

    def _described(self, obj: Any, names: Sequence[str]) -> list[str]:
        source = self.source(obj)
        if source is None or not names:
            return []
        return [element.to_text() for element in references.describe(sources.located(source)[0], names)]

    def _store(self, obj: Any, names: list[str], own_radii: Mapping[str, float], texts: list[str]) -> None:
        self._busy = True
        try:
            obj.Base = (self.source(obj), names)
            obj.OwnRadii = [float(own_radii.get(name, 0.0)) for name in names]
            obj.References = texts
            obj.Stale = True
        finally:
            self._busy = False

    def _take(self, obj: Any, answer: client.Answer) -> None:
        """Show an answer."""
        if is_mesh_feature(obj):
            obj.Mesh = sources.mesh_of(answer.vertices, answer.faces)
        else:
            assert answer.brep is not None  # a solid was asked for
            obj.Shape = sources.shape_of(answer.brep)
        obj.ErrorBound = -1.0 if answer.error_bound is None else answer.error_bound
        obj.ExactShare, obj.EngineUsed, obj.Seconds = answer.exact_share, answer.engine, answer.seconds
        obj.Warnings = answer.warnings
        for note in answer.warnings:
            App.Console.PrintWarning(f"{obj.Label}: {note}\n")


class Fillet(Operation):
    """Fillets: chosen edges, convex or concave; without any, all concave places by a ball."""

    operation, elements_kind = "fillet", "Edge"


class Round(Operation):
    """Rounds: chosen convex edges; without any, all convex places by a ball."""

    operation, elements_kind = "round", "Edge"


class Smooth(Operation):
    """Rounds and fillets: chosen edges; without any, everything, by a ball."""

    operation, elements_kind = "smooth", "Edge"


class Chamfer(Operation):
    """Chamfers of chosen edges; without any, of all."""

    operation, elements_kind = "chamfer", "Edge"

    def options(self, obj: Any) -> dict[str, Any]:
        return {"second": float(obj.Length2) or None}


class Offset(Operation):
    """Grows or shrinks."""

    operation = "offset"


class Shell(Operation):
    """Carves out to a wall, open at chosen faces."""

    operation, elements_kind = "shell", "Face"

    def options(self, obj: Any) -> dict[str, Any]:
        return {"side": obj.Direction}


class Infill(Operation):
    """Carves out to a skin and fills with a lattice."""

    operation = "infill"

    def options(self, obj: Any) -> dict[str, Any]:
        return {"cell": float(obj.Cell), "kind": obj.Kind, "skin": float(obj.Skin)}


class Boolean(Operation):
    """Unites two objects, cuts one from the other, or keeps what they share; with fillets if there is a radius."""

    operation = "boolean"

    def options(self, obj: Any) -> dict[str, Any]:
        """Give the second object in the frame of the first."""
        tool, source = obj.Tool, self.source(obj)
        if tool is None:
            raise WorkbenchError(f"{obj.Label} has no second object; choose one in its property Tool")
        frame = (sources.located_mesh if sources.is_mesh(source) else sources.located)(source)[1].inverse()
        if sources.is_mesh(tool):
            (vertices, faces), placement = sources.located_mesh(tool)
            return {"kind": obj.Kind, "tool_mesh": (sources.moved(vertices, frame.multiply(placement)), faces)}
        shape, placement = sources.located(tool)
        shape.Placement = frame.multiply(placement)
        return {"kind": obj.Kind, "tool_brep": shape.exportBrepToString()}


CLASSES: dict[str, type[Operation]] = {
    c.operation: c for c in (Fillet, Round, Smooth, Chamfer, Offset, Shell, Infill, Boolean)
}


def is_mesh_feature(obj: Any) -> bool:
    """Whether a feature gives a mesh."""
    return bool(obj.isDerivedFrom("Mesh::Feature"))


def remember(request: client.Request, answer: client.Answer) -> None:
    """Keep an answer that was computed already, so that a feature that asks the same takes it."""
    _answers[client.key(request)] = answer
    while len(_answers) > _KEPT:
        _answers.popitem(last=False)


def answered(request: client.Request, label: str) -> client.Answer:
    """Give the answer to a request: it is there already, or is waited for.

    Raises
    ------
    WorkbenchError
        As :meth:`client.Task.result`.
    """
    name = client.key(request)
    if name in _answers:
        return _answers[name]
    task = client.start(request)
    if waiting is not None:
        waiting(task, label)
    task.wait()
    return task.result()


def _is_empty(obj: Any) -> bool:
    return not obj.Mesh.CountFacets if is_mesh_feature(obj) else obj.Shape.isNull()
