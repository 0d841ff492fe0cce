"""STEP and BREP files in and out, with whichever host is installed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

import cad_implicit.cad as cad
from cad_implicit import Mesh
from cad_implicit.cad import save, to_mesh
from cad_implicit.errors import FileFormatError, GeometryWarning, InvalidMeshError, NoSolidError, OpenMeshError

pytest.importorskip("OCP", reason="needs CadQuery or build123d")
pytestmark = pytest.mark.host

import cad_parts as parts  # noqa: E402
import edge_parts  # noqa: E402

from cad_implicit.cad import occ, occ_files  # noqa: E402

BRACKET = Path(cad.__file__).parents[1] / "data" / "bracket.step"
NOW = "2001-02-03T04:05:06"


def test_the_bracket() -> None:
    mesh = to_mesh(BRACKET)
    assert mesh.is_watertight
    assert (mesh.components, mesh.genus) == (1, 5)
    assert mesh.source["name"] == "bracket"
    assert np.allclose(mesh.bounds, [[0, -30.35, 0], [80.3, 30.35, 50.9]], atol=1e-6)
    assert mesh.face_ids is not None
    assert np.unique(mesh.face_ids).tolist() == list(range(25))
    head = BRACKET.read_text()[:400]
    assert "FILE_NAME('bracket'" in head
    assert BRACKET.stat().st_size < 200_000


@pytest.mark.parametrize("suffix", [".step", ".stp", ".STEP", ".brep"])
def test_round_trip_of_exact_solids(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"größe 1{suffix}"
    shape = parts.moved(parts.torus())
    occ_files.write(shape, path, "ring", NOW)
    assert occ.volume(occ_files.read_product(path).shape) == pytest.approx(occ.volume(shape), rel=1e-9)
    mesh = to_mesh(path)
    assert mesh.is_watertight
    assert (mesh.source["kind"], mesh.source["name"]) == ("brep", "größe 1")


def test_the_same_shape_gives_the_same_file(tmp_path: Path) -> None:
    for name in ("a", "b"):
        occ_files.write(parts.torus(), tmp_path / f"{name}.step", "ring", NOW)
    assert (tmp_path / "a.step").read_bytes() == (tmp_path / "b.step").read_bytes()
    assert "PRODUCT('ring','ring'" in (tmp_path / "a.step").read_text()


def test_units_are_honoured_whatever_the_process_has_set(tmp_path: Path) -> None:
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    path = tmp_path / "inch.step"
    shape = parts.box((25.4, 50.8, 76.2))
    writer = STEPControl_Writer()
    before = {name: Interface_Static.CVal_s(name) for name in ("write.step.unit", "xstep.cascade.unit")}
    try:
        Interface_Static.SetCVal_s("write.step.unit", "INCH")
        with occ.silence():
            writer.Transfer(shape, STEPControl_AsIs)
            writer.Write(str(path))
        Interface_Static.SetCVal_s("xstep.cascade.unit", "M")
        assert to_mesh(path).volume == pytest.approx(25.4 * 50.8 * 76.2)
        occ_files.write(shape, tmp_path / "mm.step", "box", NOW)
        assert Interface_Static.CVal_s("write.step.unit") == "INCH"
    finally:
        for name, value in before.items():
            Interface_Static.SetCVal_s(name, value)
    assert "inch" in path.read_text().lower()
    assert to_mesh(path).volume == pytest.approx(25.4 * 50.8 * 76.2)
    assert to_mesh(tmp_path / "mm.step").volume == pytest.approx(25.4 * 50.8 * 76.2)


def test_several_solids_in_one_file(tmp_path: Path) -> None:
    both = occ.compound(
        [parts.box((10, 10, 10)), parts.box((10, 10, 10), at=(5, 5, 5)), parts.box((1, 1, 1), at=(30, 0, 0))]
    )
    occ_files.write(both, tmp_path / "a.step", "three", NOW)
    mesh = to_mesh(tmp_path / "a.step")
    assert mesh.source["solids"] == 2
    assert mesh.volume == pytest.approx(2000 - 125 + 1)
    assert to_mesh(tmp_path / "a.step", unite=False).volume == pytest.approx(2001)


@pytest.mark.parametrize("suffix", [".step", ".brep"])
def test_a_file_without_solids(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"face{suffix}"
    occ_files.write(next(occ.explore(parts.box((1, 1, 1)), occ.TopAbs_FACE)), path, "face", NOW)
    with pytest.raises(NoSolidError, match=r"face.*no solid, only \d shells and 1 faces"):
        to_mesh(path)


@pytest.mark.parametrize("suffix", [".step", ".brep"])
@pytest.mark.parametrize(("left_out", "encloses"), [(1, False), (8, True)])
def test_a_shell_that_lacks_a_face(tmp_path: Path, suffix: str, left_out: int, encloses: bool) -> None:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Shell

    shell, builder = TopoDS_Shell(), BRep_Builder()
    builder.MakeShell(shell)
    for number, face in enumerate(occ.explore(step_block(), occ.TopAbs_FACE), 1):
        if number != left_out:
            builder.Add(shell, face)
    path = tmp_path / f"shell{suffix}"
    occ_files.write(shell, path, "shell", NOW)
    if encloses:
        mesh = to_mesh(path)
        assert mesh.open_edges > 0
        assert mesh.volume > 0
    else:
        with pytest.raises(NoSolidError, match=r"no solid, only 1 shells"):
            to_mesh(path)


def step_block() -> occ.Shape:
    """Cube without a small block at one corner; its eighth face is of that, its first is not."""
    return edge_parts.cut(parts.box((10, 10, 10)), parts.box((3, 3, 3), (7, 7, 7)))


@pytest.mark.parametrize("suffix", [".step", ".brep"])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.9, 0.99])
def test_truncated_files(tmp_path: Path, suffix: str, share: float, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"a{suffix}"
    occ_files.write(parts.loft(), path, "loft", NOW)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(FileFormatError) as caught:
        to_mesh(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "export it again" in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_corrupt_step_names_the_fault(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.step"
    text = BRACKET.read_text()
    path.write_text(text[:20000] + text[22000:])  # a hole in the middle
    with pytest.raises(FileFormatError, match=r"is corrupt: #\d+ is missing"):
        to_mesh(path)
    path.write_text("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    with pytest.raises((FileFormatError, NoSolidError)):
        to_mesh(path)
    path.write_text("solid made by hand\n" * 99)
    with pytest.raises(FileFormatError, match="is not a STEP file"):
        to_mesh(path)
    (tmp_path / "a.brep").write_bytes(b"\x00\x01" * 999)
    with pytest.raises(FileFormatError, match="not a text BREP file"):
        to_mesh(tmp_path / "a.brep")
    assert capfd.readouterr() == ("", "")


def test_reading_and_writing_leave_the_standard_streams_clean(tmp_path: Path) -> None:
    """In a process of its own, since the kernel writes past Python's streams."""
    code = (
        "from cad_implicit.cad import to_mesh, save\n"
        f"mesh = to_mesh({str(BRACKET)!r})\n"
        "save(mesh, 'a.step'); save(mesh, 'a.brep')\n"
        "to_mesh('a.step'); to_mesh('a.brep')\n"
        "print('{}')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout == "{}\n"
    assert done.stderr == ""


# ------------------------------------------------------------------------------------------------ faceted solids
@pytest.mark.parametrize("suffix", [".step", ".brep"])
def test_a_mesh_becomes_a_valid_solid(tmp_path: Path, suffix: str) -> None:
    raw = trimesh.creation.icosphere(subdivisions=2, radius=7.3)
    mesh = Mesh(raw.vertices + np.array([100, 0, -50]), raw.faces)
    path = save(mesh, tmp_path / f"ball{suffix}")
    shape = occ_files.read_product(path).shape
    assert occ.is_valid(shape)
    assert len(occ.solids(shape)) == 1
    assert occ.shape_map(shape, occ.TopAbs_FACE).Extent() == len(mesh.faces)
    assert occ.volume(shape) == pytest.approx(mesh.volume, rel=1e-9)
    again = to_mesh(path)
    assert again.is_watertight
    assert again.volume == pytest.approx(mesh.volume, rel=1e-6)
    if suffix == ".step":
        assert "PRODUCT('ball','ball'" in path.read_text()


def test_flat_regions_become_one_face_each(tmp_path: Path) -> None:
    from OCP.TopAbs import TopAbs_EDGE

    raw = trimesh.creation.box((10, 20, 30)).subdivide().subdivide().subdivide()
    turned = Mesh(raw.vertices, raw.faces).transformed(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))
    shape = occ_files.read_product(save(turned, tmp_path / "a.step")).shape
    assert occ.shape_map(shape, occ.TopAbs_FACE).Extent() == 6
    assert occ.shape_map(shape, TopAbs_EDGE).Extent() == 12
    assert occ.volume(shape) == pytest.approx(6000, rel=1e-6)


