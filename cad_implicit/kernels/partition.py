"""Sorting triangles into the nodes of a tree: splits by the surface area heuristic, balanced enough to bound the depth.

Splits that only halve the number of triangles make trees of CAD meshes, with their long thin triangles, 30 to 40 %
slower to search.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from .jit import jit, parallel_jit

#: Triangles in a leaf, at most.
LEAF = 4
#: Children of a node, at most.
WIDTH = 8
#: Every split leaves at least this part of the triangles on each side.
_LEAST_PART = 4
#: So the depth is at most log(2**31 / LEAF) / log(4 / 3) + 2 = 73, and each level leaves up to 7 nodes waiting.
STACK = 520
#: Candidate planes across each axis, plus one.
_BINS = 12


def partition(boxes, order, even):
    """Sort triangles into nodes.

    Parameters
    ----------
    boxes : (F, 6) float64
        Low and high corner of each triangle's box.
    order : (F,) int32
        Triangles, at least one; sorted in place.
    even : bool
        Triangles are of similar size: planes are looked for across the widest axis only.

    Returns
    -------
    children : (N, 8) int32
        Node number, or ``-leaf - 1``.
    ranges : (N, 8, 2) int32
        Triangles below each child: ``order[start:stop]``; empty for unused children.
    first : (L + 1,) int32
        Triangles of each leaf: ``order[first[leaf]:first[leaf + 1]]``.
    """
    # Nodes have two children at least, so that those below a range take fewer rows than it has triangles.
    capacity = len(order)
    children, ranges = np.full((capacity, WIDTH), -1, np.int32), np.zeros((capacity, WIDTH, 2), np.int32)
    begins, counts, root = np.zeros(capacity + 1, np.bool_), np.zeros(WIDTH, np.int64), np.zeros((WIDTH, 2), np.int32)
    _fill_node(boxes, order, root, 0, capacity, even)
    _sort_ranges(boxes, order, root, even, children, ranges, begins, counts)
    return _numbered(root, counts, children, ranges, begins)


@parallel_jit
def _sort_ranges(boxes, order, root, even, children, ranges, begins, counts):
    for c in numba.prange(WIDTH):
        counts[c] = _sort_below(boxes, order, root[c, 0], root[c, 1], even, children, ranges, begins)


@jit
def _sort_below(boxes, order, start, stop, even, children, ranges, begins):
    """Sort a range into nodes, whose rows begin at ``start`` and whose numbers at 0; returns how many there are."""
    if start == stop:
        return 0
    if stop - start <= LEAF:
        begins[start] = True
        return 0
    own, below = children[start:stop], ranges[start:stop]
    stack = np.zeros((STACK, 3), np.int64)
    stack[0, 0], stack[0, 1] = start, stop
    waiting, count = 1, 1
    while waiting > 0:
        waiting -= 1
        node = stack[waiting, 2]
        filled = _fill_node(boxes, order, below[node], stack[waiting, 0], stack[waiting, 1], even)
        for c in range(filled):
            low, high = below[node, c]
            if high - low <= LEAF:
                begins[low] = True
            else:
                own[node, c] = count
                stack[waiting, 0], stack[waiting, 1], stack[waiting, 2] = low, high, count
                waiting += 1
                count += 1
    return count


@jit
def _numbered(root, counts, children, ranges, begins):
    """Nodes one after the other, those below each of the root's children together, and leaves, with their numbers."""
    total = 1
    for top in range(WIDTH):
        total += counts[top]
    nodes, below = np.full((total, WIDTH), -1, np.int32), np.zeros((total, WIDTH, 2), np.int32)
    at = 1
    for top in range(WIDTH):  # numbers, not rows: assigning rows takes the compiler seconds
        below[0, top, 0], below[0, top, 1] = root[top, 0], root[top, 1]
        if counts[top] > 0:
            nodes[0, top] = at
        for n in range(counts[top]):
            row = root[top, 0] + n
            for c in range(WIDTH):
                below[at + n, c, 0], below[at + n, c, 1] = ranges[row, c, 0], ranges[row, c, 1]
                nodes[at + n, c] = at + children[row, c] if children[row, c] >= 0 else -1
        at += counts[top]
    begins[-1] = True
    leaf_of, leaves = np.zeros(len(begins), np.int32), 0
    for q in range(len(begins)):
        leaf_of[q] = leaves
        leaves += begins[q]
    first = np.zeros(leaves, np.int32)
    for q in range(len(begins)):
        if begins[q]:
            first[leaf_of[q]] = q
    for node in range(total):
        for c in range(WIDTH):
            if nodes[node, c] < 0 and below[node, c, 1] > below[node, c, 0]:
                nodes[node, c] = -leaf_of[below[node, c, 0]] - 1
    return nodes, below, first


