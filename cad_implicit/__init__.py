"""cad_implicit: the fillet that never fails.

A part becomes a mesh, the mesh an implicit field, operations make new fields, and a contour gives a closed part back::

    part -> Mesh -> Implicit -> operations -> contour -> Mesh -> part

Conventions, everywhere: lengths in mm, **positive inside**, arrays in ``ij`` order, points ``(N, 3)`` (or ``(N, 2)`` in
the plane), values ``(N,)``.

A tour
------
A part may be a STEP, BREP, STL, 3MF, OBJ or PLY file, a CadQuery or build123d object, or arrays. Here two boxes, joined
by a function that is positive inside:

>>> import numpy as np
>>> import cad_implicit as ci
>>> def two_boxes(x):
...     def box(low, high):
...         return np.minimum(x - low, high - x).min(axis=1)
...     return np.maximum(box([0, 0, 0], [8, 4, 2]), box([0, 0, 0], [3, 4, 6]))
>>> shape = ci.Function(two_boxes, [[0, 0, 0], [8, 4, 6]])

Operations take a shape and return a shape, so they nest. Functions are worked on by the paper's grid unless the exact
engine is asked for, which is the default for parts and meshes:

>>> filleted = ci.fillet(shape, 1.0, spacing=0.1, engine="exact")
>>> mesh = ci.contour(filleted)
>>> mesh.is_watertight, mesh.components, mesh.genus
(True, 1, 0)

The two boxes are 112 mm³; the ball of radius 1 in the corner adds (1 - pi/4) mm² along 4 mm, less at the open ends:

>>> bool(112.7 < mesh.volume < 112.86)
True
>>> ci.save(mesh, "part.stl")  # doctest: +SKIP

Chosen edges of a part are filleted, rounded or chamfered as in CAD, up to their ends, and nothing else changes:

>>> block = ci.contour(ci.box((8, 4, 2)), 0.5)
>>> part = ci.contour(ci.fillet(block, 1.5, edges="|Z"))
>>> bool(abs(part.volume - (64 - 4 * (1 - np.pi / 4) * 1.5**2 * 2)) < 0.01)
True

Parts can be made of primitives with exact distances, carved out to a wall, and filled with a lattice:

>>> part = ci.box((8, 4, 2)) - ci.cylinder(0.8, 3).moved((2, 0, 0)) | ci.sphere(1.5).moved((-2, 0, 1))
>>> light = ci.infill(part, cell=2.0, wall=0.3, kind="gyroid")
>>> 0.6 < ci.contour(light).volume / ci.contour(part, 0.1).volume < 0.8
True
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .cad import save as save
    from .cad import to_mesh as to_mesh
    from .cad.edges import Edge as Edge
    from .cad.edges import edges as edges
    from .cad.solids import SolidPart as SolidPart
    from .comparison import compare as compare
    from .contouring import contour as contour
    from .contouring import contour_curves as contour_curves
    from .distance import MeshDistance as MeshDistance
    from .field import Field as Field
    from .field import sample as sample
    from .grading import graded as graded
    from .grid import Grid as Grid
    from .implicit import Function as Function
    from .implicit import Implicit as Implicit
    from .job import run as run
    from .lattice import slab_lattice as slab_lattice
    from .lattice import strut_lattice as strut_lattice
    from .local_blend import LocalBlend as LocalBlend
    from .local_ops import chamfer as chamfer
    from .local_ops import max_radius as max_radius
    from .mesh import Mesh as Mesh
    from .minimal import tpms as tpms
    from .ops import fillet as fillet
    from .ops import offset as offset
    from .ops import round as round
    from .ops import smooth as smooth
    from .parting import to_part as to_part
    from .redistancing import redistance as redistance
    from .rfunctions import normalize as normalize
    from .rfunctions import taubin as taubin
    from .rjoins import blend_intersection as blend_intersection
    from .rjoins import blend_subtraction as blend_subtraction
    from .rjoins import blend_union as blend_union
    from .rjoins import r_intersection as r_intersection
    from .rjoins import r_subtraction as r_subtraction
    from .rjoins import r_union as r_union
    from .rsystems import RAlpha as RAlpha
    from .rsystems import RPower as RPower
    from .rsystems import RSmooth as RSmooth
    from .shapes import box as box
    from .shapes import circle as circle
    from .shapes import cone as cone
    from .shapes import cylinder as cylinder
    from .shapes import ellipsoid as ellipsoid
    from .shapes import extruded as extruded
    from .shapes import plane as plane
    from .shapes import polygon as polygon
    from .shapes import rectangle as rectangle
    from .shapes import revolved as revolved
    from .shapes import slab as slab
    from .shapes import sphere as sphere
    from .shapes import superquadric as superquadric
    from .shapes import torus as torus
    from .shelling import infill as infill
    from .shelling import shell as shell
    from .simplifying import simplify as simplify
    from .skeletons import convolution as convolution
    from .transforms import mirrored as mirrored
    from .transforms import moved as moved
    from .transforms import scaled as scaled
    from .transforms import turned as turned

__version__ = "0.1.0"

#: Public names and the modules they live in; imported when first used, so that ``import cad_implicit`` costs nothing.
_HOMES = {
    "Edge": "cad.edges",
    "Field": "field",
    "Function": "implicit",
    "Grid": "grid",
    "Implicit": "implicit",
    "LocalBlend": "local_blend",
    "Mesh": "mesh",
    "MeshDistance": "distance",
    "RAlpha": "rsystems",
    "RPower": "rsystems",
    "RSmooth": "rsystems",
    "SolidPart": "cad.solids",
    "blend_intersection": "rjoins",
    "blend_subtraction": "rjoins",
    "blend_union": "rjoins",
    "box": "shapes",
    "chamfer": "local_ops",
    "circle": "shapes",
    "compare": "comparison",
    "cone": "shapes",
    "contour": "contouring",
    "contour_curves": "contouring",
    "convolution": "skeletons",
    "cylinder": "shapes",
    "edges": "cad.edges",
    "ellipsoid": "shapes",
    "extruded": "shapes",
    "fillet": "ops",
    "graded": "grading",
    "infill": "shelling",
    "max_radius": "local_ops",
    "mirrored": "transforms",
    "moved": "transforms",
    "normalize": "rfunctions",
    "offset": "ops",
    "plane": "shapes",
    "polygon": "shapes",
    "r_intersection": "rjoins",
    "r_subtraction": "rjoins",
    "r_union": "rjoins",
    "rectangle": "shapes",
    "redistance": "redistancing",
    "revolved": "shapes",
    "round": "ops",
    "run": "job",
    "sample": "field",
    "save": "cad",
    "scaled": "transforms",
    "shell": "shelling",
    "simplify": "simplifying",
    "slab": "shapes",
    "slab_lattice": "lattice",
    "smooth": "ops",
    "sphere": "shapes",
    "strut_lattice": "lattice",
    "superquadric": "shapes",
    "taubin": "rfunctions",
    "to_mesh": "cad",
    "to_part": "parting",
    "torus": "shapes",
    "tpms": "minimal",
    "turned": "transforms",
}

__all__ = [*_HOMES, "errors"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES and name != "errors":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = import_module(f".{_HOMES.get(name, name)}", __name__)
    if name in _HOMES:
        value = getattr(value, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
