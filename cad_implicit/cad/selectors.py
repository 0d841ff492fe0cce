"""Selectors: the edges or faces that a text chooses, as users of CadQuery's string selectors expect.

======================  ====================================================================================
``|Z`` ``#Z``           straight edges parallel, or perpendicular, to Z; plane faces by their normal
``+Z`` ``-Z`` ``Z``     the same in this direction only
``>Z`` ``<Z``           those whose centre is farthest, or least far, along Z, ties included
``>>Z[-2]``             the last but one by centre (0 is the first); ``>Z[-2]`` counts those parallel to Z only
``%circle``             by type: line, circle, ellipse, bspline …; plane, cylinder, cone …
``concave`` ``convex``  by convexity, also ``smooth``, ``mixed``, ``seam``, ``boundary``, ``nonmanifold``
``3,5,7``               by number, from 1
``all``                 all of them
======================  ====================================================================================

A direction is X, Y, Z, XY, XZ, YZ or a vector such as ``(1,0,0.5)``. ``and`` binds more than ``or``, ``or`` more than
``exc`` (without); ``not`` takes everything that follows, as in CadQuery: ``not |Z and >X`` is ``not (|Z and >X)``.

Works on plain arrays (:class:`Candidates`), so that it serves B-reps of any kernel and meshes alike.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cad_implicit.errors import SelectorError
from cad_implicit.mesh import FloatArray

Mask = NDArray[np.bool_]

#: Kinds of edges by the angle of the material, as selectors name them.
CONVEXITIES = ("convex", "concave", "smooth", "mixed", "seam", "boundary", "nonmanifold")

#: Centres within this many mm along a direction are a tie, and directions within this angle in radians are the same:
#: CadQuery's figures.
_TIE = 1e-4
_ANGLE = 1e-4

_AXES = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1), "XY": (1, 1, 0), "XZ": (1, 0, 1), "YZ": (0, 1, 1)}
_VIEWS = {"front": ">Z", "back": "<Z", "left": "<X", "right": ">X", "top": ">Y", "bottom": "<Y"}

_FLOAT = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_DIRECTION = rf"(?P<direction>XY|XZ|YZ|X|Y|Z|\(\s*{_FLOAT}\s*,\s*{_FLOAT}\s*,\s*{_FLOAT}\s*\))"
_ATOMS = (
    ("numbers", re.compile(r"\d+(?:\s*,\s*\d+)*(?![\w.])")),
    ("directed", re.compile(rf"(?P<sign>>>|<<|[><|#+-]?)\s*{_DIRECTION}(?!\w)\s*(?:\[\s*(?P<index>-?\s*\d+)\s*\])?")),
    ("type", re.compile(r"%\s*(?P<type>[A-Za-z]+)")),
    ("named", re.compile(r"[A-Za-z]+")),
)


@dataclass(frozen=True, eq=False)
class Candidates:
    """What can be chosen, as arrays.

    Attributes
    ----------
    noun : str
        What one of them is called: "edge" or "face".
    numbers : (N,) int
        Their numbers, ascending, from 1; some may be left out.
    centres : (N, 3) float64
        Centres of mass in mm.
    directions : (N, 3) float64
        Unit direction of a straight edge, outward normal of a plane face; NaN for others.
    types : sequence of str
        Type of curve or surface, in lower case: "line", "circle", "plane" …
    convexities : sequence of str
        Each one of ``CONVEXITIES``; empty for faces.
    """

    noun: str
    numbers: NDArray[np.integer]
    centres: FloatArray
    directions: FloatArray
    types: Sequence[str]
    convexities: Sequence[str] = ()


def select(selector: str, candidates: Candidates) -> NDArray[np.intp]:
    """Positions ``(M,)``, ascending from 0, of the candidates that a selector chooses; at least one.

    Raises
    ------
    SelectorError
        If the selector cannot be read, names a number that is not there, or chooses nothing; says what there is.

    Examples
    --------
    >>> import numpy as np
    >>> centres, along = np.diag([1.0, 2.0, 3.0]), np.eye(3)
    >>> edges = Candidates("edge", np.arange(1, 4), centres, along, ["line"] * 3, ["convex", "concave", "convex"])
    >>> select(">Z or |X", edges), select("concave", edges), select("not 2,3", edges)
    (array([0, 2]), array([1]), array([0]))
    """
    chosen = np.flatnonzero(_Parser(selector, candidates).mask())
    if not len(chosen):
        raise SelectorError(f"{selector!r} selects no {candidates.noun}; {_present(candidates)}")
    return chosen


class _Parser:
    """Recursive descent over the text of a selector, evaluated on the way."""

    def __init__(self, text: str, candidates: Candidates) -> None:
        self._text = text
        self._at = 0
        self._all = candidates

    def mask(self) -> Mask:
        """Which candidates the whole text chooses, ``(N,)``."""
        result = self._expression()
        if self._rest():
            raise self._error("expected 'and', 'or', 'exc' or the end")
        return result

    def _expression(self) -> Mask:
        return self._chain(("exc", "except"), self._sum, lambda a, b: a & ~b)

    def _sum(self) -> Mask:
        return self._chain(("or",), self._product, np.logical_or)

    def _product(self) -> Mask:
        return self._chain(("and",), self._operand, np.logical_and)

    def _chain(self, words: Sequence[str], operand: Callable[[], Mask], join: Callable[[Mask, Mask], Mask]) -> Mask:
        result = operand()
        while self._word() in words:
            self._at += len(self._word())
            result = join(result, operand())
        return result

    def _operand(self) -> Mask:
        if self._word() == "not":
            self._at += 3
            return ~self._expression()
        for kind, pattern in _ATOMS:
            found = pattern.match(self._rest())
            if found:
                result: Mask = getattr(self, f"_{kind}")(found)
                self._at += found.end()
                return result
        if self._rest().startswith("("):
            self._at += 1
            result = self._expression()
            if not self._rest().startswith(")"):
                raise self._error("expected ')'")
            self._at += 1
            return result
        raise self._error("expected |Z, #Z, >Z, <Z, +Z, -Z, %type, a number, concave, convex, all, 'not' or '('")

    def _rest(self) -> str:
        """Text that is left, from its first character that is not blank."""
        self._at += len(self._text[self._at :]) - len(self._text[self._at :].lstrip())
        return self._text[self._at :]

    def _word(self) -> str:
        found = re.match(r"[A-Za-z]+", self._rest())
        return found.group().lower() if found else ""

    def _error(self, expected: str) -> SelectorError:
        where = f"at {self._rest()[:20]!r}" if self._rest() else "at its end"
        return SelectorError(f"the selector {self._text!r} cannot be read {where}: {expected}")

    def _numbers(self, found: re.Match[str]) -> Mask:
        wanted = [int(number) for number in found.group().split(",")]
        missing = sorted(set(wanted) - set(self._all.numbers.tolist()))
        if missing:
            raise SelectorError(
                f"there is no {self._all.noun} {', '.join(map(str, missing))} for {self._text!r}; {_present(self._all)}"
            )
        return np.isin(self._all.numbers, wanted)

    def _type(self, found: re.Match[str]) -> Mask:
        return np.array([kind == found["type"].lower() for kind in self._all.types], np.bool_)

    def _named(self, found: re.Match[str]) -> Mask:
        word = found.group().lower()
        if word == "all":
            return np.ones(len(self._all.numbers), np.bool_)
        if word in CONVEXITIES and len(self._all.convexities):
            return np.array([convexity == word for convexity in self._all.convexities], np.bool_)
        if word in _VIEWS:
            return self._extreme(np.array(_AXES[_VIEWS[word][1]], np.float64), _VIEWS[word][0], None)
        raise self._error(f"{word!r} is no word of selectors for a {self._all.noun}")

    def _directed(self, found: re.Match[str]) -> Mask:
        sign, text, index = found["sign"] or "+", found["direction"], found["index"]
        vector = np.array(_AXES[text] if text in _AXES else [float(x) for x in text[1:-1].split(",")], np.float64)
        length = float(np.linalg.norm(vector))
        if not (np.isfinite(length) and length > 0):
            raise self._error("a direction must not be zero")
        if index is not None and sign[0] not in "<>":
            raise self._error("only >, <, >> and << take an index")
        vector /= length
        if sign[0] in "<>":
            return self._extreme(vector, sign, None if index is None else int(index.replace(" ", "")))
        along = self._all.directions @ vector
        if sign == "#":
            return np.asarray(np.abs(along) < np.sin(_ANGLE))
        across = np.linalg.norm(np.cross(self._all.directions, vector), axis=1)
        side = {"|": np.abs(along), "+": along, "-": -along}[sign]
        return np.asarray((across < np.sin(_ANGLE)) & (side > 0))

    def _extreme(self, vector: FloatArray, sign: str, index: int | None) -> Mask:
        """Those of the index-th group of centres along a direction; the last one by default."""
        result = np.zeros(len(self._all.numbers), np.bool_)
        some = np.arange(len(result))
        if index is not None and len(sign) == 1:
            some = np.flatnonzero(np.linalg.norm(np.cross(self._all.directions, vector), axis=1) < np.sin(_ANGLE))
        height = self._all.centres[some] @ vector * (1 if sign[0] == ">" else -1)
        groups: list[list[int]] = []
        start = -np.inf
        for position in np.argsort(height, kind="stable"):
            if height[position] - start > _TIE:
                groups.append([])
                start = height[position]
            groups[-1].append(int(some[position]))
        wanted = -1 if index is None else index
        if -len(groups) <= wanted < len(groups):
            result[groups[wanted]] = True
        return result


def _present(candidates: Candidates) -> str:
    """Say what there is to choose from."""
    noun = candidates.noun
    if not len(candidates.numbers):
        return f"the part has no {noun}s"
    counts = [Counter(names) for names in (candidates.convexities, candidates.types) if len(names)]
    kinds = "; ".join(", ".join(f"{number} {name}" for name, number in count.most_common()) for count in counts)
    last = int(candidates.numbers.max())
    return f"the part has {len(candidates.numbers)} {noun}s with numbers up to {last} ({kinds})"
