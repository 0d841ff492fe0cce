"""The demonstration: results written, a picture that shows something, a measured distance to the exact fillet."""

from __future__ import annotations

from pathlib import Path

import pytest

import cad_implicit as ci
from cad_implicit.parallel import no_progress


@pytest.mark.host
def test_demo(tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    from cad_implicit.report.demo import run_demo

    report = run_demo(tmp_path, 2.0, no_progress)
    assert report["exact_fillet"] == "ok, 17 concave edges"
    assert report["distance_rms_in_spacings"] < 0.02
    assert report["distance_max"] < 0.15 * 2.0  # where edges end in the open, closing and B-rep fillet differ by nature
    assert report["volume_after"] == pytest.approx(report["volume_exact"], rel=5e-4)
    for name in ("bracket_fillet.stl", "bracket_fillet.3mf"):
        assert ci.to_mesh(tmp_path / name).is_watertight


@pytest.mark.host
def test_picture(tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    image = pytest.importorskip("matplotlib.image")
    import shapes

    from cad_implicit.pictures import render

    part = shapes.notch(90, 20)
    render([part, part], ["before", "after"], tmp_path / "x.png")
    pixels = image.imread(tmp_path / "x.png")[..., :3]
    assert pixels.shape == (560, 1400, 3)
    for half in (pixels[:, :700], pixels[:, 700:]):
        covered = (half.min(axis=2) < 0.95).mean()
        assert 0.1 < covered < 0.8


def test_a_mesh_shows_itself(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pyvista = pytest.importorskip("pyvista")
    image = pytest.importorskip("matplotlib.image")
    import shapes

    part = shapes.notch(90, 20)
    red = ci.Mesh(part.vertices, part.faces, source={"name": "notch", "colour": (0.8, 0.1, 0.1)})
    red.show(screenshot=tmp_path / "x.png")
    pixels = image.imread(tmp_path / "x.png")[..., :3]
    assert (pixels[..., 0] > pixels[..., 1] + 0.2).mean() > 0.1
    picture = part._repr_png_()
    assert picture is not None
    assert picture.startswith(b"\x89PNG")
    shown = []
    monkeypatch.setattr(pyvista.Plotter, "show", lambda plotter: shown.append(plotter.renderer.actors))
    monkeypatch.setattr(pyvista, "OFF_SCREEN", True)
    part.show()
    assert len(shown[0]) >= 2


def test_without_pyvista_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    import shapes

    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(ci.errors.CadImplicitError, match=r"pip install .*reports"):
        shapes.notch(90, 20).show()
