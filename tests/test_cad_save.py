"""Results to files, whole or not at all; needs no host."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from cad_parts import ball, sampled

import cad_implicit as ci
from cad_implicit import Field, Function, Grid
from cad_implicit.cad import FIELD_EXTENSIONS, INPUT_EXTENSIONS, OUTPUT_EXTENSIONS, check_output, save, to_mesh
from cad_implicit.errors import FileFormatError


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_npz_and_nrrd(tmp_path: Path, dim: int, dtype: type) -> None:
    import nrrd

    field = sampled(dim, dtype)
    with np.load(save(field, tmp_path / "a.npz")) as data:
        assert sorted(data) == ["origin", "spacing", "values"]
        assert np.array_equal(data["values"], field.values)
        assert tuple(data["origin"]) == field.grid.origin
        assert tuple(data["spacing"]) == field.grid.spacing
    values, header = nrrd.read(str(save(field, tmp_path / "a.nrrd")))
    assert np.array_equal(values, field.values)
    assert values.dtype == dtype
    assert np.array_equal(header["space directions"], np.diag(field.grid.spacing))
    assert np.array_equal(header["space origin"], field.grid.origin)
    assert header["space units"] == ["mm"] * dim


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_vti_read_by_vtk(tmp_path: Path, dim: int, dtype: type) -> None:
    reader_module = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    field = sampled(dim, dtype)
    reader = reader_module.vtkXMLImageDataReader()
    reader.SetFileName(str(save(field, tmp_path / "a.vti")))
    reader.Update()
    image = reader.GetOutput()
    shape = (*field.grid.shape, 1)[:3]
    assert image.GetDimensions() == shape
    assert image.GetOrigin()[:dim] == field.grid.origin
    assert image.GetSpacing()[:dim] == field.grid.spacing
    values = vtk_to_numpy(image.GetPointData().GetScalars())
    assert values.dtype == dtype
    assert np.array_equal(values.reshape(shape, order="F").reshape(field.grid.shape), field.values)


def test_large_vti_is_written_in_pieces(tmp_path: Path) -> None:
    reader_module = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    grid = Grid((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (97, 101, 103))
    field = Field(grid, np.random.default_rng(1).normal(size=grid.shape).astype(np.float32))
    reader = reader_module.vtkXMLImageDataReader()
    reader.SetFileName(str(save(field, tmp_path / "a.vti")))
    reader.Update()
    values = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
    assert np.array_equal(values.reshape(grid.shape, order="F"), field.values)


def test_wrong_kind_of_result(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"\.stl holds a Mesh, not a Field; contour it first"):
        save(sampled(), tmp_path / "a.stl")
    with pytest.raises(FileFormatError, match=r"\.vti holds a Field, not a Mesh"):
        save(ball(), tmp_path / "a.vti")
    with pytest.raises(FileFormatError, match="a Function cannot be written; contour it"):
        save(Function(lambda x: x[:, 0], [[0, 0, 0], [1, 1, 1]]), tmp_path / "a.stl")  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_outputs_are_checked_before_any_work(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"supported are \.stl"):
        check_output(tmp_path / "a.igs")
    with pytest.raises(FileFormatError, match="there is no folder"):
        check_output(tmp_path / "no" / "a.stl")
    (tmp_path / "b.stl").mkdir()
    with pytest.raises(FileFormatError, match="is a folder"):
        check_output(tmp_path / "b.stl")
    assert check_output(str(tmp_path / "a.STL")) == tmp_path / "a.STL"
    assert set(OUTPUT_EXTENSIONS) == set(INPUT_EXTENSIONS) | set(FIELD_EXTENSIONS)


def test_stl_is_what_trimesh_writes(tmp_path: Path) -> None:
    mesh = ci.contour((ci.box((3, 2, 1)) | ci.sphere(1.1)).turned((0.48, -0.6, 0.64), 0.7), 0.3)
    rows = np.dtype([("normal", "<f4", 3), ("rest", "<V38")])
    own = ci.save(mesh, tmp_path / "a.stl").read_bytes()
    theirs = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type="stl")
    assert own[:84] == theirs[:84]
    first, second = (np.frombuffer(data[84:], rows) for data in (own, theirs))
    assert (first["rest"] == second["rest"]).all()
    assert np.abs(first["normal"] - second["normal"]).max() < 1e-6


def test_stl_of_a_triangle_without_area_has_no_normal(tmp_path: Path) -> None:
    flat = ci.Mesh([[0, 0, 0], [1, 0, 0], [3, 0, 0]], [[0, 1, 2]])
    assert not np.frombuffer(ci.save(flat, tmp_path / "a.stl").read_bytes()[84:96], "<f4").any()


@pytest.mark.parametrize("failure", [KeyboardInterrupt, MemoryError, OSError(28, "No space left on device")])
@pytest.mark.parametrize("suffix", [".stl", ".3mf", ".obj"])
def test_a_failure_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, failure: BaseException, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text("old")

    def fail(source: str, target: str) -> None:
        raise failure

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises((KeyboardInterrupt, MemoryError, FileFormatError)):
        save(ball(), path)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == [path.name]


def test_permissions_and_links_are_kept(tmp_path: Path) -> None:
    path, link = tmp_path / "a.stl", tmp_path / "link.stl"
    save(ball(), path)
    mask = os.umask(0)
    os.umask(mask)
    assert path.stat().st_mode & 0o777 == 0o666 & ~mask
    path.chmod(0o640)
    link.symlink_to(path)
    save(ball(5.0), link)
    assert link.is_symlink()
    assert path.stat().st_mode & 0o777 == 0o640
    assert to_mesh(path).volume < ball().volume
