"""Tables and the plot of runs: error against time, and how much sooner we are as accurate."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

from .methods import Operation
from .running import PARTS, RADIUS

Row = dict[str, Any]
Error = Literal["rms", "maximum"]

#: The method that others are compared with, and the one whose speed ours is to be a multiple of.
OURS, FASTEST = "cad_implicit", "MeshLib, sharp offset twice"


#: What operations are called.
OPERATIONS: dict[Operation, str] = {"fillet": "closing", "round": "opening", "smooth": "smoothing"}

_STYLES: list[tuple[Operation, str, str]] = [("fillet", "full", "-"), ("round", "none", "--"), ("smooth", "left", ":")]


def place(row: Row) -> tuple[str, str, int]:
    """Part, operation and spacing of a run."""
    return row["part"], row["operation"], row["cells"]


def sooner(rows: list[Row], peer: str, part: str, operation: str, error: Error) -> float:
    """How many times longer a peer takes than we for the same error, the least of all errors that both reach.

    Times between two spacings are interpolated, both logarithmic. NaN where no error is reached by both: a peer is less
    accurate at all of its spacings, or more.
    """
    curves = []
    for method in (OURS, peer):
        own = [row for row in rows if row["method"] == method and place(row)[:2] == (part, operation) and error in row]
        own.sort(key=lambda row: float(row[error]))
        curves.append([np.log([row[key] for row in own]) for key in (error, "seconds")])
    (ours, our_times), (theirs, their_times) = curves
    if min(len(ours), len(theirs)) == 0:
        return float("nan")
    both = np.concatenate([ours, theirs])
    both = both[(both >= max(ours[0], theirs[0])) & (both <= min(ours[-1], theirs[-1]))]
    factors = np.exp(np.interp(both, theirs, their_times) - np.interp(both, ours, our_times))
    return float(factors.min()) if len(factors) else float("nan")


def at_widest(rows: list[Row], peer: Row, error: Error) -> float:
    """How many times longer a peer took than the fastest of our runs that are no less accurate; 0 if none is."""
    own = [row for row in rows if row["method"] == OURS and place(row)[:2] == place(peer)[:2] and error in row]
    times = [row["seconds"] for row in own if row[error] <= peer[error]]
    return peer["seconds"] / min(times) if times else 0.0


def details(rows: list[Row]) -> str:
    """Markdown table of all runs, and of the ratios to ours at the same spacing."""
    lines = [
        "# Beside other packages\n",
        f"`python -m validation.peers`, {datetime.now(UTC):%Y-%m-%d}, {os.cpu_count()} cores. Radius {RADIUS:g} mm; "
        "errors in µm: distance of the true blend, and of the sharp edges that stay, to the result. Ratios are to ours "
        "at the same spacing. The processors' time is of the whole run, with the conversion of meshes.\n",
        "| part | operation | spacing | method | time s | | processors s | memory MB | RMS | | largest | | sharp "
        "edges | triangles |",
        "|" + " --- |" * 14,
    ]
    ours = {place(row): row for row in rows if row["method"] == OURS and "rms" in row}
    for row in rows:
        head = f"| {row['part']} | {row['operation']} | r/{row['cells']} | {row['method']} |"
        if "failed" in row:
            lines.append(f"{head} {row['failed']} |" + " |" * 9)
            continue
        own = ours.get(place(row), row)
        ratios = [row[key] / own[key] for key in ("seconds", "rms", "maximum")]
        sharp = "" if row["sharp"] is None else f"{1e3 * row['sharp']:.3g}"
        lines.append(
            f"{head} {row['seconds']:.2f} | {ratios[0]:.2g}x | {row['processor']:.2f} | {row['memory'] / 1e6:.0f} | "
            f"{1e3 * row['rms']:.3g} | {ratios[1]:.3g}x | {1e3 * row['maximum']:.3g} | {ratios[2]:.3g}x | {sharp} | "
            f"{row['triangles']} |"
        )
    return "\n".join(lines) + "\n"


def summary(rows: list[Row]) -> str:
    """Markdown table of how much longer others took for the same error; for the README."""
    peers = [name for name in dict.fromkeys(row["method"] for row in rows) if name != OURS]
    lines = [
        f"`python -m validation.peers --readme`, {datetime.now(UTC):%Y-%m-%d}, {os.cpu_count()} cores: times as long "
        "as ours for the same RMS error of the blend, and for the same largest one; the least of all errors that both "
        "reach, times between two spacings interpolated. Where a peer reaches none of ours: ≥, times as long as the "
        "fastest of our runs that are no less accurate.\n",
        "| part | operation | " + " | ".join(peers) + " |",
        "|" + " --- |" * (2 + len(peers)),
    ]
    for part in PARTS:
        for operation, name in OPERATIONS.items():
            here = [row for row in rows if place(row)[:2] == (part, operation)]
            cells = [_factors(rows, [row for row in here if row["method"] == peer]) for peer in peers]
            if here:
                lines.append(f"| {part} | {name} | " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", _verdict(rows)]) + "\n"


def _factors(rows: list[Row], runs: list[Row]) -> str:
    done = [row for row in runs if "rms" in row]
    if not done:
        return runs[0]["failed"] if runs else "–"
    shown = []
    for error in ("rms", "maximum"):
        factor = sooner(rows, done[0]["method"], *place(done[0])[:2], error)
        bound = min(at_widest(rows, row, error) for row in done)
        beyond = f"≥ {bound:.2g}x" if bound else "less accurate"
        shown.append(beyond if np.isnan(factor) else f"{factor:.2g}x")
    return ", ".join(shown)


def _verdict(rows: list[Row]) -> str:
    """Say where a peer was both faster and more accurate, and the least factors of the fastest."""
    done = [row for row in rows if row["method"] != OURS and "rms" in row]
    ours = [row for row in rows if row["method"] == OURS and "rms" in row]
    better = [
        row
        for row in done
        if any(
            place(own)[:2] == place(row)[:2] and row["seconds"] < own["seconds"] and row["rms"] < own["rms"]
            for own in ours
        )
    ]
    named = "; ".join(f"{row['method']} on {row['part']}, {row['operation']}, r/{row['cells']}" for row in better)
    texts = [f"Both faster and more accurate than a run of ours: {named or 'none'}."]
    fastest = [row for row in done if row["method"] == FASTEST]
    for operation, name in OPERATIONS.items():
        runs = [row for row in fastest if row["operation"] == operation]
        if runs:
            same = [
                np.nanmin([sooner(rows, FASTEST, *place(row)[:2], error) for row in runs])
                for error in ("rms", "maximum")
            ]
            beside = [min(at_widest(rows, row, error) for row in runs) for error in ("rms", "maximum")]
            texts.append(
                f"{FASTEST}, {name}: at least {same[0]:.2g}x for the same RMS error, {same[1]:.2g}x for the same "
                f"largest; {beside[0]:.2g}x and {beside[1]:.2g}x beside our fastest run that is no less accurate."
            )
    return " ".join(texts)


def plot(rows: list[Row], path: Path) -> None:
    """Error against time, both logarithmic, a panel a part; closings filled, openings hollow, smoothings half."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 3, figsize=(13, 8.2), sharex=True, sharey=True, layout="constrained")
    names = list(dict.fromkeys(row["method"] for row in rows))
    for axis, part in zip(axes.flat, PARTS, strict=True):
        for number, name in enumerate(names):
            for operation, fill, line in _STYLES:
                own = [row for row in rows if row["method"] == name and place(row)[:2] == (part, operation)]
                own = sorted((row for row in own if "rms" in row), key=lambda row: int(row["cells"]))
                axis.loglog(
                    [row["seconds"] for row in own], [1e3 * row["rms"] for row in own], marker="o", color=f"C{number}",
                    fillstyle=fill, label=name if fill == "full" else None, markersize=6,
                    linewidth=2 if name == OURS else 1, linestyle=line,
                )  # fmt: skip
        axis.set_title(part)
        axis.grid(alpha=0.3)
    for axis in axes[-1]:
        axis.set_xlabel("time, s")
    for axis in axes[:, 0]:
        axis.set_ylabel("RMS error of the blend, µm")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    title = "filled: closing; hollow, dashed: opening; half, dotted: smoothing; lower left is better"
    figure.legend(handles, labels, loc="outside lower center", ncols=3, title=title)
    figure.savefig(path, dpi=110)
    plt.close(figure)
