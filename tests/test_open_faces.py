"""Shells with open faces, and shells and infills of jobs and of the command line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import cad_implicit as ci
from cad_implicit.cad.mesh_faces import triangles_of
from cad_implicit.errors import RadiusError, SelectorError
from cad_implicit.sizing import Engine

SIZE = np.array([20.0, 16.0, 10.0])


def box(selectable: bool = True) -> ci.Mesh:
    """Box with a face number for every side, in the order -x, +x, -y, +y, -z, +z."""
    mesh = ci.contour(ci.box(SIZE), 2.0)
    normals = mesh.face_vectors / np.linalg.norm(mesh.face_vectors, axis=1)[:, None]
    axis = np.abs(normals).argmax(axis=1)
    ids = 2 * axis + (normals[np.arange(len(axis)), axis] > 0)
    return ci.Mesh(mesh.vertices, mesh.faces, ids.astype(np.int32) if selectable else None)


@pytest.mark.parametrize(
    ("selector", "faces"),
    [
        (">Z", {5}),
        ("<X", {0}),
        ("|Y", {2, 3}),
        ("#Z", {0, 1, 2, 3}),
        (">Z or <Z", {4, 5}),
        ("not |X", {2, 3, 4, 5}),
        ("3,6", {2, 5}),
    ],
)
def test_faces_by_selector(selector: str, faces: set[int]) -> None:
    mesh = box()
    assert mesh.face_ids is not None
    assert set(mesh.face_ids[triangles_of(mesh, selector)]) == faces


@pytest.mark.parametrize("engine", ["exact", "reinit"])
@pytest.mark.parametrize(
    ("selector", "hollow", "genus"),
    [(">Z", (18, 14, 9), 0), ("|Z", (18, 14, 10), 1), (">Z or >X", (19, 14, 9), 0), ("|X or |Y", (20, 16, 8), None)],
)
def test_the_cavity_runs_through_open_faces(
    engine: Engine, selector: str, hollow: tuple[float, float, float], genus: int | None
) -> None:
    mesh = ci.contour(ci.shell(box(), 1.0, open=selector, spacing=0.35, engine=engine))
    assert mesh.is_watertight
    assert mesh.components == (2 if genus is None else 1)  # two plates, with all four sides open
    if genus is not None:
        assert mesh.genus == genus
    wall = SIZE.prod() - np.prod(hollow)
    assert mesh.volume == pytest.approx(wall, rel=0.002 if engine == "exact" else 0.03)


def test_walls_beside_an_open_face_are_as_thick_as_asked() -> None:
    tray = ci.shell(box(), 1.0, open=">Z", spacing=0.3)
    x = np.array(
        [[0, 0, -4.5], [9.5, 1.0, 4.9], [0, 7.5, 2.0], [0, 0, 4.9], [8.9, 0, 4.9], [9.1, 0, 4.9], [0, 0, -3.9]]
    )
    assert (tray(x) > 0).tolist() == [True, True, True, False, False, True, False]


def test_what_cannot_be_opened_says_so() -> None:
    with pytest.raises(SelectorError, match="only triangles"):
        ci.shell(box(selectable=False), 1.0, open=">Z")
    with pytest.raises(SelectorError, match="only B-rep parts"):
        ci.shell(ci.box(SIZE), 1.0, open=">Z")
    with pytest.raises(SelectorError, match="every face"):
        ci.shell(box(), 1.0, open="all")
    with pytest.raises(SelectorError, match="selects no face"):
        ci.shell(box(), 1.0, open="%cylinder")
    with pytest.raises(ValueError, match="inward"):
        ci.shell(box(), 1.0, open=">Z", side="outward")
    with pytest.raises(RadiusError, match="no hollow"):
        ci.shell(box(), 8.5, open=">Z")


def test_jobs_shell_and_fill() -> None:
    shelled = ci.run(box(), "shell", 1.0, open=">Z", spacing=0.4)
    figures = json.loads(json.dumps(shelled.as_dict()))
    assert (figures["side"], figures["open"], figures["radius"]) == ("inward", ">Z", 1.0)
    assert shelled.mesh.volume == pytest.approx(932, rel=0.003)
    assert ci.run(box(), "shell", 1.0, side="outward", spacing=0.5).mesh.volume > 1000
    filled = ci.run(box(), "infill", 1.2, cell=6.0, spacing=0.4)
    assert filled.as_dict()["cell"] == 6.0
    assert 0.3 < filled.mesh.volume / SIZE.prod() < 0.8
    with pytest.raises(ValueError, match="cells"):
        ci.run(box(), "infill", 1.2)
    with pytest.raises(RadiusError, match="thickness"):
        ci.run(box(), "shell", -1.0)


def cli(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cad_implicit", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_command_line(tmp_path: Path) -> None:
    part, out = tmp_path / "part.stl", tmp_path / "out.stl"
    ci.save(box(), part)
    done = cli("shell", part, "-t", "1", "-o", out, "--both", "--spacing", "0.5", "--json")
    assert done.returncode == 0, done.stderr
    figures = json.loads(done.stdout)
    assert (figures["operation"], figures["side"], figures["open"]) == ("shell", "both", None)
    assert figures["watertight"]
    assert ci.to_mesh(out).volume == pytest.approx(figures["volume_after"], rel=1e-4)
    out.unlink()
    done = cli("shell", part, "-t", "1", "-o", out, "--open", ">Z")
    assert (done.returncode, done.stdout, out.exists()) == (1, "", False)
    assert "only triangles" in done.stderr
    done = cli("shell", part, "-t", "1", "-o", out, "--open", ">Z", "--outward")
    assert (done.returncode, out.exists()) == (2, False)
    done = cli("infill", part, "--cell", "6", "--wall", "1.2", "--spacing", "0.6", "-o", out, "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert 0.3 < ci.to_mesh(out).volume / SIZE.prod() < 0.8


@pytest.mark.host
def test_a_step_file_is_opened_by_selector(tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    ci.save(ci.to_mesh(BRepPrimAPI_MakeBox(*SIZE).Shape()), tmp_path / "box.step")
    done = cli(
        "shell", tmp_path / "box.step", "-t", "1", "-o", tmp_path / "out.ply", "--open", ">Z", "--spacing", "0.4"
    )
    assert done.returncode == 0, done.stderr
    tray = ci.to_mesh(tmp_path / "out.ply")
    assert (tray.is_watertight, tray.genus) == (True, 0)
    assert tray.volume == pytest.approx(932, rel=0.003)
