"""Validation reports: figures of sound results, and wrong ones that must be caught."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("OCP")

from cad_implicit.cad import open_part
from cad_implicit.job import run
from cad_implicit.mesh import Mesh
from cad_implicit.report.rolling_ball import nearest_centre
from cad_implicit.report.validation import BY_THE_BALL, Level, assess, exact_truth, limit_of, validate
from cad_implicit.report.writing import markdown, write_report
from cad_implicit.shapes import box

cq = pytest.importorskip("cadquery")

RADIUS = 2.0


def boss() -> Any:
    part = cq.Workplane().box(20, 20, 10).union(cq.Workplane().circle(5).extrude(20))
    return part.rotate((0, 0, 0), (1, 2, 3), 33)


@pytest.fixture(scope="module")
def sound() -> tuple[Any, Any]:
    """Outcome of a fillet, and the exact kernel's."""
    part = open_part(boss())
    return run(part, "fillet", RADIUS, edges="concave", spacing=0.4), exact_truth(part, RADIUS, "fillet", "concave")


def judged(mesh: Mesh, sound: tuple[Any, Any]) -> Any:
    return assess("boss", replace(sound[0], mesh=mesh), sound[1], RADIUS, "fillet", "concave")


def test_a_sound_fillet_passes_with_its_error(sound: tuple[Any, Any]) -> None:
    found = judged(sound[0].mesh, sound)
    assert found.passed, found.faults
    assert found.measured.against == "exact kernel"
    assert 1e-4 < found.regions["blend"].max < found.limits["the largest error in mm"][1]
    assert found.regions["unchanged"].max < 0.01 * found.outcome.spacing
    assert found.regions["blend"].bias > 0  # chords of a concave fillet lie in the air
    assert found.measured.defect < 1e-6
    assert abs(found.as_dict()["volume_error_share"]) < 1e-4
    assert found.bending.radius == pytest.approx(RADIUS, rel=0.02)  # a torus is no pipe
    assert found.bending.tangency < 2.0
    assert found.bending.tangency_high < 7.0  # slivers between the boss's facets and its circle are no face


def test_a_radius_off_by_five_per_cent_is_caught(sound: tuple[Any, Any]) -> None:
    wrong = run(open_part(boss()), "fillet", 1.05 * RADIUS, edges="concave", spacing=0.4)
    assert not judged(wrong.mesh, sound).passed


def test_a_moved_face_is_caught(sound: tuple[Any, Any]) -> None:
    mesh = sound[0].mesh
    up = np.array(sound[0].before.vertices).mean(axis=0)
    normals = mesh.face_vectors / np.linalg.norm(mesh.face_vectors, axis=1)[:, None]
    height = ((mesh.vertices - up)[mesh.faces].mean(axis=1) * normals).sum(axis=1)
    top = int(height.argmax())
    same = (normals @ normals[top] > 1 - 1e-9) & (np.abs(height - height[top]) < 1e-6)
    vertices = mesh.vertices.copy()
    vertices[np.unique(mesh.faces[same])] += 0.2 * sound[0].spacing * normals[top]
    assert not judged(Mesh(vertices, mesh.faces, mesh.face_ids), sound).passed


def test_a_hole_in_the_mesh_is_caught(sound: tuple[Any, Any]) -> None:
    mesh = sound[0].mesh
    found = judged(Mesh(mesh.vertices, mesh.faces[1:], mesh.face_ids[1:]), sound)
    assert any("open edges" in fault for fault in found.faults)


def ell() -> Any:
    """An L: the closing fades out at the ends of its edge, by up to 0.08 r."""
    part = cq.Workplane().box(20, 8, 4).union(cq.Workplane().box(4, 8, 16).translate((-8, 0, 6)))
    return part.rotate((0, 0, 0), (1, 2, 3), 20)


def test_the_whole_part_and_where_it_differs_by_nature() -> None:
    found = validate(ell(), RADIUS, spacing=0.5)
    assert found.passed, found.faults
    assert 0.03 * RADIUS < found.regions["differs by nature"].max < 0.1 * RADIUS
    assert found.regions["blend"].max < 0.1 * found.outcome.spacing
    assert found.regions[BY_THE_BALL].max < found.regions["differs by nature"].max


def test_the_whole_part_with_another_radius_is_caught() -> None:
    part = open_part(ell())
    wrong = run(part, "fillet", 1.05 * RADIUS, spacing=0.4)
    found = assess("ell", wrong, exact_truth(part, RADIUS, "fillet"), RADIUS, "fillet")
    assert not found.passed
    # (sqrt(2) - 1) r in the middle of the fillet: the balls of the right radius excuse none of it
    assert found.regions["blend"].max == pytest.approx((np.sqrt(2) - 1) * 0.05 * RADIUS, rel=0.35)


def test_where_the_kernel_fails_the_ball_tells() -> None:
    cube = cq.Workplane().box(10, 10, 10).rotate((0, 0, 0), (1, 2, 3), 33)
    found = validate(cube, 5.0, operation="round", edges="all", spacing=1.0)
    assert found.kernel["fate"] != "ok"
    assert found.measured.against == "rolling ball"
    assert found.passed, found.faults
    assert abs(found.outcome.mesh.volume - 523.599) < 10  # the chord


