"""Damaged files, at random: ``python -m validation.fuzz [MINUTES] [--seed N] [--keep FOLDER]``.

Small sound files of every format are damaged (bytes turned, cut, doubled, numbers made extreme, two files spliced) and
worked on in a child process: read, rounded coarsely, contoured, checked. Right is a result that is closed and finite,
or an error of this package; anything else, also a warning of numpy, a crash or a hang, is a finding, and its file is
kept. Exits with 1 if there is one.
"""

from __future__ import annotations

import argparse
import multiprocessing
import re
import sys
import time
import traceback
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable
from io import BytesIO
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import cad_implicit as ci
from cad_implicit.errors import CadImplicitError, GeometryWarning

#: Seconds that one file may take, after the kernels are compiled.
_LIMIT = 120.0

_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_EXTREMES = (
    b"nan",
    b"inf",
    b"-1",
    b"0",
    b"1e308",
    b"1e-308",
    b"4294967295",
    b"2147483648",
    b"-0.0",
    b"1e19",
    b"7",
    b"",
)

Random = np.random.Generator


def seeds(folder: Path) -> dict[str, list[bytes]]:
    """Bytes of sound files by suffix."""
    shape = (ci.box((6.1, 5.3, 4.7)) | ci.box((2.2, 2.7, 7.9))).turned((1, 2, 3), 0.4)
    small = ci.contour(shape, 1.1)
    for suffix in (".stl", ".ply", ".obj", ".3mf"):
        ci.save(small, folder / f"mesh{suffix}")
    vertices = small.vertices[small.faces]
    lines = ["solid a"]
    for a, b, c in vertices:
        corners = "\n".join("vertex {:.6g} {:.6g} {:.6g}".format(*p) for p in (a, b, c))
        lines.append(f"facet normal 0 0 0\nouter loop\n{corners}\nendloop\nendfacet")
    (folder / "text.stl").write_text("\n".join([*lines, "endsolid a\n"]))
    box = (ci.box((6.0, 5.0, 4.0)) - ci.cylinder(1.2, 9)).turned((1, 2, 3), 0.4)
    coarse = ci.contour(box, 1.6)
    for suffix in (".step", ".brep"):
        ci.save(coarse, folder / f"solid{suffix}")
    found: dict[str, list[bytes]] = {}
    for path in sorted(folder.iterdir()):
        found.setdefault(path.suffix, []).append(path.read_bytes())
    return found


def _turned(data: bytearray, random: Random) -> None:
    for place in random.integers(0, len(data), random.integers(1, 9)):
        data[place] = random.integers(256)


def _cut(data: bytearray, random: Random) -> None:
    first = int(random.integers(len(data)))
    del data[first : first + int(random.integers(1, 400))]


def _ended(data: bytearray, random: Random) -> None:
    del data[int(random.integers(len(data))) :]


def _doubled(data: bytearray, random: Random) -> None:
    first, to = (int(n) for n in random.integers(0, len(data), 2))
    data[to:to] = data[first : first + int(random.integers(1, 400))]


def _extreme(data: bytearray, random: Random) -> None:
    numbers = list(_NUMBER.finditer(bytes(data)))
    for place in sorted(random.integers(0, len(numbers), random.integers(1, 4)), reverse=True) if numbers else ():
        data[numbers[place].start() : numbers[place].end()] = _EXTREMES[random.integers(len(_EXTREMES))]


def _wild(data: bytearray, random: Random) -> None:
    """Overwrite four bytes, which may be a number of a binary file, by an extreme one."""
    if len(data) > 8:
        first = int(random.integers(len(data) - 4))
        value = random.choice([np.nan, np.inf, 0.0, 1e38, -1e-38, 1e9])
        data[first : first + 4] = np.float32(value).tobytes()


_DAMAGES: tuple[Callable[[bytearray, Random], None], ...] = (_turned, _cut, _ended, _doubled, _extreme, _extreme, _wild)


