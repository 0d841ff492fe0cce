"""Many parts: what becomes of each, again after an interruption, and past parts that fail."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cad_implicit as ci
from cad_implicit import batch, sizing
from cad_implicit.batch import LEDGER, items, run_batch
from cad_implicit.errors import ClusterError, FileFormatError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Folder with three good parts, one of them in a folder of its own, and a bad one."""
    parts = tmp_path / "parts"
    (parts / "more").mkdir(parents=True)
    for name, size in {"a.stl": 8.0, "b.ply": 9.0, "more/a.stl": 10.0}.items():
        ci.save(ci.contour(ci.box((size, 6, 5)), 1.0), parts / name)
    (parts / "broken.stl").write_text("solid nothing\n")
    return parts


def rows(parts: list[Path], output: Path, **options: Any) -> dict[str, dict[str, Any]]:
    chosen = items(parts, output, ".stl")
    found = run_batch(chosen, output, "round", 1.0, workers=2, spacing=0.5, engine="exact", **options)
    return {Path(row["output"]).relative_to(output).as_posix(): row for row in found}


def test_one_bad_part_stops_no_other_and_what_is_done_stays_done(folder: Path) -> None:
    output = folder.parent / "out"
    first = rows([folder], output)
    assert {name: row["fate"] for name, row in first.items()} == {
        "a.stl": "done", "b.stl": "done", "broken.stl": "failed", "more/a.stl": "done",
    }  # fmt: skip
    assert "broken.stl" in first["broken.stl"]["message"]
    assert not (output / "broken.stl").exists()
    # a box with rounded edges (Minkowski sum of a smaller box and a ball), less the chords
    a, b, c = 6.0, 4.0, 3.0
    exact = a * b * c + 2 * (a * b + b * c + c * a) + np.pi * (a + b + c) + 4 / 3 * np.pi
    assert ci.to_mesh(output / "a.stl").volume == pytest.approx(exact, rel=0.02)
    again = rows([folder], output)
    assert {name for name, row in again.items() if row.get("resumed")} == {"a.stl", "b.stl", "more/a.stl"}
    assert again["broken.stl"]["fate"] == "failed"


def test_a_part_that_changed_or_whose_result_is_gone_is_done_again(folder: Path) -> None:
    output = folder.parent / "out"
    rows([folder / "a.stl", folder / "b.ply"], output)
    (output / "b.stl").unlink()
    ci.save(ci.contour(ci.box((7, 6, 5)), 1.0), folder / "a.stl")
    again = rows([folder / "a.stl", folder / "b.ply"], output)
    assert not any(row.get("resumed") for row in again.values())
    assert (output / "b.stl").exists()


def test_a_ledger_that_was_cut_short_is_read_as_far_as_it_goes(folder: Path) -> None:
    output = folder.parent / "out"
    rows([folder / "a.stl"], output)
    ledger = output / LEDGER
    ledger.write_text(ledger.read_text() + '{"input": "b')
    assert rows([folder / "a.stl"], output)["a.stl"]["resumed"]
    assert json.loads(ledger.read_text().splitlines()[0])["fate"] == "done"


def test_results_of_the_same_name_do_not_meet(tmp_path: Path) -> None:
    names = [tmp_path / "x" / "a.step", tmp_path / "y" / "a.stl", tmp_path / "z" / "a.stl"]
    outputs = [item.output.name for item in items(names, tmp_path / "out", ".3mf")]
    assert outputs == ["a.3mf", "a_stl.3mf", "a_2.3mf"]


def test_processes_share_the_memory(folder: Path) -> None:
    output = folder.parent / "out"
    parts = [folder / "a.stl", folder / "b.ply"]
    need = 2 * sizing.estimate_surface(ci.to_mesh(parts[0]).area, 0.5)
    try:
        sizing.limit_memory(0.7 * need)
        assert {row["fate"] for row in rows(parts[:1], output).values()} == {"done"}  # alone it may have all
        found = rows(parts, output, force=True)
    finally:
        sizing.limit_memory(None)
    assert {row["fate"] for row in found.values()} == {"failed"}
    assert all("MemoryLimitError" in row["message"] for row in found.values())


def test_nothing_to_do_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="no part"):
        items([tmp_path], tmp_path / "out", ".stl")


def test_a_cluster_gives_the_same_bytes(folder: Path) -> None:
    distributed = pytest.importorskip("distributed")
    rows([folder], folder.parent / "out")
    with (
        warnings.catch_warnings(),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
    ):
        found = rows([folder], folder.parent / "far", scheduler=cluster.scheduler_address)
    assert {name: row["fate"] for name, row in found.items()} == {
        "a.stl": "done", "b.stl": "done", "broken.stl": "failed", "more/a.stl": "done",
    }  # fmt: skip
    for name in ("a.stl", "b.stl", "more/a.stl"):
        assert (folder.parent / "far" / name).read_bytes() == (folder.parent / "out" / name).read_bytes()


def test_no_scheduler_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(batch, "_CONNECT", 0.5)
    with pytest.raises(ClusterError, match="dask scheduler"):
        rows([folder], folder.parent / "out", scheduler="tcp://127.0.0.1:9")
