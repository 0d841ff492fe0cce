"""The user's preferences, from FreeCAD's parameters (``resources/preferences.ui`` is the page that sets them)."""

from __future__ import annotations

from typing import Any

import FreeCAD as App

#: Where FreeCAD keeps them.
GROUP = "User parameter:BaseApp/Preferences/Mod/cad_implicit"

#: Engines in the order of the page's list.
ENGINES = ("exact", "reinit")


def _group() -> Any:
    return App.ParamGet(GROUP)


def tolerance() -> float:
    """Tolerance in mm of new features; 0 lets the spacing follow from the radius."""
    return float(_group().GetFloat("Tolerance", 0.0))


def engine() -> str:
    """Engine of new features."""
    return ENGINES[_group().GetInt("Engine", 0)]


def threads() -> int:
    """Threads to compute with; 0 takes as many as there are cores."""
    return int(_group().GetInt("Threads", 0))


def memory_limit() -> float:
    """GiB that one operation may take; 0 for most of what is free."""
    return float(_group().GetFloat("MemoryLimit", 0.0))


def limits() -> dict[str, float | int | None]:
    """Options of every Request: threads, and the bytes that one operation may take."""
    return {"threads": threads() or None, "memory_limit": memory_limit() * 2**30 or None}


def preview() -> bool:
    """Whether the task panel shows a coarse preview by itself."""
    return bool(_group().GetBool("Preview", True))


def set_preview(on: bool) -> None:
    """Remember whether the task panel shows previews."""
    _group().SetBool("Preview", on)
