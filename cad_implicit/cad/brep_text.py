"""B-reps as text: the records of a BREP file, taken apart, added to, and put together again.

A kernel without a way to make vertices, edges and faces one by one still reads them from text; and tells, by writing
it, which faces share which edges. The format is that of ``BRepTools::Write``, version 1, without triangles.

Locations are kept as products of the file's elementary ones, ``((number, power), ...)``, so that two are the same
exactly if the kernel takes them for the same.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cad_implicit.errors import InvalidMeshError
from cad_implicit.implicit import FloatArray

from .geometry import Circle, Framed, Line, Spline, Surface

Location = tuple[tuple[int, int], ...]

#: What stands before the locations, and the line that ends the head of a record.
_HEAD = "DBRep_DrawableShape\n\nCASCADE Topology V1, (c) Matra-Datavision\n"
_FLAGS = re.compile(r"[01]{7}")

#: Sections before the shapes; the others hold triangles, which are left out.
_SECTIONS = (
    "Locations",
    "Curve2ds",
    "Curves",
    "Polygon3D",
    "PolygonOnTriangulations",
    "Surfaces",
    "Triangulations",
    "TShapes",
)

#: Flags of new records: modified and orientable; wires, shells and vertices closed; vertices convex.
FLAGS = {"Ve": "0101101", "Ed": "0101000", "Wi": "0101100", "Fa": "0101000", "Sh": "0101100", "So": "0100000"}
FLAGS["Co"] = "1100000"

#: Names of the primitives' records.
_PRIMITIVES = {"plane": 1, "cylinder": 2, "cone": 3, "sphere": 4, "torus": 5}


class Child(NamedTuple):
    """A shape within another: "+", "-", "i" or "e" for its orientation, its record from 0, and its place in that."""

    orientation: str
    record: int
    location: Location


@dataclass(eq=False)
class Record:
    """A shape: "Ve", "Ed", "Wi", "Fa", "Sh", "So", "CS" or "Co"; the lines of its geometry; flags; what it holds."""

    kind: str
    lines: list[str]
    flags: str
    children: list[Child]


@dataclass(eq=False)
class Brep:
    """All of a B-rep's text.

    Attributes
    ----------
    locations : list of str
        As they are written.
    placed : list of Location
        The same; the first one is that of what is not moved, which is not written.
    texts : dict of str to list of str
        Curves in space and in surfaces, and surfaces, as they are written; see :meth:`add`.
    counts : dict of str to int
        How many of each there are.
    records : list of Record
        What a shape holds comes before it.
    root : Child
    """

    locations: list[str] = field(default_factory=list)
    placed: list[Location] = field(default_factory=lambda: [()])
    texts: dict[str, list[str]] = field(default_factory=lambda: {"Curve2ds": [], "Curves": [], "Surfaces": []})
    counts: dict[str, int] = field(default_factory=lambda: {"Curve2ds": 0, "Curves": 0, "Surfaces": 0})
    records: list[Record] = field(default_factory=list)
    root: Child = field(default_factory=lambda: Child("+", 0, ()))

    def copy(self) -> Brep:
        """Text to which more can be added without changing this one."""
        texts = {name: list(text) for name, text in self.texts.items()}
        records = [Record(r.kind, list(r.lines), r.flags, list(r.children)) for r in self.records]
        return Brep(list(self.locations), list(self.placed), texts, dict(self.counts), records, self.root)

    def add(self, section: str, text: str) -> int:
        """Add a curve or surface, and give its number, from 1."""
        self.texts[section].append(text)
        self.counts[section] += 1
        return self.counts[section]

    def record(self, kind: str, lines: list[str], children: Sequence[Child] = ()) -> int:
        """Add a record, and give its number, from 0."""
        self.records.append(Record(kind, lines, FLAGS[kind], list(children)))
        return len(self.records) - 1

    def number(self, location: Location) -> int:
        """Give the number of a location, which is added if there is none."""
        if location not in self.placed:
            self.locations.append("2  " + " ".join(f"{n} {power}" for n, power in reversed(location)) + " 0")
            self.placed.append(location)
        return self.placed.index(location)

    def text(self) -> str:
        """Text of the root and all that it holds."""
        used = np.zeros(len(self.records), np.bool_)
        used[self.root.record] = True
        for number in range(len(self.records) - 1, -1, -1):
            if used[number]:
                for child in self.records[number].children:
                    used[child.record] = True
        order = np.flatnonzero(used).tolist()
        names = {number: len(order) - position for position, number in enumerate(order)}
        body = []
        for number in order:
            own = self.records[number]
            children = "".join(f"{c.orientation}{names[c.record]} {self.number(c.location)} " for c in own.children)
            body.append("\n".join([own.kind, *own.lines, "", own.flags, children + "*"]))
        root = f"\n{self.root.orientation}{names[self.root.record]} {self.number(self.root.location)} "
        sections = [_HEAD + f"Locations {len(self.locations)}", *self.locations]
        for name in ("Curve2ds", "Curves", "Polygon3D", "PolygonOnTriangulations", "Surfaces", "Triangulations"):
            sections += [f"{name} {self.counts.get(name, 0)}", *self.texts.get(name, [])]
        return "\n".join([*sections, "", f"TShapes {len(order)}", *body, root])


def times(first: Location, second: Location) -> Location:
    """Product of two locations: what is placed by the second within the first."""
    result = list(first)
    for number, power in second:
        if result and result[-1][0] == number:
            power += result.pop()[1]
        if power:
            result.append((number, power))
    return tuple(result)


def inverse(location: Location) -> Location:
    """Inverse of a location."""
    return tuple((number, -power) for number, power in reversed(location))


def turned(orientation: str, within: str) -> str:
    """Orientation of what has one within a shape that has another."""
    if within in "ie":
        return within
    return orientation if within == "+" or orientation in "ie" else "-" if orientation == "+" else "+"


def parsed(text: str) -> Brep:
    """Take the text of a BREP file apart.

    Raises
    ------
    InvalidMeshError
        If it is of another version.
    """
    if "CASCADE Topology V1," not in text[:200]:
        raise InvalidMeshError("the kernel writes a B-rep as text of another version than 1")
    found = [re.search(rf"^{name} (\d+)", text, re.MULTILINE) for name in _SECTIONS]
    if not all(found):
        raise InvalidMeshError("the kernel's text of a B-rep lacks a section")
    heads = [match for match in found if match is not None]
    ends = [match.start() for match in heads[1:]] + [len(text)]
    parts = {name: text[h.end() : end] for name, h, end in zip(_SECTIONS, heads, ends, strict=True)}
    counts = {name: int(match.group(1)) for name, match in zip(_SECTIONS, heads, strict=True)}
    brep = Brep()
    _locations(parts["Locations"], counts["Locations"], brep)
    for name in ("Curve2ds", "Curves", "Surfaces"):
        brep.counts[name] = counts[name]
        brep.texts[name] = [parts[name].strip("\n")] if counts[name] else []
    _records(parts["TShapes"], counts["TShapes"], brep)
    return brep


def _locations(text: str, count: int, brep: Brep) -> None:
    tokens = iter(text.split())
    for number in range(1, count + 1):
        if next(tokens) == "1":
            brep.locations.append("1\n" + " ".join(next(tokens) for _ in range(12)))
            brep.placed.append(((number, 1),))
            continue
        product: Location = ()
        line = "2  "
        while (factor := int(next(tokens))) != 0:
            power = int(next(tokens))
            line += f"{factor} {power} "
            one = brep.placed[factor] if power > 0 else inverse(brep.placed[factor])
            for _ in range(abs(power)):
                product = times(one, product)  # the last one is applied first
        brep.locations.append(line + "0")
        brep.placed.append(product)


def _records(text: str, count: int, brep: Brep) -> None:
    lines = iter([line for line in text.split("\n") if line.strip()])
    for _ in range(count):
        kind, body = next(lines).strip(), []
        while not _FLAGS.fullmatch((line := next(lines)).strip()):
            body.append(line)
        flags, children = line.strip(), [""]
        while not children[-1].endswith("*"):
            children.append(next(lines).strip())
        own = list(_children(" ".join(children)[:-1], count, brep.placed))
        # what follows the first line of a face names triangles
        brep.records.append(Record(kind, body[:1] if kind == "Fa" else body, flags, own))
    brep.root = next(_children(next(lines), count, brep.placed))


def _children(text: str, count: int, placed: Sequence[Location]) -> Iterator[Child]:
    tokens = text.split()
    for name, location in zip(tokens[::2], tokens[1::2], strict=True):
        yield Child(name[0], count - int(name[1:]), placed[int(location)])


# --- geometry


def curve_text(curve: Line | Circle | Spline) -> str:
    """Text of a curve in space."""
    if isinstance(curve, Line):
        return f"1 {_numbers(curve.point)} {_numbers(curve.direction)}"
    if isinstance(curve, Circle):
        side = np.cross(curve.normal, curve.start)
        frame = " ".join(map(_numbers, (curve.centre, curve.normal, curve.start, side)))
        return f"2 {frame} {curve.radius!r}"
    return spline_text(curve)


def spline_text(curve: Spline) -> str:
    """Text of a spline in space or in the plane of a surface's parameters."""
    head = f"7 0 0  {curve.degree} {len(curve.poles)} {len(curve.knots)} "
    return f"{head} {_numbers(curve.poles.ravel())}\n {_knots(curve.knots, curve.counts)}"


