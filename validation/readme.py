"""Generated tables in the README, between ``<!-- name -->`` and ``<!-- /name -->``."""

from __future__ import annotations

from pathlib import Path

README = Path(__file__).parent.parent / "README.md"


def into_readme(name: str, text: str, readme: Path = README) -> None:
    """Put a text between the marks of a name.

    Raises
    ------
    ValueError
        If the marks are not there.
    """
    old = readme.read_text(encoding="utf-8")
    start, end = f"<!-- {name} -->\n", f"<!-- /{name} -->"
    if start not in old or end not in old:
        raise ValueError(f"{readme} has no marks <!-- {name} --> and <!-- /{name} -->")
    before, rest = old.split(start)
    readme.write_text(before + start + text + end + rest.split(end)[1], encoding="utf-8")
