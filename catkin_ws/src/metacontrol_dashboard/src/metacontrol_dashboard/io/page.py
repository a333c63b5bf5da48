"""The files of the page, which `./mros setup` builds."""

from __future__ import annotations

import json
import mimetypes
import re
from pathlib import Path
from typing import TYPE_CHECKING

import rospkg

if TYPE_CHECKING:
    from metacontrol_dashboard.state.recording import Recording

INDEX = "index.html"
_PACKAGE = "metacontrol_dashboard"
_NAMES = (INDEX, "main.js", "main.css", "licences.txt")
"""What is served; nothing else is read from the folder."""
_TYPES = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".txt": "text/plain"}


class PageError(Exception):
    """The page was not built; one line with the remedy."""


def page_folder() -> Path:
    """Return the folder of the built page.

    Raises:
        PageError: it was not built.
    """
    folder = Path(__file__).resolve().parents[3] / "page" / "dist"
    if not folder.is_dir():
        try:
            folder = Path(rospkg.RosPack().get_path(_PACKAGE)) / "page" / "dist"
        except rospkg.ResourceNotFound:
            folder = Path()
    if not (folder / INDEX).is_file() or folder == Path():
        raise PageError("the page is not built: run ./mros setup where npm's registry can be reached")
    return folder


def page_files() -> dict[str, tuple[str, bytes]]:
    """Return type and content of each file of the page, by its name.

    Raises:
        PageError: the page was not built.
    """
    folder = page_folder()
    found = {}
    for name in _NAMES:
        path = folder / name
        if path.is_file():
            kind = _TYPES.get(path.suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream"
            found[name] = kind, path.read_bytes()
    return found


def standalone(recording: Recording) -> str:
    """Return the page of a recording as one HTML file that needs nothing else.

    Raises:
        PageError: the page was not built.
    """
    files = {name: content.decode("utf-8") for name, (_, content) in page_files().items()}
    # Within a script element, only these characters could end it.
    data = json.dumps(recording.as_dict(), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    script = re.sub(r"</(script)", r"<\\/\1", files["main.js"], flags=re.IGNORECASE)
    page = files[INDEX]
    style = f"<style>{files['main.css']}</style>"
    page = re.sub(r'<link[^>]*href="main\.css"[^>]*>', lambda _: style, page)
    whole = f'<script type="application/json" id="recording">{data}</script>\n<script type="module">{script}</script>'
    return re.sub(r'<script[^>]*src="main\.js"[^>]*></script>', lambda _: whole, page)
