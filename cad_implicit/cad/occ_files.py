"""STEP and BREP files in and out."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any

from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_Static
from OCP.STEPCAFControl import STEPCAFControl_Reader, STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs
from OCP.TCollection import TCollection_HAsciiString
from OCP.TopoDS import TopoDS_Shape

from cad_implicit.errors import FileFormatError

from .occ import Shape, only_planes, silence
from .occ_products import Colour, Product, new_document, single

#: The last shape's end, and the reference to the shape that the file is about.
_BREP_END = re.compile(rb"\*\s+[+-]\d+\s+\d+\s*$")
#: The line of seven flags that each shape has.
_BREP_FLAGS = re.compile(rb"^[01]{7}\s*$", re.MULTILINE)

#: Strings and comments of STEP files, and entities without them: names, numbers, references, enumerations, binaries.
_STRINGS = re.compile(rb"'(?:[^']|'')*+'|/\*.*?\*/", re.DOTALL)
_ENTITIES = re.compile(rb"^\s*(#[^;]*);", re.MULTILINE).findall
_REFERENCES = re.compile(rb"#\d++").findall
_ENTITY = re.compile(
    rb"#\d++\s*+=(?:[\s,()*$]|#\d++|[+-]?\d++(?:\.\d*+)?(?:[eE][+-]?\d++)?|\.\w++\.|''|\"[0-9A-F]*+\"|[A-Za-z_]\w*+(?=\s*\())*+"
)

#: What the kernel's readers may take, in seconds (a process starts in about one) and bytes per second (they do a MB).
_LEAST_SECONDS, _BYTES_PER_SECOND = 30.0, 1e5

#: What that process does: what :func:`_read_step` and :func:`read` do, with nothing imported that takes time.
_READING = """
import sys
if sys.argv[1].lower().endswith(".brep"):
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Shape
    BRepTools.Read_s(TopoDS_Shape(), sys.argv[1], BRep_Builder())
else:
    from OCP.STEPControl import STEPControl_Reader
    reader = STEPControl_Reader()
    if reader.ReadFile(sys.argv[1]) == 1:  # done
        checks = reader.WS().ModelCheckList()
        checks.Start()
        while checks.More() and not (checks.Number() == 0 and checks.Value().NbFails()):
            checks.Next()
        if not checks.More():
            reader.TransferRoots()
"""

_STDOUT_LOCK = RLock()


def read(path: Path) -> Shape:
    """Shape of a BREP file that :func:`write_product`, or :func:`write`, of this very machine wrote."""
    shape = TopoDS_Shape()
    with silence(), _no_stdout():
        BRepTools.Read_s(shape, str(path), BRep_Builder())
    return shape


def read_product(path: Path) -> Product:
    """Shape of a STEP or BREP file in mm, and what a STEP file says of it.

    Raises
    ------
    FileFormatError
        If the file is cut short, corrupt, or of another kind than its suffix says.
    """
    step = path.suffix.lower() in (".step", ".stp")
    try:
        with silence():
            product = _read_step(path) if step else Product(_foreign_brep(path))
    except FileFormatError:
        raise
    except Exception as error:  # OCP raises its own family of errors, which differs between versions
        raise FileFormatError(f"{path} cannot be read ({type(error).__name__}); export it again") from error
    if product.shape is None or product.shape.IsNull():
        raise FileFormatError(
            f"{path} holds no shape, or a corrupt one ({path.stat().st_size:,} bytes); export it again"
        )
    return product


def _read_step(path: Path) -> Product:
    with path.open("rb") as file:
        start = file.read(1024)
        file.seek(max(0, path.stat().st_size - 4096))
        end = file.read()
    if b"ISO-10303-21" not in start:
        raise FileFormatError(
            f"{path} is not a STEP file: it does not start with ISO-10303-21; export it again as STEP"
        )
    if b"END-ISO-10303-21" not in end:
        size = path.stat().st_size
        raise FileFormatError(f"{path} is cut short: END-ISO-10303-21 is missing after {size:,} bytes; export it again")
    _check_part21(path)
    reader, document = STEPCAFControl_Reader(), new_document()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        return Product(None)
    control = reader.ChangeReader()
    faults = _faults(control)
    if faults:  # to go on would crash the process now and then, or lose faces
        raise FileFormatError(f"{path} is corrupt, with {len(faults)} faults, the first: {faults[0]}; export it again")
    control.SetSystemLengthUnit(1.0)  # in mm, whatever another library in this process has chosen
    reader.Transfer(document)
    return Product(control.OneShape(), document)


def _faults(reader: Any) -> list[str]:
    """Faults of syntax and references to what is missing; those of single entities are left to the kernel."""
    checks, found = reader.WS().ModelCheckList(), []
    checks.Start()
    while checks.More():
        if checks.Number() == 0:  # the file as a whole
            found += [checks.Value().CFail(number) for number in range(1, checks.Value().NbFails() + 1)]
        checks.Next()
    return found


def _foreign_brep(path: Path) -> Shape:
    """Read a text BREP, once it is seen to be whole: on a cut one the kernel's reader may never come back."""
    data = path.read_bytes()
    table = re.search(rb"^TShapes (\d+)", data, re.MULTILINE)
    if b"CASCADE Topology" not in data[:256]:
        raise FileFormatError(f"{path} is not a text BREP file of Open CASCADE; export it again as BREP or STEP")
    if table is None or not _BREP_END.search(data[-256:]):
        raise FileFormatError(f"{path} is cut short: no shape at the end of {len(data):,} bytes; export it again")
    shapes, expected = len(_BREP_FLAGS.findall(data, table.end())), int(table[1])
    if shapes < expected:
        raise FileFormatError(f"{path} is corrupt: it holds {shapes:,} of {expected:,} shapes; export it again")
    del data
    _try_reading(path)
    return read(path)


