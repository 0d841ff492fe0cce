"""Vertices onto the surface: smooth ones along the gradient, sharp ones onto two or three tangent planes."""

import math

import numba
import numpy as np

from .jit import jit, parallel_jit

#: Faces whose normals differ by less than 14 degrees (cosine) make no crease. A sphere of one spacing's radius turns
#: by that much between two probes 0.24 spacings apart.
_CREASE_COSINE = 0.97

#: Nearest and farthest probes beside a sharp vertex, in spacings: far enough to tell sharp from curved and to forgive a
#: poor first position; then as near as the last step was long, because tangent planes of curved faces turn with the
#: distance, but not nearer, or both probes may lie on one side of the crease.
_NEAR_PROBE, _FAR_PROBE = 0.02, 0.12

#: How far a probe beside a corner is lifted off its face, over its distance from the corner: on the surface itself the
#: gradient of a distance is all rounding error.
_LIFT = 0.1

#: Three normals whose volume is smaller than this make a crease, not a corner.
_CORNER_VOLUME = 0.15


@jit
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit
def _normalise(a):
    length = math.sqrt(_dot(a, a))
    if length > 0 and length < math.inf:
        for d in range(3):
            a[d] /= length
    return length


@parallel_jit
def step_smooth(pending, points, f, gradient, start, limit, tolerance, position, normal):
    """Newton step along the gradient for the vertices ``pending``; returns which of them moved by more than allowed.

    A step is cut to ``limit`` mm; a vertex farther than two limits from its ``start`` goes back there and stays.
    Vertices that moved by more than ``tolerance`` mm need another look. ``normal`` (V, 3) gets outward unit normals.
    """
    again = np.zeros(len(pending), np.bool_)
    for q in numba.prange(len(pending)):
        v = pending[q]
        squared = gradient[q, 0] ** 2 + gradient[q, 1] ** 2 + gradient[q, 2] ** 2
        if not (squared > 0 and squared < math.inf):
            continue
        length = math.sqrt(squared)
        distance = f[q] / length
        if not abs(distance) < math.inf:
            continue
        distance = min(max(distance, -limit), limit)
        for d in range(3):
            normal[v, d] = -gradient[q, d] / length
        moved = 0.0
        for d in range(3):
            position[v, d] = points[q, d] - distance * gradient[q, d] / length
            moved += (position[v, d] - start[v, d]) ** 2
        if moved > 4 * limit * limit:
            for d in range(3):
                position[v, d] = start[v, d]
        else:
            again[q] = abs(distance) > tolerance
    return again


@parallel_jit
def probe_points(vertices, position, rank, planes, foot, normal, last_step, spacing):
    """Points (N, 3, 3) beside sharp vertices, one on each face; rank 2 uses the first two.

    ``last_step`` (V,) is the length in mm of each vertex's last step, infinite at first.
    """
    probes = np.empty((len(vertices), 3, 3))
    for q in numba.prange(len(vertices)):
        v = vertices[q]
        distance = min(max(last_step[v], _NEAR_PROBE * spacing), _FAR_PROBE * spacing)
        if rank[v] == 2:
            m, n = planes[v, 0], planes[v, 1]
            across = probes[q, 2]
            for d in range(3):
                across[d] = normal[m, d] - normal[n, d]
            _normalise(across)
            for d in range(3):
                probes[q, 0, d] = position[v, d] + distance * across[d]
                probes[q, 1, d] = position[v, d] - distance * across[d]
                probes[q, 2, d] = position[v, d]
        else:
            for p in range(3):
                away = probes[q, p]
                for d in range(3):
                    away[d] = foot[planes[v, p], d] - position[v, d]
                length = _normalise(away)
                step = min(distance, 0.5 * length)
                for d in range(3):
                    away[d] = position[v, d] + step * (away[d] + _LIFT * normal[planes[v, p], d])
    return probes


@jit
def _two_planes(n, height, shift):
    """Shortest vector onto two planes ``n[p] · x = height[p]``."""
    c = _dot(n[0], n[1])
    scale = 1 / (1 - c * c)
    first, second = (height[0] - c * height[1]) * scale, (height[1] - c * height[0]) * scale
    for d in range(3):
        shift[d] = first * n[0, d] + second * n[1, d]


@jit
def _three_planes(n, height, shift):
    """Point of three planes by Cramer's rule; returns the volume of the normals."""
    volume = 0.0
    for d in range(3):
        u, w = (d + 1) % 3, (d + 2) % 3
        volume += n[0, d] * (n[1, u] * n[2, w] - n[1, w] * n[2, u])
    for d in range(3):
        u, w = (d + 1) % 3, (d + 2) % 3
        shift[d] = (
            height[0] * (n[1, u] * n[2, w] - n[1, w] * n[2, u])
            + height[1] * (n[2, u] * n[0, w] - n[2, w] * n[0, u])
            + height[2] * (n[0, u] * n[1, w] - n[0, w] * n[1, u])
        ) / volume
    return abs(volume)


@jit
def _tangent_planes(vertex, count, probes, f, gradient, n, height):
    """Find unit normals and heights above ``vertex`` of the planes seen by the probes; False if one has no gradient."""
    for p in range(count):
        for d in range(3):
            n[p, d] = gradient[p, d]
        length = _normalise(n[p])
        if not (length > 0 and length < math.inf):
            return False
        height[p] = -f[p] / length
        for d in range(3):
            height[p] += n[p, d] * (probes[p, d] - vertex[d])
    return True


@parallel_jit
def step_sharp(vertices, probes, f, gradient, start, limit, tolerance, rank, last_step, position):
    """Move sharp vertices onto the tangent planes of their probes.

    Returns the outcome (N,) int8: 0 settled (the step was below ``tolerance`` mm), 1 look again, 2 not sharp or out
    of reach (``limit`` mm from its start). Three planes that hardly make a corner leave a crease (rank 2).
    """
    outcome = np.zeros(len(vertices), np.int8)
    for q in numba.prange(len(vertices)):
        v = vertices[q]
        n = np.empty((3, 3))
        height = np.empty(3)
        shift = np.empty(3)
        if not _tangent_planes(position[v], rank[v], probes[q], f[q], gradient[q], n, height):
            outcome[q] = 2
            continue
        if rank[v] == 3:
            if not _three_planes(n, height, shift) >= _CORNER_VOLUME:
                rank[v] = 2
                outcome[q] = 1
                continue
        elif _dot(n[0], n[1]) < _CREASE_COSINE:
            _two_planes(n, height, shift)
        else:
            # At first it means that there is no crease; later that the probes were too close together.
            outcome[q] = 2 if last_step[v] == math.inf else 1
            last_step[v] = 0.5 * limit
            continue
        moved = 0.0
        for d in range(3):
            moved += (position[v, d] + shift[d] - start[v, d]) ** 2
        if not moved <= limit * limit:
            outcome[q] = 2
            continue
        for d in range(3):
            position[v, d] += shift[d]
        last_step[v] = math.sqrt(_dot(shift, shift))
        outcome[q] = 1 if last_step[v] > tolerance else 0
    return outcome
