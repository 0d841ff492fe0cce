"""Parts in and out: CAD files, objects of CadQuery and build123d, meshes; fields out.

Importing this package imports neither a host nor OCP; they are imported when a B-rep is met.
"""

from .files import FIELD_EXTENSIONS, INPUT_EXTENSIONS, PART_EXTENSIONS, check_suffix
from .parts import OpenPart, open_part, to_mesh

__all__ = [
    "FIELD_EXTENSIONS",
    "INPUT_EXTENSIONS",
    "PART_EXTENSIONS",
    "OpenPart",
    "check_suffix",
    "open_part",
    "to_mesh",
]
