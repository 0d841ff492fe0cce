"""Numba kernels: they see arrays and scalars only, and import nothing but numpy, numba and math."""

import logging

from numba.core import event


class _Notice(event.Listener):  # type: ignore[misc]
    """Says so, once, when a kernel is compiled: the first use on a machine takes a minute, in silence otherwise."""

    said = False

    def on_start(self, event: event.Event) -> None:
        if not self.said and event.data["dispatcher"].py_func.__module__.startswith(__name__):
            self.said = True
            logging.getLogger("cad_implicit").warning("compiling kernels, once per machine (about a minute) …")

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _Notice())
