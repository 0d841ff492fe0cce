"""Triangles that are broken or awkward, written to files."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import cad_implicit as ci
from cad_implicit.mesh import Mesh

Triangles = tuple[NDArray[np.float64], NDArray[np.int64]]

#: Lengths in mm of the box most of them begin with, and how it is turned: off the axes.
_SIZES = (17.3, 11.9, 7.7)
_AXIS = np.array([0.48, -0.6, 0.64])
_TURN = 0.7


def turned(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (N, 3) turned off the axes (Rodrigues' formula)."""
    along = np.outer(points @ _AXIS, _AXIS)
    return along + np.cos(_TURN) * (points - along) + np.sin(_TURN) * np.cross(_AXIS, points)


def box(sizes: tuple[float, float, float] = _SIZES, centre: tuple[float, float, float] = (0, 0, 0)) -> Triangles:
    """Twelve triangles of a box, not turned."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    return corners * sizes + np.array(centre), faces


def notch() -> Triangles:
    """Give the closed triangles of an L: a box with a notch, turned."""
    outline = np.array([[0, 0], [17.3, 0], [17.3, 6.1], [7.2, 6.1], [7.2, 11.9], [0, 11.9]])
    count = len(outline)
    points = np.concatenate([np.column_stack([outline, np.full(count, z)]) for z in (0.0, 7.7)])
    caps = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    faces = [(a, c, b) for a, b, c in caps] + [(a + count, b + count, c + count) for a, b, c in caps]
    for i in range(count):
        j = (i + 1) % count
        faces += [(i, j, j + count), (i, j + count, i + count)]
    return turned(points), np.array(faces)


def joined(*parts: Triangles) -> Triangles:
    """Several as one, not welded."""
    start = np.cumsum([0] + [len(points) for points, _ in parts])
    return (
        np.concatenate([points for points, _ in parts]),
        np.concatenate([faces + n for (_, faces), n in zip(parts, start[:-1], strict=True)]),
    )


def refined(part: Triangles, rounds: int) -> Triangles:
    """Each triangle in four, some times over."""
    mesh = Mesh(*part)
    import trimesh

    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    for _ in range(rounds):
        body = body.subdivide()
    return np.asarray(body.vertices), np.asarray(body.faces)


def _ring() -> Triangles:
    """Prism with a concave outline of nine corners: 32 triangles."""
    turns = np.linspace(0, 2 * np.pi, 9, endpoint=False)
    radii = np.array([9.1, 9.1, 4.2, 9.1, 9.1, 9.1, 9.1, 9.1, 9.1])
    outline = np.column_stack([radii * np.cos(turns), radii * np.sin(turns)])
    points = np.concatenate([np.column_stack([outline, np.full(9, z)]) for z in (0.0, 7.7)])
    caps = [(2, (2 + i) % 9, (3 + i) % 9) for i in range(1, 8)]
    faces = [(a, c, b) for a, b, c in caps] + [(a + 9, b + 9, c + 9) for a, b, c in caps]
    for i in range(9):
        j = (i + 1) % 9
        faces += [(i, j, j + 9), (i, j + 9, i + 9)]
    return turned(points), np.array(faces)


def _stl(points: NDArray[np.float64], faces: NDArray[np.int64]) -> bytes:
    """Binary STL, without any check."""
    record = np.zeros(len(faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    with np.errstate(over="ignore"):
        record["corners"] = points[faces].astype(np.float32)
    return b"x".ljust(80) + np.uint32(len(faces)).tobytes() + record.tobytes()


def _obj(points: NDArray[np.float64], faces: NDArray[np.int64]) -> bytes:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += ["f " + " ".join(str(n + 1) for n in face) for face in faces.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _model(points: NDArray[np.float64], faces: NDArray[np.int64], unit: str = "millimeter") -> str:
    corners = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in points.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces.tolist())
    return (
        f'<?xml version="1.0"?><model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f'<resources><object id="1" type="model"><mesh><vertices>{corners}</vertices><triangles>{triangles}'
        '</triangles></mesh></object></resources><build><item objectid="1"/></build></model>'
    )


def _3mf(path: Path, model: str | bytes) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(
            "[Content_Types].xml",
            '<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
            '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>',
        )
        archive.writestr("3D/3dmodel.model", model)


def _bomb(path: Path) -> None:
    """3 GB of blanks in a model, in 3 MB."""
    block = b" " * 2**24
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive,
        archive.open("3D/3dmodel.model", "w", force_zip64=True) as file,
    ):
        file.write(_model(*notch()).encode()[:80])
        for _ in range(180):
            file.write(block)


def _expanding(path: Path) -> None:
    """Entities of entities: a billion words in a kilobyte of XML."""
    entities = '<!ENTITY e0 "lol">' + "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 10))
    _3mf(path, f'<?xml version="1.0"?><!DOCTYPE model [{entities}]><model>&e9;</model>')


def _bytes(data: bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(data) and None


def _as_stl(part: Triangles) -> Callable[[Path], None]:
    return _bytes(_stl(*part))


def _without(part: Triangles, *left_out: int) -> Triangles:
    return part[0], np.delete(part[1], left_out, axis=0)


def _flipped(part: Triangles, *which: int) -> Triangles:
    faces = part[1].copy()
    faces[list(which)] = faces[list(which)][:, ::-1]
    return part[0], faces


def _t_junction(part: Triangles) -> Triangles:
    """Put a new corner into the middle of an edge of the first triangle, but not of its neighbour."""
    points, faces = part
    a, b, c = faces[0]
    middle = len(points)
    points = np.concatenate([points, points[[a, b]].mean(axis=0)[None]])
    return points, np.concatenate([[[a, middle, c], [middle, b, c]], faces[1:]])


def _with(part: Triangles, vertex: int, value: float) -> Triangles:
    points = part[0].copy()
    points[vertex, 1] = value
    return points, part[1]


def _sheet() -> Triangles:
    points, faces = np.array([[0.0, 0, 0], [9, 0, 0], [9, 7, 0], [0, 7, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    return turned(points), np.concatenate([faces, faces[:, ::-1]])


def _needles(part: Triangles) -> Triangles:
    """Triangles split at points 1e-7 of an edge from its end: slivers."""
    points, faces = part
    a, b, c = faces[0]
    other = next(n for n, f in enumerate(faces[1:], 1) if a in f and b in f)
    d = next(v for v in faces[other] if v not in (a, b))
    new = len(points)
    points = np.concatenate([points, (points[a] + 1e-7 * (points[b] - points[a]))[None]])
    rest = np.delete(faces, [0, other], axis=0)
    return points, np.concatenate([rest, [[a, new, c], [new, b, c], [b, new, d], [new, a, d]]])


def _bow_tie() -> Triangles:
    """Turn the top of a box by half a turn over its bottom, so that its sides run through each other."""
    points, faces = box()
    top = points[:, 2] > 0
    points[top, :2] *= -1
    return turned(points), faces


def _moved(part: Triangles, by: tuple[float, float, float]) -> Triangles:
    return part[0] + np.array(by), part[1]


def _turned_box(
    sizes: tuple[float, float, float] = _SIZES, centre: tuple[float, float, float] = (0, 0, 0)
) -> Triangles:
    points, faces = box(sizes, centre)
    return turned(points), faces


def _inner(part: Triangles) -> Triangles:
    return part[0], part[1][:, ::-1]


def files() -> Iterator[tuple[str, str, Callable[[Path], None]]]:
    """Names, suffixes and writers."""
    good = notch()
    stl = _stl(*good)
    meshes: dict[str, Triangles] = {
        "sound": good,
        "one triangle missing": _without(good, 3),
        "a third of the triangles missing": _without(good, *range(0, len(good[1]), 3)),
        "one triangle twice": joined(good, (good[0], good[1][:1])),
        "all triangles twice": joined(good, good),
        "one triangle flipped": _flipped(good, 2),
        "half of the triangles flipped": _flipped(good, *range(0, len(good[1]), 2)),
        "all triangles flipped": _inner(good),
        "T-junction": _t_junction(good),
        "slivers of 1e-7": _needles(good),
        "sides that run through each other": _bow_tie(),
        "two boxes that overlap": joined(_turned_box(), _turned_box(centre=(6.1, 4.3, 2.2))),
        "two boxes that touch at a face": joined(_turned_box(), _turned_box(centre=(17.3, 0, 0))),
        "two boxes that touch at an edge": joined(_turned_box(), _turned_box(centre=(17.3, 11.9, 0))),
        "two boxes that touch at a corner": joined(_turned_box(), _turned_box(centre=(17.3, 11.9, 7.7))),
        "two separate boxes": joined(_turned_box(), _turned_box(centre=(0, 30.1, 0))),
        "a cavity": joined(_turned_box(), _inner(_turned_box((7.1, 4.2, 3.3)))),
        "a cavity whose triangles face outwards": joined(_turned_box(), _turned_box((7.1, 4.2, 3.3))),
        "a sheet without thickness": _sheet(),
        "a part and a sheet": joined(good, _moved(_sheet(), (0, 0, 30))),
        "a triangle that hangs on": joined(good, (good[0][:3] + 0.0, np.array([[0, 1, 2]]))),
        "1e-9 of its size": (good[0] * 1e-9, good[1]),
        "1e9 of its size": (good[0] * 1e9, good[1]),
        "1e7 mm from the origin": _moved(good, (1e7, -1e7, 1e7)),
        "NaN": _with(good, 4, np.nan),
        "infinity": _with(good, 4, np.inf),
        "1e38": _with(good, 4, 1e38),
        "all in one place": (good[0] * 0 + 3.0, good[1]),
        "two million triangles": refined(_ring(), 8),
    }
    for name, part in meshes.items():
        yield name, ".stl", _as_stl(part)
    for name in ("1e-9 of its size", "1e9 of its size", "1e7 mm from the origin"):
        yield f"{name}, in double precision", ".obj", _bytes(_obj(*meshes[name]))
    yield "no bytes", ".stl", _bytes(b"")
    yield "text", ".stl", _bytes(b"this is not a mesh\n" * 9)
    yield "random bytes", ".stl", _bytes(np.random.default_rng(3).bytes(5000))
    yield "cut short", ".stl", _bytes(stl[: len(stl) * 2 // 3])
    yield "more bytes than it says", ".stl", _bytes(stl + bytes(1000))
    yield "says it has 4 billion triangles", ".stl", _bytes(stl[:80] + b"\xff\xff\xff\xff" + stl[84:])
    yield "binary that begins with solid", ".stl", _bytes(b"solid".ljust(80) + stl[80:])
    yield "an STL called OBJ", ".obj", _bytes(stl)
    yield "an OBJ called STL", ".stl", _bytes(_obj(*good))
    yield "corners that are not there", ".obj", _bytes(_obj(good[0], good[1] + 7))
    yield "corner number zero", ".obj", _bytes(_obj(*good).replace(b"f 1 ", b"f 0 ", 1))
    yield "corners counted from the end", ".obj", _bytes(_from_the_end(good))
    yield "faces of six corners", ".obj", _bytes(_polygons())
    yield "words for numbers", ".obj", _bytes(_obj(*good).replace(b"v ", b"v one ", 1))
    yield "a coordinate of 1e308", ".obj", _bytes(re.sub(rb"v [^ ]+", b"v 1e308", _obj(*good), count=1))
    yield "cut short", ".ply", _ply(good, 0.6)
    yield "cut in its header", ".ply", _ply(good, 0.05)
    yield "4 billion faces in its header", ".ply", _boasting_ply(good)
    yield "inches", ".3mf", lambda path: _3mf(path, _model(*good, unit="inch"))
    yield "an unknown unit", ".3mf", lambda path: _3mf(path, _model(*good, unit="furlong"))
    yield "corners that are not there", ".3mf", lambda path: _3mf(path, _model(good[0], good[1] + 7))
    yield "broken XML", ".3mf", lambda path: _3mf(path, _model(*good)[:-100])
    yield "a zip file of something else", ".3mf", _other_zip
    yield "cut short", ".3mf", _cut_3mf
    yield "3 GB of blanks in 3 MB", ".3mf", _bomb
    yield "entities of entities", ".3mf", _expanding


def _from_the_end(part: Triangles) -> bytes:
    points, faces = part
    return _obj(points, faces - len(points) - 1)


def _polygons() -> bytes:
    """Make an L of two faces of six corners and six of four."""
    points, count = notch()[0], 6
    rings = [list(range(count))[::-1], list(range(count, 2 * count))]
    rings += [[i, (i + 1) % count, (i + 1) % count + count, i + count] for i in range(count)]
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    return ("\n".join(lines + ["f " + " ".join(str(n + 1) for n in ring) for ring in rings]) + "\n").encode()


def _ply_bytes(part: Triangles, path: Path) -> bytes:
    ci.save(ci.to_mesh(part), path)
    return path.read_bytes()


def _ply(part: Triangles, share: float) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        data = _ply_bytes(part, path)
        path.write_bytes(data[: int(share * len(data))])

    return write


def _boasting_ply(part: Triangles) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        data = _ply_bytes(part, path)
        path.write_bytes(data.replace(b"element face 20", b"element face 4000000000"))

    return write


def _other_zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("letter.txt", "hello")


def _cut_3mf(path: Path) -> None:
    _3mf(path, _model(*notch()))
    path.write_bytes(path.read_bytes()[:-60])
