"""Keep the translations in step with the texts of the workbench, and compile them.

``python freecad_workbench/translations.py`` collects every literal given to ``translate(…)`` and every text of the
``.ui`` files, updates ``resources/translations/*.ts`` (texts that are gone leave, new ones are marked unfinished) and
calls Qt's ``lrelease`` for the ``.qm`` files, which FreeCAD reads. Qt's own ``lupdate`` does not read Python.
"""

from __future__ import annotations

import argparse
import ast
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

WORKBENCH = Path(__file__).parent / "freecad" / "cad_implicit_wb"
FOLDER = WORKBENCH / "resources" / "translations"
CONTEXT = "cad_implicit"
LANGUAGES = ("de", "fr")

#: Functions whose literals are translated.
_CALLS = ("translate", "marked")


def literals(path: Path) -> list[str]:
    """Return the texts that a module gives to ``translate`` or ``marked``.

    Raises
    ------
    ValueError
        If one is not a literal: it could not be collected.
    """
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _CALLS:
            text = node.args[0]
            if not (isinstance(text, ast.Constant) and isinstance(text.value, str)):
                raise ValueError(f"{path}:{node.lineno}: {node.func.id}() takes a literal")
            found.append(text.value)
    return found


def descriptions(path: Path) -> list[str]:
    """Third argument of every ``Property(…)`` and second of every ``_length(…)``: tooltips of properties."""
    places = {"Property": 2, "_length": 1}
    calls = (node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Call))
    named = ((call, call.func.id) for call in calls if isinstance(call.func, ast.Name))
    arguments = (call.args[places[name]] for call, name in named if name in places)
    return [node.value for node in arguments if isinstance(node, ast.Constant)]


def texts() -> dict[str, list[str]]:
    """Return all texts, by context: the modules', and each form's."""
    own = [text for path in sorted(WORKBENCH.glob("*.py")) for text in literals(path)]
    own += descriptions(WORKBENCH / "properties.py")
    found = {CONTEXT: list(dict.fromkeys(own))}
    for form in sorted(WORKBENCH.glob("resources/*.ui")):
        root = ET.parse(form).getroot()
        shown = [node.text for node in root.iter("string") if node.text]
        context = root.findtext("class", "")
        found[context] = list(dict.fromkeys([*found.get(context, []), *shown]))
    return found


def known(path: Path) -> dict[tuple[str, str], str]:
    """Return the translations that a .ts file has, by context and text."""
    if not path.exists():
        return {}
    return {
        (context.findtext("name", ""), message.findtext("source", "")): message.findtext("translation", "")
        for context in ET.parse(path).getroot().iter("context")
        for message in context.iter("message")
    }


def update(language: str) -> list[str]:
    """Write a language's .ts file, and return the texts that it has no translation for."""
    path = FOLDER / f"cad_implicit_{language}.ts"
    old, missing = known(path), []
    root = ET.Element("TS", version="2.1", language=language, sourcelanguage="en")
    for name, all_texts in texts().items():
        context = ET.SubElement(root, "context")
        ET.SubElement(context, "name").text = name
        for text in all_texts:
            message = ET.SubElement(context, "message")
            ET.SubElement(message, "source").text = text
            translation = ET.SubElement(message, "translation")
            translation.text = old.get((name, text), "")
            if not translation.text:
                translation.set("type", "unfinished")
                missing.append(text)
    ET.indent(root)
    body = ET.tostring(root, encoding="unicode")
    path.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE TS>\n{body}\n', encoding="utf-8")
    return missing


def main() -> None:
    """Update and compile all languages; tell what has no translation yet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lrelease", default=shutil.which("lrelease") or "lrelease", help="Qt's compiler")
    lrelease = parser.parse_args().lrelease
    FOLDER.mkdir(exist_ok=True)
    for language in LANGUAGES:
        for text in update(language):
            print(f"{language}: no translation of {text!r}")  # noqa: T201
        source = FOLDER / f"cad_implicit_{language}.ts"
        subprocess.run([lrelease, "-silent", str(source), "-qm", str(source.with_suffix(".qm"))], check=True)


if __name__ == "__main__":
    main()
