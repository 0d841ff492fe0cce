"""Binary STL and PLY files, written some triangles at a time: what they take does not grow with the mesh."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from cad_implicit.mesh import Mesh

#: Triangles and vertices written at a time.
_BATCH = 1 << 18

#: Bytes of the title of an STL file, and what a triangle is.
_STL_HEAD = 80
_STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_PLY_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_stl(mesh: Mesh, file: BinaryIO) -> None:
    """Write binary STL: float32, in mm; normals of triangles without area are zero."""
    file.write(bytes(_STL_HEAD) + np.uint32(len(mesh.faces)).astype("<u4").tobytes())
    for start in range(0, len(mesh.faces), _BATCH):
        corners = mesh.vertices[mesh.faces[start : start + _BATCH]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        rows = np.zeros(len(corners), _STL)
        rows["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
        rows["corners"] = corners
        file.write(rows.tobytes())


def write_ply(mesh: Mesh, file: BinaryIO) -> None:
    """Write binary PLY: float32, in mm."""
    head = ["ply", "format binary_little_endian 1.0", "comment lengths in mm"]
    head += [f"element vertex {len(mesh.vertices)}", *(f"property float {axis}" for axis in "xyz")]
    head += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header", ""]
    file.write("\n".join(head).encode())
    for start in range(0, len(mesh.vertices), _BATCH):
        file.write(mesh.vertices[start : start + _BATCH].astype("<f4").tobytes())
    for start in range(0, len(mesh.faces), _BATCH):
        corners = mesh.faces[start : start + _BATCH]
        rows = np.empty(len(corners), _PLY_FACE)
        rows["count"], rows["corners"] = 3, corners
        file.write(rows.tobytes())
