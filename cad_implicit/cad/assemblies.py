"""Assemblies: STEP files of several parts, with their tree, names, colours and places."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from cad_implicit.parallel import Progress, no_progress

from .files import STEP_EXTENSIONS, check_output, readable, replacing
from .parts import OpenPart
from .solids import SolidPart
from .uniting import united

#: A product in a STEP file; an assembly is one, too.
_PRODUCT = re.compile(rb"=\s*PRODUCT\s*\(")


@dataclass(frozen=True, eq=False)
class Assembly:
    """A STEP file of several parts.

    Attributes
    ----------
    name : str
        Of the file.
    parts : tuple of OpenPart
        Distinct parts, each in its own coordinates, with its name as ``product`` and its colour. Solids of one part
        that touch are united, those of different parts never.
    uses : tuple of int
        In how many places each of them is.
    """

    name: str
    parts: tuple[OpenPart, ...]
    uses: tuple[int, ...]
    _product: Any

    def save(self, path: str | Path, solids: Mapping[int, SolidPart]) -> Path:
        """Write the assembly to a STEP file, some parts replaced; the tree, names, colours and places stay.

        Parameters
        ----------
        path : str or Path
        solids : mapping
            Positions in ``parts`` to what comes there, in the part's own coordinates. Later calls start from these.

        Raises
        ------
        FileFormatError
            If the file cannot be written.
        """
        from . import occ_files

        path = check_output(path, STEP_EXTENSIONS)
        members = self._product.parts()
        for position, solid in solids.items():
            self._product.replace(members[position], solid.wrapped)
        self._product.finish()
        time = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S")
        with replacing(path) as beside:
            occ_files.write_product(self._product, beside, path.stem, time)
        return path


def open_assembly(path: str | Path, *, progress: Progress = no_progress) -> Assembly | None:
    """Parts of a STEP file; None if it is another file, holds one part only in one place, or parts without solids.

    Raises
    ------
    FileFormatError, MissingHostError
        As :func:`cad_implicit.to_mesh` does.
    """
    path = readable(path)
    if path.suffix.lower() not in STEP_EXTENSIONS or len(_PRODUCT.findall(path.read_bytes())) < 2:
        return None
    from . import occ, occ_files

    progress("read", 0.0)
    product = occ_files.read_product(path)
    members = product.parts()
    progress("read", 1.0)
    if sum(member.uses for member in members) < 2 or not all(occ.has_solid(member.shape) for member in members):
        return None
    parts = tuple(
        OpenPart(
            member.name or f"{path.stem} {number}",
            occ.compound(united(member.shape)),
            None,
            member.name,
            member.colour,
        )
        for number, member in enumerate(members, 1)
    )
    return Assembly(path.stem, parts, tuple(member.uses for member in members), product)
