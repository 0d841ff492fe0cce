"""Files: which suffixes are read and written, what is checked before any work, mesh files in and out."""

from __future__ import annotations

import glob
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from shutil import copymode, rmtree
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from cad_implicit.errors import FileFormatError, InvalidMeshError, MissingHostError
from cad_implicit.mesh import Mesh

from .binary_meshes import write_ply, write_stl
from .kernel import within_freecad
from .mesh_bytes import safe_bytes
from .weld import welded

STEP_EXTENSIONS = (".step", ".stp")
BREP_EXTENSIONS = (*STEP_EXTENSIONS, ".brep")
MESH_EXTENSIONS = (".stl", ".3mf", ".obj", ".ply")
FIELD_EXTENSIONS = (".npz", ".vti", ".nrrd")
#: Suffixes that :func:`cad_implicit.cad.to_mesh` reads.
INPUT_EXTENSIONS = BREP_EXTENSIONS + MESH_EXTENSIONS
#: Suffixes that :func:`cad_implicit.cad.save` writes for a Mesh.
PART_EXTENSIONS = MESH_EXTENSIONS + BREP_EXTENSIONS
#: All suffixes that :func:`cad_implicit.cad.save` writes.
OUTPUT_EXTENSIONS = PART_EXTENSIONS + FIELD_EXTENSIONS

#: What to do where a B-rep is met and there is no OCP.
INSTALL_HOST = 'pip install "cad_implicit[cadquery]" or pip install "cad_implicit[build123d]"'

#: Coordinates of single precision are told to be coarse beyond this share of the part's diagonal.
_COARSE = 1e-5

#: Units that a 3MF file may name, in mm.
_UNITS = {
    "micron": 1e-3,
    "millimeter": 1.0,
    "millimeters": 1.0,  # trimesh, where the file names none
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
    if os.path.isdir(path):  # unlike Path.is_dir, never raises
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


def check_output(path: str | Path, allowed: tuple[str, ...] = OUTPUT_EXTENSIONS) -> Path:
    """Return the path if a file can be written there: to be asked before any work.

    Raises
    ------
    FileFormatError
        If the suffix is not among the allowed ones, or the folder does not exist or cannot be written to.
    MissingHostError
        If a B-rep is to be written and neither host is installed.
    """
    path = Path(path)
    if os.path.isdir(path):  # unlike Path.is_dir, never raises
        raise FileFormatError(f"{path} is a folder; give the name of a file")
    check_suffix(path, allowed)
    folder = path.parent
    if not os.path.isdir(folder):
        raise FileFormatError(f"{path} cannot be written: there is no folder {folder}; make it first")
    if not os.access(folder, os.W_OK):
        raise FileFormatError(f"{path} cannot be written: the folder {folder} is read-only; choose another")
    if path.suffix.lower() in BREP_EXTENSIONS and not within_freecad() and find_spec("OCP") is None:
        raise MissingHostError(f"writing {path.suffix} needs OCP, which comes with either host: {INSTALL_HOST}")
    return path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a path beside the target to write to; move it there on success, remove it on any failure.

    Raises
    ------
    FileFormatError
        If the operating system refuses.
    """
    target = Path(os.path.realpath(path))
    try:
        with TemporaryDirectory(prefix=f".{target.stem}-", dir=target.parent) as folder:
            beside = Path(folder, target.name)
            yield beside
            if target.exists():
                copymode(target, beside)
            os.replace(beside, target)
    except OSError as error:
        raise FileFormatError(f"{path} cannot be written: {error.strerror or error}") from error


def sweep(path: Path) -> None:
    """Remove what a process that was killed left beside a file that it was about to write."""
    for left in path.parent.glob(f".{glob.escape(path.stem)}-????????"):
        if left.is_dir() and all(item.name == path.name for item in left.iterdir()):
            rmtree(left, ignore_errors=True)


def write_mesh(mesh: Mesh, path: Path, kind: str) -> None:
    """Write .stl (binary), .3mf, .obj or .ply, in mm; ``kind`` is the suffix in lower case.

    STL and PLY hold float32.
    """
    if kind in (".stl", ".ply"):
        with path.open("wb") as file:
            (write_stl if kind == ".stl" else write_ply)(mesh, file)
        return
    import trimesh

    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, validate=False)
    name = str(mesh.source.get("name", "part"))
    with path.open("wb") as file:
        if kind == ".3mf":
            trimesh.Scene({name: body}).export(file, file_type="3mf")
        else:
            body.export(file, file_type=kind[1:])


#: trimesh logs what it tried before it gives up, with tracebacks; what it gives up with is told by our own errors.
logging.getLogger("trimesh").addHandler(logging.NullHandler())


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
    data, repairs = safe_bytes(path)
    try:
        scene = trimesh.load_scene(BytesIO(data), file_type=kind[1:], process=False, maintain_order=True)
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
    coarse = float(np.spacing(np.abs(mesh.bounds).max().astype(np.float32)))
    if kind == ".stl" and coarse > _COARSE * mesh.diagonal:
        repairs.append(f"so far from the origin its coordinates are whole multiples of {coarse:g} mm")
    if repairs:
        mesh.source["repairs"] = [*repairs, *mesh.source.get("repairs", [])]  # type: ignore[misc]
    return mesh


def _unit(scene: Any) -> float:
    name = str(scene.units or "millimeter").lower()
    if name not in _UNITS:
        raise ValueError(f"unknown unit {name!r}")
    return _UNITS[name]


def _first_line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
