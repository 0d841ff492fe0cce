"""Edges of a mesh: lines along which triangles meet at a sharp angle, and the pieces of surface between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cad_implicit.mesh import FloatArray, Mesh

from .edges import Edge, convexity, straight_direction, turns, unit
from .weld import groups

Ints = NDArray[np.int64]

#: A line has a corner where it turns by more than this many degrees.
_CORNER_DEGREES = 40.0

#: A line is straight within this share of the diagonal: coordinates of STL files are good to 1e-7 of it.
_STRAIGHT = 1e-6


class _Segments(NamedTuple):
    """Sharp edges of triangles.

    Vertices ``(S, 2)``, the triangles left and right of them ``(S, 2)`` (-1: none, -2: several), their normals
    ``(S, 2, 3)``, and a number ``(S,)`` that is the same for those that may be in one line.
    """

    vertices: Ints
    triangles: Ints
    normals: FloatArray
    kind: Ints


def mesh_edges(mesh: Mesh, sharp: float) -> list[Edge]:
    """Edges of a mesh, numbered from 1, chains not told; see :func:`segment` for the numbers of faces.

    Parameters
    ----------
    mesh : Mesh
    sharp : float
        Triangles that turn by more than this many degrees meet at an edge.
    """
    segments, pieces, _ = _segments(mesh, sharp)
    lines = _lines(mesh, segments)
    corners: dict[int, int] = {}
    for line in lines:
        for vertex in (_start(segments, line[0]), _start(segments, ~line[-1])):
            corners.setdefault(vertex, len(corners) + 1)
    return [_edge(mesh, segments, pieces, line, i, corners) for i, line in enumerate(lines, 1)]


def segment(mesh: Mesh, sharp: float) -> NDArray[np.int64]:
    """Give the number ``(F,)``, from 1, of the face that each triangle belongs to: pieces that no edge separates."""
    return _segments(mesh, sharp)[1]


def segment_and_join(mesh: Mesh, sharp: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """As :func:`segment`, and the pairs ``(P, 2)`` of triangles that meet at no edge, and so are of one face."""
    return _segments(mesh, sharp)[1:]


def _segments(mesh: Mesh, sharp: float) -> tuple[_Segments, Ints, Ints]:
    """Sharp segments, the piece of surface of each triangle, and the pairs of triangles without an edge between."""
    start = mesh.faces.ravel().astype(np.int64)
    end = np.roll(mesh.faces, -1, axis=1).ravel().astype(np.int64)
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, first, which, count = np.unique(
        low * len(mesh.vertices) + high, return_index=True, return_inverse=True, return_counts=True
    )
    vertices = np.stack([low[first], high[first]], axis=1)
    triangles = np.full((len(first), 2), -1, np.int64)
    owner = np.arange(len(start)) // 3
    triangles[which.ravel(), (start > end).astype(np.int64)] = owner  # left where it runs from low to high
    triangles[(count > 2) | ((count == 2) & (triangles < 0).any(axis=1))] = -2
    face_normals = unit(mesh.face_vectors)
    normals = np.where((triangles >= 0)[..., None], face_normals[triangles], np.nan)
    along = unit(mesh.vertices[vertices[:, 1]] - mesh.vertices[vertices[:, 0]])
    turn = turns(along, normals)
    regular = (triangles >= 0).all(axis=1)
    is_sharp = ~regular | (np.abs(turn) > sharp)
    pieces = groups(len(mesh.faces), triangles[~is_sharp])[0].astype(np.int64) + 1
    beside = np.sort(np.where(triangles >= 0, pieces[triangles], triangles), axis=1)[is_sharp]
    kind = np.unique(np.column_stack([beside, turn[is_sharp] > 0]), axis=0, return_inverse=True)[1].ravel()
    sharp_ones = _Segments(vertices[is_sharp], triangles[is_sharp], normals[is_sharp], kind.astype(np.int64))
    return sharp_ones, pieces, triangles[~is_sharp]


def _lines(mesh: Mesh, segments: _Segments) -> list[list[int]]:
    """Segments in lines: each a list of their numbers, inverted (``~``) where they run backward."""
    at: dict[int, list[int]] = {}
    for number, (a, b) in enumerate(segments.vertices.tolist()):
        at.setdefault(a, []).append(number)
        at.setdefault(b, []).append(~number)
    following = {}
    for meeting in at.values():
        if len(meeting) == 2 and _goes_on(mesh, segments, *meeting):
            following[~meeting[0]], following[~meeting[1]] = meeting[1], meeting[0]
    lines, done = [], set()

    inner = set(following.values())
    leading = [own for meeting in at.values() for own in meeting if own not in inner]
    for own in [*sorted(leading, key=lambda own: _name(own)), *range(len(segments.vertices))]:
        if _name(own) in done:
            continue
        line = [own]
        done.add(_name(own))
        while (after := following.get(line[-1])) is not None and _name(after) not in done:
            line.append(after)
            done.add(_name(after))
        lines.append(line)
    return lines


def _name(own: int) -> int:
    return own if own >= 0 else ~own


def _start(segments: _Segments, own: int) -> int:
    return int(segments.vertices[_name(own), 0 if own >= 0 else 1])


def _goes_on(mesh: Mesh, segments: _Segments, one: int, other: int) -> bool:
    """Whether two segments that both start at a vertex are one line through it."""
    if segments.kind[_name(one)] != segments.kind[_name(other)] or (segments.triangles[_name(one)] == -2).any():
        return False
    here = mesh.vertices[_start(segments, one)]
    first, second = (unit(mesh.vertices[_start(segments, ~own)] - here) for own in (one, other))
    return bool(first @ second < -np.cos(np.radians(_CORNER_DEGREES)))


def _edge(mesh: Mesh, segments: _Segments, pieces: Ints, line: list[int], number: int, corners: dict[int, int]) -> Edge:
    names = np.array([_name(own) for own in line])
    backward = np.array(line) < 0
    way = np.array([*(_start(segments, own) for own in line), _start(segments, ~line[-1])])
    points = mesh.vertices[way]
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    triangles = np.where(backward[:, None], segments.triangles[names, ::-1], segments.triangles[names])
    sides = np.where(backward[:, None, None], segments.normals[names, ::-1], segments.normals[names])
    if triangles[0, 0] == -1:  # a boundary has its face on the left
        return _edge(mesh, segments, pieces, [~own for own in line[::-1]], number, corners)
    closed = bool(way[0] == way[-1])
    tangents, normals = (_at_points(values, lengths, closed) for values in (unit(steps)[:, None], sides))
    beside = [int(pieces[t]) for t in triangles[0] if t >= 0]
    faces = (0, 0, 0) if triangles[0, 0] == -2 else tuple(beside)
    direction = straight_direction(points, _STRAIGHT * mesh.diagonal)
    return Edge(
        number=number,
        convexity=convexity(tangents[:, 0], normals, faces),
        curve="polyline" if direction is None else "line",
        closed=closed,
        length=float(lengths.sum()),
        centre=np.average((points[1:] + points[:-1]) / 2, axis=0, weights=lengths),
        direction=direction,
        faces=faces,
        ends=(corners[int(way[0])], corners[int(way[-1])]),
        points=points,
        tangents=tangents[:, 0],
        normals=normals,
    )


def _at_points(values: FloatArray, lengths: FloatArray, closed: bool) -> FloatArray:
    """Give unit vectors ``(P, K, 3)`` at the points of a line from those ``(P - 1, K, 3)`` of its segments."""
    weighted = values * lengths[:, None, None]
    total = np.zeros((len(values) + 1, *values.shape[1:]))
    total[:-1] += weighted
    total[1:] += weighted
    if closed and float(values[0, 0] @ values[-1, 0]) > np.cos(np.radians(_CORNER_DEGREES)):
        total[0] = total[-1] = weighted[0] + weighted[-1]
    return unit(total)
