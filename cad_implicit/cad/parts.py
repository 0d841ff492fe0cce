"""Part to Mesh: whatever a user calls a part, as triangles in mm.

Objects of a host are recognised by what they offer, so neither CadQuery nor build123d is imported here.
Not promised: the Mesh of an invalid part may be open; :meth:`Mesh.require_closed` says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cad_implicit.errors import InvalidMeshError, NoSolidError, SpacingError
from cad_implicit.mesh import FloatArray, Mesh
from cad_implicit.parallel import Progress, no_progress

from . import files
from .kernel import is_freecad, is_occ, kernel
from .uniting import united
from .weld import outward, welded


@dataclass(frozen=True, eq=False)
class OpenPart:
    """A part that is read and understood, so that it can be turned into triangles more than once.

    Attributes
    ----------
    name : str
        Name of the file or object.
    shape : TopoDS_Shape, Part.Shape or None
        For a B-rep: its solids, united; one solid, or a compound of several.
    triangles : Mesh or None
        For a part that came as triangles.
    product : str
        Name of the product in a STEP file of one part; empty if it has none.
    colour : (3,) tuple of float or None
        Its red, green and blue in sRGB, from 0 to 1.
    """

    name: str
    shape: Any = None
    triangles: Mesh | None = None
    product: str = ""
    colour: tuple[float, float, float] | None = None

    @cached_property
    def bounds(self) -> FloatArray:
        """Lower and upper corner ``(2, 3)`` in mm of a box that holds the part."""
        if self.triangles is not None:
            return self.triangles.bounds
        return np.asarray(kernel(self.shape).bounds(self.shape))

    def mesh(
        self, tolerance: float | None = None, angular_tolerance: float = 0.2, progress: Progress = no_progress
    ) -> Mesh:
        """Triangles, as :func:`to_mesh` gives them."""
        if self.triangles is not None:
            return self.triangles
        solids = kernel(self.shape).solids(self.shape)
        mesh, used = kernel(self.shape, "mesh").tessellate(solids, tolerance, angular_tolerance, progress)
        source: dict[str, object] = {"kind": "brep", "name": self.name, "solids": len(solids), "tolerance": used}
        if self.product:
            source["product"] = self.product
        if self.colour is not None:
            source["colour"] = self.colour
        return Mesh(mesh.vertices, mesh.faces, mesh.face_ids, source)


def open_part(part: Any, *, unite: bool = True, progress: Progress = no_progress) -> OpenPart:
    """Read a part and unite its solids, without tessellating it.

    Parameters, stages of ``progress`` and errors are those of :func:`to_mesh`.
    """
    if isinstance(part, OpenPart):
        return part
    if isinstance(part, str | Path):
        return _open_file(files.readable(part), unite, progress)
    triangles = _triangles(part)
    if triangles is not None:
        return OpenPart(str(triangles.source.get("name", "mesh")), None, triangles)
    return OpenPart(_name(part), _solids(shape_of(part), unite, progress))


def to_mesh(
    part: Any,
    *,
    tolerance: float | None = None,
    angular_tolerance: float = 0.2,
    unite: bool = True,
    progress: Progress = no_progress,
) -> Mesh:
    """Triangles of a part, welded and turned outward.

    Parameters
    ----------
    part : path, host object, or triangles
        A path to .step .stp .brep .stl .3mf .obj .ply; a CadQuery Workplane, Shape or Assembly; a build123d Shape
        or BuildPart; a TopoDS_Shape; a Part.Shape or an object of FreeCAD that has one; a sequence of such shapes; a
        trimesh.Trimesh or Scene; a Mesh; an :class:`OpenPart`; or a pair of vertices ``(V, 3)`` and faces ``(F, 3)``.
        STEP and 3MF name their unit, all else is taken as mm.
    tolerance : float, optional
        Largest distance in mm between the triangles and the surface of a B-rep; its diagonal / 2000 by default.
    angular_tolerance : float
        Largest angle in radians between neighbouring segments of a curve of a B-rep.
    unite : bool
        Fuse solids of a B-rep that overlap or touch. Where the kernel fails at it, or with ``unite=False``, each
        solid keeps its own closed surface. Bodies of mesh files are kept as they are.
    progress : callable
        Called as ``progress(stage, fraction)`` with stages "read", "unite" and "tessellate"; may raise to cancel.

    Returns
    -------
    Mesh
        For a B-rep, ``face_ids`` are 0-based in the order of ``TopExp::MapShapes`` over the solids (united ones if
        there were several), and ``source`` holds kind, name, solids and tolerance, and product and colour if a STEP
        file tells them of its only part. Open if the part is.

    Raises
    ------
    FileFormatError
        If a file is missing, empty, corrupt or of a kind that is not supported.
    MissingHostError
        If a B-rep is given and neither host is installed.
    NoSolidError
        If a B-rep holds no solid.
    InvalidMeshError
        If triangles are malformed, or the part is of no known kind.
    SpacingError
        If a tolerance is not positive.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mesh = to_mesh((corners, [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]]))  # inside out
    >>> mesh.is_watertight, round(mesh.volume, 4)
    (True, 0.1667)
    """
    for name, value in (("tolerance", tolerance), ("angular_tolerance", angular_tolerance)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise SpacingError(f"{name} must be positive and finite, not {value}")
    return open_part(part, unite=unite, progress=progress).mesh(tolerance, angular_tolerance, progress)


def shape_of(part: Any) -> Any:
    """Shape of a host object; a compound if it holds several.

    Raises
    ------
    NoSolidError
        If the object is empty.
    InvalidMeshError
        If it is of no known kind.
    """
    shapes = [shape for shape in _shapes(part) if not kernel(shape).is_null(shape)]
    if not shapes:
        raise NoSolidError(f"the {type(part).__name__} is empty; give a part that holds a solid")
    return kernel(shapes[0]).compound(shapes)


def _open_file(path: Path, unite: bool, progress: Progress) -> OpenPart:
    progress("read", 0.0)
    if path.suffix.lower() in files.MESH_EXTENSIONS:
        mesh = files.read_mesh(path)
        progress("read", 1.0)
        return OpenPart(path.stem, None, mesh)
    product = kernel(None, "files").read_product(path)
    progress("read", 1.0)
    parts = product.parts()
    only = parts[0] if len(parts) == 1 and parts[0].uses == 1 else None
    try:
        solids = _solids(product.shape, unite, progress)
        return OpenPart(path.stem, solids, None, only.name if only else "", only.colour if only else None)
    except NoSolidError as error:
        raise NoSolidError(f"{path}: {error}") from None


def _solids(shape: Any, unite: bool, progress: Progress) -> Any:
    """Solids of a shape as one shape."""
    own = kernel(shape)
    progress("unite", 0.0)
    solids = united(shape) if unite else own.solids(shape)
    progress("unite", 1.0)
    return own.compound(solids)


def _shapes(part: Any) -> list[Any]:
    """Raw shapes in a host object, recognised by what it offers."""
    if _is_raw(part):
        return [part]
    if is_freecad(getattr(part, "Shape", None)):  # an object of a FreeCAD document
        return [part.Shape]
    if hasattr(part, "wrapped"):  # a shape of CadQuery or build123d; None if empty
        return [] if part.wrapped is None else [part.wrapped]
    if callable(getattr(part, "vals", None)):  # a CadQuery Workplane
        return _workplane_shapes(part)
    if callable(getattr(part, "toCompound", None)):  # a CadQuery Assembly
        return [part.toCompound().wrapped]
    if hasattr(part, "part"):  # a build123d BuildPart
        return [] if part.part is None else _shapes(part.part)
    if isinstance(part, Iterable) and not isinstance(part, dict | bytes):
        return [shape for item in part for shape in _shapes(item)]
    raise InvalidMeshError(
        f"a {type(part).__name__} is not a part; give a path, a CadQuery, build123d or FreeCAD object, a TopoDS_Shape, "
        "a trimesh.Trimesh, a Mesh, or a pair of vertices and faces"
    )


def _workplane_shapes(workplane: Any) -> list[Any]:
    """Shapes with solids on a CadQuery stack, or the last solid before it (the stack may hold edges or faces)."""
    shapes = [value.wrapped for value in workplane.vals() if _is_raw(getattr(value, "wrapped", None))]
    whole = [shape for shape in shapes if kernel(shape).has_solid(shape)]
    if whole:
        return whole
    try:
        return [workplane.findSolid().wrapped]
    except ValueError:  # CadQuery's way to say that there is none
        return shapes


def _is_raw(part: Any) -> bool:
    return is_occ(part) or is_freecad(part)


def _triangles(part: Any) -> Mesh | None:
    """Mesh of an object that holds triangles; None if it holds something else."""
    if isinstance(part, Mesh):
        return outward(part)
    source: dict[str, object] = {"kind": "mesh", "name": "mesh", "tolerance": None}
    if hasattr(part, "wrapped"):
        return None
    if hasattr(part, "geometry") and callable(getattr(part, "to_mesh", None)):  # a trimesh.Scene
        part = part.to_mesh()
    vertices, faces = getattr(part, "vertices", None), getattr(part, "faces", None)
    if isinstance(part, tuple | list) and len(part) == 2 and not any(_is_host(item) for item in part):
        vertices, faces = part
    if vertices is None or faces is None or callable(vertices) or callable(faces):
        return None
    mesh = welded(vertices, faces, source=source)
    mesh.source["solids"] = mesh.components
    return mesh


def _is_host(item: Any) -> bool:
    return _is_raw(item) or any(hasattr(item, name) for name in ("wrapped", "vals", "toCompound", "part", "Shape"))


def _name(part: Any) -> str:
    label = next(filter(None, (getattr(part, name, None) for name in ("label", "name", "Label"))), None)
    return label if isinstance(label, str) else "part"
