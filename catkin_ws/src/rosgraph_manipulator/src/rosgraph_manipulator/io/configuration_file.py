"""Reads the manipulator's configuration file, and finds the launch files that it names."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from node_kit.io.input_files import InputFileError, is_file, read_yaml
from ros_model.errors import ModelError
from ros_model.io.files import resolve

from rosgraph_manipulator.configuration.configurations import ConfigurationError, ManipulatorOptions, parse_options
from rosgraph_manipulator.configuration.repairs import parse_repairs

_SCHEME = "package://"


def options_from(parameters: Mapping[str, Any]) -> ManipulatorOptions:
    """Check the manipulator's parameters, and find the launch files that they name.

    Raises:
        ConfigurationError: a key is missing or has a value that cannot be used.
    """
    options = parse_options(parameters, find_launch_file)
    repairs = parse_repairs(parameters.get("repairs"), options.configurations, find_launch_file)
    return replace(options, repairs=repairs)


def find_launch_file(uri: str, anywhere: bool) -> str:
    """Return the path of a launch file.

    Args:
        uri: its path or `package://PKG/PATH`.
        anywhere: where `package://PKG/launch/FILE` is not there, search the whole package for FILE, as roslaunch does.

    Raises:
        ConfigurationError: there is no such file.
    """
    try:
        path = resolve(uri)
    except ModelError as error:
        raise ConfigurationError(str(error)) from error
    if anywhere and uri.startswith(_SCHEME) and not is_file(path):
        package, _, file = uri.removeprefix(_SCHEME).partition("/launch/")
        folder = resolve(f"{_SCHEME}{package}/package.xml").parent
        parts = Path(file).parts
        path = next((found for found in _files_below(folder) if found.parts[-len(parts) :] == parts), path)
    if not is_file(path):
        raise ConfigurationError(f"there is no launch file {path}: correct the name, or generate it")
    return str(path)


def _files_below(folder: Path) -> list[Path]:
    return sorted(Path(place, name) for place, _, names in os.walk(folder) for name in names)


def read_file(name: str) -> dict[str, Any]:
    """Return the keys of a configuration file.

    Raises:
        ConfigurationError: it can't be read.
    """
    try:
        content = read_yaml(name)
    except InputFileError as error:
        raise ConfigurationError(str(error)) from error
    if not isinstance(content, dict):
        raise ConfigurationError(f"{name}: expected keys such as 'configurations', found none")
    return content
