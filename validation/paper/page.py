"""The page: text, tables and pictures as one self-contained HTML file."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Sequence
from pathlib import Path

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1180px; margin: 2em auto; padding: 0 1em; color: #1c2530; }
h1 { font-size: 1.7em; } h2 { margin-top: 2em; border-bottom: 1px solid #ccd3da; }
table { border-collapse: collapse; margin: 1em 0; } caption { text-align: left; font-weight: 600; padding: .3em 0; }
th, td { padding: .3em .8em; text-align: right; border-bottom: 1px solid #e3e8ec; } th { background: #f2f5f7; }
th:first-child, td:first-child { text-align: left; }
figure { margin: 1.5em 0; } img { max-width: 100%; } figcaption { color: #44505c; font-size: .93em; }
.good { color: #18703a; } .bad { color: #b3261e; font-weight: 600; }
"""


class Page:
    """Collects paragraphs, tables and figures, and writes them."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._parts = [f"<h1>{html.escape(title)}</h1>"]

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._parts.append(f"<h2>{html.escape(text)}</h2>")

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{html.escape(text)}</p>")

    def table(self, caption: str, head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
        """Add a table; a cell that is True or False says whether a figure is as good as it should be."""
        lines = [f"<table><caption>{html.escape(caption)}</caption><tr>"]
        lines += [f"<th>{html.escape(cell)}</th>" for cell in head]
        for row in rows:
            lines.append("</tr>\n<tr>")
            lines += [_cell(cell) for cell in row]
        self._parts.append("".join(lines) + "</tr></table>")

    def figure(self, picture: Path, caption: str) -> None:
        """Add a picture, its file in the page itself."""
        data = base64.b64encode(picture.read_bytes()).decode()
        text = html.escape(caption)
        self._parts.append(
            f'<figure><img alt="{text}" src="data:image/png;base64,{data}"><figcaption>{text}</figcaption></figure>'
        )

    def write(self, path: Path) -> None:
        """Write the file."""
        head = f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(self._title)}</title>'
        body = "\n".join(self._parts)
        path.write_text(f"{head}<style>{_STYLE}</style></head>\n<body>\n{body}\n</body></html>\n", encoding="utf-8")


def _cell(cell: object) -> str:
    if isinstance(cell, bool):
        return '<td class="good">yes</td>' if cell else '<td class="bad">no</td>'
    return f"<td>{html.escape(str(cell))}</td>"
