"""Operations for build123d, in algebra and builder mode: fillets that do not fail, shells and infills.

They take what build123d's own operations take. Edges tell where; faces stand for their edges, vertices for the edges
that end there. A part, or nothing in a builder, means all of it, by a ball. The result is a ``Part`` with an attribute
``implicit``, a :class:`~cad_implicit.solid_job.Provenance`: by which engine it was made, and how far off it may be.

::

    from build123d import Axis, Box
    from cad_implicit.build123d import implicit_fillet

    part = implicit_fillet(Box(50, 80, 10).edges().filter_by(Axis.Z), radius=25)
    part.implicit.error_bound

Not promised: joints and materials of the part; build123d's own fillet drops them, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeAlias, Unpack

from .cad import OpenPart, open_part
from .cad.edges import part_edges
from .cad.files import INSTALL_HOST
from .cad.solids import SolidPart
from .errors import MissingHostError, NoSolidError, SelectorError
from .rails import Radius
from .solid_job import BlendOptions, Options, Provenance, blendable, safely_filleted, shelled, worked

try:
    from build123d import Builder, Compound, Edge, Face, Location, Mode, Part, Shape, Solid, Vertex, Wire
    from build123d.build_common import operations_apply_to, validate_inputs
except ImportError as error:
    raise MissingHostError(f"build123d cannot be imported ({error}): {INSTALL_HOST}") from error

#: Shapes that choose places of a part, and shapes that hold solids.
PlaceType: TypeAlias = Edge | Wire | Face | Vertex
BodyType: TypeAlias = Solid | Part | Compound

#: One radius in mm, the two at the start and the end of each edge, a function of the fraction of its length; or a
#: mapping of edges, or selectors of edges, to them.
Radii = Radius | Mapping[Any, Radius]

_PLACES = (Edge, Wire, Face, Vertex)

#: What makes a solid of a part, at the places that were chosen.
_Work: TypeAlias = Callable[[OpenPart], tuple[SolidPart, Provenance]]

__all__ = [
    "BlendOptions",
    "Options",
    "Provenance",
    "implicit_chamfer",
    "implicit_fillet",
    "implicit_infill",
    "implicit_offset",
    "implicit_round",
    "implicit_shell",
    "implicit_smooth",
    "safe_fillet",
]


def implicit_fillet(
    objects: PlaceType | BodyType | Iterable[PlaceType | BodyType] | None,
    radius: Radii,
    **options: Unpack[BlendOptions],
) -> Part:
    """Part operation: fillet edges, convex ones rounded, concave ones filled; of a part all concave ones by a ball.

    Parameters
    ----------
    objects : Edge, Face, Vertex, Part or iterable of these
        Edges; faces or wires for their edges; vertices for the edges that end there; or a part as a whole. None in a
        builder is the part that it has built.
    radius : float, pair, callable, or mapping of edges to these
        In mm. With a mapping, its keys are the edges: of build123d, or selectors such as ``"|Z"``.
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
    return _blended("fillet", objects, radius, options)


def implicit_round(
    objects: PlaceType | BodyType | Iterable[PlaceType | BodyType] | None,
    radius: Radii,
    **options: Unpack[BlendOptions],
) -> Part:
    """Part operation: round convex edges; of a part all of them, which removes what is thinner than twice the radius.

    Parameters and errors as for :func:`implicit_fillet`; concave edges are an error.
    """
    return _blended("round", objects, radius, options)


def implicit_smooth(
    objects: PlaceType | BodyType | Iterable[PlaceType | BodyType] | None,
    radius: Radii,
    **options: Unpack[BlendOptions],
) -> Part:
    """Part operation: round convex and fillet concave edges; of a part all of them by a ball.

    Parameters and errors as for :func:`implicit_fillet`.
    """
    return _blended("smooth", objects, radius, options)


