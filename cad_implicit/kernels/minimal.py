"""Feet of points on triply periodic surfaces, all with the period 2 pi; see :mod:`cad_implicit.walls`."""

from __future__ import annotations

import math

from numba import prange

from .jit import jit, parallel_jit

#: Numbers of the surfaces.
GYROID, SCHWARZ_P, DIAMOND, IWP = range(4)


@jit
def _level(kind, x, y, z):
    """Value and gradient of a function whose zero level is the surface."""
    sx, cx = math.sin(x), math.cos(x)
    sy, cy = math.sin(y), math.cos(y)
    sz, cz = math.sin(z), math.cos(z)
    if kind == GYROID:
        return sx * cy + sy * cz + sz * cx, cx * cy - sx * sz, cy * cz - sy * sx, cz * cx - sz * sy
    if kind == SCHWARZ_P:
        return cx + cy + cz, -sx, -sy, -sz
    if kind == DIAMOND:
        return (
            cx * cy * cz - sx * sy * sz,
            -sx * cy * cz - cx * sy * sz,
            -cx * sy * cz - sx * cy * sz,
            -cx * cy * sz - sx * sy * cz,
        )
    value = 2 * (cx * cy + cy * cz + cz * cx) - 2 * (cx * cx + cy * cy + cz * cz) + 3
    return (
        value,
        sx * (4 * cx - 2 * (cy + cz)),
        sy * (4 * cy - 2 * (cz + cx)),
        sz * (4 * cz - 2 * (cx + cy)),
    )


@parallel_jit
def levels(points, kind, values, gradients):
    """Values (N,) and gradients (N, 3) at points (N, 3)."""
    for n in prange(len(points)):
        values[n], gradients[n, 0], gradients[n, 1], gradients[n, 2] = _level(
            kind, points[n, 0], points[n, 1], points[n, 2]
        )


@parallel_jit
def feet(points, kind, reach, rounds, longest, on_surface, still, distance, away):
    """Distances (N,) up to ``reach``, and unit vectors (N, 3) away from the surface, zero from there on.

    The foot is projected onto the tangent plane at its last place, over and over; the shortest of the arms that end on
    the surface counts.
    """
    for n in prange(len(points)):
        px, py, pz = points[n, 0], points[n, 1], points[n, 2]
        x, y, z = px, py, pz
        best = reach
        ax = 0.0
        ay = 0.0
        az = 0.0
        for number in range(rounds):
            value, gx, gy, gz = _level(kind, x, y, z)
            square = gx * gx + gy * gy + gz * gz
            if square < 1e-20:
                break
            steep = math.sqrt(square)
            dx, dy, dz = px - x, py - y, pz - z
            length = math.sqrt(dx * dx + dy * dy + dz * dz)
            if abs(value) <= on_surface * steep and length < best:
                best = length
                if length <= on_surface:
                    ax, ay, az = gx / steep, gy / steep, gz / steep
                else:
                    ax, ay, az = dx / length, dy / length, dz / length
            # on the way to the surface along the gradient first, then to the foot
            if number < 3:
                dx = 0.0
                dy = 0.0
                dz = 0.0
            push = (value + gx * dx + gy * dy + gz * dz) / square
            dx -= push * gx
            dy -= push * gy
            dz -= push * gz
            step = math.sqrt(dx * dx + dy * dy + dz * dz)
            if number >= 3 and step < still:
                break
            short = min(1.0, longest / max(step, 1e-300))
            x += short * dx
            y += short * dy
            z += short * dz
        distance[n] = best
        away[n, 0] = ax
        away[n, 1] = ay
        away[n, 2] = az
