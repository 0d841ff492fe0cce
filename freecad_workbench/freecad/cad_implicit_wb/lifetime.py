"""Notices that objects, or their document, are deleted while something works on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import FreeCAD as App

from .qt import QtCore


class Lifetime:
    """Calls ``gone()`` once when one of the objects is deleted, or their document is closed.

    FreeCAD calls the ``slot…`` methods of its observers.
    """

    def __init__(self, objects: Sequence[Any], gone: Callable[[], None]) -> None:
        self._names = {obj.Name for obj in objects}
        self._document = objects[0].Document.Name
        self._gone: Callable[[], None] | None = gone
        App.addDocumentObserver(self)

    def slotDeletedObject(self, obj: Any) -> None:  # noqa: N802
        """Note that an object is about to be deleted."""
        if obj.Document.Name == self._document and obj.Name in self._names:
            self._end()

    def slotDeletedDocument(self, document: Any) -> None:  # noqa: N802
        """Note that a document is about to be closed."""
        if document.Name == self._document:
            self._end()

    def stop(self) -> None:
        """Watch no longer."""
        if self._gone is not None:
            self._gone = None
            # Not now: this may be called by the observer that is removed, which FreeCAD 0.20 does not survive.
            QtCore.QTimer.singleShot(0, lambda: App.removeDocumentObserver(self))

    def _end(self) -> None:
        gone = self._gone
        self.stop()
        if gone is not None:
            gone()
