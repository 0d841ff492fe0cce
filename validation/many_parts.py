"""Many parts under trouble: ``python -m validation.many_parts [COUNT]`` (200 by default).

One part in twenty is broken. A worker is killed midway, then the whole batch; it is begun again and must finish what is
left and nothing else. Prints figures; exits with 1 if a result is lost, done twice, or left half.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import psutil

import cad_implicit as ci

_RADIUS = 0.9
_BROKEN = 20


def make(folder: Path, count: int) -> int:
    """Write boxes with bosses, turned, of sizes of their own; return how many are broken."""
    random = np.random.default_rng(7)
    folder.mkdir()
    broken = 0
    for number in range(count):
        path = folder / f"part{number:03d}.stl"
        a, b, c = random.uniform(5, 9, 3)
        axis = random.normal(size=3)
        shape = (ci.box((a, b, c)) | ci.box((2.2, 2.7, c + 3))).turned(axis, random.uniform(0.2, 1.2))
        ci.save(ci.contour(shape, 0.8), path)
        if number % _BROKEN == 3:
            path.write_bytes(path.read_bytes()[:-777])
            broken += 1
    return broken


def command(parts: Path, output: Path) -> list[str]:
    """Command line of the batch."""
    options = ["--op", "fillet", "-r", str(_RADIUS), "--spacing", "0.3", "-o", str(output), "--quiet"]
    return [sys.executable, "-m", "cad_implicit", "batch", str(parts), *options]


def finished(output: Path) -> int:
    """Lines in the ledger."""
    ledger = output / "batch.jsonl"
    return len(ledger.read_text().splitlines()) if ledger.exists() else 0


def main() -> int:
    """Make parts, work on them, kill, begin again, look."""
    parser = argparse.ArgumentParser(description="A batch whose worker and whose whole are killed.")
    parser.add_argument("count", type=int, nargs="?", default=200)
    count = parser.parse_args().count
    with TemporaryDirectory() as folder:
        parts, output = Path(folder, "parts"), Path(folder, "out")
        broken = make(parts, count)
        start = time.perf_counter()
        with subprocess.Popen(command(parts, output)) as batch:
            while finished(output) < count // 4:
                time.sleep(0.1)
            workers = [p for p in psutil.Process(batch.pid).children() if "spawn_main" in " ".join(p.cmdline())]
            workers[0].kill()
            while finished(output) < count // 2:
                time.sleep(0.1)
            family = psutil.Process(batch.pid).children(recursive=True)
            batch.kill()
            for process in family:
                if process.is_running():
                    process.kill()
        first = {path: path.stat().st_mtime_ns for path in output.glob("*.stl")}
        before = finished(output)
        code = subprocess.run(command(parts, output), check=False).returncode
        seconds = time.perf_counter() - start
        rows = {}
        for line in (output / "batch.jsonl").read_text().splitlines():
            row = json.loads(line)
            rows[row["output"]] = row
        results = sorted(output.glob("*.stl"))
        again = sum(path.stat().st_mtime_ns != first[path] for path in first)
        left = sorted(str(path) for path in output.iterdir() if path.name.startswith("."))
        closed = sum(ci.to_mesh(path).is_watertight for path in results)
        fates = [row["fate"] for row in rows.values()]
        print(f"{count} parts, {broken} broken: {fates.count('done')} done, {fates.count('failed')} failed, ", end="")
        print(
            f"{fates.count('killed')} killed; {before} finished before the kill, {again} of their files written again, "
        )
        print(
            f"{len(results)} results, {closed} of them closed, {len(left)} left half; {seconds:.0f} s, exit code {code}"
        )
    good = len(results) == closed == count - broken and fates.count("failed") == broken
    return 0 if good and not again and not left and code == 1 else 1


if __name__ == "__main__":
    sys.exit(main())
