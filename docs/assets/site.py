"""Hooks of mkdocs: the site has the folders of the repository, so that each link works in both."""

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
CONTENT = (
    "*.md",
    "docs/**/*.md",
    "docs/**/*.png",
    "docs/**/*.svg",
    "docs/**/*.css",
    "docs/**/*.js",
    "docker/*.md",
    "packaging/*.md",
    "examples/**/*.md",
    "catkin_ws/src/**/*.md",
)
LINK = re.compile(r"(?<=\]\()(?!https?:|#)([^)\s#]+)(?=[)\s#])")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Return the files of the theme, the documents of the whole repository, and the sources to which they link."""
    paths = {path for pattern in CONTENT for path in ROOT.glob(pattern)}
    for document in [path for path in paths if path.suffix == ".md"]:
        links = LINK.findall(document.read_text(encoding="utf-8"))
        linked = ((document.parent / link).resolve() for link in links)
        paths |= {path for path in linked if path.is_file() and path.is_relative_to(ROOT)}
    found = [file for file in files if not Path(file.abs_src_path or "").is_relative_to(config.docs_dir)]
    found += [_file(str(path.relative_to(ROOT)), config) for path in sorted(paths)]
    found.append(File.generated(config, "api/index.html", content="", inclusion=InclusionLevel.INCLUDED))  # pdoc's
    return Files(found)


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Return the text, in which links to folders lead to their READMEs."""
    folder = (ROOT / page.file.src_uri).parent

    def complete(link: re.Match[str]) -> str:
        readme = folder / link[1] / "README.md"
        return f"{link[1].rstrip('/')}/README.md" if readme.is_file() else link[1]

    return LINK.sub(complete, markdown)


def _file(path: str, config: MkDocsConfig) -> File:
    file = File(path, str(ROOT), config.site_dir, use_directory_urls=False)
    in_an_index = re.match(r"docs/decisions/\d", path)  # too many for the navigation
    file.inclusion = InclusionLevel.NOT_IN_NAV if in_an_index else InclusionLevel.INCLUDED
    return file