def test_tessellated_bracket_becomes_a_solid_again(tmp_path: Path) -> None:
    mesh = to_mesh(BRACKET, tolerance=0.1)
    path = save(mesh, tmp_path / "a.step")
    assert occ.is_valid(occ_files.read_product(path).shape)
    again = to_mesh(path)
    assert again.is_watertight
    assert again.genus == 5
    assert again.volume == pytest.approx(mesh.volume, rel=1e-6)


def test_cavities_and_separate_bodies(tmp_path: Path) -> None:
    def shell(size: float, at: float, turn: int) -> tuple[np.ndarray, np.ndarray]:
        box = trimesh.creation.box((size, size, size))
        return box.vertices + np.array([at, 0.0, 0.0]), box.faces[:, ::turn]

    bodies = [shell(10, 0, 1), shell(4, 0, -1), shell(2, 0, 1), shell(3, 20, 1)]  # hollow with a core; one apart
    faces = np.concatenate([f + 8 * n for n, (_, f) in enumerate(bodies)])
    mesh = Mesh(np.concatenate([v for v, _ in bodies]), faces)
    assert mesh.is_watertight
    path = save(mesh, tmp_path / "a.step")
    shape = occ_files.read_product(path).shape
    assert occ.is_valid(shape)
    assert sorted(round(occ.volume(solid)) for solid in occ.solids(shape)) == [8, 27, 936]
    assert to_mesh(path, unite=False).volume == pytest.approx(1000 - 64 + 8 + 27)


