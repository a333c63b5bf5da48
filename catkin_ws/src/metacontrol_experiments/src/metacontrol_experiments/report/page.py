"""The page of a report: Markdown as one HTML file with the pictures in it."""

from __future__ import annotations

import base64
from html import escape
from typing import TYPE_CHECKING

from markdown_it import MarkdownIt

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from markdown_it.token import Token

_STYLE = """
body { font: 16px/1.5 system-ui, "Liberation Sans", sans-serif; color: #1a1a1a; background: #fff; margin: 0 auto;
  max-width: 76rem; padding: 1rem 1.5rem 4rem; }
p, ul { max-width: 50rem; }
li p { max-width: none; }
h1, h2, h3 { line-height: 1.2; margin: 2em 0 0.6em; }
h1 { margin-top: 0.5em; }
h2 { border-bottom: 1px solid #bbb; padding-bottom: 0.2em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.82rem; font-variant-numeric: tabular-nums; margin: 0.5em 0 1em; }
th, td { border-bottom: 1px solid #ccc; padding: 0.3em 0.7em; vertical-align: top; }
th { background: #f0f0f0; text-align: left; }
tbody tr:hover { background: #f7f7f7; }
p:has(img) { max-width: 62rem; }
img { display: block; max-width: 100%; height: auto; margin: 0.5em 0; }
code { background: #f0f0f0; padding: 0.05em 0.25em; font-size: 0.92em; }
pre { background: #f0f0f0; padding: 0.8em; overflow-x: auto; }
pre code { padding: 0; }
@media print { .wide { overflow: visible; } body { max-width: none; font-size: 11px; } }
"""


def page(markdown: str, title: str, pictures: Mapping[str, bytes]) -> str:
    """Return an HTML page that needs no other file.

    Args:
        markdown: of the report; HTML in it is shown as text.
        title: of the page.
        pictures: PNG files by the address that the Markdown has.
    """
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(markdown)
    for token in _all(tokens):
        source = token.attrs.get("src") if token.type == "image" else None
        if isinstance(source, str) and source in pictures:
            token.attrs["src"] = f"data:image/png;base64,{base64.b64encode(pictures[source]).decode()}"
    body = reader.renderer.render(tokens, reader.options, {})
    body = body.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n"
    )


def _all(tokens: Sequence[Token]) -> Iterator[Token]:
    for token in tokens:
        yield token
        yield from _all(token.children or ())
