"""Mesh: closed, oriented triangles; lengths in mm, normals outward.

Not promised: a Mesh may be open, overlap itself or hold slivers. Operations check what they need and say so.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidMeshError, OpenMeshError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]

#: Coordinates beyond, in mm, are refused: their cubes, as in volumes, and the numbers of files would overflow.
_FARTHEST = 1e30

#: Triangles measured at a time, so that what that takes stays below the mesh itself.
_BATCH = 1 << 20


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with shared vertices.

    Parameters
    ----------
    vertices : (V, 3) array_like
        Positions in mm; stored as float64.
    faces : (F, 3) array_like
        Vertex indices, counter-clockwise seen from outside; stored as int32.
    face_ids : (F,) array_like, optional
        The 0-based B-rep face that each triangle came from; -1 for none.
    source : dict, optional
        What is known of the origin (file name, unit, name, colour), for messages and for export.

    Raises
    ------
    InvalidMeshError
        If the arrays have the wrong shape, are not finite, or faces point to vertices that do not exist.
    """

    vertices: FloatArray
    faces: IntArray
    face_ids: IntArray | None = None
    source: dict[str, object] = field(default_factory=dict)

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        face_ids: ArrayLike | None = None,
        source: dict[str, object] | None = None,
    ) -> None:
        v = np.ascontiguousarray(vertices, np.float64)
        f = np.ascontiguousarray(faces)
        if v.ndim != 2 or v.shape[1] != 3 or f.ndim != 2 or f.shape[1] != 3:
            raise InvalidMeshError(f"a mesh needs vertices (V, 3) and faces (F, 3), not {v.shape} and {f.shape}")
        if len(f) == 0:
            raise InvalidMeshError("the mesh has no triangles")
        if not np.issubdtype(f.dtype, np.integer):
            raise InvalidMeshError(f"faces must be integers, not {f.dtype}")
        if f.min() < 0 or f.max() >= len(v):
            raise InvalidMeshError(f"faces name vertices {f.min()}..{f.max()}, but there are {len(v)}")
        if not np.abs(v).max() <= _FARTHEST:
            bad = int((~(np.abs(v) <= _FARTHEST)).any(axis=1).sum())
            raise InvalidMeshError(
                f"{bad} of {len(v)} vertices are not finite or beyond {_FARTHEST:g} mm; remove them before meshing"
            )
        ids = None if face_ids is None else np.ascontiguousarray(face_ids, np.int32)
        if ids is not None and ids.shape != (len(f),):
            raise InvalidMeshError(f"face_ids must have one entry for each of {len(f)} faces, not {ids.shape}")
        f = f.astype(np.int32)
        for array in (v, f, ids):
            if array is not None:
                array.setflags(write=False)
        object.__setattr__(self, "vertices", v)
        object.__setattr__(self, "faces", f)
        object.__setattr__(self, "face_ids", ids)
        object.__setattr__(self, "source", dict(source or {}))

    @cached_property
    def bounds(self) -> FloatArray:
        """Lower and upper corner ``(2, 3)`` of the used vertices in mm."""
        used = _marked(self.faces, len(self.vertices))[:, None]
        low = self.vertices.min(axis=0, where=used, initial=np.inf)
        return np.stack([low, self.vertices.max(axis=0, where=used, initial=-np.inf)])

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal in mm."""
        return float(np.linalg.norm(self.bounds[1] - self.bounds[0]))

    @cached_property
    def face_vectors(self) -> FloatArray:
        """Outward normals ``(F, 3)``, each as long as its triangle's area in mm²."""
        return self._vectors(slice(None))

    @cached_property
    def area(self) -> float:
        """Surface area in mm²."""
        return float(sum(np.linalg.norm(self._vectors(some), axis=1).sum() for some in self._batches()))

    @cached_property
    def volume(self) -> float:
        """Enclosed volume in mm³, positive if normals point outward (divergence theorem)."""
        return float(self.shell_volumes.sum())

    @cached_property
    def open_edges(self) -> int:
        """Number of directed edges that are not met by exactly one opposite edge; 0 for a closed mesh."""
        from .kernels.edges import open_edges

        return int(open_edges(len(self.vertices), np.ascontiguousarray(self.faces)))

    @property
    def is_watertight(self) -> bool:
        """Whether every edge has exactly one triangle on each side, consistently oriented."""
        return self.open_edges == 0

    @cached_property
    def component_of_face(self) -> IntArray:
        """Number ``(F,)`` of the connected component (by shared vertices) of each triangle."""
        from .kernels.linked import linked

        pairs = np.ascontiguousarray(self.faces[:, [0, 1, 1, 2]].reshape(-1, 2), np.int32)
        labels = linked(len(self.vertices), pairs)[self.faces[:, 0]]
        return np.asarray((np.cumsum(_marked(labels, len(self.vertices))) - 1)[labels], np.int32)

    @property
    def shells(self) -> int:
        """Number of connected surfaces, cavities among them."""
        return int(self.component_of_face.max()) + 1

    @cached_property
    def shell_volumes(self) -> FloatArray:
        """Signed volume of each shell in mm³; cavities are negative."""
        from .kernels.edges import cone_volumes

        centre = self.vertices.mean(axis=0)
        return np.asarray(cone_volumes(self.vertices, self.faces, centre, self.component_of_face, self.shells))

    @property
    def components(self) -> int:
        """Number of connected solids: shells of positive volume."""
        return int((self.shell_volumes > 0).sum())

    @property
    def genus(self) -> int:
        """Number of through holes, summed over all shells (from the Euler characteristic of a closed mesh)."""
        edges = 3 * len(self.faces) // 2
        euler = int(_marked(self.faces, len(self.vertices)).sum()) - edges + len(self.faces)
        return self.shells - euler // 2

    def _batches(self) -> Iterator[slice]:
        """Triangles, some at a time."""
        return (slice(start, start + _BATCH) for start in range(0, len(self.faces), _BATCH))

    def _vectors(self, some: slice) -> FloatArray:
        """Give the normals (N, 3) of triangles, as long as their area."""
        a, b, c = (self.vertices[self.faces[some, i]] for i in range(3))
        return np.asarray(np.cross(b - a, c - a) / 2)

    def require_closed(self) -> Mesh:
        """Return this mesh.

        Raises
        ------
        OpenMeshError
            If an edge does not have one triangle on each side; says how many.
        """
        if self.open_edges:
            raise OpenMeshError(
                f"the mesh is not closed: {self.open_edges} of {3 * len(self.faces) // 2} edges are open or shared "
                "by more than two triangles; repair it first (for instance with trimesh.repair or in FreeCAD's "
                "Mesh workbench)",
                self.open_edges,
            )
        return self

    def transformed(self, matrix: ArrayLike) -> Mesh:
        """Mesh moved by a homogeneous matrix ``(4, 4)``; mirrored ones are turned outward again."""
        m = np.asarray(matrix, np.float64)
        faces = self.faces if np.linalg.det(m[:3, :3]) > 0 else self.faces[:, ::-1]
        return Mesh(self.vertices @ m[:3, :3].T + m[:3, 3], faces, self.face_ids, self.source)

    def show(self, screenshot: str | Path | None = None) -> None:
        """Open a window with the mesh (drag to turn), or render it to a PNG, which needs no display.

        Parameters
        ----------
        screenshot : str or Path, optional
            The PNG; without it a window opens, and this waits until it is closed.

        Raises
        ------
        CadImplicitError
            If pyvista is not installed.
        """
        from .pictures import show

        show(self, screenshot)

    def _repr_png_(self) -> bytes | None:
        """Give Jupyter a picture; None if pyvista is not installed."""
        from .pictures import png

        return png(self)


def _marked(numbers: IntArray, count: int) -> NDArray[np.bool_]:
    """Which of the numbers below ``count`` (count,) there are; a thirtieth of the time of numpy.unique."""
    marked = np.zeros(count, np.bool_)
    marked[numbers.ravel()] = True
    return marked
