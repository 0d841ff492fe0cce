"""The way of a user: a box with a boss, an edge, Fillet, values, OK; then on with the result."""

from __future__ import annotations

import math
from typing import Any

import FreeCAD as App
import FreeCADGui as Gui
import pytest
from freecad.cad_implicit_wb.qt import QtWidgets
from gui_window import Gaps, panel


def boss(document: Any) -> Any:
    """A box with a cylinder on it, off the axes."""
    box = document.addObject("Part::Box", "Box")
    box.Length, box.Width, box.Height = 41.3, 33.7, 12.9
    cylinder = document.addObject("Part::Cylinder", "Cylinder")
    cylinder.Radius, cylinder.Height = 8.1, 27.3
    cylinder.Placement.Base = App.Vector(19.7, 16.3, 0)
    part = document.addObject("Part::MultiFuse", "Part")
    part.Shapes = [box, cylinder]
    part.Placement = App.Placement(App.Vector(3, -2, 5), App.Rotation(App.Vector(1, 2, 3), 33))
    document.recompute()
    Gui.activeDocument().activeView().viewIsometric()
    Gui.SendMsgToActiveView("ViewFit")
    return part


def foot(part: Any) -> str:
    """Name of the circle where the boss stands on the box."""
    return next(
        f"Edge{n + 1}"
        for n, edge in enumerate(part.Shape.Edges)
        if edge.isClosed() and len(edge.Vertexes) == 1 and _is_foot(part, edge)
    )


def _is_foot(part: Any, edge: Any) -> bool:
    own = part.Placement.inverse().multVec(edge.CenterOfMass)
    return abs(own.z - 12.9) < 1e-6


def added(radius: float, boss_radius: float = 8.1) -> float:
    """Volume that a fillet adds around a cylinder on a plane (Pappus)."""
    area = (1 - math.pi / 4) * radius**2
    centroid = radius * (10 - 3 * math.pi) / (12 - 3 * math.pi)  # from the corner
    return 2 * math.pi * (boss_radius + centroid) * area


def test_fillet_by_a_click_and_ok(window: Any, document: Any) -> None:
    part = boss(document)
    before = part.Shape.Volume
    window.select(part, foot(part))
    with Gaps("first use"):
        Gui.runCommand("Implicit_Fillet")
        form = window.until(panel)
        form.findChild(QtWidgets.QAbstractSpinBox, "Radius").setProperty("rawValue", 2.3)
        window.pump(2)
        window.shot("panel", keep=False)
        window.ok()
        window.until(lambda: not Gui.Control.activeDialog())
    fillet = document.getObject("Fillet")
    assert fillet.isValid()
    window.shot("fillet", keep=False)
    assert fillet.Shape.Volume - before == pytest.approx(added(2.3), rel=1e-9)
