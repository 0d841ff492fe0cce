"""Solids of plane faces, through text."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .brep_text import Brep, Child
from .facets import RESOLUTION, Polyhedron
from .freecad import Shape
from .freecad_geometry import read


def polyhedron(plan: Polyhedron) -> tuple[Shape, Callable[[int], bool]]:
    """Solid of plane faces, and a way to ask the kernel whether the face of a number is valid."""
    brep = Brep()
    edges = _edges(plan, brep)
    shells = plan.shells()
    own: list[list[Child]] = [[] for _ in range(max(shells) + 1)]
    order: list[list[int]] = [[] for _ in own]
    for number, (face, shell) in enumerate(zip(_faces(plan, edges, brep), shells, strict=True)):
        own[shell].append(face)
        order[shell].append(number)
    children = [Child("+", brep.record("Sh", [], faces), ()) for faces in own]
    brep.root = Child("+", brep.record("So", [], children), ())
    solid = read(brep.text()).Solids[0]
    faces = solid.Faces
    place = np.argsort(np.concatenate([np.array(numbers, np.int64) for numbers in order]))

    def is_good(number: int) -> bool:
        return bool(faces[int(place[number])].isValid())

    return solid, is_good


def _edges(plan: Polyhedron, brep: Brep) -> list[int]:
    """Give the records of straight edges between shared vertices."""
    points, tolerances = plan.points.tolist(), plan.vertex_off.tolist()
    corners = {}
    for number in np.unique(np.concatenate([plan.low, plan.high])).tolist():
        corners[number] = brep.record("Ve", [repr(tolerances[number]), " ".join(map(repr, points[number])), "0 0"])
    way = plan.points[plan.high] - plan.points[plan.low]
    length = np.linalg.norm(way, axis=1)
    directions = (way / length[:, None]).tolist()
    edges = []
    for a, b, direction, far, off in zip(
        plan.low.tolist(), plan.high.tolist(), directions, length.tolist(), plan.edge_off.tolist(), strict=True
    ):
        curve = brep.add("Curves", "1 " + " ".join(map(repr, (*points[a], *direction))))
        lines = [f" {off!r} 1 1 0", f"1  {curve} 0 0 {far!r}", "0"]
        edges.append(brep.record("Ed", lines, [Child("+", corners[a], ()), Child("-", corners[b], ())]))
    return edges


def _faces(plan: Polyhedron, edges: list[int], brep: Brep) -> list[Child]:
    first = np.cross(plan.faces.normals, np.eye(3)[np.argmin(np.abs(plan.faces.normals), axis=1)])
    first /= np.linalg.norm(first, axis=1)[:, None]
    frames = np.hstack([plan.faces.centres, plan.faces.normals, first, np.cross(plan.faces.normals, first)]).tolist()
    made, corner = [], 0
    for loops, frame in zip(plan.faces.loops, frames, strict=True):
        surface = brep.add("Surfaces", "1 " + " ".join(map(repr, frame)))
        wires = []
        for loop in loops:
            span = range(corner, corner + len(loop))
            pieces = [Child("+" if plan.forward[n] else "-", edges[plan.edge[n]], ()) for n in span]
            wires.append(Child("+", brep.record("Wi", [], pieces), ()))
            corner += len(loop)
        made.append(Child("+", brep.record("Fa", [f"0  {RESOLUTION!r} {surface} 0"], wires), ()))
    return made
