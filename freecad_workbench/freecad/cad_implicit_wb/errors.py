"""What the workbench's user is told when something cannot be done."""

from __future__ import annotations


class WorkbenchError(Exception):
    """Something cannot be done; the message says what and why, in words of FreeCAD's user."""


class CancelledError(WorkbenchError):
    """The user cancelled the work."""


class BrokenReferenceError(WorkbenchError):
    """A chosen edge or face of the source is not there any more, or it cannot be told which one it is."""
