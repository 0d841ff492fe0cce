"""What a surface crosses: grid edges with a change of sign, the cells around them, and the faces in doubt."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import parallel
from .errors import EmptyResultError
from .implicit import FloatArray
from .kernels import crossings, open_cells
from .kernels.cell_tables import LOOPS
from .sparse import Bricks


@dataclass(frozen=True, eq=False)
class Cells:
    """Crossed edges, active cells and ambiguous faces (see :mod:`cad_implicit.kernels.crossings` for the codes).

    Attributes
    ----------
    edges, cells, faces : (N,) int64
        Codes of the crossed edges (E), active cells (C) and ambiguous faces (A), in order.
    edge_lookup, cell_lookup : tuple of arrays
        Words of bits and the number of bits before each word, to find the index of an edge or a cell.
    tables : tuple of (C,) int32
        Row of each cell in the cell tables, and the number of its first vertex.
    joined : (A,) bool
        Whether the surface joins the inside corners of an ambiguous face.
    vertices : int
        Number of vertices of all cells.
    end_values : (E, 2) float64
        Values at the lower and upper end of each edge, infinite where only the sign is known.
    flat : (E,) bool
        Edges that cross a plane for certain; filled in by whoever looks at the edges.
    """

    edges: NDArray[np.int64]
    cells: NDArray[np.int64]
    faces: NDArray[np.int64]
    edge_lookup: tuple[NDArray[np.uint64], NDArray[np.int64]]
    cell_lookup: tuple[NDArray[np.uint64], NDArray[np.int64]]
    tables: tuple[NDArray[np.int32], NDArray[np.int32]]
    joined: NDArray[np.bool_]
    vertices: int
    end_values: FloatArray
    flat: NDArray[np.bool_]

    @property
    def inside_first(self) -> NDArray[np.bool_]:
        """Whether the lower end of each edge (E,) is the inside one."""
        return np.asarray(self.end_values[:, 0] > 0)


def find_cells(bricks: Bricks, values: Callable[[FloatArray], FloatArray], threads: int | None = None) -> Cells:
    """Find what the surface crosses, and decide the ambiguous faces by the sign at their centres.

    Parameters
    ----------
    bricks : Bricks
        Node values.
    values : callable
        Maps points (N, 3) in mm to values (N,), positive inside.
    threads : int, optional
        Number of threads of the kernels, all cores by default.

    Raises
    ------
    EmptyResultError
        If no edge changes its sign.
    """
    b = bricks
    with parallel.threads(threads, b.values.size):
        signs = crossings.sign_words(b.values)
        edge_words, cell_words, face_words = crossings.crossing_words(signs, b.neighbours)
        if b.inner is not None:
            open_cells.leave_out(edge_words, cell_words, face_words, b.neighbours, b.inner)
        edge_start, cell_start, face_start = (crossings.starts(w) for w in (edge_words, cell_words, face_words))
        edges = crossings.codes(edge_words, edge_start)
        cells = crossings.codes(cell_words, cell_start)
        faces = crossings.codes(face_words, face_start)
        centres = crossings.face_centres(faces, b.blocks, b.origin, b.spacing)
    if len(edges) == 0:
        size = " x ".join(f"{x:g}" for x in b.box[1] - b.box[0])
        raise EmptyResultError(
            f"no surface was found within {size} mm at a spacing of {b.spacing:g} mm: no node lies inside; "
            "check the bounds, or use a smaller spacing if the part is thinner than that"
        )
    centre_values = values(centres)
    with parallel.threads(threads, len(cells)):
        joined = crossings.joined_words(faces, centre_values, face_words)
        rows = crossings.cell_rows(cells, signs, joined, b.neighbours)
        end_values = crossings.edge_values(edges, b.values, b.neighbours)
    ends = np.cumsum(LOOPS[rows], dtype=np.int64)
    return Cells(
        edges=edges,
        cells=cells,
        faces=faces,
        edge_lookup=(edge_words, edge_start),
        cell_lookup=(cell_words, cell_start),
        tables=(rows, (ends - LOOPS[rows]).astype(np.int32)),
        joined=centre_values > 0,
        vertices=int(ends[-1]),
        end_values=end_values,
        flat=np.zeros(len(edges), np.bool_),
    )
