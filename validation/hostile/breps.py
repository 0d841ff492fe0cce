"""B-rep files that are broken or awkward."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import cadquery as cq


def notch() -> cq.Workplane:
    """Give an L off the axes."""
    outline = [(0, 0), (17.3, 0), (17.3, 6.1), (7.2, 6.1), (7.2, 11.9), (0, 11.9)]
    return cq.Workplane().polyline(outline).close().extrude(7.7).rotate((0, 0, 0), (0.48, -0.6, 0.64), 40)


def _written(shape: cq.Workplane | cq.Shape) -> Callable[[Path], None]:
    return lambda path: cq.exporters.export(
        shape if isinstance(shape, cq.Workplane) else cq.Workplane(shape), str(path), _KINDS[path.suffix]
    )


_KINDS = {".step": "STEP", ".brep": "BREP"}


def _edited(shape: cq.Workplane, edit: Callable[[bytes], bytes]) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        _written(shape)(path)
        path.write_bytes(edit(path.read_bytes()))

    return write


def _inches(data: bytes) -> bytes:
    """STEP in inches: the file's own unit of millimetres under a factor."""
    unit = b"( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
    assert unit in data
    number = max(int(line[1 : line.index(b" ")]) for line in data.splitlines() if line[:1] == b"#" and b" = " in line)
    a, b, c, d = (number + n for n in range(1, 5))
    lines = (
        b"#%d = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\n" % a
        + b"#%d = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#%d);\n" % (b, a)
        + b"#%d = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n" % c
    )
    inch = b"( CONVERSION_BASED_UNIT('INCH',#%d) LENGTH_UNIT() NAMED_UNIT(#%d) )" % (b, c)
    del d
    before, after = data.split(b"ENDSEC;\nEND-ISO", 1)
    return before.replace(unit, inch) + lines + b"ENDSEC;\nEND-ISO" + after


def files() -> Iterator[tuple[str, str, Callable[[Path], None]]]:
    """Names, suffixes and writers."""
    part = notch()
    boxes = cq.Workplane().box(17.3, 11.9, 7.7)
    beside = boxes.translate((0, 30.1, 0))
    for suffix in (".step", ".brep"):
        yield "sound", suffix, _written(part)
        yield "cut in the middle", suffix, _edited(part, lambda data: data[: len(data) // 2])
        yield "cut at the end", suffix, _edited(part, lambda data: data[:-40])
        yield "another header", suffix, _edited(part, lambda data: b"GIF89a" + data[30:])
        yield "a face without its solid", suffix, _written(part.faces(">Z").val())
        yield "a shell that lacks a face", suffix, _written(cq.Shell.makeShell(part.faces("not >Z").vals()))
        yield "an edge", suffix, _written(part.edges(">Z").val())
        yield "two separate solids", suffix, _written(cq.Compound.makeCompound([boxes.val(), beside.val()]))
        yield (
            "two solids that overlap",
            suffix,
            _written(cq.Compound.makeCompound([boxes.val(), boxes.translate((6.1, 4.3, 2.2)).val()])),
        )
        yield (
            "two solids that touch",
            suffix,
            _written(cq.Compound.makeCompound([boxes.val(), boxes.translate((17.3, 0, 0)).val()])),
        )
        yield "inside out", suffix, _written(cq.Shape.cast(part.val().wrapped.Reversed()))
        yield "1e-4 of its size", suffix, _written(part.val().scale(1e-4))
        yield "1e5 of its size", suffix, _written(part.val().scale(1e5))
        yield "1e7 mm from the origin", suffix, _written(part.translate((1e7, -1e7, 1e7)))
        yield "random bytes", suffix, lambda path: path.write_bytes(bytes(range(256)) * 20) and None
    yield "inches", ".step", _edited(part, _inches)
    yield (
        "a reference to nothing",
        ".step",
        _edited(part, lambda data: data.replace(b"CLOSED_SHELL('',(#", b"CLOSED_SHELL('',(#9")),
    )
    yield (
        "words for numbers",
        ".step",
        _edited(part, lambda data: data.replace(b"CARTESIAN_POINT('',(", b"CARTESIAN_POINT('',(NAN,", 3)),
    )
    yield "words for numbers", ".brep", _edited(part, lambda data: data.replace(b"\nVe\n", b"\nVe\nwords for ", 1))
    yield (
        "a word in an edge",
        ".brep",
        _edited(part, lambda data: re.sub(rb"(\nEd\n.*\n1  )", rb"\1first ", data, count=1)),
    )
    yield (
        "an entity that lacks its beginning",
        ".step",
        _edited(part, lambda data: data.replace(b"CARTESIAN_POINT('',(", b"V,", 1)),
    )
    yield "two entities of one name", ".step", _edited(part, lambda data: data.replace(b"\n#9 ", b"\n#7 ", 1))
    yield "a BREP called STEP", ".step", _as(".brep", part)
    yield "a STEP called BREP", ".brep", _as(".step", part)
    yield (
        "a union that the kernel made invalid",
        ".step",
        _written(cq.Workplane().box(10, 10, 10).union(cq.Workplane().sphere(6))),
    )


def _as(suffix: str, part: cq.Workplane) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        other = path.with_suffix(suffix)
        _written(part)(other)
        other.replace(path)

    return write
