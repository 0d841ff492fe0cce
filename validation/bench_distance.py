"""Speed of the distance to a mesh: ``python -m validation.bench_distance``.

The bracket that comes with the package, tessellated to about 12k triangles and turned off the axes. Times are the
best of some runs, after compilation.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib.resources import as_file, files

import numpy as np

from cad_implicit import parallel
from cad_implicit.cad import to_mesh
from cad_implicit.comparison import compare, surface_samples
from cad_implicit.distance import MeshDistance, sample_distance
from cad_implicit.grid import Grid
from cad_implicit.kernels.bvh import build_tree
from cad_implicit.mesh import Mesh
from cad_implicit.thickness import thin_spots

#: In mm; gives about 12k triangles.
_TOLERANCE = 0.0002
_NEAR = 1 / 128
_RUNS = 5


def turned_bracket() -> Mesh:
    """Return the bracket, turned about a skew axis."""
    with as_file(files("cad_implicit") / "data" / "bracket.step") as path:
        mesh = to_mesh(path, tolerance=_TOLERANCE)
    axis = np.array([1.0, 2.0, 0.5]) / np.linalg.norm([1.0, 2.0, 0.5])
    cross = np.cross(np.eye(3), axis)
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) + np.sin(0.7) * cross + (1 - np.cos(0.7)) * cross @ cross
    return mesh.transformed(matrix)


def best(function: Callable[[], object]) -> float:
    """Return the shortest time in seconds of some calls, after one to warm up."""
    function()
    times = []
    for _ in range(_RUNS):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def query_points(mesh: Mesh) -> dict[str, np.ndarray]:
    """Return sets of 100k points: near the surface in order and shuffled, on a grid, and far outside."""
    random = np.random.default_rng(0)
    near = surface_samples(mesh, 100_000)[0] + random.normal(0, _NEAR * mesh.diagonal / 2, (100_000, 3))
    grid = Grid.cover(mesh.bounds, shape=46).nodes()
    far = mesh.bounds.mean(axis=0) + random.normal(0, 3 * mesh.diagonal, (100_000, 3))
    return {"near, along the surface": near, "near, any order": random.permutation(near), "grid": grid, "far": far}


def main() -> None:
    """Print one line for each figure."""
    mesh = turned_bracket()
    print(f"{len(mesh.faces)} triangles")
    with parallel.threads():
        print(f"tree               {1e3 * best(lambda: build_tree(mesh.vertices, mesh.faces)):8.1f} ms")
        print(f"tree, unsigned     {1e3 * best(lambda: build_tree(mesh.vertices, mesh.faces, False)):8.1f} ms")
    print(f"MeshDistance       {1e3 * best(lambda: MeshDistance(mesh)):8.1f} ms")
    single = MeshDistance(mesh, threads=1)
    for name, x in query_points(mesh).items():
        per_point = 1e6 / len(x)
        print(f"{name}: {len(x)} points, one thread")
        print(f"  signed           {per_point * best(lambda x=x: single(x)):8.2f} µs a point")
        print(f"  unsigned         {per_point * best(lambda x=x: single.unsigned(x)):8.2f} µs a point")
        radius = 0.02 * mesh.diagonal
        print(f"  within 2 %       {per_point * best(lambda x=x, r=radius: single.within(x, r)):8.2f} µs a point")
        print(f"  winding          {per_point * best(lambda x=x: single.winding(x)):8.2f} µs a point")
    for size in (128, 256):
        grid = Grid.cover(mesh.bounds, shape=size, margin=0.05 * mesh.diagonal)
        for threads in (1, 2):
            seconds = best(lambda g=grid, t=threads: sample_distance(single, g, threads=t))
            print(f"raster {size}³, {threads} threads  {1e3 * seconds:8.1f} ms")
    print(f"compare            {1e3 * best(lambda: compare(mesh, mesh)):8.1f} ms")
    print(f"thin_spots r = 4   {1e3 * best(lambda: thin_spots(mesh, 4.0)):8.1f} ms")


if __name__ == "__main__":
    main()
