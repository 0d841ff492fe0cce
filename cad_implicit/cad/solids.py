"""Results as B-rep solids that go on in CAD."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from cad_implicit.mesh import Mesh
from cad_implicit.parallel import Progress, no_progress

from .facets import facets
from .kernel import kernel


def described(part: SolidPart, source: Mapping[str, object]) -> SolidPart:
    """Solid with the product's name and colour that a mesh's ``source`` tells."""
    colour = source.get("colour")
    return replace(part, product=str(source.get("product", "")), colour=colour if isinstance(colour, tuple) else None)


@dataclass(frozen=True, eq=False)
class SolidPart:
    """A solid, or a compound of several, with what is known of it.

    Attributes
    ----------
    wrapped : TopoDS_Shape, or Part.Shape in FreeCAD
        What CadQuery and build123d wrap, too.
    name : str
    area : float
        In mm².
    exact_area : float
        Area in mm² of the faces that lie on surfaces of the part or of blends; the rest are plane facets that stand
        for triangles.
    faces, facets : int
        Number of all faces, and of those that stand for triangles.
    why : str
        Why there are facets where there might be none.
    product : str
        Name of the product in a STEP file; empty for that of the file.
    colour : (3,) tuple of float or None
        Red, green and blue in sRGB, from 0 to 1, for a STEP file.
    """

    wrapped: Any
    name: str
    area: float
    exact_area: float
    faces: int
    facets: int
    why: str = ""
    product: str = ""
    colour: tuple[float, float, float] | None = None

    @property
    def exact_share(self) -> float:
        """Share of the area that is exact, from 0 to 1."""
        return self.exact_area / self.area if self.area > 0 else 0.0

    def as_dict(self) -> dict[str, Any]:
        """Figures, ready for JSON."""
        return {"faces": self.faces, "facets": self.facets, "exact_share": self.exact_share, "why": self.why}


def solid_of(mesh: Mesh, *, name: str | None = None, why: str = "", progress: Progress = no_progress) -> SolidPart:
    """Solid of plane faces, triangles in one plane merged; see :func:`cad_implicit.to_part`.

    Raises
    ------
    MissingHostError
        If neither host is installed.
    OpenMeshError, InvalidMeshError
        If no solid can be made of the mesh.
    """
    progress("solid", 0.0)
    shape = facets(mesh)
    progress("solid", 1.0)
    area, count = kernel(shape).area(shape), kernel(shape).count_faces(shape)
    part = SolidPart(shape, name or str(mesh.source.get("name", "part")), area, 0.0, count, count, why)
    return described(part, mesh.source)
