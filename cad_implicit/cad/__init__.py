"""Parts in and out: CAD files, objects of CadQuery and build123d, meshes; fields out.

Importing this package imports neither a host nor OCP; they are imported when a B-rep is met.
"""

from .assemblies import Assembly, open_assembly
from .files import (
    FIELD_EXTENSIONS,
    INPUT_EXTENSIONS,
    OUTPUT_EXTENSIONS,
    PART_EXTENSIONS,
    check_output,
    check_suffix,
    readable,
)
from .parts import OpenPart, open_part, to_mesh
from .writing import save

__all__ = [
    "FIELD_EXTENSIONS",
    "INPUT_EXTENSIONS",
    "OUTPUT_EXTENSIONS",
    "PART_EXTENSIONS",
    "Assembly",
    "OpenPart",
    "check_output",
    "check_suffix",
    "open_assembly",
    "open_part",
    "readable",
    "save",
    "to_mesh",
]
