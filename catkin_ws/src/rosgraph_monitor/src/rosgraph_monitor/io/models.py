"""Reads the desired model from files: the base system and its variants."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.file_names import safe_file_name
from ros_model.io.files import resolve
from ros_model.io.models import read_system

from rosgraph_monitor.graph.desired import DesiredModel

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from ros_model.language.metamodel import RosSystem

_EXTENSION = ".rossystem"


def desired_model(base: str, variants: str, warn: Callable[[str], None]) -> DesiredModel:
    """Return the desired model of files.

    Args:
        base: path of the base system, or `package://PACKAGE/path`; empty: none.
        variants: folder with NAME.rossystem of each configuration, written likewise; empty: none.
        warn: is told, once, of a variant that can't be read; that is a problem only when it is deployed.

    Raises:
        ModelError: the base can't be read.
    """

    def read(name: str) -> RosSystem:
        if not variants:
            raise ModelError(f"configuration {name!r}: set ~variants to the folder of the variants' models")
        return read_system(resolve(variants) / f"{safe_file_name(name, 'configuration')}{_EXTENSION}")

    read_all = _Variants(variants, warn).read if variants else tuple
    return DesiredModel(read_system(resolve(base)) if base else None, read, read_all)


class _Variants:
    """All models of a folder. A model is read until that succeeds once, and then kept, also where its file goes."""

    def __init__(self, folder: str, warn: Callable[[str], None]) -> None:
        self._folder, self._warn = folder, warn
        self._known: dict[Path, RosSystem] = {}
        self._told: set[str] = set()

    def read(self) -> Iterator[RosSystem | ModelError]:
        """Give each model, and the errors with which others can't be read."""
        try:
            for path in _models_in(resolve(self._folder)):
                if path in self._known:
                    continue
                try:
                    self._known[path] = read_system(path)
                except ModelError as error:
                    yield self._tell(error)
        except ModelError as error:
            yield self._tell(error)
        yield from self._known.values()

    def _tell(self, error: ModelError) -> ModelError:
        if str(error) not in self._told:
            self._told.add(str(error))
            self._warn(f"left out for now, so nodes that only this variant has count as the base's: {error}")
        return error


def _models_in(folder: Path) -> list[Path]:
    """Return the models in a folder; one that is not there has none.

    Raises:
        ModelError: the folder can't be listed.
    """
    try:
        return [folder / name for name in sorted(os.listdir(folder)) if name.endswith(_EXTENSION)]
    except FileNotFoundError:
        return []
    except OSError as error:
        raise ModelError(f"{folder}: can't be listed ({error.strerror or error})") from error