@jit
def _fill_node(boxes, order, own, start, stop, even):
    """Split a range into up to eight, the one with the largest box first; return their number."""
    scratch = np.zeros((_BINS, 6)), np.zeros(_BINS, np.int64), np.zeros(_BINS), np.zeros(6), np.zeros(3), np.zeros(3)
    size = np.zeros(WIDTH)
    own[0, 0], own[0, 1] = start, stop
    size[0] = math.inf
    filled = 1
    while filled < WIDTH:
        largest = -1
        for c in range(filled):
            if own[c, 1] - own[c, 0] > LEAF and (largest < 0 or size[c] > size[largest]):
                largest = c
        if largest < 0:
            break
        start, stop = np.int64(own[largest, 0]), np.int64(own[largest, 1])
        middle = _split(boxes, order, start, stop, even, scratch)
        own[largest, 1] = own[filled, 0] = middle
        own[filled, 1] = stop
        size[largest] = _surface_of(boxes, order, start, middle, scratch[3])
        size[filled] = _surface_of(boxes, order, middle, stop, scratch[3])
        filled += 1
    return filled


@jit
def _split(boxes, order, start, stop, even, scratch):
    """Reorder a range so that a good split falls at the position returned."""
    best, best_axis, best_bin, best_low, best_width = math.inf, np.int64(-1), 0, 0.0, 0.0  # as in closest.py
    lowest, extent = scratch[4], scratch[5]
    widest, widest_axis = -1.0, np.int64(0)
    for axis in range(3):
        low, high = math.inf, -math.inf
        for q in range(start, stop):
            key = boxes[order[q], axis] + boxes[order[q], 3 + axis]
            low, high = min(low, key), max(high, key)
        lowest[axis], extent[axis] = low, high - low
        if high - low > widest:
            widest, widest_axis = high - low, axis
    for axis in range(3):
        if extent[axis] > 1e-14 and stop - start > 2 * LEAF and (axis == widest_axis or not even):
            width = extent[axis] / _BINS * (1 + 1e-9)
            cost, b = _best_plane(boxes, order, start, stop, axis, lowest[axis], width, scratch)
            if cost < best:
                best, best_axis, best_bin, best_low, best_width = cost, axis, b, lowest[axis], width
    if best_axis < 0:
        # halves, the left one made of full leaves
        middle = start + max(((stop - start) // 2 + LEAF // 2) // LEAF, 1) * LEAF
        _select(boxes, order, start, stop, middle, widest_axis)
        return middle
    i, j = start, stop - 1
    while i <= j:
        if _bin(boxes, order[i], best_axis, best_low, best_width) < best_bin:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i


@jit
def _bin(boxes, t, axis, low, width):
    """Bin of a triangle; where bins are hardly wider than rounding errors, sums in another order land beside them."""
    return min(max(int((boxes[t, axis] + boxes[t, 3 + axis] - low) / width), 0), _BINS - 1)


@jit
def _best_plane(boxes, order, start, stop, axis, low, width, scratch):
    """Cost of the best plane across an axis and the first bin right of it; infinite if none is balanced enough."""
    bins, number, right, box, _, _ = scratch
    number[:] = 0
    for b in range(_BINS):
        _clear(bins[b])
    for q in range(start, stop):
        t = order[q]
        b = _bin(boxes, t, axis, low, width)
        number[b] += 1
        _grow(bins[b], boxes[t])
    _clear(box)
    count = 0
    for b in range(_BINS - 1, 0, -1):
        _grow(box, bins[b])
        count += number[b]
        right[b] = _surface(box) * _leaves(count)
    _clear(box)
    best, best_bin, count, total = math.inf, 0, 0, stop - start
    for b in range(1, _BINS):
        _grow(box, bins[b - 1])
        count += number[b - 1]
        if min(count, total - count) * _LEAST_PART >= total:
            cost = _surface(box) * _leaves(count) + right[b]
            if cost < best:
                best, best_bin = cost, b
    return best, best_bin


@jit
def _leaves(count):
    return (count + LEAF - 1) // LEAF


@jit
def _clear(box):
    for d in range(3):
        box[d], box[3 + d] = math.inf, -math.inf


@jit
def _grow(box, other):
    for d in range(3):
        box[d], box[3 + d] = min(box[d], other[d]), max(box[3 + d], other[3 + d])


@jit
def _surface(box):
    """Half the surface of a box; 0 if it is empty."""
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x if x >= 0.0 else 0.0


@jit
def _surface_of(boxes, order, start, stop, box):
    _clear(box)
    for q in range(start, stop):
        _grow(box, boxes[order[q]])
    return _surface(box)


@jit
def _select(boxes, order, start, stop, middle, axis):
    """Reorder a range so that box centres left of middle are not above those right of it (quickselect)."""
    left, right = start, stop - 1
    while left < right:
        pivot = boxes[order[(left + right) >> 1], axis] + boxes[order[(left + right) >> 1], 3 + axis]
        i, j = left, right
        while i <= j:
            while boxes[order[i], axis] + boxes[order[i], 3 + axis] < pivot:
                i += 1
            while boxes[order[j], axis] + boxes[order[j], 3 + axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            right = j
        elif middle >= i:
            left = i
        else:
            return
