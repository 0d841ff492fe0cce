"""Local blends: fillets, rounds and chamfers of chosen edges, as in CAD.

The closing and opening of a whole part by a ball fade out at open ends of edges, and delete what is thinner than the
ball. Local blends have their full radius up to the ends, do not care how thin the part is elsewhere, and change nothing
but the neighbourhood of the chosen edges: the ball touches the two faces beside an edge, continued beyond their
borders, and no others. The result is ``(part | added) - removed``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import sizing
from .blend_regions import SPACINGS, Regions, Without
from .cad import OpenPart, open_part
from .cad.edges import Edge, part_edges
from .choices import Edges, choose
from .distance import MeshDistance
from .errors import RadiusError
from .face_groups import PartFaces
from .following import followed
from .implicit import FloatArray, Implicit
from .layout import Laid, lay
from .mesh import Mesh
from .parallel import Progress, no_progress
from .rails import Choice, Radius, rails
from .rolling import rolled
from .strips import Region

Pair = tuple[FloatArray, FloatArray]

#: Convexities of edges that can be blended.
KINDS = ("convex", "concave")

#: How far regions stick out of the part at least, in radii.
_MARGIN_RADII = 0.02

#: Where margins are narrow the cells are smaller by this factor at most: the work grows with its square.
_FINEST = 4.0

#: How far free-form faces are continued, in radii.
REACH = 8.0

#: Angle in degrees between faces below which strips are taken to be no wider.
_SHARPEST = 2.0

#: Relative width at which the search for the largest radius ends.
_RADIUS_FOUND = 1e-4


class LocalBlend(Implicit):
    """A part with some regions taken off and others filled in.

    Attributes
    ----------
    parent : MeshDistance
        The part.
    removed, added : Regions or None
    laid : dict of str to Laid
        Of convex and concave edges: where the balls' centres run.
    choices : tuple of Choice
        The blended edges with their radii.
    part : OpenPart
    faces : PartFaces
        Of the part.
    """

    lipschitz = 2.0
    spacing: float

    def __init__(
        self,
        parent: MeshDistance,
        removed: Sequence[Region],
        added: Sequence[Region],
        spacing: float,
        laid: dict[str, Laid],
        choices: Sequence[Choice],
        part: OpenPart,
        faces: PartFaces,
    ) -> None:
        self.part, self.faces = part, faces
        self.parent, self.spacing, self.laid, self.choices = parent, spacing, laid, tuple(choices)
        self.removed = Regions(removed) if removed else None
        self.added = Regions(added) if added else None
        self.bounds = parent.bounds
        if self.added is not None:
            low, high = self.added.bounds
            self.bounds = np.stack([np.minimum(self.bounds[0], low), np.maximum(self.bounds[1], high)])

    def __call__(self, points: ArrayLike) -> FloatArray:
        return self.value_and_gradient(points)[0]

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Gradients (N, 3) of what decides."""
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points: ArrayLike) -> Pair:
        """Values (N,) and gradients (N, 3)."""
        x = np.asarray(points, np.float64)
        value, gradient = self.parent.value_and_gradient(x)
        if self.added is not None:
            f, slope = self.added.value_and_gradient(x)
            more = f > value
            value, gradient = np.where(more, f, value), np.where(more[:, None], slope, gradient)
        if self.removed is not None:
            f, slope = self.removed.value_and_gradient(x)
            less = -f < value
            value, gradient = np.where(less, -f, value), np.where(less[:, None], -slope, gradient)
        return value, gradient

    def kept_part(self, spacing: float) -> MeshDistance | None:
        """Part whose own triangles a contour at this spacing keeps; none if it leaks or overlaps itself."""
        return self.parent if spacing == self.spacing and is_sound(self.parent) else None

    def mesh(self, *, threads: int | None = None, progress: Progress = no_progress) -> Mesh:
        """Mesh of the result: the part's own triangles, but for the neighbourhood of the blends.

        Raises
        ------
        OpenMeshError
            If the part is not closed; :func:`cad_implicit.contour` works all the same.
        """
        from .settling import settled
        from .stitching import stitched

        added, removed = ([] if regions is None else regions.clusters() for regions in (self.added, self.removed))
        for cluster in (*added, *removed):
            cluster.spacing = max(cluster.spacing, self.spacing / _FINEST)
        before, h = self.parent.mesh, self.spacing
        mesh = stitched(before, added, removed, h, shape=self.parent, threads=threads, progress=progress)
        return settled(mesh, self, before, h, threads)