def test_an_operation_that_fails_is_told() -> None:
    found = validate(cq.Workplane().box(10, 10, 1), 3.0, operation="round")
    assert not found.passed
    assert "too large" in found.faults[0]


def test_the_nearest_free_centre() -> None:
    shape = box((10, 10, 10))
    on_round = np.array([[4.0 + np.sqrt(0.5), 4.0 + np.sqrt(0.5), 0.0]])
    inward = -np.array([[np.sqrt(0.5), np.sqrt(0.5), 0.0]])
    assert nearest_centre(shape, on_round, inward, 1.0, 1.0)[0] == pytest.approx(1.0, abs=1e-3)
    at_edge = np.array([[5.0, 5.0, 0.0]])
    assert nearest_centre(shape, at_edge, inward, 1.0, 1.0)[0] == pytest.approx(np.sqrt(2), abs=1e-3)


def test_the_ball_that_rolls_off_an_end() -> None:
    # a wall on a floor that ends at z = 5: beyond the end the ball comes nearer to a point 0.1 before it
    shape = box((10, 10, 10)).moved((5, -5, 0)) | box((10, 20, 10)).moved((-5, 0, 0))
    turn = np.pi / 4
    down = np.array([[-np.cos(turn), -np.sin(turn), 0.0]])
    middle, end = (2.0 * np.array([1, 1, 0]) + 2.0 * down + np.array([[0, 0, z]]) for z in (0.0, 4.8))
    assert nearest_centre(shape, middle, -down, 2.0, -1.0)[0] == pytest.approx(2.0, abs=2e-4)
    beyond = np.linspace(0.0, 2.0, 200_001)
    axis = np.sqrt(4.0 - beyond**2)  # touching the ends of both faces
    away = np.sqrt(2 * (axis - end[0, 0]) ** 2 + (beyond + 0.2) ** 2)
    assert away.min() < 1.995
    found = nearest_centre(shape, end, -down, 2.0, -1.0)[0][0]
    assert away.min() - 1e-6 < found < away.min() + 5e-3  # the search is no better, 2.5e-3 radii


@pytest.mark.parametrize(("text", "value"), [("0.02h", 0.01), ("1%", 0.02), ("0.3", 0.3), ("0.3 mm", 0.3), (None, 7.0)])
def test_limits(text: str | None, value: float) -> None:
    assert limit_of(text)(0.5, 2.0, 7.0) == pytest.approx(value)


def test_a_limit_that_cannot_be_read() -> None:
    with pytest.raises(ValueError, match=r"0\.02h"):
        limit_of("much")


def test_reports(sound: tuple[Any, Any], tmp_path: Path) -> None:
    pytest.importorskip("plotly")
    found = judged(sound[0].mesh, sound)
    pytest.importorskip("pyvista")
    levels = [Level("exact", h, 0.1 * h**2, 0.03 * h**2, 1.0) for h in (1.0, 0.5, 0.25)]
    html, figures, text, *pictures = write_report(replace(found, levels=levels), tmp_path / "report")
    assert {path.name for path in pictures} == {"histogram.png", "slices.png", "convergence.png", "solids.png"}
    for path in pictures:
        assert path.stat().st_size > 10_000  # blank ones have 5,000 at most
    told = json.loads(figures.read_text())
    assert told["schema"] == 1
    assert told["verdict"] == "passed"
    assert told["regions"]["blend"]["max"] == found.regions["blend"].max
    assert "boss" in text.read_text()
    assert "http" not in html.read_text(encoding="utf-8").split("<script>")[0]
    assert markdown([found]).count("|\n") == 3


@pytest.mark.skipif(shutil.which("chromium") is None and "CI" not in os.environ, reason="there is no Chromium")
def test_the_page_in_a_browser(sound: tuple[Any, Any], tmp_path: Path) -> None:
    pytest.importorskip("plotly")
    from playwright.sync_api import sync_playwright

    html = write_report(judged(sound[0].mesh, sound), tmp_path)[0]
    faults: list[str] = []
    drawing = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=drawing)
        page = browser.new_page(viewport={"width": 1250, "height": 1400})
        page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(html.as_uri())
        page.wait_for_selector("#solids canvas")
        page.wait_for_timeout(3000)
        place = page.locator("#solids").bounding_box()
        view = {"x": place["x"] + 60, "y": place["y"] + 120, "width": 400, "height": 400}
        first = page.screenshot(clip=view)
        assert len(first) > 10_000  # a blank one has some hundreds of bytes
        before = page.evaluate("document.getElementById('solids').data[0].cmax")
        page.locator("#solids .updatemenu-header").click()
        page.locator("#solids .updatemenu-dropdown-button").nth(2).click()
        page.wait_for_timeout(1500)
        assert page.evaluate("document.getElementById('solids').data[0].cmax") != before
        page.mouse.move(view["x"] + 100, view["y"] + 200)
        page.mouse.down()
        page.mouse.move(view["x"] + 250, view["y"] + 250, steps=6)
        page.mouse.up()
        page.wait_for_timeout(2000)
        assert page.screenshot(clip=view) != first
        browser.close()
    assert faults == []
