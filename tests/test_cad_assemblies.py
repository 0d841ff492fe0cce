"""STEP assemblies, names and colours, with whichever host is installed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from cad_implicit.cad import Assembly, open_assembly, save, to_mesh
from cad_implicit.cli import app

pytest.importorskip("OCP", reason="needs CadQuery or build123d")
pytestmark = pytest.mark.host

import cad_parts as parts  # noqa: E402

from cad_implicit.cad import occ, occ_files  # noqa: E402
from cad_implicit.cad.occ_products import Product, new_document  # noqa: E402

NOW = "2001-02-03T04:05:06"
RED, BLUE = (0.8, 0.1, 0.1), (0.1, 0.2, 0.9)


def bracket() -> Any:
    """An L of volume 10 x 10 x 2 + 2 x 10 x 6, with one concave edge."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse

    return occ.solids(BRepAlgoAPI_Fuse(parts.box((10, 10, 2)), parts.box((2, 10, 8))).Shape())[0]


def assembly(path: Path) -> Path:
    """A box named "base", red, and two blue Ls named "ell" that stand on it and touch it, one in a group of its own."""
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

    document = new_document()
    tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())

    def named(label: Any, name: str, colour: tuple[float, float, float] | None = None) -> Any:
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(name))
        if colour:
            colours.SetColor(label, Quantity_Color(*colour, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
        return label

    turn, lift = gp_Trsf(), gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(15, 5, 0), gp_Dir(0, 0, 1)), np.pi)
    lift.SetTranslation(gp_Vec(0, 0, 3))
    base = named(tool.AddShape(parts.box((30, 10, 3)), False), "base", RED)
    ell = named(tool.AddShape(bracket(), False), "ell", BLUE)
    top, group = named(tool.NewShape(), "top"), named(tool.NewShape(), "group")
    tool.AddComponent(group, ell, TopLoc_Location(turn))
    tool.AddComponent(top, base, TopLoc_Location())
    tool.AddComponent(top, ell, TopLoc_Location(lift))
    tool.AddComponent(top, group, TopLoc_Location(lift))
    tool.UpdateAssemblies()
    occ_files.write_product(Product(tool.GetShape_s(top), document), path, path.stem, NOW)
    return path


def opened(path: Path) -> Assembly:
    found = open_assembly(path)
    assert found is not None
    return found


def test_parts_names_colours_and_uses(tmp_path: Path) -> None:
    found = opened(assembly(tmp_path / "a.step"))
    assert [part.name for part in found.parts] == ["base", "ell"]
    assert [part.colour for part in found.parts] == [pytest.approx(RED, abs=1e-3), pytest.approx(BLUE, abs=1e-3)]
    assert found.uses == (1, 2)
    assert np.allclose(found.parts[1].bounds, [[0, 0, 0], [10, 10, 8]], atol=1e-6)


def test_one_part_is_no_assembly_and_keeps_name_and_colour(tmp_path: Path) -> None:
    occ_files.write(parts.moved(bracket()), tmp_path / "a.step", "Winkel größe 1", NOW, RED)
    assert open_assembly(tmp_path / "a.step") is None
    mesh = to_mesh(tmp_path / "a.step")
    assert mesh.source["name"] == "a"
    assert mesh.source["product"] == "Winkel größe 1"
    assert mesh.source["colour"] == pytest.approx(RED, abs=1e-3)
    again = to_mesh(save(mesh, tmp_path / "b.step"))
    assert (again.source["product"], again.source["colour"]) == (mesh.source["product"], mesh.source["colour"])
    assert again.volume == pytest.approx(mesh.volume, rel=1e-9)


def test_an_assembly_is_worked_part_by_part(tmp_path: Path) -> None:
    path = assembly(tmp_path / "a.step")
    arguments = ["fillet", str(path), "-r", "1.5", "--edges", "concave", "-o", str(tmp_path / "b.step"), "--json"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    figures = json.loads(result.stdout)
    assert [(row["input"], row["uses"], row["changed"]) for row in figures["parts"]] == [
        ("base", 1, False),
        ("ell", 2, True),
    ]
    assert "base stays as it is" in figures["warnings"][0]
    after = opened(tmp_path / "b.step")
    assert [part.name for part in after.parts] == ["base", "ell"]
    assert after.parts[0].colour == pytest.approx(RED, abs=1e-3)
    assert after.parts[1].colour == pytest.approx(BLUE, abs=1e-3)
    assert after.uses == (1, 2)
    gain = (1 - np.pi / 4) * 1.5**2 * 10
    assert occ.volume(after.parts[0].shape) == pytest.approx(900, rel=1e-9)
    assert occ.volume(after.parts[1].shape) == pytest.approx(320 + gain, rel=1e-4)
    whole = occ_files.read_product(tmp_path / "b.step").shape
    assert len(occ.solids(whole)) == 3  # they touch and are not welded
    assert occ.is_valid(whole)
    assert np.allclose(occ.bounds(whole), occ.bounds(occ_files.read_product(path).shape), atol=1e-6)


def test_edge_numbers_and_other_outputs(tmp_path: Path) -> None:
    path = assembly(tmp_path / "a.step")
    numbers = ["fillet", str(path), "-r", "1", "--edges", "1,2", "-o", str(tmp_path / "b.step")]
    result = CliRunner().invoke(app, numbers)
    assert result.exit_code == 1
    assert "assembly of 2, worked on part by part" in result.output
    thin = ["round", str(path), "-r", "2", "-o", str(tmp_path / "b.step"), "--spacing", "0.5"]
    result = CliRunner().invoke(app, thin)
    assert result.exit_code == 1
    assert "base: " in result.output
    assert not (tmp_path / "b.step").exists()
