"""Operations on shapes of CadQuery: a shape in, a shape out, nothing is patched.

:mod:`cad_implicit.cadquery` makes them methods of ``Workplane``. Every result has an attribute ``implicit``, a
:class:`~cad_implicit.solid_job.Provenance`: by which engine it was made, and how far off it may be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias, TypeVar, Unpack

from .cad import OpenPart, open_part
from .cad.edges import part_edges
from .cad.files import INSTALL_HOST
from .cad.solids import SolidPart
from .errors import MissingHostError, SelectorError
from .lattice import Crystal
from .minimal import Minimal
from .rails import Radius
from .solid_job import BlendOptions, Options, Provenance, blendable, safely_filleted, shelled, worked

try:
    import cadquery as cq
except ImportError as error:
    raise MissingHostError(f"CadQuery cannot be imported ({error}): {INSTALL_HOST}") from error

#: A solid, a compound of solids, or an assembly.
Body = TypeVar("Body", "cq.Shape", "cq.Assembly")

#: A shape, or several: edges, wires, faces or vertices of a part.
Selection: TypeAlias = "cq.Shape | Iterable[cq.Shape]"

#: One radius in mm, the two at the start and the end of each edge, a function of the fraction of its length; or a
#: mapping of edges, or selectors of edges, to them.
Radii = Radius | Mapping[Any, Radius]

__all__ = [
    "BlendOptions",
    "Options",
    "Provenance",
    "cq",
    "implicitChamfer",
    "implicitFillet",
    "implicitInfill",
    "implicitOffset",
    "implicitRound",
    "implicitShell",
    "implicitSmooth",
    "safeFillet",
]


def implicitFillet(  # noqa: N802 (camelCase is at home in CadQuery)
    shape: Body, radius: Radii, edges: Selection | None = None, **options: Unpack[BlendOptions]
) -> Body:
    """Fillet edges as CAD does, convex ones rounded, concave ones filled; without edges, all concave ones by a ball.

    Parameters
    ----------
    shape : Shape or Assembly
        Solid, or compound of solids; the parts of an assembly are worked on one by one, and keep their places, names
        and colours.
    radius : float, pair, callable, or mapping of edges to these
        In mm. With a mapping, its keys are the edges: of CadQuery, or selectors such as ``"|Z"``.
    edges : Shape or iterable of Shape, optional
        Edges; wires or faces for their edges; vertices for the edges that end there.
    **options
        See :class:`~cad_implicit.solid_job.BlendOptions`.

    Raises
    ------
    SelectorError
        If no edge is chosen, or one that cannot be filleted is.
    RadiusError
        If a radius is not positive, or does not fit; names the edge and the largest that does.
    CadImplicitError
        As :func:`cad_implicit.run`.
    """
    return _blended("fillet", shape, radius, edges, options)


def implicitRound(  # noqa: N802
    shape: Body, radius: Radii, edges: Selection | None = None, **options: Unpack[BlendOptions]
) -> Body:
    """Round convex edges; without edges, all of them by a ball, which removes what is thinner than twice the radius.

    Parameters and errors as for :func:`implicitFillet`; concave edges are an error.
    """
    return _blended("round", shape, radius, edges, options)


def implicitSmooth(  # noqa: N802
    shape: Body, radius: Radii, edges: Selection | None = None, **options: Unpack[BlendOptions]
) -> Body:
    """Round convex and fillet concave edges: those given, or without edges all of them by a ball.

    Parameters and errors as for :func:`implicitFillet`.
    """
    return _blended("smooth", shape, radius, edges, options)


def implicitChamfer(  # noqa: N802
    shape: Body,
    length: float,
    length2: float | None = None,
    edges: Selection | None = None,
    **options: Unpack[BlendOptions],
) -> Body:
    """Chamfer edges: convex ones are cut off, concave ones filled, with a flat strip; without edges, all of them.

    Parameters
    ----------
    shape, edges, **options
        As for :func:`implicitFillet`.
    length, length2 : float
        In mm, on the face on the left of the edge, as seen from outside, and on that on its right.
    """
    return _each(
        shape, lambda part: worked(part, "chamfer", length, edges=_numbers(part, edges), second=length2, **options)
    )


def implicitOffset(shape: Body, distance: float, **options: Unpack[Options]) -> Body:  # noqa: N802
    """Grow (positive distance in mm) or shrink (negative) a solid; convex edges come out round as it grows."""
    return _each(shape, lambda part: worked(part, "offset", distance, **options))


def implicitShell(  # noqa: N802
    shape: Body, thickness: float, openings: Selection | None = None, **options: Unpack[Options]
) -> Body:
    """Carve a solid out to a wall.

    Parameters
    ----------
    shape : Shape
    thickness : float
        In mm; as in CadQuery, the wall lies within the part if it is negative, around it if it is positive.
    openings : Face or iterable of Face, optional
        Faces that get no wall, for walls within the part; without them the hollow is closed.
    **options
        See :class:`~cad_implicit.solid_job.Options`.

    Raises
    ------
    SelectorError
        If an opening is no face of the part.
    RadiusError
        If the wall leaves no hollow.
    CadImplicitError
        As :func:`cad_implicit.run`.
    """
    if openings is None:
        return _each(shape, lambda part: shelled(part, thickness, None, **options))
    faces = _sequence(openings)
    if not faces or not all(isinstance(face, cq.Face) for face in faces):
        kinds = ", ".join(sorted({type(face).__name__ for face in faces})) or "nothing"
        raise SelectorError(f"a shell is opened at faces, and {kinds} was given; select faces")
    return _each(shape, lambda part: shelled(part, thickness, [face.wrapped for face in faces], **options))


def implicitInfill(  # noqa: N802
    shape: Body,
    cell: float,
    wall: float,
    kind: Minimal | Crystal | str = "gyroid",
    skin: float | None = None,
    **options: Unpack[Options],
) -> Body:
    """Carve a solid out to a skin and fill it with a lattice.

    Not promised: speed. A lattice has many facets; for printing write triangles,
    ``cad_implicit.save(cad_implicit.contour(cad_implicit.infill(part, cell, wall)), "part.3mf")``.

    Parameters
    ----------
    shape : Shape
    cell, wall : float
        Period of the lattice and thickness of its walls in mm.
    kind, skin
        As for :func:`cad_implicit.infill`.
    **options
        See :class:`~cad_implicit.solid_job.Options`.
    """
    return _each(shape, lambda part: worked(part, "infill", wall, cell=cell, kind=kind, skin=skin, **options))


def safeFillet(  # noqa: N802
    shape: Body,
    radius: Radii,
    edges: Selection | None = None,
    *,
    timeLimit: float | None = None,
    **options: Unpack[Options],
) -> Body:
    """Fillet edges by the exact kernel, and where that fails by :func:`implicitFillet`; without edges, all of them.

    The kernel runs in a child process, so that it cannot crash this one; its result counts if it is valid and closed,
    and its volume positive and changed in the right direction. ``implicit`` of the result tells which of the two it is
    and, if it is not the kernel's, why.

    Parameters
    ----------
    shape, radius, edges
        As for :func:`implicitFillet`.
    timeLimit : float, optional
        Seconds that the kernel may take; 120 by default.
    **options
        See :class:`~cad_implicit.solid_job.Options`; for the case that the kernel fails.
    """
    if isinstance(radius, Mapping):
        return _each(shape, lambda part: safely_filleted(part, None, radius, time_limit=timeLimit, **options))
    return _each(
        shape, lambda part: safely_filleted(part, radius, _numbers(part, edges), time_limit=timeLimit, **options)
    )


def _blended(operation: str, shape: Body, radius: Radii, edges: Selection | None, options: BlendOptions) -> Body:
    if isinstance(radius, Mapping):
        return _each(shape, lambda part: worked(part, operation, None, edges=radius, **options))
    if edges is not None:
        return _each(shape, lambda part: worked(part, operation, radius, edges=_numbers(part, edges), **options))
    whole: dict[str, Any] = {key: value for key, value in options.items() if key != "tangent"}
    return _each(shape, lambda part: worked(part, operation, radius, **whole))


def _numbers(part: OpenPart, edges: Selection | None) -> list[int]:
    """Numbers of edges that are given; of all, if none are."""
    from .cad.occ_chosen import edge_numbers

    found = part_edges(part)
    return blendable(found) if edges is None else edge_numbers(part, found, [e.wrapped for e in _sequence(edges)])


def _sequence(shapes: Selection) -> Sequence[cq.Shape]:
    return [shapes] if isinstance(shapes, cq.Shape) else list(shapes)


def _each(body: Any, work: Callable[[OpenPart], tuple[SolidPart, Provenance]]) -> Any:
    """Shape that is made of a shape, with its label; assembly of those that are made of an assembly's parts."""
    if not isinstance(body, cq.Assembly):
        solid, provenance = work(open_part(body))
        shape = cq.Shape.cast(solid.wrapped)
        shape.label = body.label
        shape.implicit = provenance
        return shape
    own = [_each(_one(body.shapes), work)] if body.shapes else []
    whole = cq.Assembly(*own, loc=body.loc, name=body.name, color=body.color, metadata=body.metadata)
    for child in body.children:
        whole.add(_each(child, work))
    return whole


def _one(shapes: Sequence[cq.Shape]) -> cq.Shape:
    return shapes[0] if len(shapes) == 1 else cq.Compound.makeCompound(shapes)
