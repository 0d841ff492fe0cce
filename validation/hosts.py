"""Parts at which the exact kernel fails, through the host that is installed: ``python -m validation.hosts [CASE…]``.

Chosen edges by the safe fillet (the exact kernel first), and the whole part by a ball. Each run is a child process, so
that a crash would be told. A run is sound if it gives a valid, closed solid of positive volume, or an error of this
package. Exits with 1 if a run is not sound.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
import warnings
from importlib.util import find_spec
from typing import Any

#: Seconds that one run may take.
_LIMIT = 600

_HOST = "cadquery" if find_spec("cadquery") else "build123d"


def _runs() -> dict[str, Any]:
    if _HOST == "cadquery":
        from .hosts_cadquery import runs
    else:
        from .hosts_build123d import runs
    return dict(runs())


def perform(name: str) -> dict[str, Any]:
    """Do one run in this process."""
    from cad_implicit.cad import occ, to_mesh
    from cad_implicit.errors import CadImplicitError

    work = _runs()[name]
    start = time.perf_counter()
    try:
        result = work()
    except CadImplicitError as error:
        return {"seconds": time.perf_counter() - start, "refused": f"{type(error).__name__}: {error}"}
    seconds = time.perf_counter() - start
    shape, how = result.wrapped, result.implicit
    faults = [] if occ.is_valid(shape) else ["invalid"]
    faults += [] if occ.volume(shape) > 0 else ["negative volume"]
    faults += [] if to_mesh(shape).is_watertight else ["open"]
    return {
        "seconds": seconds,
        "faults": faults,
        "volume": occ.volume(shape),
        "faces": occ.count_faces(shape),
        "exact": how.exact_share,
        "bound": how.error_bound,
        "engine": how.engine,
        "why": " | ".join(filter(None, [how.reason, how.facets])),
    }


def _in_a_child(name: str) -> dict[str, Any]:
    command = [sys.executable, "-m", __spec__.name, "--run", name]
    try:
        child = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return {"seconds": _LIMIT, "crash": f"no answer within {_LIMIT} s"}
    try:
        return dict(json.loads(child.stdout.splitlines()[-1]))
    except (IndexError, ValueError):
        last = child.stderr.strip().splitlines()[-1:] or [""]
        return {"seconds": 0.0, "crash": f"the process ended with code {child.returncode} {last[0]}"}


def _line(name: str, found: dict[str, Any]) -> str:
    head = f"{name:28s}{found['seconds']:7.1f} s  "
    if "crash" in found:
        return f"{head}CRASH: {found['crash']}"
    if "refused" in found:
        return f"{head}{found['refused']}"
    state = "valid" if not found["faults"] else "FAULT: " + ", ".join(found["faults"])
    bound = "unknown" if found["bound"] is None else f"{found['bound']:.2g}"
    return (
        f"{head}{state}, {found['engine']}, {found['volume']:.4f} mm³, {found['faces']} faces, "
        f"{found['exact']:.0%} exact, error {bound}  {found['why']}"
    )


def main() -> int:
    """Run all, or some cases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", help="numbers of cases; all by default")
    parser.add_argument("--run", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        warnings.simplefilter("ignore")
        print(json.dumps(perform(options.run)))
        return 0
    print(f"host: {_HOST}")
    bad = 0
    for name in _runs():
        if options.cases and name.split()[0] not in options.cases:
            continue
        found = _in_a_child(name)
        bad += bool(found.get("faults") or "crash" in found)
        print(_line(name, found), flush=True)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
