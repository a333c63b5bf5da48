"""Looks up packages that are installed, and the messages, services and actions that they define."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import TYPE_CHECKING

import rospkg

from ros_model.findings import WARNING
from ros_model.io.launch_files import wrong_parameters
from ros_model.language.library import Unknown, action_of
from ros_model.language.metamodel import EXTENSIONS_OF_SCRIPTS
from ros_model.language.packages import EXTENSIONS, PARTS, MessageField, Spec, SpecKind

if TYPE_CHECKING:
    from collections.abc import Iterator

_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)


class InstalledPackages:
    """The packages on ROS_PACKAGE_PATH (an `Installed` of `ros_model.language.library`)."""

    def __init__(self) -> None:
        self._missing: dict[tuple[str, str], Unknown | None] = {}

    def has_package(self, name: str) -> bool:
        """Return whether a package of that name is installed."""
        return _folder(name) is not None

    def has_type(self, package: str, kind: SpecKind, name: str) -> bool:
        """Return whether an installed package has the type; messages that are made of an action count, too."""
        folder = _folder(package)
        if folder is None:
            return False
        if (folder / EXTENSIONS[kind] / f"{name}.{EXTENSIONS[kind]}").is_file():
            return True
        if kind is SpecKind.ACTION and (folder / "msg" / f"{name}Action.msg").is_file():
            return True
        action = action_of(kind, name)
        return action is not None and _is_action_of(folder, action)

    def parts(self, package: str, spec: Spec) -> dict[str, tuple[MessageField, ...]]:
        """Return the fields of an installed message or service by its parts; nothing where there is none."""
        folder = _folder(package)
        if (
            folder is None
            or spec.kind is SpecKind.ACTION
            or not (_NAME.fullmatch(package) and _NAME.fullmatch(spec.name))
        ):
            return {}
        path = folder / EXTENSIONS[spec.kind] / f"{spec.name}.{EXTENSIONS[spec.kind]}"
        if not path.is_file():
            return {}
        from genmsg import InvalidMsgSpec, MsgContext
        from genmsg.msg_loader import load_msg_from_file, load_srv_from_file

        context = MsgContext.create_default()
        try:
            if spec.kind is SpecKind.TOPIC:
                loaded = [load_msg_from_file(context, str(path), f"{package}/{spec.name}")]
            else:
                service = load_srv_from_file(context, str(path), f"{package}/{spec.name}")
                loaded = [service.request, service.response]
        except (InvalidMsgSpec, OSError, ValueError):
            return {}
        return {
            part: (
                *(MessageField(constant.type, constant.name, str(constant.val_text)) for constant in found.constants),
                *(MessageField(kind, name) for kind, name in zip(found.types, found.names, strict=True)),
            )
            for part, found in zip(PARTS[spec.kind], loaded, strict=True)
        }

    def missing_executable(self, package: str, name: str) -> Unknown | None:
        """Return why roslaunch does not find an executable; None where it does.

        A package that is not on this machine is a warning, because its models may have been written for another one.
        """
        if (package, name) not in self._missing:
            self._missing[package, name] = _missing_executable(package, name)
        return self._missing[package, name]

    def missing_file(self, package: str, name: str, own: Path | None = None) -> Unknown | None:
        """Return why a package lacks a file; None where it has it.

        A package that is not on this machine is a warning, because its models may have been written for another one.
        """
        folders = [folder for folder in (own, _folder(package)) if folder]
        if any((folder / name).is_file() for folder in folders):
            return None
        if not folders:
            text = f"the package '{package}' is not on this machine, so {name} can't be looked for"
            return Unknown(f"{text}: source the workspace that holds it", WARNING)
        return Unknown(f"the package '{package}' has no file {name} in {folders[0]}: add it, or correct the name")

    def wrong_parameter_file(self, package: str, name: str, own: Path | None = None) -> Unknown | None:
        """Return why a file of a package can't be loaded as the parameters of a node; None where it can."""
        if missing := self.missing_file(package, name, own):
            return missing
        files = (folder / name for folder in (own, _folder(package)) if folder)
        why = wrong_parameters(next(file for file in files if file.is_file()))
        return Unknown(why) if why else None


def _missing_executable(package: str, name: str) -> Unknown | None:
    if _folder(package) is None:
        text = f"the package '{package}' is not on this machine, so its executables can't be looked for"
        return Unknown(f"{text}: source the workspace that holds it", WARNING)
    if _executables(package, name):
        return None
    text = f"roslaunch finds no executable '{name}' in the package '{package}'"
    if file := next(_files(package, name), None):
        return Unknown(f"{text}: {file} is not executable: chmod +x it")
    if other := next((other for other in _similar(name) if _executables(package, other)), None):
        return Unknown(f"{text}: did you mean '{other}'?")
    return Unknown(f"{text}: build and source its workspace, or correct the name")


def _executables(package: str, name: str) -> list[str]:
    """Return the files that roslaunch finds: in libexec, in share, and in the package's folder."""
    from roslib.packages import find_node  # imported when asked for: it takes 30 ms

    try:
        found: list[str] = find_node(package, name, _packages())
    except OSError:  # a link that leads nowhere
        return []
    return found


def _files(package: str, name: str) -> Iterator[str]:
    from roslib.packages import find_resource

    yield from find_resource(package, name, rospack=_packages())


def _similar(name: str) -> list[str]:
    """Return a script's name without its extension, or the name with each extension of a script."""
    stem, _, extension = name.rpartition(".")
    return (
        [stem] if extension in EXTENSIONS_OF_SCRIPTS else [f"{name}.{other}" for other in sorted(EXTENSIONS_OF_SCRIPTS)]
    )


@functools.cache
def _packages() -> rospkg.RosPack:
    return rospkg.RosPack()


def _folder(package: str) -> Path | None:
    try:
        return Path(_packages().get_path(package))
    except rospkg.ResourceNotFound:
        return None


def _is_action_of(folder: Path, name: str) -> bool:
    return (folder / "action" / f"{name}.action").is_file()
