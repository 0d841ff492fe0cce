"""Which triangles of a closed mesh run through each other, or lie on each other.

Triangles are sorted into the bins of a coarse grid. Where all triangles of a bin face one way there is nothing to
find: between two sheets that cross there, a third one or a fold faces the other way. Elsewhere all pairs in a bin are
tried (:mod:`.meeting`). Triangles that are large beside the bins are looked up in trees (:mod:`.large_triangles`).
"""

import math

import numpy as np
from numba import prange

from .jit import frozen, jit, parallel_jit
from .large_triangles import large_against_all
from .meeting import meet
from .stack import dealt

#: Width of the bins in spacings. On 96,000 triangles of a bracket, bins of 1.5 and 2 spacings take 16 and 17 ms on one
#: thread.
_BIN = 1.5

#: The most bins: more would take more memory than the mesh. Where a grid has more, as around a strip along a long edge,
#: those that are so many apart share one.
_MOST_BINS = 1 << 22

#: Triangles whose box touches more bins than this are large.
_MOST_TOUCHED = 64

#: Triangles face one way if none is farther from their mean direction than this cosine (41 degrees).
_CALM = 0.75

#: Heights above a plane that count without a look at rounding errors, in spacings: those of normals of slivers of 0.01
#: degrees are 1e-12.
_CLEAR = 1e-6

_CHUNK = 64


@parallel_jit
def _boxes(position, faces):
    """Bounding boxes (F, 6) and unit normals (F, 3) of triangles, zero without area."""
    box = np.empty((len(faces), 6))
    normal = np.zeros((len(faces), 3))
    for t in prange(len(faces)):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        for d in range(3):
            x, y, z = position[a, d], position[b, d], position[c, d]
            box[t, d], box[t, 3 + d] = min(x, min(y, z)), max(x, max(y, z))
        ux, uy, uz = position[b, 0] - position[a, 0], position[b, 1] - position[a, 1], position[b, 2] - position[a, 2]
        vx, vy, vz = position[c, 0] - position[a, 0], position[c, 1] - position[a, 1], position[c, 2] - position[a, 2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = math.sqrt(x * x + y * y + z * z)
        if area > 0:
            normal[t, 0], normal[t, 1], normal[t, 2] = x / area, y / area, z / area
    return box, normal


@jit
def _grid(box, spacing):
    """Lower corner (3,), width and numbers (3,) of bins."""
    low, high, count = np.full(3, math.inf), np.full(3, -math.inf), np.zeros(3, np.int64)
    for t in range(len(box)):
        for d in range(3):
            low[d], high[d] = min(low[d], box[t, d]), max(high[d], box[t, 3 + d])
    width = _BIN * spacing
    for d in range(3):
        count[d] = int(min((high[d] - low[d]) / width, 1e6)) + 1
    return low, width, count


@jit
def _touched(box, low, inverse, count, at):
    """First and last bins (6,) along the axes that the box of a triangle touches; returns how many in all.

    ``inverse`` is one over their width.
    """
    for d in range(6):
        at[d] = min(int((box[d] - low[d % 3]) * inverse), count[d % 3] - 1)
    return (at[3] - at[0] + 1) * (at[4] - at[1] + 1) * (at[5] - at[2] + 1)


@jit
def _bins(box, spacing):
    """Sort triangles into bins: the first entry (N + 1,) of each bin, the triangles (M,) of all entries, large ones."""
    low, width, count = _grid(box, spacing)
    total = min(count[0] * count[1] * count[2], _MOST_BINS)
    start = np.zeros(total + 2, np.int32)
    entries = np.empty(0, np.int32)
    large = np.zeros(len(box), np.bool_)
    at = np.empty(6, np.int64)
    # Count, then fill: ``start`` is one ahead, and moves back as the bins fill.
    for fill in range(2):
        for t in range(len(box)):
            if _touched(box[t], low, 1 / width, count, at) > _MOST_TOUCHED:
                large[t] = True
                continue
            for i in range(at[0], at[3] + 1):
                for j in range(at[1], at[4] + 1):
                    for k in range(at[2], at[5] + 1):
                        b = ((i * count[1] + j) * count[2] + k) % total
                        if fill == 0:
                            start[b + 2] += 1
                        else:
                            entries[start[b + 1]] = t
                            start[b + 1] += 1
        if fill == 0:
            for b in range(total):
                start[b + 2] += start[b + 1]
            entries = np.empty(start[total + 1], np.int32)
    return start[: total + 1], entries, large


@jit
def _calm(normal, entries):
    """Whether all triangles face one way."""
    x, y, z = 0.0, 0.0, 0.0
    for e in range(len(entries)):
        t = entries[e]
        x, y, z = x + normal[t, 0], y + normal[t, 1], z + normal[t, 2]
    least = _CALM * math.sqrt(x * x + y * y + z * z)
    if least == 0:
        return False
    for e in range(len(entries)):
        t = entries[e]
        if x * normal[t, 0] + y * normal[t, 1] + z * normal[t, 2] < least:
            return False
    return True


@jit
def _try_pairs(p, faces, box, normal, entries, least, bad):
    """Mark the triangles of a bin that meet others of it."""
    for m in range(len(entries)):
        s = entries[m]
        for n in range(m):
            t = entries[n]
            if (
                s != t
                and box[s, 0] <= box[t, 3]
                and box[t, 0] <= box[s, 3]
                and box[s, 1] <= box[t, 4]
                and box[t, 1] <= box[s, 4]
                and box[s, 2] <= box[t, 5]
                and box[t, 2] <= box[s, 5]
                and not (bad[s] and bad[t])
                and meet(p, faces[s], faces[t], normal[s], normal[t], least)
            ):
                bad[s] = True
                bad[t] = True


@parallel_jit
def _search(position, faces, box, normal, start, entries, least, bad):
    """Mark the triangles that meet others, bin by bin."""
    chunks = (len(start) + _CHUNK - 2) // _CHUNK
    for number in prange(chunks):
        first = _CHUNK * dealt(np.int64(number), chunks)
        _search_bins(position, faces, box, normal, start[first : first + _CHUNK + 1], entries, least, bad)


@jit
def _search_bins(position, faces, box, normal, start, entries, least, bad):
    for b in range(len(start) - 1):
        inside = entries[start[b] : start[b + 1]]
        if len(inside) > 1 and not _calm(normal, inside):
            _try_pairs(position, faces, box, normal, inside, least, bad)


def intersecting(position: np.ndarray, faces: np.ndarray, spacing: float | None = None) -> np.ndarray:
    """Which triangles (F,) run through others or lie on others.

    ``position`` (V, 3) and ``spacing``, about the size of the triangles, are in mm, ``faces`` (F, 3) int32. By default
    it is the side of a square as large as half of them: triangles of round faces are long and thin. Call it inside
    :func:`cad_implicit.parallel.threads`.
    """
    bad = np.zeros(len(faces), np.bool_)
    if spacing is None:
        a, b, c = (position[faces[:, k]] for k in range(3))
        spacing = float(np.sqrt(np.median(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2))) if len(faces) else 0.0
    if len(faces) and spacing > 0:
        position, faces = frozen(position), frozen(faces)
        box, normal = _boxes(position, faces)
        start, entries, large = _bins(box, spacing)
        _search(position, faces, box, normal, start, entries, _CLEAR * spacing, bad)
        large_against_all(position, faces, box, normal, large, _CLEAR * spacing, bad)
    return bad
