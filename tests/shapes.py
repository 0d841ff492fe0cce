"""Parts with known answers: extrusions and bosses off the axes, and points on their exact fillets and rounds."""

from __future__ import annotations

import manifold3d
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cad_implicit import Mesh

#: No axis of a part is an axis of the grid.
TURN = Rotation.from_euler("xyz", [23, 37, 11], degrees=True).as_matrix()
SHIFT = np.array([0.137, 0.371, 0.218])


def placed(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points of the part's own frame, turned and moved off the grid."""
    return points @ TURN.T + SHIFT


def as_mesh(manifold: manifold3d.Manifold) -> Mesh:
    raw = manifold.to_mesh64()
    return Mesh(placed(np.asarray(raw.vert_properties)[:, :3]), np.asarray(raw.tri_verts, np.int64))


def extrusion(polygon: list[tuple[float, float]], height: float) -> Mesh:
    """Prism over a counter-clockwise polygon, from -height/2 to height/2."""
    section = manifold3d.CrossSection([polygon])
    return as_mesh(section.extrude(height).translate([0, 0, -height / 2]))


def box(low: list[float], high: list[float]) -> manifold3d.Manifold:
    return manifold3d.Manifold.cube((np.array(high) - low).tolist()).translate(low)


def notch(angle: float, size: float) -> Mesh:
    """Block with a concave edge along z through the origin; the empty wedge opens towards +x by ``angle`` degrees."""
    half = np.radians(angle / 2)
    reach = size / 2 / max(np.cos(half), np.sin(half))
    x, y = reach * np.cos(half), reach * np.sin(half)
    return extrusion([(x, y), (x, size), (-size, size), (-size, -size), (x, -size), (x, -y), (0, 0)], 1.5 * size)


def notch_fillet(angle: float, radius: float, length: float) -> NDArray[np.float64]:
    """Points on the fillet of :func:`notch`, over ``length`` in the middle of the edge."""
    half = np.radians(angle / 2)
    turn = np.linspace(-(np.pi / 2 - half), np.pi / 2 - half, 41)[1:-1]
    z = np.linspace(-length / 2, length / 2, 23)
    a, z = (m.ravel() for m in np.meshgrid(turn, z))
    return placed(np.stack([radius / np.sin(half) - radius * np.cos(a), radius * np.sin(a), z], axis=1))


def corner(size: float) -> Mesh:
    """Cube of side ``2 size`` without its octant towards (+, +, +): three concave edges meet at the origin."""
    return as_mesh(box([-size] * 3, [size] * 3) - box([0, 0, 0], [2 * size] * 3))


def octant(radius: float) -> NDArray[np.float64]:
    """Points on the sphere patch of radius ``radius`` around (r, r, r), towards the origin."""
    a = np.linspace(0.03, np.pi / 2 - 0.03, 25)
    u, v = (m.ravel() for m in np.meshgrid(a, a))
    direction = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=1)
    return placed(radius - radius * direction)


def boss(inner: float, size: float, height: float, segments: int = 720) -> Mesh:
    """Cylinder of radius ``inner`` on a plate whose top is z = 0."""
    cylinder = manifold3d.Manifold.cylinder(height, inner, inner, segments)
    return as_mesh(cylinder + box([-size, -size, -size / 2], [size, size, 0]))


def boss_fillet(inner: float, radius: float) -> NDArray[np.float64]:
    """Points on the torus between the boss and the plate."""
    a, b = np.linspace(0, 2 * np.pi, 97), np.linspace(0.03, np.pi / 2 - 0.03, 25)
    a, b = (m.ravel() for m in np.meshgrid(a, b))
    rho, z = inner + radius - radius * np.cos(b), radius - radius * np.sin(b)
    return placed(np.stack([rho * np.cos(a), rho * np.sin(a), z], axis=1))


def pocket(half: float, depth: float) -> Mesh:
    """Block whose top is z = 0, with a square pocket of side ``2 half``: five concave edges meet three at a time."""
    size = 2 * half
    block = box([-size, -size, -2 * depth], [size, size, 0])
    return as_mesh(block - box([-half, -half, -depth], [half, half, depth]))


def square_boss(half: float, size: float, height: float) -> Mesh:
    """Square boss of side ``2 half`` on a plate whose top is z = 0: its concave edges close around convex ones."""
    plate = box([-size, -size, -size / 2], [size, size, 0])
    return as_mesh(plate + box([-half, -half, -1], [half, half, height]))


def cone_boss(bottom: float, top: float, size: float, height: float, segments: int = 720) -> Mesh:
    """Cone between the radii ``bottom`` and ``top`` on a plate whose top is z = 0."""
    plate = box([-size, -size, -size / 2], [size, size, 0])
    slope = (top - bottom) / height
    cone = manifold3d.Manifold.cylinder(height + 1, bottom - slope, top, segments).translate([0, 0, -1])
    return as_mesh(plate + cone)


def cross(first: float, second: float, reach: float, segments: int = 720) -> Mesh:
    """Cylinders of radii ``first`` along z and ``second`` along x through it, to ``reach`` on all sides."""
    upright = manifold3d.Manifold.cylinder(2 * reach, first, first, segments, center=True)
    lying = manifold3d.Manifold.cylinder(2 * reach, second, second, segments, center=True).rotate([0, 90, 0])
    return as_mesh(upright + lying)


def drilled(radius: float, size: float, thickness: float, segments: int = 720) -> Mesh:
    """Plate between z = -thickness and z = 0 with a hole of radius ``radius`` along z."""
    plate = box([-size, -size, -thickness], [size, size, 0])
    return as_mesh(plate - manifold3d.Manifold.cylinder(4 * thickness, radius, radius, segments, center=True))


def blind(radius: float, size: float, depth: float, segments: int = 720) -> Mesh:
    """Block whose top is z = 0, with a flat-bottomed hole of radius ``radius`` along z."""
    block = box([-size, -size, -1.5 * depth], [size, size, 0])
    return as_mesh(block - manifold3d.Manifold.cylinder(2 * depth, radius, radius, segments).translate([0, 0, -depth]))


def cavity(part: Mesh, wall: float) -> Mesh:
    """Block that leaves a part-shaped hollow, ``wall`` inside its faces: what is convex in one is concave in the other.

    In the frame of the turned part, so that the hollow is where the part was.
    """
    low, high = part.bounds
    outer = box((low - wall).tolist(), (high + wall).tolist()).to_mesh64()
    count = len(outer.vert_properties)
    vertices = np.concatenate([np.asarray(outer.vert_properties)[:, :3], part.vertices])
    return Mesh(vertices, np.concatenate([np.asarray(outer.tri_verts, np.int64), part.faces[:, ::-1] + count]))
