"""Seams: edges at which a face of the part meets itself, as far as they are left in a result."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .crossing_curves import POINT
from .distance import MeshDistance
from .implicit import FloatArray
from .mesh import Mesh
from .outlines import Border, Original, Outline, Outlined
from .patches import Numbers, Patches

#: Borders cross a seam where they go past it by less than so many turns in a step.
_STEP = 0.25


def seam_crossings(mesh: Mesh, patches: Patches, known: Numbers, original: Original, count: int) -> dict[int, int]:
    """Seams by the vertices of the mesh at which borders of the part's ``count`` faces cross them.

    ``known`` (V,) tells the vertices that are the part's.
    """
    found: dict[int, int] = {}
    for label, loops in zip(patches.labels.tolist(), patches.loops, strict=True):
        for seam in original.seams(label) if label < count else []:
            ends = np.array(original.edges[seam].ends)
            for loop in loops:
                runs = [(patches.chains[n].vertices, forward) for n, forward in loop]
                vertices = np.concatenate([(run if forward else run[::-1])[:-1] for run, forward in runs])
                past = original.past_seam(label, seam, mesh.vertices[vertices])
                at_end = np.isin(known[vertices], ends)
                for place in _changes(past, at_end):
                    found[int(vertices[place])] = seam
    return found


def _changes(past: FloatArray, at_end: NDArray[np.bool_]) -> list[int]:
    """Places nearest to where a closed run goes past a seam, unless at its ends."""
    after, end_after = np.roll(past, -1), np.roll(at_end, -1)
    crossing = np.flatnonzero((past * after <= 0) & (np.abs(past - after) < _STEP) & ~at_end & ~end_after)
    nearer = np.abs(past[crossing]) <= np.abs(after[crossing])
    return [int(place) for place in np.where(nearer, crossing, (crossing + 1) % len(past))]


def add_seams(outline: Outline, mesh: Mesh, patches: Patches, original: Original, count: int, spacing: float) -> None:
    """Add to the faces of the part that meet themselves what is left of their seams."""
    inside: _Inside | None = None
    for face in outline.faces:
        for seam in original.seams(face.label) if face.label < count else []:
            inside = inside or _Inside(mesh, patches, spacing)
            _add_seam(outline, face, original, seam, inside, spacing)


class _Inside:
    """Tells which patch a point is on."""

    def __init__(self, mesh: Mesh, patches: Patches, spacing: float) -> None:
        self._distance, self._patches, self._h = MeshDistance(mesh, sign="pseudonormal"), patches, spacing

    def __call__(self, point: FloatArray, patch: int) -> bool:
        found = self._distance.closest(point[None])
        return bool(self._patches.of_triangle[found.triangle[0]] == patch and found.distance[0] < self._h)


def _add_seam(outline: Outline, face: Outlined, original: Original, seam: int, inside: _Inside, spacing: float) -> None:
    edge = original.edges[seam]
    borders = [outline.borders[n] for loop in face.loops for n, _ in loop]
    stops: dict[int, float] = {}
    for vertex in {v for border in borders for v in (border.start, border.end)}:
        way = edge.way(outline.points[[vertex]])
        if np.linalg.norm(edge.at(way)[0] - outline.points[vertex]) < POINT * spacing:
            stops[vertex] = float(way[0])
    for end, limit in zip(edge.ends, (edge.low, edge.high), strict=True):
        here = [v for v in stops if outline.known[v] == end]
        if here:
            stops[here[0]] = limit
        elif inside(original.vertices[end], face.patch):
            stops[_vertex(outline, original, end)] = limit
    for a, b in pairwise(sorted(stops, key=lambda vertex: stops[vertex])):
        middle = edge.at(np.array([(stops[a] + stops[b]) / 2]))[0]
        if inside(middle, face.patch):
            face.seams.append(len(outline.borders))
            outline.borders.append(Border(a, b, None, np.array([stops[a], stops[b]]), seam))


def _vertex(outline: Outline, original: Original, known: int) -> int:
    """Place of a vertex of the part in the list of an outline."""
    here = np.flatnonzero(outline.known == known)
    if len(here):
        return int(here[0])
    outline.points = np.concatenate([outline.points, original.vertices[[known]]])
    outline.known = np.append(outline.known, known)
    return len(outline.points) - 1
