"""The FreeCAD workbench as files: what the wheel ships, what the Addon Manager reads, translations, sizes."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
WORKBENCH = ROOT / "freecad_workbench" / "freecad" / "cad_implicit_wb"
NAMESPACE = {"p": "https://wiki.freecad.org/Package_Metadata"}


@pytest.fixture(scope="module")
def translations() -> ModuleType:
    """The script that keeps the translations."""
    spec = importlib.util.spec_from_file_location("translations", ROOT / "freecad_workbench" / "translations.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_wheel_ships_the_workbench_in_freecads_namespace() -> None:
    wheel = pytest.importorskip("hatchling.builders.wheel")
    files = {f.distribution_path for f in wheel.WheelBuilder(str(ROOT)).recurse_included_files()}
    own = "freecad/cad_implicit_wb"
    assert {"cad_implicit/__init__.py", f"{own}/__init__.py", f"{own}/init_gui.py"} <= files
    assert {f"{own}/resources/preferences.ui", f"{own}/resources/translations/cad_implicit_de.qm"} <= files
    assert f"{own}/resources/icons/implicit_fillet.svg" in files
    assert "freecad/__init__.py" not in files  # it would hide all other add-ons
    assert not any(name.startswith(("tests", "freecad_workbench")) for name in files)


def test_addon_manager_finds_what_package_xml_names() -> None:
    root = ET.parse(ROOT / "package.xml").getroot()
    bench = root.find("p:content/p:workbench", NAMESPACE)
    assert bench is not None
    folder = ROOT / bench.findtext("p:subdirectory", "", NAMESPACE)
    assert (folder / "freecad" / "cad_implicit_wb" / "init_gui.py").is_file()
    assert (folder / bench.findtext("p:icon", "", NAMESPACE)).is_file()
    assert (ROOT / root.findtext("p:icon", "", NAMESPACE)).is_file()
    name = bench.findtext("p:classname", "", NAMESPACE)
    assert f"class {name}(" in (WORKBENCH / "init_gui.py").read_text(encoding="utf-8")
    assert f'version = "{root.findtext("p:version", "", NAMESPACE)}"' in (ROOT / "pyproject.toml").read_text()


@pytest.mark.parametrize("language", ["de", "fr"])
def test_everything_is_translated(translations: Any, language: str) -> None:
    path = translations.FOLDER / f"cad_implicit_{language}.ts"
    known = translations.known(path)
    wanted = {(context, text) for context, texts in translations.texts().items() for text in texts}
    assert wanted == set(known)
    assert [text for (_, text), translation in known.items() if not translation] == []
    for (_, text), translation in known.items():
        assert text.count("{") == translation.count("{"), text
    assert path.with_suffix(".qm").is_file()


def test_texts_must_be_literals(translations: Any, tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    module.write_text("translate(name)")
    with pytest.raises(ValueError, match=r"module.py:1: translate\(\) takes a literal"):
        translations.literals(module)


def test_files_stay_readable() -> None:
    long = {p.name: n for p in WORKBENCH.glob("*.py") if (n := len(p.read_text(encoding="utf-8").splitlines())) > 400}
    assert not long


def test_screenshots_are_small() -> None:
    pictures = list((ROOT / "freecad_workbench" / "screenshots").glob("*.png"))
    assert all(p.stat().st_size < 300_000 for p in pictures)
