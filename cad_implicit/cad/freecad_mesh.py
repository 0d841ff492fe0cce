"""Triangles of B-rep solids of FreeCAD: tessellated by the kernel, welded by topology."""

from __future__ import annotations

from collections.abc import Sequence

import MeshPart
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cad_implicit.errors import NoSolidError
from cad_implicit.mesh import FloatArray, Mesh
from cad_implicit.parallel import Progress, no_progress

from .freecad import Shape, bounds, compound
from .weld import clean, closer, groups, joined, outward

#: Nodes of a face are those of an edge beside it if they are nearer than this share of the diagonal: they are the same
#: points, moved to their places by different products.
_SAME = 1e-11

#: So coarse that the triangles that a face has already are good enough.
_AS_IT_IS = 1e9


def tessellate(
    parts: Sequence[Shape],
    tolerance: float | None = None,
    angular_tolerance: float = 0.2,
    progress: Progress = no_progress,
) -> tuple[Mesh, float]:
    """Triangles of solids; the solids themselves stay as they are.

    Parameters, results and errors are those of :func:`cad_implicit.cad.occ_mesh.tessellate`.
    """
    whole = compound(parts)
    low, high = bounds(whole)
    diagonal = float(np.linalg.norm(high - low))
    if tolerance is None:
        tolerance = diagonal / 2000
    progress("tessellate", 0.0)
    copy = whole.copy(True, False)
    MeshPart.meshFromShape(
        Shape=copy, LinearDeflection=tolerance, AngularDeflection=angular_tolerance, Relative=False
    )  # the shape keeps the triangles; the mesh that comes back is not closed
    progress("tessellate", 0.5)
    numbers = {face.hashCode(): number for number, face in enumerate(copy.Faces)}
    faces = copy.Faces
    meshes = []
    for solid in copy.Solids:
        own = [(_number(face, numbers, faces), face) for face in solid.Faces]
        mesh = _solid_mesh(solid, own, _SAME * diagonal)
        if mesh is not None:
            meshes.append(mesh)
    progress("tessellate", 1.0)
    if not meshes:
        raise NoSolidError(f"no face of {len(parts)} solids could be triangulated; check the part's geometry")
    return joined(meshes), tolerance


def _number(face: Shape, numbers: dict[int, int], faces: Sequence[Shape]) -> int:
    """Position of a face in the whole; faces may share a hash code."""
    number = numbers[face.hashCode()]
    return number if faces[number].isSame(face) else next(n for n, one in enumerate(faces) if one.isSame(face))


def _solid_mesh(solid: Shape, own: Sequence[tuple[int, Shape]], same: float) -> Mesh | None:
    """Triangles of one solid, welded along the edges that its faces share."""
    edges = solid.Edges
    known: dict[int, list[int]] = {}
    for number, edge in enumerate(edges):
        known.setdefault(edge.hashCode(), []).append(number)
    lines = [_line(solid, number) for number in range(1, len(edges) + 1)]
    starts = np.cumsum([0] + [len(line) for line in lines])
    points, triangles, ids, pairs, count = list(lines), [], [], [], int(starts[-1])
    for number, face in own:
        if face.Orientation not in ("Forward", "Reversed"):
            continue  # a face inside the material bounds nothing
        nodes, corners = face.tessellate(_AS_IT_IS)
        if not corners:
            continue
        place = np.array([tuple(node) for node in nodes])
        points.append(place)
        triangles.append(np.array(corners, np.int64) + count)
        ids.append(np.full(len(corners), number))
        tree = cKDTree(place)
        for edge in face.Edges:
            at = next(n for n in known[edge.hashCode()] if edges[n].isSame(edge))
            pairs.append(_same_nodes(lines[at], tree, int(starts[at]), count, same))
        count += len(place)
    if not triangles:
        return None
    label, first = groups(count, np.concatenate(pairs or [np.zeros((0, 2), np.int64)]))
    where, faces, face_ids = clean(np.concatenate(points)[first], label[np.concatenate(triangles)], np.concatenate(ids))
    return outward(closer(Mesh(where, faces, face_ids))) if len(faces) else None


def _line(solid: Shape, number: int) -> FloatArray:
    """Nodes (N, 3) along an edge, numbered from 1, as the triangles beside it have them."""
    return np.array([tuple(point) for point in solid.getLinesFromSubElement("Edge", number)[0]]).reshape(-1, 3)


def _same_nodes(line: FloatArray, tree: cKDTree, start: int, count: int, same: float) -> NDArray[np.int64]:
    """Pairs of nodes that are one vertex: of an edge, whose first one has a number, and of a face."""
    found = tree.query_ball_point(line, same) if len(line) else []
    pairs = [(start + n, count + node) for n, nodes in enumerate(found) for node in nodes]
    return np.array(pairs, np.int64).reshape(-1, 2)
