"""What the user is told: errors in a box and in the report view, and the dialog about missing packages."""

from __future__ import annotations

import FreeCAD as App
import FreeCADGui as Gui

from . import requirements
from .qt import QtWidgets, run_dialog, translate


def tell_error(title: str, error: BaseException | str) -> None:
    """Write an error into the report view and show it in a box that does not stop FreeCAD.

    Parameters
    ----------
    title : str
        What did not work, translated.
    error : BaseException or str
        Why; the package's own errors are written for users, with figures and what to do.
    """
    text = in_words(error)
    App.Console.PrintError(f"{title}: {text}\n")
    box = QtWidgets.QMessageBox(Gui.getMainWindow())
    box.setObjectName("cad_implicit_error")
    box.setIcon(QtWidgets.QMessageBox.Warning)
    box.setWindowTitle(title)
    box.setText(text)
    box.setStandardButtons(QtWidgets.QMessageBox.Ok)
    box.setModal(False)
    box.show()


def in_words(error: BaseException | str) -> str:
    """Return an error as a sentence: its text, or the name of its class where it has none."""
    text = str(error).strip() or type(error).__name__
    return text[0].upper() + text[1:]


class MissingPackages(QtWidgets.QDialog):
    """Names the packages that are missing, and the command that installs them, with a button that copies it."""

    def __init__(self, packages: list[str]) -> None:
        super().__init__(Gui.getMainWindow())
        self.setObjectName("cad_implicit_missing")
        self.setWindowTitle(translate("Packages are missing"))
        version = (int(App.Version()[0]), int(App.Version()[1]))
        self.command = requirements.pip_command(packages, App.getUserAppDataDir(), version)
        told = translate("The workbench Implicit needs Python packages that this FreeCAD does not have:")
        after = translate("Paste this into a terminal, then start FreeCAD again:")
        label = QtWidgets.QLabel(f"{told}\n\n{', '.join(packages)}\n\n{after}")
        label.setWordWrap(True)
        text = QtWidgets.QPlainTextEdit(self.command)
        text.setReadOnly(True)
        text.setMinimumWidth(480)
        text.setMaximumHeight(110)
        copy = QtWidgets.QPushButton(translate("Copy the command"))
        copy.setObjectName("copy")
        copy.clicked.connect(self.copy)
        close = QtWidgets.QDialogButtonBox(QtWidgets.QDialogButtonBox.Close)
        close.addButton(copy, QtWidgets.QDialogButtonBox.ActionRole)
        close.rejected.connect(self.reject)
        layout = QtWidgets.QVBoxLayout(self)
        for widget in (label, text, close):
            layout.addWidget(widget)

    def copy(self) -> None:
        """Put the command on the clipboard."""
        QtWidgets.QApplication.clipboard().setText(self.command)


def all_there(packages: dict[str, str]) -> bool:
    """Return whether packages can be found; if not, say in a dialog how to install them."""
    missing = requirements.missing(packages)
    if missing:
        App.Console.PrintError(f"Implicit: missing packages: {', '.join(missing)}\n")
        run_dialog(MissingPackages(missing))
    return not missing