def surface_text(surface: Surface) -> str:
    """Text of a surface."""
    if isinstance(surface, Framed):
        primitive = surface.primitive
        side = np.cross(surface.axis, surface.start)
        sizes = {
            "plane": [],
            "cylinder": [primitive.radius],
            "cone": [0.0, primitive.radius],
            "sphere": [primitive.radius],
            "torus": [primitive.ring, primitive.radius],
        }[primitive.kind]
        frame = " ".join(map(_numbers, (primitive.point, surface.axis, surface.start, side)))
        return f"{_PRIMITIVES[primitive.kind]} {frame} {' '.join(repr(float(size)) for size in sizes)}"
    rows, columns = surface.poles.shape[:2]
    head = f"9 0 0 0 0 {surface.degrees[0]} {surface.degrees[1]} {rows} {columns} "
    head += f"{len(surface.knots[0])} {len(surface.knots[1])} "
    knots = "\n".join(_knots(*one) for one in zip(surface.knots, surface.counts, strict=True))
    return f"{head} {_numbers(surface.poles.ravel())}\n{knots}"


def _numbers(values: FloatArray) -> str:
    return " ".join(map(repr, values.tolist()))


def _knots(knots: FloatArray, counts: Sequence[int] | FloatArray | object) -> str:
    return " ".join(f"{knot!r} {int(count)}" for knot, count in zip(knots.tolist(), np.asarray(counts), strict=True))
