"""Edges of a part: where they run, between which faces, at what angle, and which continue each other.

A B-rep gives its own edges, numbered from 1 in the order of ``TopExp::MapShapes`` (FreeCAD's EdgeN); degenerate ones,
as at the poles of a sphere, are left out but counted. A mesh gives the lines along which its triangles meet at a sharp
angle, cut at corners and where the convexity or a face changes; its faces are the pieces between such lines.

Not promised: two edges of a mesh that meet at less than the sharp angle are one, and so are the faces beside it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cad_implicit.errors import SelectorError
from cad_implicit.mesh import FloatArray

from .kernel import is_freecad, is_occ, kernel
from .parts import OpenPart, open_part
from .selectors import Candidates, select
from .weld import groups

#: Faces that turn by less than this many degrees are tangent, and so are edges that continue each other: the ball's
#: centre between tangent faces is not defined.
TANGENT_DEGREES = 1.0

#: Triangles of a mesh that turn by more than this many degrees meet at an edge: tessellations turn by 11 degrees by
#: default here, by 5 to 20 in other programs.
SHARP_DEGREES = 25.0


#: Points lie on an edge if they are nearer to it than this share of the diagonal: twice the error of its polyline.
_SAME_PLACE = 1e-3


@dataclass(frozen=True, eq=False)
class Edge:
    """One edge of a part.

    Attributes
    ----------
    number : int
        From 1.
    convexity : str
        "convex"; "concave"; "mixed" if it changes along the edge; "smooth" if the faces turn by less than 1 degree;
        "seam" where a face meets itself smoothly; "boundary" with one face only; "nonmanifold" with more than two.
    curve : str
        "line", "circle", "ellipse", "hyperbola", "parabola", "bezier", "bspline", "offset" or "other"; "line" or
        "polyline" in a mesh.
    closed : bool
        Whether it ends where it starts.
    length : float
        In mm.
    centre : (3,) float64
        Centre of mass in mm.
    direction : (3,) float64 or None
        Unit direction of a straight edge.
    faces : tuple of int
        Numbers, from 1, of the face on its left and that on its right, as seen from outside; the same twice at a seam.
    ends : tuple of int
        Numbers, from 1, of the vertices where it starts and ends.
    points : (P, 3) float64
        Polyline along it in mm, both ends included.
    tangents : (P, 3) float64
        Unit directions there.
    normals : (P, 2, 3) float64
        Outward unit normals there of the two faces; NaN for a face that is not there.
    chain : int
        Lowest number among the edges that continue each other tangentially, with the same convexity.
    """

    number: int
    convexity: str
    curve: str
    closed: bool
    length: float
    centre: FloatArray
    direction: FloatArray | None
    faces: tuple[int, ...]
    ends: tuple[int, int]
    points: FloatArray
    tangents: FloatArray
    normals: FloatArray
    chain: int = 0

    @property
    def angles(self) -> FloatArray:
        """Dihedral angles ``(P,)`` of the material in degrees: below 180 where convex, above where concave."""
        return 180 - turns(self.tangents, self.normals)

    @property
    def angle(self) -> float:
        """Dihedral angle in degrees in the middle of the edge."""
        return float(self.angles[len(self.points) // 2])


def edges(part: Any, selector: str = "all", *, sharp: float = SHARP_DEGREES) -> tuple[Edge, ...]:
    """Edges of a part, for a user to choose from.

    Parameters
    ----------
    part : path, host object, or triangles
        As for :func:`cad_implicit.to_mesh`.
    selector : str
        Which of them: "all", "concave", "|Z", "3,5,7" …; see :mod:`cad_implicit.cad.selectors`.
    sharp : float
        For meshes: triangles that turn by more than this many degrees meet at an edge.

    Returns
    -------
    tuple of Edge
        In ascending order of their numbers.

    Raises
    ------
    SelectorError
        If the selector cannot be read or selects nothing.
    ValueError
        If ``sharp`` is not between 0 and 180.

    Examples
    --------
    >>> import trimesh
    >>> box = trimesh.creation.box((1, 2, 3))
    >>> [(edge.number, edge.convexity, round(edge.length, 3)) for edge in edges(box, "|Z and >X")]
    [(9, 'convex', 3.0), (12, 'convex', 3.0)]
    """
    return selected(part_edges(open_part(part), sharp), selector)


def part_edges(part: OpenPart, sharp: float = SHARP_DEGREES) -> tuple[Edge, ...]:
    """All edges of a part that is open already; see :func:`edges`."""
    if not 0 < sharp < 180:
        raise ValueError(f"sharp must be between 0 and 180 degrees, not {sharp:g}")
    if part.triangles is not None:
        from .mesh_edges import mesh_edges

        return chained(mesh_edges(part.triangles, sharp), sharp)
    return chained(kernel(part.shape, "edges").shape_edges(part.shape), TANGENT_DEGREES)


def selected(found: Sequence[Edge], selector: str) -> tuple[Edge, ...]:
    """Those that a selector chooses.

    Raises
    ------
    SelectorError
        If the selector cannot be read or selects nothing.
    """
    nowhere = np.full(3, np.nan)
    candidates = Candidates(
        "edge",
        np.array([edge.number for edge in found], np.int64),
        np.array([edge.centre for edge in found], np.float64).reshape(-1, 3),
        np.array([nowhere if edge.direction is None else edge.direction for edge in found]).reshape(-1, 3),
        [edge.curve for edge in found],
        [edge.convexity for edge in found],
    )
    return tuple(found[position] for position in select(selector, candidates))


def edge_number(part: OpenPart, found: Sequence[Edge], one: Any) -> int:
    """Give the number of an edge, however it is given.

    Parameters
    ----------
    part : OpenPart
    found : sequence of Edge
        All of its edges.
    one : int, Edge, edge of CadQuery or build123d, TopoDS_Edge, Part.Edge, or (N, 3) points along it in mm
        Of a B-rep the very edge if the part has it, else the one in the same place.

    Raises
    ------
    SelectorError
        If the part has no such edge.
    """
    if isinstance(one, int | np.integer):
        return int(one)
    if isinstance(one, Edge):
        return one.number
    shape = getattr(one, "wrapped", one)
    if part.shape is not None and (is_occ(shape) or is_freecad(shape)):
        own = kernel(part.shape, "edges")
        number = own.number_of(part.shape, shape)
        if number:
            return int(number)
        one = own.points_along(shape)
    try:
        points = np.asarray(one, np.float64).reshape(-1, 3)
    except (TypeError, ValueError):
        raise SelectorError(f"{one!r} is no edge: give a selector, a number, an edge of the part, or points") from None
    away = [float(_distances(points, edge.points).max()) for edge in found]
    limit = _SAME_PLACE * float(np.linalg.norm(part.bounds[1] - part.bounds[0]))
    if not away or min(away) > limit:
        x, y, z = points[len(points) // 2]
        raise SelectorError(f"the part has no edge at ({x:.4g}, {y:.4g}, {z:.4g}) mm")
    return found[int(np.argmin(away))].number


def _distances(points: FloatArray, line: FloatArray) -> FloatArray:
    """Distances (N,) of points (N, 3) from a polyline (P, 3)."""
    start, along = line[:-1], np.diff(line, axis=0)
    length = np.maximum((along * along).sum(axis=1), 1e-300)
    t = np.clip(((points[:, None] - start) * along).sum(axis=2) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - start - t[:, :, None] * along, axis=2).min(axis=1))


def turns(tangents: FloatArray, normals: FloatArray) -> FloatArray:
    """Angles ``(P,)`` in degrees by which the outward normal turns over an edge: positive where it is convex.

    Parameters
    ----------
    tangents : (P, 3) float64
    normals : (P, 2, 3) float64
        Of the face on the left, and on the right.
    """
    first, second = normals[:, 0], normals[:, 1]
    across = (np.cross(first, second) * tangents).sum(axis=1)
    return np.asarray(np.degrees(np.arctan2(across, (first * second).sum(axis=1))))


def convexity(tangents: FloatArray, normals: FloatArray, faces: Sequence[int]) -> str:
    """Convexity of an edge, as :class:`Edge` names it.

    Parameters
    ----------
    tangents : (P, 3) float64
    normals : (P, 2, 3) float64
    faces : sequence of int
        All that meet there.
    """
    if len(faces) != 2:
        return "boundary" if len(faces) < 2 else "nonmanifold"
    turn = turns(tangents, normals)
    convex, concave = bool((turn > TANGENT_DEGREES).any()), bool((turn < -TANGENT_DEGREES).any())
    if convex or concave:
        return ("mixed" if concave else "convex") if convex else "concave"
    return "seam" if faces[0] == faces[1] else "smooth"


def chained(found: Sequence[Edge], tolerance: float = TANGENT_DEGREES) -> tuple[Edge, ...]:
    """Edges with ``chain`` filled in.

    At each vertex an edge is continued by the one that runs on most nearly straight, within ``tolerance`` degrees, and
    has the same convexity. Smooth edges, seams and boundaries stay alone.
    """
    at_vertex: dict[int, list[tuple[int, FloatArray]]] = {}
    for position, edge in enumerate(found):
        if edge.convexity in ("convex", "concave", "mixed"):
            for vertex, away in zip(edge.ends, (edge.tangents[0], -edge.tangents[-1]), strict=True):
                at_vertex.setdefault(vertex, []).append((position, away))
    pairs = [pair for ends in at_vertex.values() for pair in _continued(found, ends, tolerance)]
    label, _ = groups(len(found), np.array(pairs, np.int64).reshape(-1, 2))
    lowest: dict[int, int] = {}
    for edge, own in zip(found, label.tolist(), strict=True):
        lowest[own] = min(edge.number, lowest.get(own, edge.number))
    return tuple(replace(edge, chain=lowest[own]) for edge, own in zip(found, label.tolist(), strict=True))


def _continued(
    found: Sequence[Edge], ends: Sequence[tuple[int, FloatArray]], tolerance: float
) -> list[tuple[int, int]]:
    """Pairs of edges that continue each other at one vertex, each end at most once, the straightest first."""
    straight = [
        (float(ends[i][1] @ ends[j][1]), i, j)
        for i in range(len(ends))
        for j in range(i)
        if found[ends[i][0]].convexity == found[ends[j][0]].convexity
    ]
    used: set[int] = set()
    pairs = []
    for cosine, i, j in sorted(straight):
        if cosine < -math.cos(math.radians(tolerance)) and not {i, j} & used:
            used |= {i, j}
            pairs.append((ends[i][0], ends[j][0]))
    return pairs


def aside(edge: Edge, step: float) -> tuple[FloatArray, FloatArray]:
    """Points ``(P - 1, 3)`` on the left and on the right of the middles of an edge's segments, a step in mm away."""
    middles = (edge.points[1:] + edge.points[:-1]) / 2
    left, right = np.cross(edge.normals, edge.tangents[:, None]).transpose(1, 0, 2)
    return middles + step * (left[1:] + left[:-1]) / 2, middles - step * (right[1:] + right[:-1]) / 2


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors ``(..., 3)`` of length 1; those of length 0 stay."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def straight_direction(points: FloatArray, tolerance: float) -> NDArray[np.float64] | None:
    """Direction of a polyline ``(P, 3)`` that is straight within a tolerance in mm, else None."""
    along = points[-1] - points[0]
    length = float(np.linalg.norm(along))
    if length <= tolerance:
        return None
    along /= length
    offset = points - points[0]
    away = offset - np.outer(offset @ along, along)
    return along if float(np.linalg.norm(away, axis=1).max()) <= tolerance else None
