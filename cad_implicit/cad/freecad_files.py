"""STEP and BREP files in and out, through FreeCAD.

Not promised: names and colours of STEP files are not read, and colours are not written; FreeCAD's own import and export
do that for documents.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import Part

from cad_implicit.errors import FileFormatError

from .freecad import Shape

#: The name that the kernel gives to a product.
_PRODUCT = re.compile(r"PRODUCT\('Open CASCADE[^']*','Open CASCADE[^']*'")


@dataclass(frozen=True, eq=False)
class Product:
    """What a file holds; the parts of a STEP file are not told apart."""

    shape: Shape

    def parts(self) -> list[Any]:
        """Parts with names and colours: none are known."""
        return []


def read_product(path: Path) -> Product:
    """Shape of a STEP or BREP file in mm.

    Raises
    ------
    FileFormatError
        If it cannot be read.
    """
    try:
        shape = Part.read(str(path))
    except (Part.OCCError, OSError) as error:
        raise FileFormatError(f"{path} cannot be read ({error}); export it again") from error
    if shape.isNull():
        raise FileFormatError(f"{path} holds no shape, or a corrupt one; export it again")
    return Product(shape)


def write(shape: Shape, path: Path, name: str, time: str, colour: object = None) -> None:
    """Write a shape in mm to a STEP or BREP file; FreeCAD itself sets the time.

    Raises
    ------
    FileFormatError
        If it cannot be written.
    """
    try:
        if path.suffix.lower() == ".brep":
            shape.exportBrep(str(path))
            return
        shape.exportStep(str(path))
    except (Part.OCCError, OSError) as error:
        raise FileFormatError(f"{path} cannot be written ({error})") from error
    title = name.encode("ascii", "replace").decode().replace("'", "''")
    text = path.read_text(encoding="utf-8")
    path.write_text(_PRODUCT.sub(lambda _: f"PRODUCT('{title}','{title}'", text), encoding="utf-8")
