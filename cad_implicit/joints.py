"""Where rails meet and end: corners of three and more faces, cuts at the faces that an edge runs into, mitres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal

import numpy as np

from .cad.edges import Edge
from .face_groups import PartFaces
from .guides import Support
from .implicit import FloatArray
from .rails import Rail

#: A ball at a corner is found if it touches its faces within this share of the radius, …
_SOLVED = 1e-9
_ROUNDS = 40
#: … growing in these steps.
_GROWTH = (0.02, 0.1, 0.25, 0.5, 0.75, 1.0)

#: A corner's ball may be in another face by this share of the radius; balls nearer to each other are one.
_SAME = 1e-6

#: Where to look on which side of an end's face an edge lies: shares of the radius.
_LOOKS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
#: A face is left by an edge at this slope at least.
_LEAVING = 0.05


@dataclass(eq=False)
class Around:
    """The faces around one end of a rail.

    Attributes
    ----------
    own : (int, int)
        Clusters of the faces on the left and on the right.
    cuts : dict of int to (Support, float)
        Other clusters: the face, and the side of it on which the edge lies; 1 is the side of the balls.
    """

    own: tuple[int, int]
    cuts: dict[int, tuple[Support, float]]


@dataclass(eq=False)
class Vertex:
    """A vertex at which rails end.

    Attributes
    ----------
    place : (3,) float64
    clusters : list of list of int
        Numbers of the faces around it; those that meet smoothly there are in one cluster.
    sharp : set of int
        Numbers of the sharp edges that end there.
    ends : list of (Rail, 0 or 1)
        Rails that end there, and which end of them.
    corners : list of Ball
        Balls that touch three or more of the clusters, if all its edges are blended alike.
    """

    place: FloatArray
    clusters: list[list[int]]
    sharp: set[int]
    ends: list[tuple[Rail, Literal[0, 1]]] = field(default_factory=list)
    corners: list[Ball] = field(default_factory=list)

    def cluster(self, face: int) -> int:
        """Index of the cluster of a face, -1 if it is not there."""
        return next((index for index, own in enumerate(self.clusters) if face in own), -1)


@dataclass(frozen=True, eq=False)
class Ball:
    """A ball that touches the faces of several clusters."""

    centre: FloatArray
    radius: float
    clusters: tuple[int, ...]
    contacts: FloatArray


def vertices(rails: Sequence[Rail], edges: Sequence[Edge]) -> dict[int, Vertex]:
    """Vertices at which rails end, by number."""
    at: dict[int, list[tuple[Edge, int]]] = {}
    for edge in edges:
        for which in (0, 1):
            at.setdefault(edge.ends[which], []).append((edge, which))
    found: dict[int, Vertex] = {}
    for rail in rails:
        if rail.guide.closed:
            continue
        for which, end in enumerate(rail.ends):
            if end.vertex == 0:
                continue
            if end.vertex not in found:
                found[end.vertex] = _vertex(at[end.vertex])
            found[end.vertex].ends.append((rail, 0 if which == 0 else 1))
            end.smooth = _goes_on(rail, which, at[end.vertex])
    return found


def _vertex(incident: Sequence[tuple[Edge, int]]) -> Vertex:
    edge, which = incident[0]
    place = edge.points[0] if which == 0 else edge.points[-1]
    faces = sorted({face for edge, _ in incident for face in edge.faces})
    clusters = {face: {face} for face in faces}
    for edge, _ in incident:
        if edge.convexity == "smooth":
            one, other = clusters[edge.faces[0]], clusters[edge.faces[1]]
            if one is not other:
                one |= other
                for face in other:
                    clusters[face] = one
    distinct = {id(own): sorted(own) for own in clusters.values()}
    sharp = {edge.number for edge, _ in incident if edge.convexity not in ("smooth", "seam")}
    return Vertex(place, list(distinct.values()), sharp)


def _goes_on(rail: Rail, which: int, incident: Sequence[tuple[Edge, int]]) -> bool:
    """Whether a chain of edges goes on beyond the end of a rail."""
    own = rail.choices[-which].edge.chain
    return any(edge.chain == own and edge.number not in rail.numbers for edge, _ in incident)


def find_corners(vertex: Vertex, faces: PartFaces) -> None:
    """Fill in the corners of a vertex: none unless all its sharp edges are blended alike."""
    rails = [rail for rail, _ in vertex.ends]
    covered = {choice.edge.number for rail in rails for choice in rail.choices}
    radius = rails[0].constant
    alike = all(rail.constant == radius and rail.sign == rails[0].sign for rail in rails)
    if len(rails) < 3 or radius is None or not alike or not vertex.sharp <= covered:
        return
    groups = faces.groups([own[0] for own in vertex.clusters])
    supports = [Support(groups[own[0]], rails[0].sign) for own in vertex.clusters]
    vertex.corners = balls(supports, radius, vertex.place)
    pairs = [set(clusters_beside(vertex, rail, which)) for rail, which in vertex.ends]
    if not all(any(pair <= set(ball.clusters) for ball in vertex.corners) for pair in pairs):
        vertex.corners = []


def balls(supports: Sequence[Support], radius: float, tip: FloatArray) -> list[Ball]:
    """Balls that touch at least three faces at a corner and are in none.

    Parameters
    ----------
    supports : sequence of Support
    radius : float
        In mm.
    tip : (3,) float64
        Where the faces meet.
    """
    centres: list[FloatArray] = []
    for triple in combinations(supports, 3):
        centre = _touching(triple, radius, tip)
        if centre is None or min(float(s(centre[None])[0][0]) for s in supports) < radius * (1 - _SAME):
            continue
        if all(float(np.linalg.norm(centre - other)) > _SAME * radius for other in centres):
            centres.append(centre)
    found = []
    for centre in centres:
        values, slopes = zip(*((f[0], g[0]) for f, g in (s(centre[None]) for s in supports)), strict=True)
        touched = [index for index, f in enumerate(values) if f < radius * (1 + _SAME)]
        contacts = -np.array([slopes[index] for index in touched])
        order = _around(contacts)
        found.append(Ball(centre, radius, tuple(touched[i] for i in order), contacts[order]))
    return found


def _touching(supports: Sequence[Support], radius: float, tip: FloatArray) -> FloatArray | None:
    """Centre (3,) of the ball that touches three faces; None if there is none, or no clear one."""
    before, x, done = tip, tip, 0.0
    for last, share in zip((0.0, *_GROWTH), _GROWTH, strict=False):
        ahead = x if done == last else x + (x - before) * (share - last) / (last - done)
        before, done, solved = x, last, False
        x = ahead
        for _ in range(_ROUNDS):
            values, slopes = zip(*((f[0], g[0]) for f, g in (s(x[None]) for s in supports)), strict=True)
            rows, miss = np.array(slopes), share * radius - np.array(values)
            if float(np.abs(miss).max()) <= _SOLVED * radius:
                solved = True
                break
            if abs(float(np.linalg.det(rows))) < 1e-4:
                return None
            move = np.linalg.solve(rows, miss)
            x = x + move * min(1.0, radius / max(float(np.linalg.norm(move)), 1e-300))
    return x if solved else None


def _around(directions: FloatArray) -> list[int]:
    """Order of unit directions (K, 3) around their mean."""
    axis = directions.mean(axis=0)
    axis = axis / np.linalg.norm(axis)
    first = directions[0] - (directions[0] @ axis) * axis
    second = np.cross(axis, first)
    angles = np.arctan2(directions @ second, directions @ first)
    return [int(i) for i in np.argsort(angles)]


def around(vertex: Vertex, rail: Rail, which: Literal[0, 1], faces: PartFaces, radius: float) -> Around:
    """Faces around one end of a rail, and on which side of them its edge lies."""
    own = clusters_beside(vertex, rail, which)
    others = [index for index in range(len(vertex.clusters)) if index not in own]
    if not others:
        return Around(own, {})
    seeds = [min(vertex.clusters[index]) for index in others]
    groups = faces.groups(seeds)
    looks = np.minimum(np.array(_LOOKS) * radius, 0.6 * rail.guide.length)
    places, _ = rail.guide.place(looks if which == 0 else rail.guide.length - looks)
    cuts = {}
    for index, seed in zip(others, seeds, strict=True):
        support = Support(groups[seed], rail.sign)
        value, _ = support(places)
        clear = np.flatnonzero(np.abs(value) > _LEAVING * looks)
        cuts[index] = (support, float(np.sign(value[clear[0] if len(clear) else -1])) or 1.0)
    return Around(own, cuts)


def clusters_beside(vertex: Vertex, rail: Rail, which: Literal[0, 1]) -> tuple[int, int]:
    """Clusters on the left and on the right of a rail at a vertex."""
    left, right = rail.ends[which].sides
    return vertex.cluster(left), vertex.cluster(right)
