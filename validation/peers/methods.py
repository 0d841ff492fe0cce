"""Closings and openings by a ball, and smoothings, by this package and by others: mesh, radius, spacing -> mesh.

A smoothing is an opening and then a closing. The time to bring arrays into a library's own mesh is not counted.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cad_implicit import Grid, Mesh, run
from cad_implicit.distance import sample_distance

Operation = Literal["fillet", "round", "smooth"]

#: Part, radius and spacing in mm -> result, seconds.
Method = Callable[[Mesh, float, float, Operation], tuple[Mesh, float]]

#: Offsets that each operation is made of, in radii.
_OFFSETS = {"fillet": (1, -1), "round": (-1, 1), "smooth": (-1, 2, -1)}

#: Spacings of air around a part, besides the radius.
_MARGIN = 4

#: Segments of the ball of a Minkowski sum.
_SEGMENTS = 32


def _ours(engine: Literal["exact", "reinit"]) -> Method:
    def method(mesh: Mesh, radius: float, spacing: float, operation: Operation) -> tuple[Mesh, float]:
        start = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = run(mesh, operation, radius, spacing=spacing, engine=engine, force=True).mesh
        return result, time.perf_counter() - start

    return method


def _meshlib(sharp: bool) -> Method:
    def method(mesh: Mesh, radius: float, spacing: float, operation: Operation) -> tuple[Mesh, float]:
        from meshlib import mrmeshnumpy, mrmeshpy

        part = mrmeshnumpy.meshFromFacesVerts(mesh.faces, mesh.vertices.astype(np.float32))
        # the default takes cavities for solid
        modes = mrmeshpy.SignDetectionMode
        mode = modes.ProjectionNormal if operation == "round" else modes.OpenVDB
        start = time.perf_counter()
        options = mrmeshpy.SharpOffsetParameters() if sharp else mrmeshpy.OffsetParameters()
        options.voxelSize, options.signDetectionMode = spacing, mode
        if operation == "fillet" and not sharp:
            result = mrmeshpy.doubleOffsetMesh(mrmeshpy.MeshPart(part), radius, -radius, options)
        else:
            result, offset = part, mrmeshpy.sharpOffsetMesh if sharp else mrmeshpy.mcOffsetMesh
            for distance in _OFFSETS[operation]:
                result = offset(mrmeshpy.MeshPart(result), distance * radius, options)
        seconds = time.perf_counter() - start
        return Mesh(mrmeshnumpy.getNumpyVerts(result), mrmeshnumpy.getNumpyFaces(result.topology)), seconds

    return method


def _manifold(mesh: Mesh, radius: float, spacing: float, operation: Operation) -> tuple[Mesh, float]:
    """Minkowski sum and difference with a ball of 32 segments, whatever the spacing."""
    from manifold3d import Manifold, Mesh64

    part = Manifold(Mesh64(np.array(mesh.vertices), np.array(mesh.faces, np.uint64)))
    ball = Manifold.sphere(radius, _SEGMENTS)
    start = time.perf_counter()
    result = part
    if operation != "fillet":
        result = result.minkowski_difference(ball).minkowski_sum(ball)
    if operation != "round":
        result = result.minkowski_sum(ball).minkowski_difference(ball)
    raw = result.to_mesh64()
    seconds = time.perf_counter() - start
    return Mesh(np.array(raw.vert_properties)[:, :3], np.array(raw.tri_verts).astype(np.int64)), seconds


def _fast_marching(mesh: Mesh, radius: float, spacing: float, operation: Operation) -> tuple[Mesh, float]:
    """Do it by sampled distance, offset, fast marching (scikit-fmm) before each further one, marching cubes."""
    import skfmm
    from skimage.measure import marching_cubes

    start = time.perf_counter()
    grid = Grid.cover(mesh.bounds, spacing, margin=radius + _MARGIN * spacing)
    values = sample_distance(mesh, grid, band=radius + 2 * spacing).values.astype(np.float64)
    first, *others = _OFFSETS[operation]
    values += first * radius
    for distance in others:
        values = np.asarray(skfmm.distance(values, dx=spacing)) + distance * radius
    vertices, faces, _, _ = marching_cubes(values, 0.0, spacing=(spacing,) * 3, gradient_direction="ascent")
    seconds = time.perf_counter() - start
    return Mesh(vertices + grid.origin, faces.astype(np.int64)), seconds


def methods() -> dict[str, Method]:
    """Methods whose packages are installed, by name."""
    found: dict[str, Method] = {"cad_implicit": _ours("exact"), "the paper's scheme": _ours("reinit")}
    if find_spec("meshlib"):
        found["MeshLib, offset twice"] = _meshlib(False)
        found["MeshLib, sharp offset twice"] = _meshlib(True)
    if find_spec("skfmm"):
        found["scikit-fmm"] = _fast_marching
    found["manifold3d, Minkowski"] = _manifold
    return found


def distances(result: Mesh, samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances in mm (N,) from points (N, 3) of the true surface to a result."""
    from cad_implicit import MeshDistance

    return MeshDistance(result, sign="pseudonormal").unsigned(samples)
