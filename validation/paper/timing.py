"""Tables 2 and 3: seconds of an iteration, and of the examples."""

from __future__ import annotations

import os
from dataclasses import dataclass

from validation.bench_redistance import milliseconds

from .examples import BOXES_RADIUS, PART_RADIUS, Result, microstructure, sampled, smoothed

#: Table 2 of the paper: seconds of one iteration on one thread, by shape and resolution.
PAPER_ITERATION = {
    "sphere": (0.0017, 0.014, 0.11),
    "jaw": (0.0018, 0.014, 0.11),
    "boxes": (0.0018, 0.014, 0.11),
    "part": (0.0018, 0.014, 0.11),
}

#: Table 3 of the paper: seconds on one and on four threads.
PAPER_EXAMPLE = {"jaw": (3.85, 1.91), "boxes": (2.52, 1.52), "part": (2.95, 1.67)}

#: Runs of an example, of which the fastest counts: another program on the machine only ever adds time.
_RUNS = 3


@dataclass(frozen=True)
class Example:
    """Seconds of an example on one thread and on two, the faster run of each step by step."""

    one: Result
    two: Result


def iteration(nodes: tuple[int, ...], batches: int = 5) -> dict[str, list[float]]:
    """Seconds of one iteration on one thread, by shape, for each number of nodes."""
    return {
        name: [milliseconds(sampled(name, count), batches, 1)[0] / 1000 for count in nodes] for name in PAPER_ITERATION
    }


def run(name: str, nodes: int, threads: int) -> Result:
    """Run an example once."""
    if name == "jaw":
        return microstructure(nodes, threads)
    return smoothed(name, BOXES_RADIUS if name == "boxes" else PART_RADIUS, nodes, threads)


def examples(nodes: int) -> dict[str, Example]:
    """Time the three examples, after a run that compiles their kernels."""
    found = {}
    for name in PAPER_EXAMPLE:
        run(name, 24, 1)
        one, two = (min((run(name, nodes, n) for _ in range(_RUNS)), key=lambda r: r.total) for n in (1, 2))
        found[name] = Example(one, two)
    return found


def machine() -> str:
    """Name of the processor, as Linux tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return f"{names[0] if names else 'an unknown processor'}, {os.cpu_count()} cores"
