"""Compare two meshes: distance both ways, volume, area."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .implicit import FloatArray
from .kernels.bvh import build_tree
from .kernels.closest import unsigned_distances
from .kernels.jit import frozen
from .mesh import Mesh
from .parallel import Progress, no_progress

#: Random samples are the same on every run.
_SEED = 20200803


@dataclass(frozen=True)
class Deviation:
    """Distances in mm from samples of one mesh to the triangles of the other.

    Attributes
    ----------
    maximum : float
        Over vertices, triangle centres and random points.
    mean, rms, p99 : float
        Mean, root mean square and 99th percentile over random points, which are uniform over the area.
    place : tuple of 3 float
        Where on the sampled mesh the distance is largest, in mm.
    """

    maximum: float
    mean: float
    rms: float
    p99: float
    place: tuple[float, float, float]


@dataclass(frozen=True)
class Comparison:
    """Two-sided distance between meshes a and b, and what they enclose.

    Attributes
    ----------
    maximum, mean, rms, p99 : float
        Both ways together, in mm; the maximum is the Hausdorff distance as far as the samples see it (a lower bound).
    place : tuple of 3 float
        Where the distance is largest, in mm.
    a_to_b, b_to_a : Deviation
        One way each.
    volume_a, volume_b, volume_difference : float
        In mm³; the difference is b less a.
    volume_difference_relative : float
        Difference over the volume of a; NaN if that is zero.
    area_a, area_b : float
        In mm².
    """

    maximum: float
    mean: float
    rms: float
    p99: float
    place: tuple[float, float, float]
    a_to_b: Deviation
    b_to_a: Deviation
    volume_a: float
    volume_b: float
    volume_difference: float
    volume_difference_relative: float
    area_a: float
    area_b: float

    def as_dict(self) -> dict[str, object]:
        """Return all figures by name, for JSON."""
        return asdict(self)


def compare(
    a: Mesh,
    b: Mesh,
    *,
    samples: int = 100_000,
    threads: int | None = None,
    progress: Progress = no_progress,
) -> Comparison:
    """Measure the distance between two meshes both ways.

    From each mesh all vertices, all triangle centres and random points, uniform over the area and the same on every
    run, to the triangles of the other. Meshes need not be closed; the volume of an open one means little.

    Parameters
    ----------
    a, b : Mesh
    samples : int
        Number of random points on each mesh, at least 1.
    threads : int, optional
        Number of threads; all cores by default.
    progress : callable
        Called as ``progress("compare", fraction)``; may raise to cancel.

    Raises
    ------
    ValueError
        If ``samples`` is less than 1.
    """
    if samples < 1:
        raise ValueError(f"samples must be at least 1, not {samples}")
    progress("compare", 0.0)
    forth, far_forth = _one_way(a, b, samples, threads)
    progress("compare", 0.5)
    back, far_back = _one_way(b, a, samples, threads)
    progress("compare", 1.0)
    both = np.concatenate([far_forth, far_back])
    farthest = forth if forth.maximum >= back.maximum else back
    change = b.volume - a.volume
    return Comparison(
        maximum=farthest.maximum,
        mean=float(both.mean()),
        rms=_rms(both),
        p99=float(np.percentile(both, 99)),
        place=farthest.place,
        a_to_b=forth,
        b_to_a=back,
        volume_a=a.volume,
        volume_b=b.volume,
        volume_difference=change,
        volume_difference_relative=change / a.volume if a.volume else math.nan,
        area_a=a.area,
        area_b=b.area,
    )


def surface_samples(mesh: Mesh, count: int) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return points ``(count, 3)`` in mm, one in each of ``count`` equal shares of the area, and their triangles."""
    random = np.random.default_rng(_SEED)
    total = np.cumsum(np.linalg.norm(mesh.face_vectors, axis=1))
    share = (np.arange(count) + random.random(count)) / count * total[-1]
    triangle = np.minimum(np.searchsorted(total, share, side="right"), len(total) - 1)
    u, v = random.random((2, count))
    folded = u + v > 1
    u, v = np.where(folded, 1 - u, u)[:, None], np.where(folded, 1 - v, v)[:, None]
    first, second, third = (mesh.vertices[mesh.faces[triangle, corner]] for corner in range(3))
    return np.asarray((1 - u - v) * first + u * second + v * third), triangle


def _one_way(source: Mesh, target: Mesh, samples: int, count: int | None) -> tuple[Deviation, FloatArray]:
    """Deviation of the source from the target, and the distances of the random points."""
    corners = source.vertices[source.faces]
    points = np.concatenate(
        [surface_samples(source, samples)[0], source.vertices[np.unique(source.faces)], corners.mean(axis=1)]
    )
    with parallel.threads(count):
        tree = build_tree(target.vertices, target.faces, signed=False)
        distance = unsigned_distances(tree, frozen(points))
    worst = int(distance.argmax())
    x, y, z = points[worst].tolist()
    uniform = distance[:samples]
    deviation = Deviation(
        maximum=float(distance[worst]),
        mean=float(uniform.mean()),
        rms=_rms(uniform),
        p99=float(np.percentile(uniform, 99)),
        place=(x, y, z),
    )
    return deviation, uniform


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values * values)))
