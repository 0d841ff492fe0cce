"""Numbers of edges and faces: from those of FreeCAD's shape to those of the part that the library works on.

They are the same for one solid. Of compounds the library unites the solids; there the places tell.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from cad_implicit.cad import OpenPart
from cad_implicit.cad.edges import edge_number, part_edges
from cad_implicit.errors import SelectorError

#: Points along an edge by which it is found.
_POINTS = 9

#: A face is the same if its area and centre are, to this share of the diagonal (and its square).
_SAME = 1e-6

_NO_PLACES = "meshes have no edges or faces to choose; choose the whole object"


def edge_numbers(shape: Any, part: OpenPart, edges: Mapping[int, float]) -> dict[int, float]:
    """Radii by the part's numbers of edges.

    Raises
    ------
    SelectorError
        If an edge is not there (any more).
    """
    _check(shape, "edge", edges, len(shape.Edges) if shape is not None else 0)
    if _alike(shape, part):
        return dict(edges)
    found = part_edges(part)
    points = {n: [(p.x, p.y, p.z) for p in shape.Edges[n - 1].discretize(_POINTS)] for n in edges}
    return {edge_number(part, found, points[n]): radius for n, radius in edges.items()}


def face_numbers(shape: Any, part: OpenPart, faces: Iterable[int]) -> list[int]:
    """Give the part's numbers of faces; errors as for edges."""
    faces = list(faces)
    _check(shape, "face", faces, len(shape.Faces) if shape is not None else 0)
    if _alike(shape, part):
        return faces
    diagonal = float(np.linalg.norm(part.bounds[1] - part.bounds[0]))
    result = []
    for number in faces:
        face = shape.Faces[number - 1]
        away = [
            max(other.CenterOfMass.distanceToPoint(face.CenterOfMass), abs(other.Area - face.Area) / diagonal)
            for other in part.shape.Faces
        ]
        if min(away) > _SAME * diagonal:
            raise SelectorError(f"face {number} is not there any more when the solids are united; unite them first")
        result.append(int(np.argmin(away)) + 1)
    return result


def _check(shape: Any, kind: str, numbers: Iterable[int], count: int) -> None:
    if shape is None:
        raise SelectorError(_NO_PLACES)
    missing = [n for n in numbers if not 1 <= n <= count]
    if missing:
        raise SelectorError(f"the source has no {kind} {missing[0]}: it has {count}")


def _alike(shape: Any, part: OpenPart) -> bool:
    own = part.shape
    return len(shape.Solids) == 1 and len(own.Edges) == len(shape.Edges) and len(own.Faces) == len(shape.Faces)