def damaged(data: bytes, others: list[bytes], random: Random) -> bytes:
    """Bytes of a sound file with one to three damages; those of 3MF mostly within the packed text."""
    if data[:2] == b"PK" and random.random() < 0.8:
        return _repacked(data, random)
    some = bytearray(data)
    for _ in range(random.integers(1, 4)):
        if len(some):
            _DAMAGES[random.integers(len(_DAMAGES))](some, random)
    if random.random() < 0.1:
        other = others[random.integers(len(others))]
        some[int(random.integers(len(some) + 1)) :] = other[int(random.integers(len(other))) :]
    return bytes(some)


def _repacked(data: bytes, random: Random) -> bytes:
    packed = BytesIO()
    with zipfile.ZipFile(BytesIO(data)) as old, zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            text = bytearray(old.read(name))
            if name.endswith(".model"):
                _DAMAGES[random.integers(len(_DAMAGES))](text, random)
            new.writestr(name, bytes(text))
    return packed.getvalue()


def fate(path: Path, force: bool) -> str:
    """Work on a file; tell what came of it. With force, what leaks is worked on, too."""
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", GeometryWarning)
    try:
        outcome = ci.run(path, "round", 0.8, spacing=0.45, force=force)
    except CadImplicitError:
        return "refused"
    if not outcome.mesh.is_watertight or not np.isfinite(outcome.mesh.vertices).all():
        return "FINDING: the result is not closed"
    return "works"


def _child(pipe: Connection) -> None:
    while (job := pipe.recv()) is not None:
        try:
            answer = fate(*job)
        except BaseException:
            answer = f"FINDING: {traceback.format_exc(limit=-4)}"
        pipe.send(answer)


class _Child:
    """A process that tells fates, begun anew after a crash or a hang."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._start()

    def _start(self) -> None:
        self._pipe, theirs = self._context.Pipe()
        self._process = self._context.Process(target=_child, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def fate(self, path: Path, force: bool = False, limit: float = _LIMIT) -> str:
        """Fate of a file, as :func:`fate` tells it."""
        self._pipe.send((path, force))
        try:
            if self._pipe.poll(limit):
                return str(self._pipe.recv())
            found = f"FINDING: no answer within {limit:.0f} s"
        except EOFError:
            self._process.join()
            found = f"FINDING: the process ended with code {self._process.exitcode}"
        self._process.kill()
        self._start()
        return found


def main() -> int:
    """Damage files until the time is over."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("minutes", type=float, nargs="?", default=10.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("findings"))
    options = parser.parse_args()
    random = np.random.default_rng(options.seed)
    counts: Counter[tuple[str, str]] = Counter()
    with TemporaryDirectory() as name:
        sound = seeds(Path(name))
        child = _Child()
        for suffix in sound:  # compiles
            path = Path(name, f"sound{suffix}")
            path.write_bytes(sound[suffix][0])
            found = child.fate(path, limit=1200.0)
            if found != "works":
                raise AssertionError(f"the sound {suffix}: {found}")
            path.write_bytes(sound[suffix][0][:-400])
            child.fate(path, force=True, limit=1200.0)
        end = time.monotonic() + 60 * options.minutes
        while time.monotonic() < end:
            suffix = str(random.choice(list(sound)))
            data = sound[suffix][random.integers(len(sound[suffix]))]
            path = Path(name, f"damaged{suffix}")
            path.write_bytes(damaged(data, sound[suffix], random))
            found = child.fate(path, force=bool(random.random() < 0.6))
            counts[suffix, found.split(":")[0]] += 1
            if found.startswith("FINDING"):
                options.keep.mkdir(exist_ok=True)
                kept = options.keep / f"{options.seed}_{sum(counts.values())}{suffix}"
                kept.write_bytes(path.read_bytes())
                sys.stdout.write(f"{kept}: {found}\n")
                sys.stdout.flush()
    for (suffix, what), count in sorted(counts.items()):
        sys.stdout.write(f"{suffix:6} {what:8} {count}\n")
    return int(any(what == "FINDING" for _, what in counts))


if __name__ == "__main__":
    sys.exit(main())
