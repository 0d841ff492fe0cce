"""Mesh files and triangles in; needs no host."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from cad_parts import ball

from cad_implicit import Mesh
from cad_implicit.cad import (
    INPUT_EXTENSIONS,
    check_output,
    check_suffix,
    open_part,
    save,
    to_mesh,
)
from cad_implicit.errors import CadImplicitError, FileFormatError, InvalidMeshError

MESH_SUFFIXES = [".stl", ".3mf", ".obj", ".ply"]


# ------------------------------------------------------------------------------------------------ triangles in
def test_arrays_and_trimesh() -> None:
    mesh = ball()
    exact = pytest.approx(mesh.volume, rel=1e-12)
    for part in (
        mesh,
        (mesh.vertices, mesh.faces),
        [mesh.vertices.tolist(), mesh.faces.tolist()],
        trimesh.Trimesh(mesh.vertices, mesh.faces, process=False),
        (mesh.vertices, mesh.faces[:, ::-1]),  # inside out
        Mesh(mesh.vertices, mesh.faces[:, ::-1]),
    ):
        result = to_mesh(part)
        assert result.volume == exact
        assert result.is_watertight
    assert to_mesh(mesh) is mesh
    assert open_part(mesh).triangles is mesh
    assert np.array_equal(open_part(mesh).bounds, mesh.bounds)


def test_scene_is_flattened_with_its_transforms() -> None:
    box = trimesh.creation.box((1, 2, 3))
    scene = trimesh.Scene()
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([10, 0, 0]))
    scene.add_geometry(box, transform=trimesh.transformations.scale_matrix(-2.0))  # mirrored
    mesh = to_mesh(scene)
    assert mesh.volume == pytest.approx(6 + 48)
    assert mesh.components == 2
    assert mesh.bounds[1, 0] == pytest.approx(10.5)


def test_soup_is_welded_and_cleaned() -> None:
    mesh = ball()
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    corners[::7] += 1e-9 * mesh.diagonal  # as after a careless writer
    soup = np.arange(len(corners)).reshape(-1, 3)
    waste = np.array([[0, 0, 1], [3, 4, 5], [6, 7, 8], [8, 7, 6]])  # degenerate, a duplicate, and a flap
    result = to_mesh((corners, np.concatenate([soup, waste])))
    assert result.is_watertight
    assert len(result.faces) == len(mesh.faces)
    assert len(result.vertices) == len(mesh.vertices)
    assert result.volume == pytest.approx(mesh.volume, rel=1e-6)


def test_an_open_mesh_is_returned_open() -> None:
    mesh = ball()
    result = to_mesh((mesh.vertices, mesh.faces[1:]))
    assert result.open_edges == 3


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (([[0, 0, 0]], [[0, 1, 2]]), "name vertices"),
        (([[0, 0, np.nan]] * 3, [[0, 1, 2]]), "not finite"),
        ((np.zeros((3, 2)), [[0, 1, 2]]), "needs vertices"),
        ((np.eye(3), np.zeros((0, 3), int)), "no triangles"),
        ((np.eye(3), [[0, 0, 1]]), "no triangles"),
    ],
)
def test_malformed_arrays(part: tuple[object, object], words: str) -> None:
    with pytest.raises(InvalidMeshError, match=words):
        to_mesh(part)


# ------------------------------------------------------------------------------------------------ files in
@pytest.mark.parametrize("suffix", [*MESH_SUFFIXES, ".STL"])
def test_mesh_files_round_trip(tmp_path: Path, suffix: str) -> None:
    mesh = ball()
    path = save(mesh, tmp_path / f"teil größe{suffix}")
    again = to_mesh(str(path))
    assert again.is_watertight
    assert len(again.faces) == len(mesh.faces)
    assert np.abs(np.sort(again.vertices, axis=0) - np.sort(mesh.vertices, axis=0)).max() < 1e-5  # float32 at 100 mm
    assert again.volume == pytest.approx(mesh.volume, rel=1e-6)
    assert again.source == {"kind": "mesh", "name": "teil größe", "tolerance": None, "solids": 1}
    assert os.listdir(tmp_path) == [path.name]


def test_ascii_stl(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_text(trimesh.exchange.stl.export_stl_ascii(trimesh.creation.box((1, 2, 3))))
    mesh = to_mesh(path)
    assert mesh.is_watertight
    assert (mesh.volume, len(mesh.vertices)) == (pytest.approx(6), 8)


def test_inward_file_is_turned_outward(tmp_path: Path) -> None:
    mesh = ball()
    path = save(Mesh(mesh.vertices, mesh.faces[:, ::-1]), tmp_path / "in.obj")
    assert to_mesh(path).volume == pytest.approx(mesh.volume, rel=1e-6)


def test_several_bodies_are_kept(tmp_path: Path) -> None:
    boxes = [trimesh.creation.box((1, 1, 1)), trimesh.creation.box((2, 2, 2)).apply_translation([5, 0, 0])]
    for suffix in MESH_SUFFIXES:
        path = tmp_path / f"two{suffix}"
        trimesh.Scene(boxes).export(path)
        mesh = to_mesh(path)
        assert (mesh.components, mesh.source["solids"]) == (2, 2)
        assert mesh.volume == pytest.approx(9)


@pytest.mark.parametrize(
    ("unit", "factor"), [("micron", 1e-3), ("millimeter", 1), ("inch", 25.4), ("foot", 304.8), ("meter", 1000)]
)
def test_3mf_units(tmp_path: Path, unit: str, factor: float) -> None:
    source, path = save(ball(), tmp_path / "mm.3mf"), tmp_path / "other.3mf"
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b'unit="millimeter"', f'unit="{unit}"'.encode()))
    assert to_mesh(path).diagonal == pytest.approx(ball().diagonal * factor, rel=1e-6)


def damaged(path: Path) -> dict[str, bytes]:
    """Contents that no reader may take for a part."""
    whole = path.read_bytes()
    return {
        "noise": np.random.default_rng(3).bytes(3000),
        "text": b"hello world\n" * 50,
        "cut": whole[: len(whole) // 2],
    }


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
@pytest.mark.parametrize("kind", ["noise", "text", "cut"])
def test_damaged_mesh_files(tmp_path: Path, suffix: str, kind: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = save(ball(), tmp_path / f"a{suffix}")
    path.write_bytes(damaged(path)[kind])
    if suffix == ".obj" and kind == "cut":
        path.write_bytes(
            path.read_bytes() + b"\nf 1 2 999999\n"
        )  # a cut OBJ is an OBJ; one that points to nothing is not
    with pytest.raises((FileFormatError, InvalidMeshError)) as caught:
        to_mesh(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr().out == ""


def test_stl_without_triangles_or_with_nan(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    path.write_bytes(bytes(80) + struct.pack("<I", 0))
    with pytest.raises(FileFormatError, match=r"no triangles \(84 bytes\)"):
        to_mesh(path)
    path.write_bytes(bytes(80) + struct.pack("<I12fH", 1, *[0.0] * 3, *[float("nan")] * 9, 0))
    with pytest.raises(InvalidMeshError, match="not finite"):
        to_mesh(path)
    path.write_bytes(bytes(80) + struct.pack("<I12fH", 1, *[0.0] * 12, 0))
    with pytest.raises(InvalidMeshError, match="no triangles"):
        to_mesh(path)


def test_paths_that_cannot_be_read(tmp_path: Path) -> None:
    for suffix in INPUT_EXTENSIONS:
        with pytest.raises(FileFormatError, match="does not exist"):
            to_mesh(tmp_path / f"no{suffix}")
        (tmp_path / f"empty{suffix}").touch()
        with pytest.raises(FileFormatError, match="empty"):
            to_mesh(tmp_path / f"empty{suffix}")
    with pytest.raises(FileFormatError, match="is a folder"):
        to_mesh(tmp_path)
    with pytest.raises(FileFormatError, match=r"the suffix \.igs; supported are \.step"):
        to_mesh(tmp_path / "a.igs")
    with pytest.raises(FileFormatError, match="no suffix"):
        check_suffix(tmp_path / "a")


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="POSIX permissions")
def test_permission_denied(tmp_path: Path) -> None:
    path, locked = save(ball(), tmp_path / "a.stl"), tmp_path / "locked"
    locked.mkdir()
    path.chmod(0)
    locked.chmod(0)
    user = os.geteuid()
    if user == 0:  # root may read everything
        os.seteuid(65534)
    try:
        for denied in (path, locked / "a.stl"):
            with pytest.raises(FileFormatError, match="Permission denied"):
                to_mesh(denied)
        with pytest.raises(FileFormatError, match="cannot be written"):
            check_output(locked / "a.stl")
    finally:
        if user == 0:
            os.seteuid(user)
        locked.chmod(0o700)


def test_import_is_light() -> None:
    code = "import sys, cad_implicit.cad; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"OCP", "cadquery", "build123d", "numba", "trimesh", "scipy", "manifold3d"} & set(loaded)


def test_without_a_host_the_extras_are_named(tmp_path: Path) -> None:
    """In an interpreter that cannot see OCP, a B-rep gets one clear error and meshes go on working."""
    save(ball(), tmp_path / "a.stl")
    (tmp_path / "a.step").write_text("ISO-10303-21;\nEND-ISO-10303-21;\n")
    code = (
        "import sys; sys.modules['OCP'] = None\n"
        "from cad_implicit.cad import to_mesh, save\n"
        "mesh = to_mesh('a.stl'); print(len(mesh.faces))\n"
        "for work in (lambda: to_mesh('a.step'), lambda: save(mesh, 'b.step')):\n"
        "    try: work()\n"
        "    except Exception as error: print(type(error).__name__, error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    count, *lines = done.stdout.splitlines()
    assert int(count) == len(ball().faces)
    for line in lines:
        assert line.startswith("MissingHostError")
        assert 'pip install "cad_implicit[cadquery]" or pip install "cad_implicit[build123d]"' in line
    assert len(lines) == 2
    assert not (tmp_path / "b.step").exists()


def test_all_errors_are_of_one_family() -> None:
    with pytest.raises(CadImplicitError):
        to_mesh("nothing.stl")