def _check_part21(path: Path) -> None:
    """Look at the syntax of a STEP file (ISO 10303-21): at some faults the kernel's reader crashes, now and then.

    Raises
    ------
    FileFormatError
        If entities are cut, have the same name, or are missing; or if the reader crashes at what else is unusual.
    """
    entities = _ENTITIES(_STRINGS.sub(b"''", path.read_bytes()))
    names = {entity[: entity.find(b"=")].rstrip() for entity in entities}
    cut = next((entity for entity in entities if entity.count(b"(") != entity.count(b")")), None)
    missing = {name for entity in entities for name in _REFERENCES(entity)} - names
    fault = (
        f"there are {len(entities)} entities of {len(names)} names"
        if len(names) < len(entities)
        else f"its entity {cut[:20].decode(errors='replace')} … is cut"
        if cut
        else f"{min(missing).decode()} is missing"
        if missing
        else ""
    )
    if fault:
        raise FileFormatError(f"{path} is corrupt: {fault}; export it again")
    if not all(map(_ENTITY.fullmatch, entities)):
        _try_reading(path)


def _try_reading(path: Path) -> None:
    """Let a process of its own read a file at whose faults the kernel's readers crash or read for ever.

    Raises
    ------
    FileFormatError
        If it crashes, or takes too long.
    """
    if getattr(sys, "frozen", False) or not sys.executable:  # no interpreter to try it with
        return
    try:
        done = subprocess.run(
            [sys.executable, "-c", _READING, str(path)],
            capture_output=True,
            timeout=_LEAST_SECONDS + path.stat().st_size / _BYTES_PER_SECOND,
            check=False,
        )
    except subprocess.TimeoutExpired:
        done = None
    if done is None or done.returncode < 0:
        fate = "hangs" if done is None else "crashes"
        raise FileFormatError(f"{path} is corrupt: the CAD kernel {fate} when it reads it; export it again")


@contextmanager
def _no_stdout() -> Iterator[None]:
    """Send file descriptor 1 nowhere: the BREP reader complains there, past all messengers."""
    with _STDOUT_LOCK:
        try:
            before, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
        except OSError:  # no standard output, as in a windowed program
            yield
            return
        try:
            os.dup2(nowhere, 1)
            yield
        finally:
            os.dup2(before, 1)
            os.close(before)
            os.close(nowhere)


def write(shape: Shape, path: Path, name: str, time: str, colour: Colour | None = None) -> None:
    """Write a STEP or BREP file in mm.

    Parameters
    ----------
    shape : TopoDS_Shape
    path : Path
        With suffix .step, .stp or .brep.
    name, time : str
        Name of the product and time stamp (ISO 8601) in a STEP file.
    colour : (3,) tuple of float, optional
        Of the product in a STEP file, as :attr:`.occ_products.Product.colour`.

    Raises
    ------
    FileFormatError
        If the kernel cannot write the shape.
    """
    with silence():
        if path.suffix.lower() == ".brep":
            done = BRepTools.Write_s(shape, str(path))
        else:
            done = _write_step(single(shape, name, colour), path, name, time)
    if not done:
        raise FileFormatError(f"{path} could not be written by the B-rep kernel; write a mesh (.stl, .3mf) instead")


def write_product(product: Product, path: Path, name: str, time: str) -> None:
    """Write a STEP file of a product with all its parts, as :func:`write`."""
    with silence():
        done = _write_step(product, path, name, time)
    if not done:
        raise FileFormatError(f"{path} could not be written by the B-rep kernel; write a mesh (.stl, .3mf) instead")


def _write_step(product: Product, path: Path, name: str, time: str) -> bool:
    """Write a document; the kernel's numbering of unnamed products is undone, so that files are the same each time."""
    writer = STEPCAFControl_Writer()
    writer.SetNameMode(True)
    writer.SetColorMode(True)
    with (
        _setting("write.step.unit", "MM"),
        _setting("xstep.cascade.unit", "MM"),
        _setting("write.surfacecurve.mode", "Off" if only_planes(product.shape) else "On"),
    ):
        if not writer.Transfer(product.document, STEPControl_AsIs):
            return False
    model = writer.ChangeWriter().Model()
    header = APIHeaderSection_MakeHeader(model)
    header.SetName(TCollection_HAsciiString(name))
    header.SetTimeStamp(TCollection_HAsciiString(time))
    return bool(writer.Write(str(path)) == IFSelect_RetDone)


@contextmanager
def _setting(name: str, value: str) -> Iterator[None]:
    """Change one of the kernel's global settings for a while."""
    before = Interface_Static.CVal_s(name)
    Interface_Static.SetCVal_s(name, value)
    try:
        yield
    finally:
        Interface_Static.SetCVal_s(name, before)
