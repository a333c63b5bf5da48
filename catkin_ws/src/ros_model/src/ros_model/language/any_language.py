"""Reads a text of either language."""

from __future__ import annotations

import re
from pathlib import PurePath
from typing import TYPE_CHECKING

from ros_model.language.packages_reader import parse_packages
from ros_model.language.system_reader import parse_system

if TYPE_CHECKING:
    from ros_model.language.metamodel import RosSystem
    from ros_model.language.packages import PackageSet

PACKAGES = ".ros"
SYSTEM = ".rossystem"
"""The extensions of the languages' files."""

_FIRST_WORD = re.compile(r"(?:\s++|//[^\n]*+|/\*.*?\*/)*+(\w*)", re.DOTALL)


def parse_all(text: str, file: str) -> RosSystem | PackageSet:
    """Return what a text of either language says: by the file's extension, else by its first word.

    Raises:
        ModelError: it is not well-formed.
    """
    suffix = PurePath(file).suffix
    match = _FIRST_WORD.match(text)
    in_packages = suffix == PACKAGES or (suffix != SYSTEM and match is not None and match[1] == "PackageSet")
    return parse_packages(text, file) if in_packages else parse_system(text, file)
