"""Generates docs/variants.md: a table of the variants with the levels that are expected of each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ros_model.generators import write_file

if TYPE_CHECKING:
    from ros_model.language.metamodel import RosSystem
    from ros_model.project.project import Project

QUALITY = "qa_"
"""Names of parameters that hold an expected level begin so."""


def generate(project: Project, output: Path) -> list[Path]:
    """Write the table; return the path of its file.

    Args:
        project: base, variants and metacontrol.yaml, read and checked.
        output: folder of the package.

    Raises:
        ModelError: the file can't be written.
    """
    qualities = sorted({name for variant in project.variants for name in levels(variant)})
    rows = [["variant", *(name.removeprefix(QUALITY) for name in qualities)], ["---"] * (len(qualities) + 1)]
    for variant in project.variants:
        found = levels(variant)
        rows.append([variant.name, *(found.get(name, "") for name in qualities)])
    text = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    return [write_file(output / "docs" / "variants.md", f"# Variants of {project.base.name}\n\n{text}\n", output)]


def levels(variant: RosSystem) -> dict[str, str]:
    """Return the expected levels of a variant: parameter -> level as text."""
    return {p.name: str(p.value) for p in variant.parameters if p.name.startswith(QUALITY)}
