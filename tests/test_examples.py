"""The examples run, each beside its host, and write what they promise: closed meshes and valid solids."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from cad_implicit.cad import open_part, to_mesh

pytestmark = pytest.mark.host

EXAMPLES = Path(__file__).parents[1] / "validation" / "examples"

#: What each example writes, and its volume in mm³ where a formula gives it, with the share that may be missing or over.
RESULTS: dict[str, dict[str, tuple[float, float] | None]] = {
    "cadquery_stadium": {"stadium.step": ((50 * 30 + np.pi * 25**2 - np.pi * 6**2) * 10, 1e-4)},
    "cadquery_two_radii": {
        "bracket.step": (((40 * 6 + 6 * 24 + (1 - np.pi / 4) * 8**2) * 25 - (2 - np.pi / 2) * 4**2 * 6)
                         - np.pi * 3.5**2 * 6, 1e-4),
    },
    "cadquery_lattice": {"light.3mf": None},
    "cadquery_safe": {"safe.step": (1000 + 500 * np.pi + 500 / 3 * np.pi, 1e-4)},
    "build123d_sphere": {"ball.step": (500 / 3 * np.pi, 1e-2)},
    "build123d_two_radii": {
        "cradle.step": (50 * 30 * 6 + 2 * 4 * 14 * 30 + 4 * (1 - np.pi / 4) * 9 * 30 - (2 - np.pi / 2) * 25 * 6, 1e-4),
    },
    "build123d_shell": {"housing.step": None},
    "build123d_remix": {"remix.stl": None, "remix.step": None},
}  # fmt: skip


def test_every_example_is_here() -> None:
    assert sorted(path.stem for path in EXAMPLES.glob("*.py")) == sorted(RESULTS)


@pytest.mark.parametrize("name", RESULTS)
def test_example(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip(name.split("_")[0])
    from cad_implicit.cad import occ

    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(EXAMPLES / f"{name}.py"))
    for file, expected in RESULTS[name].items():
        mesh = to_mesh(tmp_path / file)
        assert mesh.is_watertight
        assert mesh.components == 1
        if file.endswith(".step"):
            shape = open_part(tmp_path / file).shape
            assert occ.is_valid(shape)
            if expected is not None:
                assert occ.volume(shape) == pytest.approx(expected[0], rel=expected[1])