def blend_edges(
    part: Any,
    radius: Radius | None,
    edges: Edges,
    *,
    kinds: Sequence[str] = KINDS,
    second: float | None = None,
    chamfer: bool = False,
    tangent: bool = True,
    spacing: float | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> LocalBlend:
    """Blend chosen edges of a part; what :func:`cad_implicit.fillet` and its like do if edges are given.

    Parameters
    ----------
    part : path, host object, or triangles
        As for :func:`cad_implicit.to_mesh`.
    radius : Radius or None
        In mm, for edges without one of their own; for chamfers the length on the face on the left.
    edges : Edges
        See :func:`cad_implicit.fillet`.
    kinds : sequence of str
        Convexities that are allowed.
    second : float, optional
        Length of chamfers on the face on the right; by default that on the left.
    chamfer : bool
        Pairs of numbers are lengths on the left and on the right then.
    tangent : bool
        Whether edges that go on smoothly are blended, too.
    spacing, tolerance : float, optional
        At most one of them, in mm.

    Raises
    ------
    SelectorError
        If no edge is chosen, or one that cannot be blended is.
    RadiusError
        If a radius is not positive, or does not fit: names the edge and the largest that does.
    """
    opened = open_part(part)
    found = part_edges(opened)
    choices = choose(opened, found, edges, radius, second=second, chamfer=chamfer, tangent=tangent, kinds=kinds)
    radii = [_largest(choice) for choice in choices]
    smallest, largest = min(min(_range(choice)) for choice in choices), max(radii)
    known = None if opened.triangles is None else MeshDistance(opened.triangles, threads=threads)
    area = strip_area(choices) if known is None or is_sound(known) else None
    h = sizing.choose_spacing(opened.bounds, smallest, engine="exact", spacing=spacing, tolerance=tolerance, area=area)
    progress("spines", 0.0)
    faces = PartFaces(opened, REACH * largest, found)
    margin = max(SPACINGS * h, _MARGIN_RADII * largest)
    distance = known or MeshDistance(opened.mesh(sizing.TESSELLATION_PER_SPACING["exact"] * h), threads=threads)
    try:
        laid = lay_out(choices, faces, found, margin, distance)
    except RadiusError as error:
        fits = _fitting(choices, faces, found, margin, at_fault=error.edges)
        advice = f"; the largest radius for these edges is {fits * largest:.4g} mm" if fits > 0 else ""
        raise RadiusError(f"{error}{advice}") from None
    progress("spines", 1.0)
    removed, added = (
        [*laid[kind].strips.values(), *laid[kind].others] if kind in laid else [] for kind in ("convex", "concave")
    )
    if not removed and not added:
        raise RadiusError("nothing is left to blend: all edges are shorter than their corners")
    return LocalBlend(distance, removed, added, h, laid, choices, opened, faces)


def is_sound(part: MeshDistance) -> bool:
    """Whether the triangles of a part bound it: none is missing, none lies inside."""
    return part.sign == "pseudonormal" and part.mesh.is_watertight


def strip_area(choices: Sequence[Choice]) -> float:
    """Surface in mm² of the strips along edges, nearly: all that is contoured for blends of a sound part."""
    total = 0.0
    for choice in choices:
        radius = _largest(choice)
        opening = np.radians(np.clip(np.minimum(choice.edge.angles, 360 - choice.edge.angles), _SHARPEST, 180.0))
        girth = 2 / np.tan(opening / 2) + np.pi - opening
        total += (choice.edge.length + 2 * radius) * radius * float(girth.mean())
    return total


def max_radius(part: Any, edges: Edges = "all", *, tangent: bool = True) -> float:
    """Largest radius in mm at which all chosen edges can be blended without a face being consumed.

    Parameters are those of :func:`blend_edges`.

    Raises
    ------
    SelectorError
        If no edge is chosen, or one that cannot be blended is.
    """
    opened = open_part(part)
    found = part_edges(opened)
    choices = choose(opened, found, edges, 1.0, tangent=tangent)
    return largest_radius(opened, found, choices)


def largest_radius(part: OpenPart, found: Sequence[Edge], choices: Sequence[Choice]) -> float:
    """Largest radius in mm for chosen edges, 0 if there is none; see :func:`max_radius`."""
    size = float(np.linalg.norm(part.bounds[1] - part.bounds[0]))
    faces = PartFaces(part, size, found)
    whole = [Choice(choice.edge, size) for choice in choices]
    return size * _fitting(whole, faces, found, 0.0, strict=True)


def lay_out(
    choices: Sequence[Choice],
    faces: PartFaces,
    found: Sequence[Edge],
    margin: float,
    part: MeshDistance | None = None,
    *,
    strict: bool = False,
) -> dict[str, Laid]:
    """Regions of chosen edges, those of convex and of concave ones; parameters are those of :func:`layout.lay`.

    Raises
    ------
    RadiusError
        If a ball does not fit, or blends run into each other.
    """
    single = [
        rail for kind in KINDS for rail in rails([choice for choice in choices if choice.edge.convexity == kind], faces)
    ]
    joined, after = rolled(*followed(single, found))
    laid = {}
    for kind, sign in (("concave", -1.0), ("convex", 1.0)):
        own = [rail for rail in joined if rail.sign == sign]
        if own:
            laid[kind] = lay(own, faces, found, margin, part, strict=strict)
    # what is filled in around a rounded edge comes after it
    for first in set(after) & set(laid["convex"].strips) if len(laid) == 2 else ():
        filled = [laid["concave"].strips[id(rail)] for rail in after[first] if id(rail) in laid["concave"].strips]
        if filled:
            laid["convex"].strips[first] = Without(laid["convex"].strips[first], filled)
    return laid


def _fitting(
    choices: Sequence[Choice],
    faces: PartFaces,
    found: Sequence[Edge],
    margin: float,
    *,
    strict: bool = False,
    at_fault: Sequence[int] = (),
) -> float:
    """Largest factor below 1 by which radii fit, 0 if none does.

    Looks first at those edges only at which larger radii do not fit, ``at_fault``, and their neighbours.
    """

    def fault(some: Sequence[Choice], factor: float) -> RadiusError | None:
        try:
            lay_out([_scaled(choice, factor) for choice in some], faces, found, margin * factor, strict=strict)
        except RadiusError as error:
            return error
        return None

    def largest(some: Sequence[Choice], high: float) -> float:
        low = 0.0
        while high - low > _RADIUS_FOUND * high and high > 1e-6:
            middle = (low + high) / 2 if low > 0 else high / 4
            low, high = (low, middle) if fault(some, middle) else (middle, high)
        return low

    high, asked = 1.0, set[int]()
    while not set(at_fault) <= asked:
        asked = set(at_fault)
        fits = largest(_beside(choices, asked), high)
        if fits == 0:
            break  # some of a chain of edges may be worse than all
        error = fault(choices, fits)
        if error is None:
            return fits
        high, at_fault = fits, error.edges
    return largest(choices, high)


def _beside(choices: Sequence[Choice], numbers: set[int]) -> list[Choice]:
    """Choices of some edges, and of those that share a vertex with them."""
    ends = {end for choice in choices if choice.edge.number in numbers for end in choice.edge.ends} - {0}
    return [choice for choice in choices if choice.edge.number in numbers or ends & set(choice.edge.ends)]


def _scaled(choice: Choice, factor: float) -> Choice:
    radius = choice.radius
    second = None if choice.second is None else factor * choice.second
    if isinstance(radius, int | float):
        return Choice(choice.edge, factor * radius, second)
    if isinstance(radius, tuple):
        return Choice(choice.edge, (factor * radius[0], factor * radius[1]), second)
    return Choice(choice.edge, _Times(radius, factor), second)


class _Times:
    """A function times a factor; two of the same are equal, so that edges with them stay together."""

    def __init__(self, function: Any, factor: float) -> None:
        self.function, self.factor = function, factor

    def __call__(self, fraction: float) -> float:
        return self.factor * float(self.function(fraction))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Times) and (self.function, self.factor) == (other.function, other.factor)

    def __hash__(self) -> int:
        return hash((self.function, self.factor))


def _range(choice: Choice) -> list[float]:
    """Radii of a choice, at some places."""
    if callable(choice.radius):
        return [float(choice.radius(f)) for f in np.linspace(0, 1, 33).tolist()]
    radii = [float(r) for r in np.atleast_1d(np.asarray(choice.radius, np.float64))]
    return radii if choice.second is None else [*radii, choice.second]


def _largest(choice: Choice) -> float:
    return max(_range(choice))
