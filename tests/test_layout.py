"""The import rules of the house, read from the syntax trees; and what start-up may import."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import cad_implicit

ROOT = Path(cad_implicit.__file__).parent
MODULES = sorted(ROOT.rglob("*.py"))
HOSTS = {"OCP", "cadquery", "build123d", "FreeCAD", "Part", "MeshPart"}
KERNELS = {"occ": {"OCP"}, "freecad": {"FreeCAD", "Part", "MeshPart"}}
FRONT_ENDS = {"cli_validate", "cli_batch", "cli", "report", "cadquery", "cadquery_shapes", "build123d"}
HOST_MODULES = {"cadquery.py": {"cadquery"}, "cadquery_shapes.py": {"cadquery"}, "build123d.py": {"build123d"}}


def imported(path: Path) -> set[str]:
    """Absolute dotted names of everything that a module imports, anywhere in it."""
    package = ("cad_implicit", *path.relative_to(ROOT).parts[:-1])
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(filter(None, [base, node.module]))
            names |= {module} | {f"{module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_import_rules(path: Path) -> None:
    relative = path.relative_to(ROOT)
    roots = {name.split(".")[0] for name in imported(path)}
    own = {name.split(".")[1] for name in imported(path) if name.startswith("cad_implicit.")}
    if relative.parts[0] == "kernels":
        compiler = {"llvmlite", "collections"} if relative.name == "lanes.py" else set()
        assert roots <= {"__future__", "math", "typing", "numpy", "numba", "cad_implicit"} | compiler
        assert own <= {"kernels"}
    kernel = relative.stem.split("_")[0] if relative.parts[0] == "cad" else ""
    assert roots & HOSTS <= KERNELS.get(kernel, HOST_MODULES.get(str(relative), set()))
    other = {"occ": "freecad", "freecad": "occ"}.get(kernel)
    assert not any(module.split(".")[-1].split("_")[0] == other for module in imported(path))
    if relative.parts[0] not in FRONT_ENDS and relative.stem not in FRONT_ENDS | {"__main__"}:
        assert not own & FRONT_ENDS


def modules_after(code: str) -> set[str]:
    command = [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"]
    return set(subprocess.run(command, capture_output=True, text=True, check=True).stdout.split())


def test_import_and_help_are_light() -> None:
    heavy = {"numba", "skimage", "scipy", "OCP", "cadquery", "trimesh"}
    assert not modules_after("import cad_implicit, cad_implicit.cli") & heavy
    code = "import sys, cad_implicit.cli as c; sys.argv = ['x', '--help']\ntry: c.main()\nexcept SystemExit: pass"
    assert not modules_after(code) & heavy


def test_work_on_whole_parts_imports_nothing_for_chosen_edges() -> None:
    code = "from cad_implicit import save, to_mesh, box, contour, fillet, run\nimport cad_implicit.cli_assembly"
    heavy = {"scipy.spatial", "scipy.interpolate", "scipy.sparse", "trimesh", "skimage", "cad_implicit.local_blend"}
    assert not modules_after(code) & heavy


def test_public_names_are_complete_and_documented() -> None:
    for name in cad_implicit.__all__:
        assert getattr(cad_implicit, name).__doc__, name
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = cad_implicit.nothing  # type: ignore[attr-defined]


def test_files_stay_readable() -> None:
    long = {str(p.relative_to(ROOT)): n for p in MODULES if (n := len(p.read_text().splitlines())) > 400}
    assert not long