def test_marching_cubes_with_slivers_becomes_a_solid(tmp_path: Path) -> None:
    from skimage.measure import marching_cubes

    axis = np.linspace(-1.3, 1.3, 14)
    x = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    ball, cube = 1 - np.linalg.norm(x, axis=-1), 0.8 - np.abs(x + 0.3).max(axis=-1)
    vertices, faces, _, _ = marching_cubes(np.maximum(ball, cube).astype(np.float32), 0, spacing=(2.0,) * 3)
    mesh = to_mesh((vertices, faces))
    edges = np.linalg.norm(np.diff(mesh.vertices[mesh.faces], axis=1), axis=2)
    assert edges.min() < 1e-6  # far below the kernel's own resolution
    path = save(mesh, tmp_path / "a.step")
    assert occ.is_valid(occ_files.read_product(path).shape)
    again = to_mesh(path)
    assert again.is_watertight
    assert again.volume == pytest.approx(mesh.volume, rel=1e-6)


def test_holes_in_faces(tmp_path: Path) -> None:
    """A plate with through holes, cut by a mesh: two faces with six holes each, one edge for each side."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_WIRE

    tools = [
        trimesh.creation.cylinder(1.5, 9, sections=24).apply_translation((x, y, 0)) for x in (-6, 0, 6) for y in (-4, 4)
    ]
    plate = trimesh.boolean.difference([trimesh.creation.box((24, 17, 3)), *tools], engine="manifold")
    mesh = Mesh(plate.vertices, plate.faces).transformed(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))
    shape = occ_files.read_product(save(mesh, tmp_path / "a.step")).shape
    assert occ.is_valid(shape)
    assert occ.volume(shape) == pytest.approx(mesh.volume, rel=1e-9)
    assert occ.area(shape) == pytest.approx(mesh.area, rel=1e-9)
    counts = [occ.shape_map(shape, kind).Extent() for kind in (occ.TopAbs_FACE, TopAbs_WIRE, TopAbs_EDGE)]
    assert counts == [6 + 6 * 24, 6 + 6 * 24 + 12, 12 + 6 * 3 * 24]


def test_the_cost_is_told_before_it_is_paid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from cad_implicit.cad import facets

    raw = trimesh.creation.icosphere(subdivisions=2, radius=7.3)
    monkeypatch.setattr(facets, "_MANY", 300)
    with pytest.warns(GeometryWarning, match=r"solid of 320 plane faces .* s, and .* MB as STEP: .*tolerance"):
        save(Mesh(raw.vertices, raw.faces), tmp_path / "a.step")


def test_what_cannot_be_a_solid_is_refused_and_nothing_written(tmp_path: Path) -> None:
    raw = trimesh.creation.icosphere(subdivisions=1)
    with pytest.raises(OpenMeshError):
        save(Mesh(raw.vertices, raw.faces[1:]), tmp_path / "a.step")
    with pytest.raises(InvalidMeshError, match="resolution"):
        save(Mesh(raw.vertices * 1e-7, raw.faces), tmp_path / "a.step")
    stray = np.concatenate([raw.faces, raw.faces[:, ::-1] + len(raw.vertices)])  # the second one is inside out
    with pytest.raises(InvalidMeshError, match=r"80 triangles is inside out .* in no other"):
        save(Mesh(np.concatenate([2 * raw.vertices, raw.vertices + np.array([5, 0, 0])]), stray), tmp_path / "a.step")
    assert not list(tmp_path.iterdir())


def test_an_inside_out_mesh_is_turned(tmp_path: Path) -> None:
    raw = trimesh.creation.icosphere(subdivisions=1)
    path = save(Mesh(raw.vertices, raw.faces[:, ::-1]), tmp_path / "a.step")
    assert occ.volume(occ_files.read_product(path).shape) == pytest.approx(raw.volume)
