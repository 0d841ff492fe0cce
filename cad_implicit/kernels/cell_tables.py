"""Which edges of a cell belong to the same piece of surface, for every sign case and every ambiguous face.

Corner ``4 x + 2 y + z`` of a cell is bit ``4 x + 2 y + z`` of its mask (set: inside). Edge ``4 axis + 2 a + b`` runs
along ``axis`` at offsets ``a, b`` along the two other axes in ascending order. Face ``2 axis + side``.

On each face the surface joins the crossed edges in pairs, so the crossed edges of a cell form closed loops, each
the border of one piece of surface with one vertex. A face with inside corners on one diagonal only is ambiguous:
the pairs go around the inside corners (*separated*) or around the outside corners (*joined*). Both cells at the face
must take the same choice, hence the tables are indexed by it. Manifold dual contouring: Schaefer, Ju and Warren
2007, DOI 10.1109/TVCG.2007.1012.
"""

import numpy as np


def _corner(offsets):
    return 4 * offsets[0] + 2 * offsets[1] + offsets[2]


def _edge_corners():
    corners = []
    for axis in range(3):
        first, second = (a for a in range(3) if a != axis)
        for a, b in ((0, 0), (0, 1), (1, 0), (1, 1)):
            start = [0, 0, 0]
            start[first], start[second] = a, b
            end = list(start)
            end[axis] = 1
            corners.append((_corner(start), _corner(end)))
    return tuple(corners)


def _face_edges():
    def lies_on(corner, axis, side):
        return corner >> (2 - axis) & 1 == side

    return tuple(
        [e for e, ends in enumerate(EDGE_CORNERS) if all(lies_on(c, axis, side) for c in ends)]
        for axis in range(3)
        for side in range(2)
    )


def _crossed(mask, face_edges):
    return [e for e in face_edges if (mask >> EDGE_CORNERS[e][0] ^ mask >> EDGE_CORNERS[e][1]) & 1]


def _pairs_on_face(mask, face_edges, joined):
    """Pairs of crossed edges of one face that the surface joins."""
    crossed = _crossed(mask, face_edges)
    if len(crossed) < 4:
        return [crossed] if crossed else []
    around = [c for c in range(8) if (mask >> c & 1) != joined]
    pairs = ([e for e in crossed if c in EDGE_CORNERS[e]] for c in around)
    return [pair for pair in pairs if len(pair) == 2]


def _loops(mask, joined_faces):
    """Loop number (12,) of each edge, -1 for edges that are not crossed; ``joined_faces`` has a bit per face."""
    label = {e: e for e in _crossed(mask, range(12))}
    for face, face_edges in enumerate(FACE_EDGES):
        for first, second in _pairs_on_face(mask, face_edges, joined_faces >> face & 1):
            old, new = label[first], label[second]
            label = {e: new if root == old else root for e, root in label.items()}
    roots = sorted(set(label.values()))
    return [roots.index(label[e]) if e in label else -1 for e in range(12)]


def _tables():
    ambiguous = np.zeros(256, np.uint8)
    first_row = np.zeros(256, np.int32)
    rows = []
    for mask in range(256):
        faces = [f for f in range(6) if len(_crossed(mask, FACE_EDGES[f])) == 4]
        ambiguous[mask] = sum(1 << f for f in faces)
        first_row[mask] = len(rows)
        for choice in range(1 << len(faces)):
            joined = sum(1 << f for q, f in enumerate(faces) if choice >> q & 1)
            rows.append(_loops(mask, joined))
    loops = np.array(rows, np.int8)
    return ambiguous, first_row, loops, (loops.max(axis=1) + 1).astype(np.int8)


#: Corners of each of the 12 edges, lower end first.
EDGE_CORNERS = _edge_corners()

#: Edges of each of the 6 faces.
FACE_EDGES = _face_edges()

#: AMBIGUOUS (256,): bits of the ambiguous faces of a mask. FIRST_ROW (256,): row of a mask with all of them separated;
#: bit q of the number added to it says that the q-th ambiguous face is joined. LOOP_OF_EDGE (rows, 12): loop of each
#: edge or -1. LOOPS (rows,): number of loops.
AMBIGUOUS, FIRST_ROW, LOOP_OF_EDGE, LOOPS = _tables()
