"""The way of a user: a box with a boss, an edge, Fillet, values, OK; then on with the result."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui
import Part
import pytest
from freecad.cad_implicit_wb import reporting
from gui_window import Gaps, closed, panel

#: Radius and height of the boss, size of the box; nothing round or even.
BOSS, SIZE = 8.1, (41.3, 33.7, 12.9)


def boss(document: Any) -> Any:
    """A box with a cylinder on it, off the axes."""
    box = document.addObject("Part::Box", "Box")
    box.Length, box.Width, box.Height = SIZE
    cylinder = document.addObject("Part::Cylinder", "Cylinder")
    cylinder.Radius, cylinder.Height = BOSS, 27.3
    cylinder.Placement.Base = App.Vector(19.7, 16.3, 0)
    part = document.addObject("Part::MultiFuse", "Part")
    part.Shapes = [box, cylinder]
    part.Placement = App.Placement(App.Vector(3, -2, 5), App.Rotation(App.Vector(1, 2, 3), 13))
    document.recompute()
    Gui.activeDocument().activeView().viewIsometric()
    Gui.SendMsgToActiveView("ViewFit")
    return part


def foot(part: Any) -> str:
    """Name of the circle where the boss stands on the box."""
    place = part.Placement.multVec(App.Vector(19.7, 16.3, SIZE[2]))
    edges = enumerate(part.Shape.Edges)
    return next(f"Edge{n + 1}" for n, edge in edges if edge.CenterOfMass.isEqual(place, 1e-6))


def added(radius: float) -> float:
    """Volume that a fillet adds around a cylinder on a plane: Pappus, about the centroid of its profile."""
    area = (1 - math.pi / 4) * radius**2
    centroid = radius * (10 - 3 * math.pi) / (12 - 3 * math.pi)  # from the corner
    return 2 * math.pi * (BOSS + centroid) * area


def filleted(window: Any, part: Any, *names: str, radius: float) -> Any:
    """Fillet edges as a user does."""
    window.select(part, *names)
    Gui.runCommand("Implicit_Fillet")
    form = window.until(panel)
    form.preview.setChecked(False)
    form.fields["Radius"].widget.setProperty("rawValue", radius)
    window.ok()
    window.until(closed)
    return part.Document.ActiveObject


def test_fillet_by_a_click_and_ok(window: Any, document: Any) -> None:
    part = boss(document)
    before = part.Shape.Volume
    window.select(part, foot(part))
    with Gaps("box with a boss: panel, preview, fillet") as gaps:
        Gui.runCommand("Implicit_Fillet")
        form = window.until(panel)
        form.fields["Radius"].widget.setProperty("rawValue", 3.3)
        window.until(lambda: form.progress.isVisible())
        window.until(lambda: not form.progress.isVisible())
        assert form.note.text() == ""
        window.shot("panel")
        gaps.forgive()
        window.ok()
        window.until(closed)
    fillet = document.Fillet
    assert fillet.isValid()
    assert fillet.Shape.Volume - before == pytest.approx(added(3.3), rel=1e-9)
    assert fillet.ExactShare == 1.0
    torus = next(face.Surface for face in fillet.Shape.Faces if isinstance(face.Surface, Part.Toroid))
    assert torus.MinorRadius == pytest.approx(3.3)
    assert torus.Center.isEqual(part.Placement.multVec(App.Vector(19.7, 16.3, SIZE[2] + 3.3)), 1e-6)
    assert fillet.Shape.isValid()
    assert fillet.ViewObject.Visibility
    assert not part.ViewObject.Visibility
    assert fillet.ViewObject.Proxy.claimChildren() == [part]
    Gui.Selection.clearSelection()
    window.shot("fillet")
    colours = fillet.ViewObject.Proxy.colours
    colours.toggle()
    bar = window.until(lambda: colours._bar)
    window.shot("error")
    assert 0 < bar.largest < fillet.Radius.Value / 100


def test_the_part_goes_on(window: Any, document: Any, tmp_path: Path) -> None:
    """Another length, undo and redo, a Part boolean with the result, a file."""
    part = boss(document)
    fillet = filleted(window, part, foot(part), radius=2.3)
    document.Box.Length = SIZE[0] + 7.7
    document.recompute()
    assert fillet.isValid()
    assert fillet.Shape.Volume - part.Shape.Volume == pytest.approx(added(2.3), rel=1e-9)
    longer = fillet.Shape.Volume
    cut = document.addObject("Part::Cut", "Cut")
    hole = document.addObject("Part::Cylinder", "Hole")
    hole.Radius, hole.Height = 3.1, 200
    hole.Placement = part.Placement.multiply(App.Placement(App.Vector(19.7, 16.3, -50), App.Rotation()))
    cut.Base, cut.Tool = fillet, hole
    document.recompute()
    assert cut.Shape.isValid()
    assert longer - cut.Shape.Volume == pytest.approx(math.pi * 3.1**2 * 27.3, rel=1e-6)
    window.shot("cut", keep=False)
    path = str(tmp_path / "part.FCStd")
    document.saveAs(path)
    App.closeDocument(document.Name)
    opened = App.openDocument(path)
    assert opened.Fillet.Shape.Volume == pytest.approx(longer, rel=1e-12)
    assert not [obj.Name for obj in opened.Objects if "Touched" in obj.State]


def test_undo_and_redo_of_a_fillet(window: Any, document: Any) -> None:
    part = boss(document)
    filleted(window, part, foot(part), radius=2.3)
    document.undo()
    assert document.getObject("Fillet") is None
    assert part.ViewObject.Visibility
    document.redo()
    assert document.Fillet.Shape.Volume - part.Shape.Volume == pytest.approx(added(2.3), rel=1e-9)


def test_a_real_click_in_the_view_adds_an_edge(window: Any, document: Any) -> None:
    box = document.addObject("Part::Box", "Box")
    box.Length, box.Width, box.Height = SIZE
    document.recompute()
    view = Gui.activeDocument().activeView()
    view.viewIsometric()
    Gui.SendMsgToActiveView("ViewFit")
    window.select(box)
    Gui.runCommand("Implicit_Round")
    form = window.until(panel)
    form.preview.setChecked(False)
    name, edge = next(
        (f"Edge{n + 1}", e)
        for n, e in enumerate(box.Shape.Edges)
        if e.CenterOfMass.isEqual(App.Vector(SIZE[0] / 2, 0, SIZE[2]), 1e-6)
    )
    for chosen in ([name], []):
        window.click(view, edge.valueAt(edge.FirstParameter + 0.4 * edge.Length))
        window.until(lambda chosen=chosen: form.elements.names == chosen, 20)
    window.cancel()


def test_clicks_choose_edges_with_their_own_radii(window: Any, document: Any) -> None:
    box = document.addObject("Part::Box", "Box")
    box.Length, box.Width, box.Height = SIZE
    document.recompute()
    Gui.SendMsgToActiveView("ViewFit")
    upright = [f"Edge{n + 1}" for n, e in enumerate(box.Shape.Edges) if abs(e.tangentAt(e.FirstParameter).z) > 0.9]
    window.select(box, upright[0])
    Gui.runCommand("Implicit_Round")
    form = window.until(panel)
    form.preview.setChecked(False)
    assert form.elements.names == upright[:1]
    for name in (upright[1], upright[2], upright[1]):  # the last is clicked again, and goes
        Gui.Selection.addSelection(document.Name, "Box", name, 1, 2, 3)
        window.pump(0.1)
    assert form.elements.names == [upright[0], upright[2]]
    own = form.elements.tree.itemWidget(form.elements.tree.topLevelItem(1), 1)
    own.setProperty("rawValue", 4.1)
    form.fields["Radius"].widget.setProperty("rawValue", 2.2)
    window.shot("edges", keep=False)
    window.ok()
    window.until(closed)
    gone = (1 - math.pi / 4) * (2.2**2 + 4.1**2) * SIZE[2]
    assert math.prod(SIZE) - document.Round.Shape.Volume == pytest.approx(gone, rel=1e-9)
    document.Round.ViewObject.Proxy.doubleClicked(document.Round.ViewObject)
    again = window.until(panel)
    assert again.elements.own_radii == {upright[2]: 4.1}
    window.cancel()


@pytest.mark.parametrize(
    ("size", "radius", "length", "volume"),
    [
        ((10, 10, 10), 5.0, 10.0, 4 / 3 * math.pi * 125),
        ((50, 80, 10), 25.0, 10.0, 10 * (50 * 30 + math.pi * 625)),
        ((30, 30, 17), 15.0, 17.0, 17 * math.pi * 225),
    ],
    ids=["ball", "stadium", "disc"],
)
def test_what_part_fillet_refuses(
    window: Any, document: Any, size: tuple[float, ...], radius: float, length: float, volume: float
) -> None:
    """Full rounds: the faces between the edges vanish."""
    box = document.addObject("Part::Box", "Box")
    box.Length, box.Width, box.Height = size
    box.Placement = App.Placement(App.Vector(1.3, -2.1, 3.7), App.Rotation(13, 27, 41))
    document.recompute()
    Gui.SendMsgToActiveView("ViewFit")
    names = [f"Edge{n + 1}" for n, e in enumerate(box.Shape.Edges) if abs(e.Length - length) < 1e-6]
    with pytest.raises(Part.OCCError):
        box.Shape.makeFillet(radius, [box.Shape.getElement(name) for name in names])
    result = filleted(window, box, *names, radius=radius)
    assert result.isValid()
    assert result.Shape.isValid()
    assert result.Shape.Volume == pytest.approx(volume, rel=1e-6)
    window.shot(f"refused_{length:g}", keep=False)


def test_report_opens_in_the_browser(window: Any, document: Any, monkeypatch: Any) -> None:
    opened = []
    monkeypatch.setattr(reporting.QtGui.QDesktopServices, "openUrl", opened.append)
    part = boss(document)
    window.select(filleted(window, part, foot(part), radius=2.3))
    assert window.active("Implicit_Validate")
    with Gaps("report"):
        Gui.runCommand("Implicit_Validate")
        report = reporting._running[0]
        window.until(lambda: not reporting._running)
    error = window.find("cad_implicit_error")
    assert error is None, error.text()
    assert opened[0].toLocalFile() == str(report.page)
    assert "Fillet" in report.page.read_text(encoding="utf-8") or report.page.stat().st_size > 100_000
    figures = (report.page.parent / "report.json").read_text(encoding="utf-8")
    assert '"verdict": "passed"' in figures


def test_shell_open_at_a_clicked_face_and_its_error(window: Any, document: Any) -> None:
    box = document.addObject("Part::Box", "Box")
    box.Length, box.Width, box.Height = SIZE
    document.recompute()
    Gui.activeDocument().activeView().viewIsometric()
    Gui.SendMsgToActiveView("ViewFit")
    top = next(f"Face{n + 1}" for n, face in enumerate(box.Shape.Faces) if face.CenterOfMass.z > SIZE[2] - 1e-6)
    window.select(box, top)
    Gui.runCommand("Implicit_Shell")
    form = window.until(panel)
    form.preview.setChecked(False)
    assert form.elements.names == [top]
    form.fields["Thickness"].widget.setProperty("rawValue", 1.9)
    window.ok()
    window.until(closed)
    inner = (SIZE[0] - 3.8) * (SIZE[1] - 3.8) * (SIZE[2] - 1.9)
    assert document.Shell.Shape.Volume == pytest.approx(math.prod(SIZE) - inner, rel=2e-3)
    document.Shell.ViewObject.Proxy.colours.toggle()
    colours = document.Shell.ViewObject.Proxy.colours
    window.until(lambda: colours._bar or window.find("cad_implicit_error"))
    window.shot("shell_error", keep=False)
    assert colours.shown
    assert colours._bar.largest <= document.Shell.ErrorBound.Value
