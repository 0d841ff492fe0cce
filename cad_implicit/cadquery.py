"""CadQuery plugin: ``import cad_implicit.cadquery`` gives ``Workplane`` fillets that do not fail, shells and infills.

What is on the stack tells where: edges; faces for their edges (for a shell, faces to open); vertices for the edges that
end there. A solid on the stack means all of it, by a ball. The result is a solid in the chain, as with
``Workplane.fillet``. :mod:`cad_implicit.cadquery_shapes` has the same as functions of shapes, and patches nothing.

::

    import cadquery as cq
    import cad_implicit.cadquery

    part = cq.Workplane().box(50, 80, 10).edges("|Z").implicitFillet(25)
    part.implicit.error_bound
"""

from __future__ import annotations

from typing import Any, Unpack

from . import cadquery_shapes as shapes
from .cadquery_shapes import BlendOptions, Options, Provenance, Radii, cq
from .errors import NoSolidError, SelectorError

#: Shapes that choose places of a part.
_PLACES = (cq.Edge, cq.Wire, cq.Face, cq.Vertex)

#: Shapes that hold solids.
_BODIES = (cq.Solid, cq.Compound)


def implicitFillet(self: cq.Workplane, radius: Radii, **options: Unpack[BlendOptions]) -> cq.Workplane:  # noqa: N802
    """Fillet the edges on the stack, or with a solid there all its concave edges by a ball.

    See :func:`cad_implicit.cadquery_shapes.implicitFillet`.
    """
    return _applied(self, shapes.implicitFillet, radius, edges=_places(self, "implicitFillet"), **options)


def implicitRound(self: cq.Workplane, radius: Radii, **options: Unpack[BlendOptions]) -> cq.Workplane:  # noqa: N802
    """Round the convex edges on the stack, or with a solid there all its convex edges by a ball.

    See :func:`cad_implicit.cadquery_shapes.implicitRound`.
    """
    return _applied(self, shapes.implicitRound, radius, edges=_places(self, "implicitRound"), **options)


def implicitSmooth(self: cq.Workplane, radius: Radii, **options: Unpack[BlendOptions]) -> cq.Workplane:  # noqa: N802
    """Round and fillet the edges on the stack, or with a solid there all its edges by a ball.

    See :func:`cad_implicit.cadquery_shapes.implicitSmooth`.
    """
    return _applied(self, shapes.implicitSmooth, radius, edges=_places(self, "implicitSmooth"), **options)


def implicitChamfer(  # noqa: N802
    self: cq.Workplane, length: float, length2: float | None = None, **options: Unpack[BlendOptions]
) -> cq.Workplane:
    """Chamfer the edges on the stack, or with a solid there all its edges.

    See :func:`cad_implicit.cadquery_shapes.implicitChamfer`.
    """
    edges = _places(self, "implicitChamfer")
    return _applied(self, shapes.implicitChamfer, length, length2, edges=edges, **options)


def implicitOffset(self: cq.Workplane, distance: float, **options: Unpack[Options]) -> cq.Workplane:  # noqa: N802
    """Grow (positive distance in mm) or shrink (negative) the solid on the stack.

    See :func:`cad_implicit.cadquery_shapes.implicitOffset`.
    """
    _only_solids(self, "implicitOffset")
    return _applied(self, shapes.implicitOffset, distance, **options)


def implicitShell(self: cq.Workplane, thickness: float, **options: Unpack[Options]) -> cq.Workplane:  # noqa: N802
    """Carve out to a wall, open at the faces on the stack, or with a solid there closed; negative is inward.

    See :func:`cad_implicit.cadquery_shapes.implicitShell`.
    """
    return _applied(self, shapes.implicitShell, thickness, openings=_places(self, "implicitShell"), **options)


def implicitInfill(  # noqa: N802
    self: cq.Workplane,
    cell: float,
    wall: float,
    kind: str = "gyroid",
    skin: float | None = None,
    **options: Unpack[Options],
) -> cq.Workplane:
    """Carve the solid on the stack out to a skin and fill it with a lattice.

    See :func:`cad_implicit.cadquery_shapes.implicitInfill`.
    """
    _only_solids(self, "implicitInfill")
    return _applied(self, shapes.implicitInfill, cell, wall, kind, skin, **options)


def safeFillet(  # noqa: N802
    self: cq.Workplane,
    radius: Radii,
    *,
    timeLimit: float | None = None,
    **options: Unpack[Options],
) -> cq.Workplane:
    """Fillet the edges on the stack, or with a solid there all of them: exactly if the kernel can, else implicitly.

    ``implicit`` of the result tells which. See :func:`cad_implicit.cadquery_shapes.safeFillet`.
    """
    edges = _places(self, "safeFillet")
    return _applied(self, shapes.safeFillet, radius, edges=edges, timeLimit=timeLimit, **options)


def _provenance(self: cq.Workplane) -> Provenance | None:
    """How the last solid in the chain that this package made came about; None if there is none."""
    step = self
    while step is not None:
        for value in step.objects:
            found = getattr(value, "implicit", None)
            if isinstance(found, Provenance):
                return found
        step = step.parent
    return None


def _places(workplane: cq.Workplane, method: str) -> list[cq.Shape] | None:
    """Shapes on the stack that choose places; None if it holds solids.

    Raises
    ------
    SelectorError
        If it holds nothing, or something else.
    """
    stack = workplane.vals()
    if not stack:
        raise SelectorError(f"{method}: nothing is selected; the selector before it found nothing")
    if all(isinstance(value, _BODIES) for value in stack):
        return None
    if not all(isinstance(value, _PLACES) for value in stack):
        kinds = ", ".join(sorted({type(value).__name__ for value in stack}))
        raise SelectorError(f"{method}: there is {kinds} on the stack; select edges, faces or vertices, or a solid")
    return list(stack)


def _only_solids(workplane: cq.Workplane, method: str) -> None:
    """Raise SelectorError if there is something else on the stack than solids."""
    if _places(workplane, method) is not None:
        raise SelectorError(f"{method} works on the whole solid; call it on that, or go back to it with .end()")


def _applied(workplane: cq.Workplane, function: Any, *arguments: Any, **options: Any) -> cq.Workplane:
    """Apply a function to the solid of a chain; its result goes on in that chain."""
    try:
        solid = workplane.findSolid()
    except ValueError as error:  # CadQuery's way to say that there is none
        raise NoSolidError(f"{error}; make one first") from None
    return workplane.newObject([function(solid, *arguments, **options)])


_METHODS = (
    implicitFillet, implicitRound, implicitSmooth, implicitChamfer, implicitOffset, implicitShell, implicitInfill,
    safeFillet,
)  # fmt: skip

for _method in _METHODS:
    setattr(cq.Workplane, _method.__name__, _method)
cq.Workplane.implicit = property(_provenance)
