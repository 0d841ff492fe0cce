"""Validations to files: the page, all figures as JSON, a summary in Markdown."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from cad_implicit.cad.files import replacing

from .charts import write_pictures
from .measuring import REGIONS
from .page import page
from .validation import Validation


def write_report(result: Validation, folder: Path) -> list[Path]:
    """Write ``report.html``, ``report.json``, ``report.md`` and the charts as PNGs into a folder, which is made.

    Raises
    ------
    CadImplicitError
        If plotly is not installed.
    OSError
        If a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    texts = {
        "report.html": page(result),
        "report.json": json.dumps(result.as_dict(), indent=1, allow_nan=False, default=str) + "\n",
        "report.md": markdown([result]),
    }
    paths = []
    for name, text in texts.items():
        with replacing(folder / name) as beside:
            beside.write_text(text, encoding="utf-8")
        paths.append(folder / name)
    return paths + write_pictures(result, folder)


def markdown(results: Sequence[Validation]) -> str:
    """Table of validations in Markdown: one line each, errors in mm."""
    columns = ["part", "operation", "r", "h", "exact kernel", "against", *REGIONS, "triangles", "s", "verdict"]
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    for v in results:
        outcome, measured = v.outcome, v.measured
        regions = [f"{v.regions[r].max:.2g}" if r in v.regions else "–" for r in REGIONS]
        edges = f" of {v.edges}" if v.edges else ""
        row = [v.part, v.operation + edges, f"{v.radius:g}", f"{outcome.spacing:.3g}" if outcome else "–"]
        row += [v.kernel["fate"], measured.against if measured else "–", *regions]
        row += [str(len(outcome.mesh.faces)) if outcome else "–", f"{v.seconds:.1f}"]
        row.append("passed" if v.passed else "**failed**: " + "; ".join(v.faults))
        lines.append("| " + " | ".join(text.replace("|", "\\|") for text in row) + " |")
    return "\n".join(lines) + "\n"
