"""Results as parts: solids that CadQuery, build123d and STEP take.

Where a result is a blend of chosen edges of a B-rep, its faces are those of the part, on their own surfaces, trimmed
by the blends, and the blends are planes, cylinders, cones, tori, spheres or splines. All else becomes plane faces.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .blend_labels import Outward, blend_surfaces, label
from .cad.kernel import kernel
from .cad.memory import Memory
from .cad.parts import to_mesh
from .cad.planner import EDGE, Planner
from .cad.plans import Product, Topology
from .cad.solids import SolidPart, solid_of
from .contouring import contour
from .errors import InvalidMeshError
from .facetting import facetted
from .implicit import FloatArray, Implicit
from .local_blend import LocalBlend
from .mesh import Mesh
from .outliner import Outliner
from .parallel import Progress, no_progress
from .patches import Numbers, Patches
from .simplifying import simplify

#: The volume of a solid may differ by that from that of the mesh, in chords: cubic mm per squared spacing over radius
#: and square mm of new surface. The chord itself takes 0.2.
_CHORDS = 0.5

#: And by this share of the volume, for the part's own facets.
_SHARE = 2e-5

#: Rounds in which more and more triangles become faces before all of them do; in the first ones only those are added
#: that touch a border that is not on its surfaces, then all of the patch.
_ROUNDS = 16
_LOCAL = 12

#: Whether the triangles of a solid meet is tried with this tolerance, in spacings. Where they do not, those of the mesh
#: nearer than this become faces, then twice as far …
_MESHED, _NEXT = 0.5, 0.5


def to_part(
    result: Mesh | Implicit | Any,
    *,
    mesh: Mesh | None = None,
    name: str | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> SolidPart:
    """Solid of a result, to go on with in CAD.

    Parameters
    ----------
    result : Mesh or Implicit
        A LocalBlend of a B-rep keeps the surfaces of that; anything else becomes plane faces.
    mesh : Mesh, optional
        The contour of an Implicit, if it is there already.
    name : str, optional
        By default that of the part it came from.
    tolerance : float, optional
        Triangles are simplified within so many mm first; by default only as far as the kernel needs it.
    threads : int, optional
    progress : callable
        Called as ``progress(stage, fraction)``; may raise to cancel.

    Returns
    -------
    SolidPart
        Its ``wrapped`` is the TopoDS_Shape, or in FreeCAD the Part.Shape; it says how much of its area is exact.

    Raises
    ------
    MissingHostError
        If neither host is installed.
    OpenMeshError, InvalidMeshError
        If no solid can be made.
    """
    if isinstance(result, Mesh):
        mesh = result
    elif mesh is None:
        mesh = contour(result, threads=threads, progress=progress)
    why = ""
    if isinstance(result, LocalBlend) and result.part.shape is not None and mesh.face_ids is not None:
        try:
            return _exact(result, mesh, name or result.part.name, progress)
        except InvalidMeshError as error:
            why = str(error)
        except Exception as error:  # the kernel raises its own family of errors, which differs between versions
            why = f"{type(error).__name__}: {error}"
    if tolerance is not None:
        mesh = simplify(mesh, tolerance)
    return solid_of(mesh, name=name, why=why, progress=progress)


def _exact(blend: LocalBlend, mesh: Mesh, name: str, progress: Progress) -> SolidPart:
    """Solid of a blend on the surfaces of the part and of the blends; triangles where one of them does not do.

    Raises
    ------
    InvalidMeshError
        If the kernel finds it invalid, or it is not what the mesh is.
    """
    own = kernel(blend.part.shape)
    progress("solid", 0.0)
    surfaces = blend_surfaces(blend.laid)
    count = own.count_faces(blend.part.shape)
    labels = label(mesh, count, blend.faces, surfaces, blend.spacing)
    progress("solid", 0.3)
    product, facets, why = _rebuilt(blend, mesh, labels, surfaces)
    shape = product.shape
    area = np.linalg.norm(mesh.face_vectors, axis=1)
    radius = min(
        [float(strip.spine.radius.min()) for laid in blend.laid.values() for strip in laid.plain]
        + [ball.radius for laid in blend.laid.values() for ball in laid.corners]
    )
    allowed = _CHORDS * blend.spacing**2 / radius * float(area[labels >= count].sum())
    allowed += (_SHARE + own.VOLUMES_OFF) * mesh.volume
    off = abs(own.volume(shape) - mesh.volume)
    if off > allowed:  # an accuracy that is asked for holds for each face, however small, and takes a minute
        off = abs(own.volume(shape, _SHARE) - mesh.volume)
    if off > allowed:
        raise InvalidMeshError(f"its volume differs by {off:.3g} mm³ from that of the mesh")
    progress("solid", 1.0)
    whole, plane = own.area(shape), sum(own.area(product.faces[position]) for position in facets)
    return SolidPart(shape, name, whole, whole - plane, own.count_faces(shape), len(facets), why)


def _rebuilt(blend: LocalBlend, mesh: Mesh, labels: Numbers, surfaces: list[Outward]) -> tuple[Product, list[int], str]:
    """Solid, the positions of those faces that stand for triangles, and why: round by round there are more of them."""
    shape = blend.part.shape
    kernels_own, solids = kernel(shape), kernel(shape, "solids")
    own: Topology = kernel(shape, "original").ShapeTopology(shape)
    count = len(own.face_shapes)
    unknown = int((labels < 0).sum())
    reasons = [f"{unknown} triangles lie on no known surface"] if unknown else []
    astray = 0.0
    reach = _NEXT * blend.spacing
    outliner, memory = Outliner(count, blend.faces, surfaces, own, blend.spacing), Memory()
    for turn in range(_ROUNDS):
        if (labels < 0).any():
            mesh, labels = facetted(mesh, labels, outliner.surface, outliner.first_facet, EDGE / 2)
        outline = outliner.outline(mesh, labels)
        planner = Planner(mesh, outline, outliner.patches, count, surfaces, own, memory)
        plan = planner.plan()
        if plan is not None:
            product: Product = solids.made(plan, own)
            if kernels_own.is_valid(product.shape):
                facets = [position for position, face in enumerate(plan.faces) if face.facet]
                gaps = _gaps(product.shape, blend.spacing) if facets else np.zeros((0, 3))
                if len(gaps) == 0:
                    return product, facets, _told(reasons, astray)
                reasons.append("its triangles would not meet")
                labels = np.where(_near(mesh, gaps, reach), -1, labels)
                reach *= 2
                continue
            for position, face in enumerate(plan.faces):
                if not face.facet and not kernels_own.is_valid(product.faces[position]):
                    planner.blame_invalid(position, product.crossing(position))
        if not planner.failed:
            break
        reasons, astray = reasons + planner.reasons, max(astray, planner.astray)
        labels = np.where(_failing(mesh, outliner.patches, planner.failed, turn < _LOCAL), -1, labels)
    raise InvalidMeshError(_told(reasons, astray) or "the kernel finds the solid invalid")


def _gaps(shape: object, spacing: float) -> FloatArray:
    """Middles (N, 3) of edges at which the triangles of a valid solid do not meet, as is seen at very small faces."""
    mesh = to_mesh(shape, tolerance=_MESHED * spacing)
    if mesh.is_watertight:
        return np.zeros((0, 3))
    edges = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    return np.asarray(mesh.vertices[edges[count != 2]].mean(axis=1))


def _near(mesh: Mesh, places: FloatArray, reach: float) -> NDArray[np.bool_]:
    """Triangles (F,) with a corner nearer than that to one of a few places."""
    near = np.zeros(len(mesh.vertices), np.bool_)
    for place in places:
        near |= np.linalg.norm(mesh.vertices - place, axis=1) < reach
    return np.asarray(near[mesh.faces].any(axis=1))


def _told(reasons: list[str], astray: float) -> str:
    """Each reason once."""
    away = [f"edges are up to {astray:.3g} mm away from their faces"] if astray > 0 else []
    return "; ".join(dict.fromkeys(reasons + away))


def _failing(mesh: Mesh, patches: Patches, failed: Mapping[int, set[int] | None], local: bool) -> NDArray[np.bool_]:
    """Triangles (F,) of failed patches: where known and local only those at the vertices where they fail."""
    found = np.zeros(len(mesh.faces), np.bool_)
    for patch, vertices in failed.items():
        own = patches.of_triangle == patch
        if local and vertices is not None:
            near = np.zeros(len(mesh.vertices), np.bool_)
            near[list(vertices)] = True
            own &= near[mesh.faces].any(axis=1)
        found |= own
    return found
