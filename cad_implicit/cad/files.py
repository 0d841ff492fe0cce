"""Mesh files in, through trimesh; and the suffixes that are read and written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cad_implicit.errors import FileFormatError, InvalidMeshError
from cad_implicit.mesh import Mesh

from .weld import welded

BREP_EXTENSIONS = (".step", ".stp", ".brep")
MESH_EXTENSIONS = (".stl", ".3mf", ".obj", ".ply")
FIELD_EXTENSIONS = (".npz", ".vti", ".nrrd")
#: Suffixes that :func:`cad_implicit.cad.to_mesh` reads.
INPUT_EXTENSIONS = BREP_EXTENSIONS + MESH_EXTENSIONS
#: Suffixes that :func:`cad_implicit.cad.save` writes for a Mesh.
PART_EXTENSIONS = MESH_EXTENSIONS + BREP_EXTENSIONS

#: Units that a 3MF file may name, in mm.
_UNITS = {
    "micron": 1e-3,
    "millimeter": 1.0,
    "centimeter": 10.0,
    "inch": 25.4,
    "foot": 304.8,
    "meter": 1000.0,
}


def check_suffix(path: str | Path, allowed: tuple[str, ...] = INPUT_EXTENSIONS) -> Path:
    """Return the path if its suffix (in any case) is among the allowed ones.

    Raises
    ------
    FileFormatError
        If it is not; names those that are.
    """
    path = Path(path)
    if path.suffix.lower() not in allowed:
        kind = f"the suffix {path.suffix}" if path.suffix else "no suffix"
        raise FileFormatError(f"{path} has {kind}; supported are {' '.join(allowed)}")
    return path


def readable(path: str | Path) -> Path:
    """Return the path if it is a file that can be read, is not empty, and has a supported suffix.

    Raises
    ------
    FileFormatError
        If not; says what is wrong.
    """
    path = Path(path)
    if path.is_dir():
        raise FileFormatError(f"{path} is a folder; give a file of {' '.join(INPUT_EXTENSIONS)}")
    check_suffix(path)
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except FileNotFoundError:
        raise FileFormatError(f"{path} does not exist; check the path") from None
    except OSError as error:
        raise FileFormatError(f"{path} cannot be read: {error.strerror or error}; check its permissions") from None
    if empty:
        raise FileFormatError(f"{path} is empty (0 bytes); export it again")
    return path


def read_mesh(path: Path) -> Mesh:
    """Mesh of all bodies in an STL, 3MF, OBJ or PLY file, in place, in mm.

    Raises
    ------
    FileFormatError
        If the file is corrupt or holds no triangles.
    InvalidMeshError
        If vertices are not finite.
    """
    import trimesh

    kind = path.suffix.lower()
    size = path.stat().st_size
    try:
        with path.open("rb") as file:
            scene = trimesh.load_scene(file, file_type=kind[1:], process=False, maintain_order=True)
        bodies = [body for body in scene.dump() if isinstance(body, trimesh.Trimesh) and len(body.faces)]
        unit = _unit(scene) if kind == ".3mf" else 1.0
    except MemoryError:
        raise
    except Exception as error:  # trimesh's readers raise whatever their parsers raise
        raise FileFormatError(
            f"{path} cannot be read as {kind[1:].upper()} ({size:,} bytes): {_first_line(error)}; export it again"
        ) from error
    if not bodies:
        raise FileFormatError(f"{path} holds no triangles ({size:,} bytes); export it again as a mesh of triangles")
    start = np.cumsum([0] + [len(body.vertices) for body in bodies])
    vertices = np.concatenate([np.asarray(body.vertices, np.float64) for body in bodies]) * unit
    faces = np.concatenate([np.asarray(body.faces) + n for body, n in zip(bodies, start[:-1], strict=True)])
    source: dict[str, object] = {"kind": "mesh", "name": path.stem, "tolerance": None}
    try:
        mesh = welded(vertices, faces, share=kind == ".stl", source=source)
    except InvalidMeshError as error:
        raise InvalidMeshError(f"{path}: {error}") from None
    mesh.source["solids"] = mesh.components
    return mesh


def _unit(scene: Any) -> float:
    name = str(scene.units or "millimeter").lower()
    if name not in _UNITS:
        raise ValueError(f"unknown unit {name!r}")
    return _UNITS[name]


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
