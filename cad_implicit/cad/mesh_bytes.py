"""Bytes of mesh files, made safe for the reader.

Archives that would burst and STL files cut short are refused; polygons of OBJ files, which the reader would cut into
fans though they need not be convex, become triangles.
"""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import numpy as np

from cad_implicit.errors import FileFormatError
from cad_implicit.mesh import FloatArray

#: Members of 3MF archives beyond so many bytes are refused if they are packed better than by this factor: models pack
#: by 5 to 30, blanks by 1000.
_UNPACKED, _PACKING = 100_000_000, 200

#: A binary STL: its title and its count of triangles, and a triangle, with its normal and an unused number.
_STL_HEAD, _STL_TRIANGLE = 84, 50


def safe_bytes(path: Path) -> tuple[bytes, list[str]]:
    """Bytes of a mesh file as its reader should see them, and what was done to them.

    Raises
    ------
    FileFormatError
        If the file is not what its suffix says, cut short, or would unpack to more than any model.
    """
    kind = path.suffix.lower()
    if kind == ".3mf":
        _check_archive(path)
    data = path.read_bytes()
    if kind == ".stl":
        return _stl(path, data)
    if kind == ".obj":
        return _obj(path, data)
    return data, []


def _check_archive(path: Path) -> None:
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, OSError, ValueError) as error:
        raise FileFormatError(f"{path} is not a 3MF file: {error}; export it again") from None
    if not any(item.filename.lower().endswith(".model") for item in members):
        raise FileFormatError(f"{path} is not a 3MF file: there is no model in the archive; export it again")
    for item in members:
        if item.file_size > _UNPACKED and item.file_size > _PACKING * item.compress_size:
            raise FileFormatError(
                f"{path} is refused: {item.filename} in it unpacks from {item.compress_size:,} to {item.file_size:,} "
                "bytes, as no model does"
            )


def _stl(path: Path, data: bytes) -> tuple[bytes, list[str]]:
    """Binary STL as long as it says; text is left alone."""
    if b"facet" in data[:4096] or len(data) < _STL_HEAD:
        return data, []
    (count,) = struct.unpack("<I", data[80:_STL_HEAD])
    expected = _STL_HEAD + _STL_TRIANGLE * count
    if len(data) < expected:
        raise FileFormatError(
            f"{path} is no STL file, or cut short: {len(data):,} bytes hold "
            f"{(len(data) - _STL_HEAD) // _STL_TRIANGLE:,} triangles, and it says {count:,}; export it again"
        )
    if len(data) > expected:
        return data[:expected], [f"bytes left out after the last triangle: {len(data) - expected:,}"]
    return data, []


def _obj(path: Path, data: bytes) -> tuple[bytes, list[str]]:
    """OBJ in which polygons of more than three corners are triangles.

    The reader takes corner 0, which there is none of, for corner 1.
    """
    if not any(len(line.split()) > 4 for line in data.splitlines() if line.startswith(b"f ")):
        numbers = [
            part.split(b"/")[0] for line in data.splitlines() if line.startswith(b"f ") for part in line.split()[1:]
        ]
        if b"0" in numbers:
            raise FileFormatError(f"{path} has a face with corner 0; corners are numbered from 1: export it again")
        return data, []
    points: list[list[float]] = []
    lines: list[bytes] = []
    for line in data.splitlines():
        if line.startswith(b"v "):
            points.append(_numbers(path, line))
        if line.startswith(b"f "):
            lines += [b"f %d %d %d" % triangle for triangle in _triangles(path, line, points)]
        elif not line.startswith((b"vt ", b"vn ")):  # faces no longer name them
            lines.append(line)
    return b"\n".join(lines) + b"\n", []


def _numbers(path: Path, line: bytes) -> list[float]:
    try:
        x, y, z = (float(word) for word in line.split()[1:4])
    except ValueError:
        raise FileFormatError(
            f"{path} cannot be read as OBJ: {line.decode(errors='replace')!r}; export it again"
        ) from None
    return [x, y, z]


def _triangles(path: Path, line: bytes, points: list[list[float]]) -> list[tuple[int, int, int]]:
    """Triangles of a face, corners numbered from 1."""
    try:
        corners = [int(word.split(b"/")[0]) for word in line.split()[1:]]
    except ValueError:
        corners = []
    corners = [corner if corner > 0 else len(points) + 1 + corner for corner in corners if corner]
    if (
        len(corners) != len(line.split()) - 1
        or len(corners) < 3
        or not 1 <= min(corners) <= max(corners) <= len(points)
    ):
        shown = line.decode(errors="replace")[:60]
        raise FileFormatError(
            f"{path} has the face {shown!r}, but {len(points)} corners are known there; export it again"
        )
    if len(corners) == 3:
        return [(corners[0], corners[1], corners[2])]
    return [(corners[a], corners[b], corners[c]) for a, b, c in _cut(np.array([points[n - 1] for n in corners]))]


def _cut(polygon: FloatArray) -> list[tuple[int, int, int]]:
    """Triangles of a polygon (N, 3), which need be neither convex nor quite flat."""
    normal = np.cross(polygon, np.roll(polygon, -1, axis=0)).sum(axis=0)  # Newell's
    length = float(np.linalg.norm(normal))
    count = len(polygon)
    if length == 0:
        return [(0, n, n + 1) for n in range(1, count - 1)]
    normal /= length
    x = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    x /= np.linalg.norm(x)
    flat = polygon @ np.stack([x, np.cross(normal, x)], axis=1)
    steps = np.roll(flat, -1, axis=0) - flat
    turns = steps[:, 0] * np.roll(steps, -1, axis=0)[:, 1] - steps[:, 1] * np.roll(steps, -1, axis=0)[:, 0]
    if (turns >= 0).all():
        return [(0, n, n + 1) for n in range(1, count - 1)]
    from manifold3d import triangulate

    return [(int(a), int(b), int(c)) for a, b, c in triangulate([flat])]
