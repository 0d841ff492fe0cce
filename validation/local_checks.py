"""What is checked of every local blend: closed, manifold, free of self-intersections, and touched by its balls."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from itertools import pairwise
from multiprocessing import get_context
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from cad_implicit.cad import OpenPart
from cad_implicit.implicit import FloatArray
from cad_implicit.local_blend import LocalBlend
from cad_implicit.mesh import Mesh

from .contact import Contacts, Curve
from .intersections import find_intersections
from .runs import manifold_status
from .surfaces import Surfaces

#: Vertices farther than this many spacings from the part are on its blends.
_OFF = 0.005
#: Triangles that tell which face of the part is nearest may be off by this many spacings.
_FACETS = 1 / 20
#: So many vertices go through the contact test at most.
_MOST = 6000
#: Pieces of a spine between two of its samples.
_FINER = 16
#: Balls farther than this share of the radius from touching a face roll on its border.
_BORDER = 1e-3
#: Farthest a vertex may be from where a ball touches, in spacings.
CONTACT = 0.02


@dataclass(frozen=True)
class Checked:
    """Figures of one mesh.

    Attributes
    ----------
    contact : float
        Farthest that a vertex of a blend is from a ball, in spacings.
    place : (3,) tuple
        Where that is, in mm.
    loose : int
        How many are farther than ``CONTACT``, of the ``tested`` ones.
    centres : float
        Farthest that the distances from the spines to the faces are from the radius, in spacings.
    """

    faces: int
    closed: bool
    manifold: str
    crossings: int
    volume: float
    contact: float
    place: tuple[float, float, float]
    loose: int
    tested: int
    centres: float

    @property
    def faults(self) -> list[str]:
        """What is wrong, nothing for a sound mesh."""
        found = [] if self.closed else ["open"]
        found += [self.manifold] if self.manifold != "NoError" else []
        found += [f"{self.crossings} self-intersections"] if self.crossings else []
        found += ["inside out"] if self.volume <= 0 else []
        if not self.contact <= CONTACT:
            x, y, z = self.place
            found.append(f"contact {self.contact:.2g} at ({x:.3f}, {y:.3f}, {z:.3f}), {self.loose} of {self.tested}")
        found += [f"centres {self.centres:.2g}"] if not self.centres <= CONTACT else []
        return found


def checked(mesh: Mesh, blend: LocalBlend, part: OpenPart, radii: Mapping[int, float], spacing: float) -> Checked:
    """Check the mesh of a local blend with constant radii by number of the edge."""
    points = blend_vertices(mesh, part, spacing)
    contact, place, loose = 0.0, (0.0, 0.0, 0.0), 0
    if len(points) and radii:
        defect = Contacts(part, radii).test(points).defect
        far = defect > CONTACT * spacing
        defect[far] = np.minimum(defect[far], from_spines(points[far], blend))
        defect /= spacing
        worst = int(defect.argmax())
        x, y, z = points[worst].tolist()
        contact, place, loose = float(defect[worst]), (x, y, z), int((defect > CONTACT).sum())
    return Checked(
        faces=len(mesh.faces),
        closed=mesh.is_watertight,
        manifold=manifold_status(mesh),
        crossings=find_intersections(mesh).count,
        volume=mesh.volume,
        contact=contact,
        place=place,
        loose=loose,
        tested=len(points),
        centres=centres(blend) / spacing,
    )


def blend_vertices(mesh: Mesh, part: OpenPart, spacing: float) -> FloatArray:
    """Vertices (N, 3) that are not on the part's own surface; some of them if they are many."""
    points = mesh.vertices[np.unique(mesh.faces)]
    distance, _ = Surfaces(part.shape, _FACETS * spacing).nearest(points)
    points = points[distance > _OFF * spacing]
    if len(points) > _MOST:
        points = points[np.random.default_rng(0).choice(len(points), _MOST, replace=False)]
    return points


def centres(blend: LocalBlend) -> float:
    """Largest difference in mm between the radius and the distances from the spines of balls to both faces.

    Where a ball rolls on a sharp border, beyond the face, it is the distance to the border that counts.
    """
    worst = 0.0
    for laid in blend.laid.values():
        for spine, supports in laid.spines:
            for side, support in enumerate(supports) if spine.ball else ():
                off = np.abs(support(spine.centres)[0] - spine.radius)
                reach = np.abs(np.linalg.norm(spine.reaches[:, side], axis=1) - spine.radius)
                worst = max(worst, float(np.where(off < _BORDER * spine.radius, off, reach).max()))
    return worst


def from_spines(points: FloatArray, blend: LocalBlend) -> FloatArray:
    """Differences (N,) in mm between the distances of points to the nearest spine or corner and the radius there.

    The spines are the blend's own; :func:`centres` tells how well they keep their distance from the faces.
    """
    best = np.full(len(points), np.inf)
    for laid in blend.laid.values():
        for spine, _ in laid.spines:
            if spine.ball and len(points) and float(np.ptp(spine.radius)) == 0.0:
                radius = float(spine.radius[0])
                curve = Curve(_finer(spine.centres, spine.tangents), 1.0, radius)
                best = np.minimum(best, np.abs(curve.value_and_gradient(points)[0]))
        for ball in laid.corners:
            best = np.minimum(best, np.abs(np.linalg.norm(points - ball.centre, axis=1) - ball.radius))
    return best


def _finer(points: FloatArray, tangents: FloatArray) -> FloatArray:
    """Points of a curve, and more between them by Hermite's cubics."""
    span = np.linalg.norm(np.diff(points, axis=0), axis=1)
    rows = np.concatenate([[True], span > 0])
    points, tangents = points[rows], tangents[rows]
    if len(points) < 2:
        return np.repeat(points, 2, axis=0)
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    fine = np.unique(np.concatenate([np.linspace(a, b, _FINER) for a, b in pairwise(at.tolist())]))
    return np.asarray(CubicHermiteSpline(at, points, tangents)(fine))


class Worker:
    """A child process for runs, started again after one that crashed or hung."""

    def __init__(self, task: Callable[[int], Any], timeout: float) -> None:
        self._task, self._timeout = task, timeout
        self._pool: ProcessPoolExecutor | None = None

    def __call__(self, index: int) -> Any:
        """Give what the task gives, or what happened instead as text."""
        if self._pool is None:
            self._pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"))
        try:
            return self._pool.submit(self._task, index).result(timeout=self._timeout)
        except BrokenProcessPool:
            self._pool = None
            return "the process crashed"
        except TimeoutError:
            for process in list(self._pool._processes.values()):
                process.kill()
            self._pool = None
            return f"not done after {self._timeout:g} s"
        except Exception as error:
            return f"{type(error).__name__}: {error}"

    def close(self) -> None:
        """End the child process."""
        if self._pool is not None:
            self._pool.shutdown()


def numbers_in(text: str) -> set[int]:
    """Whole numbers in a text such as "3,7" or "10-20"."""
    found: set[int] = set()
    for piece in text.split(","):
        low, _, high = piece.partition("-")
        found |= set(range(int(low), int(high or low) + 1))
    return found