def implicit_chamfer(
    objects: PlaceType | BodyType | Iterable[PlaceType | BodyType] | None,
    length: float,
    length2: float | None = None,
    **options: Unpack[BlendOptions],
) -> Part:
    """Part operation: chamfer edges, convex ones cut off, concave ones filled; of a part all of them.

    Parameters
    ----------
    objects, **options
        As for :func:`implicit_fillet`.
    length, length2 : float
        In mm, on the face on the left of the edge, as seen from outside, and on that on its right.
    """
    call = _Call("implicit_chamfer", objects)
    return call.result(
        lambda part: worked(part, "chamfer", length, edges=call.numbers(part), second=length2, **options)
    )


def implicit_offset(
    objects: BodyType | Iterable[BodyType] | None = None, amount: float = 0, **options: Unpack[Options]
) -> Part:
    """Part operation: grow (positive amount in mm) or shrink (negative) a part; convex edges come out round."""
    call = _Call("implicit_offset", objects, bodies=True)
    return call.result(lambda part: worked(part, "offset", amount, **options))


def implicit_shell(
    objects: BodyType | Iterable[BodyType] | None = None,
    amount: float = 0,
    openings: Face | list[Face] | None = None,
    **options: Unpack[Options],
) -> Part:
    """Part operation: carve a part out to a wall.

    Parameters
    ----------
    objects : Part or iterable of these
        None in a builder is the part that it has built.
    amount : float
        Thickness in mm; as of build123d's ``offset``, the wall lies within the part if it is negative, around it if it
        is positive.
    openings : Face or list of Face, optional
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
    call = _Call("implicit_shell", objects, bodies=True)
    if openings is None:
        return call.result(lambda part: shelled(part, amount, None, **options))
    faces = [face.wrapped for face in _flat(openings)]
    return call.result(lambda part: shelled(part, amount, faces, **options))


def implicit_infill(
    objects: BodyType | Iterable[BodyType] | None = None,
    cell: float = 0,
    wall: float = 0,
    kind: str = "gyroid",
    skin: float | None = None,
    **options: Unpack[Options],
) -> Part:
    """Part operation: carve a part out to a skin and fill it with a lattice.

    Not promised: speed. A lattice has many facets; for printing write triangles,
    ``cad_implicit.save(cad_implicit.contour(cad_implicit.infill(part, cell, wall)), "part.3mf")``.

    Parameters
    ----------
    objects : Part or iterable of these
        None in a builder is the part that it has built.
    cell, wall : float
        Period of the lattice and thickness of its walls in mm.
    kind, skin
        As for :func:`cad_implicit.infill`.
    **options
        See :class:`~cad_implicit.solid_job.Options`.
    """
    call = _Call("implicit_infill", objects, bodies=True)
    return call.result(lambda part: worked(part, "infill", wall, cell=cell, kind=kind, skin=skin, **options))


def safe_fillet(
    objects: PlaceType | BodyType | Iterable[PlaceType | BodyType] | None,
    radius: Radii,
    *,
    time_limit: float | None = None,
    **options: Unpack[Options],
) -> Part:
    """Part operation: fillet edges by the exact kernel, and where that fails as :func:`implicit_fillet`; of a part all.

    The kernel runs in a child process, so that it cannot crash this one; its result counts if it is valid and closed,
    and its volume positive and changed in the right direction. ``implicit`` of the result tells which of the two it is
    and, if it is not the kernel's, why.

    Parameters
    ----------
    objects, radius
        As for :func:`implicit_fillet`.
    time_limit : float, optional
        Seconds that the kernel may take; 120 by default.
    **options
        See :class:`~cad_implicit.solid_job.Options`; for the case that the kernel fails.
    """
    call = _Call("safe_fillet", objects)
    if isinstance(radius, Mapping):
        return call.result(lambda part: safely_filleted(part, None, radius, time_limit=time_limit, **options))
    return call.result(lambda part: safely_filleted(part, radius, call.numbers(part), time_limit=time_limit, **options))


def _blended(operation: str, objects: Any, radius: Radii, options: BlendOptions) -> Part:
    call = _Call(f"implicit_{operation}", objects)
    if isinstance(radius, Mapping):
        return call.result(lambda part: worked(part, operation, None, edges=radius, **options))
    if call.places:
        return call.result(lambda part: worked(part, operation, radius, edges=call.numbers(part), **options))
    whole: dict[str, Any] = {key: value for key, value in options.items() if key != "tangent"}
    return call.result(lambda part: worked(part, operation, radius, **whole))


class _Call:
    """What all operations do: find the builder, the part and the places on it; give the result to the builder.

    Raises SelectorError if nothing is chosen or it does not belong together, NoSolidError if there is no part.
    """

    def __init__(self, name: str, objects: Any, bodies: bool = False) -> None:
        self.context: Any = Builder._get_context(name)
        given = _flat(objects)
        validate_inputs(self.context, name, given)
        self.places = [shape for shape in given if isinstance(shape, _PLACES)]
        if objects is not None and not given:
            raise SelectorError(f"{name}: nothing is selected; the selector before it found nothing")
        if self.places and (bodies or len(self.places) < len(given)):
            what = "works on a whole part" if bodies else "takes places or parts, not both"
            raise SelectorError(f"{name} {what}; leave out the {type(self.places[0]).__name__}")
        self.targets = self._parts(name) if self.places or not given else given

    def _parts(self, name: str) -> list[Any]:
        """Part that the places belong to, or that the builder has built."""
        own = self.places[0].topo_parent if self.places else None
        target = own if self.context is None else self.context._obj
        if target is None:
            what = "the selection belongs to no part; select from one, as in part.edges()" if self.places else "no part"
            raise NoSolidError(f"{name}: {what}")
        return [target]

    def numbers(self, part: OpenPart) -> list[int]:
        """Numbers of the edges that are chosen; of all, if none are."""
        from .cad.occ_chosen import edge_numbers

        found = part_edges(part)
        return edge_numbers(part, found, [shape.wrapped for shape in self.places]) if self.places else blendable(found)

    def result(self, work: _Work) -> Part:
        """Part that is made, added to the builder."""
        first = self.targets[0]
        if len(self.targets) == 1 and first.children and not self.places:
            made = _assembly(first, work)
        else:
            made = _made(first if len(self.targets) == 1 else self.targets, work)
        if self.context is not None:
            self.context._add_to_context(made, mode=Mode.REPLACE, clean=False)
            self.context._obj.implicit = made.implicit
        return made


def _made(target: Any, work: _Work) -> Part:
    """Part that is made of a shape or several, with its label and colour."""
    from .cad import occ

    solid, provenance = work(open_part(target))
    part = Part(Compound([Solid(one) for one in occ.solids(solid.wrapped)]).wrapped)
    first = target[0] if isinstance(target, list) else target
    part.label, part.color = first.label, first.color
    part.implicit = provenance
    return part


def _assembly(target: Any, work: _Work) -> Any:
    """Assembly of the parts that are made of an assembly's, each in its place, with labels and colours."""
    children = []
    for child in target.children:
        place = child.location
        alone = child.located(Location())
        made = _assembly(alone, work) if alone.children else _made(alone, work)
        children.append(made.locate(place))
    whole = Compound(label=target.label, children=children)
    whole.color = target.color
    whole.implicit = children[0].implicit
    return whole


def _flat(objects: Any) -> list[Any]:
    """Shapes of a shape, or of nested sequences of shapes."""
    if objects is None:
        return []
    if isinstance(objects, Shape) or not isinstance(objects, Iterable):
        return [objects]
    return [shape for item in objects for shape in _flat(item)]


for _name in __all__:
    if _name.startswith(("implicit_", "safe_")):
        operations_apply_to[_name] = ["BuildPart"]
