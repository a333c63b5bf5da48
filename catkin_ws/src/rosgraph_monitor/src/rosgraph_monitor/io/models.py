"""Reads the desired model from files: the base system and its variants."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.file_names import safe_file_name
from ros_model.io.files import resolve
from ros_model.io.models import read_system

from rosgraph_monitor.graph.desired import DesiredModel

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ros_model.language.metamodel import RosSystem


def desired_model(base: str, variants: str, warn: Callable[[str], None]) -> DesiredModel:
    """Return the desired model of files.

    Args:
        base: path of the base system, or `package://PACKAGE/path`; empty: none.
        variants: folder with NAME.rossystem of each configuration, written likewise; empty: none.
        warn: is told of a variant that can't be read; that is a problem only when it is deployed.

    Raises:
        ModelError: the base can't be read.
    """

    def read(name: str) -> RosSystem:
        if not variants:
            raise ModelError(f"configuration {name!r}: set ~variants to the folder of the variants' models")
        return read_system(resolve(variants) / f"{safe_file_name(name, 'configuration')}.rossystem")

    def read_all() -> Iterator[RosSystem]:
        for path in sorted(resolve(variants).glob("*.rossystem")) if variants else ():
            try:
                yield read_system(path)
            except ModelError as error:
                warn(f"left out, so nodes that only this variant has count as the base's: {error}")

    return DesiredModel(read_system(resolve(base)) if base else None, read, read_all)
