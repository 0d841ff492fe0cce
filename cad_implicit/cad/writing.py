"""Results to files: a Mesh as a mesh or a faceted solid, a Field as a field."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from cad_implicit.errors import FileFormatError
from cad_implicit.field import Field
from cad_implicit.mesh import Mesh

from .fields import write_field
from .files import BREP_EXTENSIONS, FIELD_EXTENSIONS, PART_EXTENSIONS, check_output, replacing, write_mesh
from .kernel import kernel
from .solids import SolidPart, solid_of


def save(result: Mesh | Field | SolidPart, path: str | Path) -> Path:
    """Write a result to a file, by suffix; an existing file is replaced, and only by a whole one.

    Parameters
    ----------
    result : Mesh, Field or SolidPart
        A Mesh is written as .stl (binary, float32), .3mf, .obj, .ply (float32), or as a solid of plane faces to
        .step, .stp and .brep; a SolidPart (:func:`cad_implicit.to_part`) to the latter as it is; a Field as .npz
        (``origin``, ``spacing``, ``values``), .vti or .nrrd. All in mm.
    path : str or Path
        Suffix in upper or lower case.

    Returns
    -------
    Path
        The path written to.

    Raises
    ------
    FileFormatError
        If the suffix is not supported or not for this kind of result, or the file cannot be written.
    MissingHostError
        If a B-rep is to be written and neither host is installed.
    OpenMeshError, InvalidMeshError
        If no solid can be made of the mesh.
    """
    path = check_output(path)
    kind = path.suffix.lower()
    if not isinstance(result, Field | Mesh | SolidPart):
        raise FileFormatError(
            f"a {type(result).__name__} cannot be written; contour it to a Mesh, or sample it on a Grid to a Field"
        )
    if isinstance(result, SolidPart) and kind not in BREP_EXTENSIONS:
        raise FileFormatError(f"{kind} does not hold solids; write a SolidPart as {' '.join(BREP_EXTENSIONS)}")
    if isinstance(result, Field) != (kind in FIELD_EXTENSIONS):
        raise FileFormatError(_mismatch(result, kind))
    with replacing(path) as beside:
        if isinstance(result, Field):
            write_field(result, beside, kind)
        elif isinstance(result, SolidPart) or kind in BREP_EXTENSIONS:
            _write_brep(result, beside)
        else:
            write_mesh(result, beside, kind)
    return path


def _mismatch(result: object, kind: str) -> str:
    name = type(result).__name__
    if kind in FIELD_EXTENSIONS:
        return f"{kind} holds a Field, not a {name}; write a mesh as {' '.join(PART_EXTENSIONS)}"
    return f"{kind} holds a Mesh, not a {name}; contour it first, or write it as {' '.join(FIELD_EXTENSIONS)}"


def _write_brep(result: Mesh | SolidPart, path: Path) -> None:
    solid = solid_of(result) if isinstance(result, Mesh) else result
    time = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S")
    kernel(solid.wrapped, "files").write(solid.wrapped, path, solid.product or path.stem, time, solid.colour)
