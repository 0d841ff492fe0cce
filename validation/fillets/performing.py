"""One run of the corpus; in a module of its own, so that other processes find it."""

from __future__ import annotations

import re
import resource
import time
from typing import Any

from cad_implicit.report.validation import validate

from .corpus import jobs, prepared

#: Seconds for the exact kernel.
_EXACT = 60.0

_REFUSED = re.compile(r"largest")


def perform(number: int) -> dict[str, Any]:
    """Do the run of a number; returns a row of the table."""
    job = jobs()[number]
    start, before = time.perf_counter(), _processor()
    part, radius, there = prepared(job)
    if not there:
        return {"key": job.key, "fate": "none"}
    spacing = radius / 4 if job.edges else None
    found = validate(
        part, radius, operation=job.operation, edges=job.edges, spacing=spacing, time_limit=_EXACT, threads=1
    )
    refused = found.outcome is None and bool(_REFUSED.search(found.failure))
    fate = "passed" if found.passed else "refused" if refused and found.kernel["fate"] != "ok" else "failed"
    row = {
        "key": job.key, "part": job.part, "operation": job.operation, "edges": job.edges, "radius": radius,
        "fate": fate, "kernel": found.kernel["fate"], "faults": found.faults, "seconds": time.perf_counter() - start,
        "processor_seconds": _processor() - before,
        "regions": {name: s.max for name, s in found.regions.items()},
    }  # fmt: skip
    if found.outcome is not None and found.measured is not None:
        row |= {
            "spacing": found.outcome.spacing, "triangles": len(found.outcome.mesh.faces),
            "own_seconds": sum(found.outcome.seconds.values()), "against": found.measured.against,
            "bound": found.outcome.error_bound,
        }  # fmt: skip
    return row


def _processor() -> float:
    """Processor time in s of this process and its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)
