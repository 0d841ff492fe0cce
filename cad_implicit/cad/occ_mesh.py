"""Triangles of B-rep solids: tessellated by the kernel, welded by topology."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.Message import Message_ProgressRange
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_FORWARD, TopAbs_REVERSED, TopAbs_SOLID
from OCP.TopLoc import TopLoc_Location

from cad_implicit import parallel
from cad_implicit.errors import NoSolidError
from cad_implicit.kernels.intersections import intersecting
from cad_implicit.mesh import FloatArray, Mesh
from cad_implicit.parallel import Progress, no_progress

try:
    from OCP import IMeshTools
except ImportError:  # OCP 7.7, that of CadQuery 2.5, has only the slower method
    IMeshTools = None

from .occ import Shape, as_edge, as_face, bounds, compound, distinct, explore, shape_map
from .weld import clean, closer, groups, joined, outward

#: Below this share of the diagonal the kernel's faster method is tried first. A sphere of 200 mm to 4 micrometres,
#: 246,000 triangles, takes 1.5 s with it and 20 s without; but one of 30 parts to 2e-5 had triangles that cross.
_FINE = 2e-5


def tessellate(
    parts: Sequence[Shape],
    tolerance: float | None = None,
    angular_tolerance: float = 0.2,
    progress: Progress = no_progress,
) -> tuple[Mesh, float]:
    """Triangles of solids; the solids themselves stay as they are.

    Parameters
    ----------
    parts : sequence of TopoDS_Shape
        Solids; each gives its own closed surface.
    tolerance : float, optional
        Largest distance in mm between triangle and surface; the diagonal / 2000 by default.
    angular_tolerance : float
        Largest angle in radians between neighbouring segments of a curve.
    progress : callable
        Called with stage "tessellate".

    Returns
    -------
    mesh : Mesh
        ``face_ids`` number the faces of the compound of all parts from 0 in the order of ``TopExp::MapShapes``.
        Closed if the B-rep is valid.
    tolerance : float
        The one used, in mm.
    """
    whole = compound(parts)
    low, high = bounds(whole)
    diagonal = float(np.linalg.norm(high - low))
    if tolerance is None:
        tolerance = diagonal / 2000
    progress("tessellate", 0.0)
    mesh = None
    if tolerance < _FINE * diagonal and IMeshTools is not None:
        mesh = _triangles(whole, tolerance, angular_tolerance, True, progress)
    if mesh is None or not _sound(mesh):
        mesh = _triangles(whole, tolerance, angular_tolerance, False, progress)
    progress("tessellate", 1.0)
    if mesh is None:
        raise NoSolidError(f"no face of {len(parts)} solids could be triangulated; check the part's geometry")
    return mesh, tolerance


def _triangles(whole: Shape, tolerance: float, angle: float, fast: bool, progress: Progress) -> Mesh | None:
    """Triangles of the solids of a compound by one of the kernel's methods; None if there are none."""
    copy = BRepBuilderAPI_Copy(whole, False, False).Shape()
    if fast:
        parameters = IMeshTools.IMeshTools_Parameters()
        parameters.Deflection, parameters.Angle, parameters.InParallel = tolerance, angle, True
        parameters.MeshAlgo = IMeshTools.IMeshTools_MeshAlgoType.IMeshTools_MeshAlgoType_Delabella
        BRepMesh_IncrementalMesh(copy, parameters, Message_ProgressRange())
    else:
        BRepMesh_IncrementalMesh(copy, tolerance, False, angle, True)
    progress("tessellate", 0.5)
    numbers = shape_map(copy, TopAbs_FACE)
    meshes = [mesh for solid in distinct(copy, TopAbs_SOLID) if (mesh := _solid_mesh(solid, numbers))]
    return joined(meshes) if meshes else None


def _sound(mesh: Mesh) -> bool:
    """Whether a mesh is closed, and no triangles of it run through each other."""
    with parallel.threads(None, len(mesh.faces)):
        return mesh.is_watertight and not bool(intersecting(mesh.vertices, mesh.faces).any())


def _solid_mesh(solid: Shape, numbers: Any) -> Mesh | None:
    """Triangles of one solid, welded along the edges that its faces share."""
    vertices, faces, ids, pairs = [], [], [], []
    edges = shape_map(solid, TopAbs_EDGE)
    first_use: dict[int, NDArray[np.int64]] = {}
    count = 0
    for shape in explore(solid, TopAbs_FACE):
        if shape.Orientation() not in (TopAbs_FORWARD, TopAbs_REVERSED):
            continue  # a face inside the material bounds nothing
        location = TopLoc_Location()
        triangulation = BRep_Tool.Triangulation_s(as_face(shape), location)
        if triangulation is None or not triangulation.NbTriangles():
            continue
        points, triangles = _face_arrays(triangulation, location, shape.Orientation() == TopAbs_REVERSED)
        vertices.append(points)
        faces.append(triangles + count)
        ids.append(np.full(len(triangles), numbers.FindIndex(shape) - 1))
        for edge in explore(shape, TopAbs_EDGE):
            nodes = _edge_nodes(as_edge(edge), triangulation, location)
            if nodes is not None:
                pairs.append(_same_nodes(edge, nodes + count, first_use, edges.FindIndex(edge)))
        count += len(points)
    if not faces:
        return None
    label, first = groups(count, np.concatenate(pairs or [np.zeros((0, 2), np.int64)]))
    points, triangles, face_ids = clean(
        np.concatenate(vertices)[first], label[np.concatenate(faces)], np.concatenate(ids)
    )
    return outward(closer(Mesh(points, triangles, face_ids))) if len(triangles) else None


def _face_arrays(triangulation: Any, location: Any, reverse: bool) -> tuple[FloatArray, NDArray[np.integer]]:
    """Nodes and triangles of one face in place, counter-clockwise seen from outside the material."""
    node, triangle = triangulation.Node, triangulation.Triangle  # bound once: half the time is such look-ups
    points = np.array([node(i).Coord() for i in range(1, triangulation.NbNodes() + 1)])
    triangles = np.array([triangle(i).Get() for i in range(1, triangulation.NbTriangles() + 1)], np.int32) - 1
    if not location.IsIdentity():
        move = location.Transformation()
        matrix = np.array([[move.Value(row, column) for column in range(1, 5)] for row in range(1, 4)])
        points = points @ matrix[:, :3].T + matrix[:, 3]
        reverse ^= bool(np.linalg.det(matrix[:, :3]) < 0)
    return points, triangles[:, ::-1] if reverse else triangles


def _edge_nodes(edge: Shape, triangulation: Any, location: Any) -> NDArray[np.int64] | None:
    """0-based nodes of a face's triangulation along an edge; a seam gives either side by its orientation."""
    polygon = BRep_Tool.PolygonOnTriangulation_s(edge, triangulation, location)
    return None if polygon is None else np.array([polygon.Node(i) for i in range(1, polygon.NbNodes() + 1)]) - 1


def _same_nodes(
    edge: Shape, nodes: NDArray[np.int64], first_use: dict[int, NDArray[np.int64]], number: int
) -> NDArray[np.int64]:
    """Pairs of nodes that are one vertex: along an edge with its first use, at a pole all of them."""
    if BRep_Tool.Degenerated_s(as_edge(edge)):
        return np.stack([np.full(len(nodes), nodes[0]), nodes], axis=1)
    other = first_use.setdefault(number, nodes)
    if len(other) != len(nodes):
        return np.zeros((0, 2), np.int64)
    return np.stack([other, nodes], axis=1)
