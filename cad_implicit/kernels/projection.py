"""Vertices onto the surface: smooth ones along the gradient, sharp ones onto two or three tangent planes."""

import math

import numba
import numpy as np

from .jit import jit, parallel_jit

#: Faces whose normals differ by less than 14 degrees (cosine) make no crease. A sphere of one spacing's radius turns
#: by that much between two probes 0.24 spacings apart.
_CREASE_COSINE = 0.97

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
def probe_points(vertices, position, rank, planes, foot, normal, distance):
    """Points (N, 3, 3) beside sharp vertices, one on each face; rank 2 uses the first two."""
    probes = np.empty((len(vertices), 3, 3))
    for q in numba.prange(len(vertices)):
        v = vertices[q]
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
                    away[d] = position[v, d] + step * away[d]
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


@parallel_jit
def step_sharp(vertices, probes, f, gradient, start, limit, tolerance, final, rank, position):
    """Move sharp vertices onto the tangent planes of their probes.

    Returns the outcome (N,) int8: 0 settled, 1 look again, 2 not sharp or out of reach (``limit`` mm from its
    start). Three planes that hardly make a corner leave a crease (rank 2). In the ``final`` round a vertex that
    still moves by more than ``tolerance`` is settled.
    """
    outcome = np.zeros(len(vertices), np.int8)
    for q in numba.prange(len(vertices)):
        v = vertices[q]
        n = np.empty((3, 3))
        height = np.empty(3)
        shift = np.empty(3)
        count = 3 if rank[v] == 3 else 2
        valid = True
        for p in range(count):
            for d in range(3):
                n[p, d] = gradient[q, p, d]
            length = _normalise(n[p])
            valid &= length > 0 and length < math.inf
            height[p] = -f[q, p] / length
            for d in range(3):
                height[p] += n[p, d] * (probes[q, p, d] - position[v, d])
        if count == 3 and valid and _three_planes(n, height, shift) < _CORNER_VOLUME:
            rank[v] = 2
            outcome[q] = 1
            continue
        if count == 2:
            valid &= _dot(n[0], n[1]) < _CREASE_COSINE
            if valid:
                _two_planes(n, height, shift)
        moved = 0.0
        step = 0.0
        if valid:
            for d in range(3):
                step += shift[d] ** 2
                moved += (position[v, d] + shift[d] - start[v, d]) ** 2
        if not valid or not moved <= limit * limit:
            outcome[q] = 2
            continue
        for d in range(3):
            position[v, d] += shift[d]
        outcome[q] = 1 if step > tolerance * tolerance and not final else 0
    return outcome
