"""What the workbench needs beside FreeCAD, whether it is there, and how to install it into this FreeCAD's Python."""

from __future__ import annotations

import importlib.machinery
import importlib.metadata
import shlex
import subprocess
import sys
from pathlib import Path

#: Import name -> name for pip. ``cad_implicit`` comes with the workbench if the whole repository is in ``Mod``. Without
#: manifold3d, which the Addon Manager does not install, blends take longer and may have plane facets: results say so.
NEEDED = {
    "cad_implicit": "cad_implicit",
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "llvmlite": "llvmlite",
    "psutil": "psutil",
}

#: Beside those, for the accuracy report.
FOR_REPORTS = {"plotly": "plotly", "typer": "typer", "rich": "rich"}


def missing(packages: dict[str, str]) -> list[str]:
    """Names for pip of the packages that cannot be found. Nothing is imported: this runs at every start."""
    return [name for module, name in packages.items() if not _found(module)]


def _found(module: str) -> bool:
    """Whether a module is on the path; a mere folder of that name, as the add-on's own may have, does not count."""
    spec = importlib.machinery.PathFinder.find_spec(module)
    return spec is not None and spec.origin is not None


def package_folder(user_data: str, version: tuple[int, int]) -> Path:
    """Folder of the user's Python packages, where the Addon Manager, too, puts them; FreeCAD has it on its path.

    Parameters
    ----------
    user_data : str
        ``FreeCAD.getUserAppDataDir()``.
    version : (int, int)
        FreeCAD's. Since 0.21 the folder bears the version of Python.
    """
    base = Path(user_data) / "AdditionalPythonPackages"
    return base / f"py{sys.version_info.major}{sys.version_info.minor}" if version >= (0, 21) else base


def pip_command(packages: list[str], user_data: str, version: tuple[int, int]) -> str:
    """Command line that installs packages for this FreeCAD, to be pasted into a terminal.

    FreeCAD's own numpy comes before any other on its path, so the others are chosen to fit it.
    """
    fitting = [] if "numpy" in packages else [f"numpy=={importlib.metadata.version('numpy')}"]
    from .child import commands

    python = next(command[0] for command in commands())
    target = str(package_folder(user_data, version))
    parts = [python, "-m", "pip", "install", "--upgrade", "--target", target, *packages, *fitting]
    return subprocess.list2cmdline(parts) if sys.platform == "win32" else shlex.join(parts)
