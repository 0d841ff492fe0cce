"""Field files out: .npz (NumPy), .vti (VTK, ParaView), .nrrd (Slicer, ImageJ)."""

from __future__ import annotations

import sys
from base64 import b64encode
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

import numpy as np

from cad_implicit.field import Field

#: Bytes encoded at a time; a multiple of 3, so that pieces of base64 join without padding.
_CHUNK = 3 << 20


def write_field(field: Field, path: Path, kind: str) -> None:
    """Write a field with its grid in mm; ``kind`` is the suffix in lower case.

    ``.npz`` holds the arrays ``origin (D,)``, ``spacing (D,)`` and ``values`` in ``ij`` order.
    """
    {".npz": _write_npz, ".nrrd": _write_nrrd, ".vti": _write_vti}[kind](field, path)


def _write_npz(field: Field, path: Path) -> None:
    with path.open("wb") as file:  # an open file, since NumPy adds its own suffix to names
        np.savez(file, origin=field.grid.origin, spacing=field.grid.spacing, values=field.values)


def _write_nrrd(field: Field, path: Path) -> None:
    import nrrd

    grid = field.grid
    header = {
        "space dimension": grid.dim,
        "space directions": np.diag(grid.spacing),
        "space origin": np.array(grid.origin),
        "space units": ["mm"] * grid.dim,
        "kinds": ["domain"] * grid.dim,
        "encoding": "raw",  # gzip makes distances hardly smaller and takes far longer
    }
    nrrd.write(str(path), np.asarray(field.values), header, index_order="F")


def _write_vti(field: Field, path: Path) -> None:
    """Write VTK's XML image data: one scalar array, base64, appended; a field in the plane is one layer."""
    pad = (0,) * (3 - field.grid.dim)
    origin = _words((*field.grid.origin, *pad))
    spacing = _words((*field.grid.spacing, *(1 for _ in pad)))
    extent = _words(last for count in (*field.grid.shape, *(1 for _ in pad)) for last in (0, count - 1))
    kind = {np.dtype(np.float32): "Float32", np.dtype(np.float64): "Float64"}[field.values.dtype]
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    head = f"""<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="{order}" header_type="UInt64">
  <ImageData WholeExtent="{extent}" Origin="{origin}" Spacing="{spacing}">
    <Piece Extent="{extent}">
      <PointData Scalars="value">
        <DataArray type="{kind}" Name="value" format="appended" offset="0"/>
      </PointData>
    </Piece>
  </ImageData>
  <AppendedData encoding="base64">
   _"""
    with path.open("wb") as file:
        file.write(head.encode())
        file.write(b64encode(np.uint64(field.values.nbytes).tobytes()))
        _write_base64(field, file)
        file.write(b"\n  </AppendedData>\n</VTKFile>\n")


def _write_base64(field: Field, file: BinaryIO) -> None:
    """Write the values with the first axis fastest, as VTK wants them, layer by layer to save memory."""
    rest = b""
    for layer in np.moveaxis(field.values, -1, 0):
        rest += layer.tobytes(order="F")
        if len(rest) >= _CHUNK:
            whole = len(rest) // 3 * 3
            file.write(b64encode(rest[:whole]))
            rest = rest[whole:]
    file.write(b64encode(rest))


def _words(numbers: Iterable[float]) -> str:
    return " ".join(repr(number) for number in numbers)
