"""Assembly jobs: one operation on every part of a STEP assembly, each in its own coordinates.

A part that is in several places is worked on once. Parts that touch are not welded.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

from .cad.assemblies import Assembly
from .cad.solids import SolidPart, described
from .errors import CadImplicitError, GeometryWarning, SelectorError
from .job import run
from .outcome import Outcome
from .parallel import Progress, no_progress

#: Edges chosen by their numbers, which are those of the whole.
_NUMBERS = re.compile(r"[\d\s,]+")


def run_assembly(
    assembly: Assembly,
    operation: str,
    amount: Any,
    output: Path,
    *,
    progress: Progress = no_progress,
    **options: Any,
) -> list[Outcome | None]:
    """Work on all parts of an assembly, and write it with its tree, names, colours and places.

    Parameters
    ----------
    assembly : Assembly
        As :func:`cad_implicit.cad.open_assembly` gives it.
    operation, amount, **options
        As for :func:`cad_implicit.run`. Edges are chosen in each part by itself, in its own coordinates: by a selector
        or in words, not by numbers.
    output : Path
        A STEP file.

    Returns
    -------
    list of Outcome or None
        One for each part; None for parts that have no such edges, and stay as they are.

    Raises
    ------
    CadImplicitError
        As :func:`cad_implicit.run`, with the name of the part; nothing is written then.

    Warns
    -----
    GeometryWarning
        For each part that stays as it is, why.
    """
    chosen = [options.get("edges"), *(options.get("edge_radius") or ())]
    if any(isinstance(one, str) and _NUMBERS.fullmatch(one) for one in chosen):
        raise SelectorError(
            f"edge numbers are those of a single part, and {assembly.name} is an assembly of {len(assembly.parts)}, "
            "worked on part by part: choose edges by a selector, or concave, convex or all"
        )
    from .parting import to_part

    outcomes: list[Outcome | None] = []
    solids: dict[int, SolidPart] = {}
    nothing: SelectorError | None = None
    for position, part in enumerate(assembly.parts):
        try:
            outcome = run(part, operation, amount, progress=progress, **options)
        except SelectorError as error:
            nothing = error
            warnings.warn(f"{part.name} stays as it is: {error}", GeometryWarning, stacklevel=2)
            outcomes.append(None)
            continue
        except CadImplicitError as error:
            raise type(error)(f"{part.name}: {error}") from error
        solid = to_part(outcome.shape, mesh=outcome.mesh, name=part.name, progress=progress)
        solids[position] = described(solid, outcome.before.source)
        outcomes.append(outcome)
    if not solids and nothing is not None:
        raise nothing
    assembly.save(output, solids)
    return outcomes
