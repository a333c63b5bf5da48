"""Looks up packages that are installed, and the messages, services and actions that they define."""

from __future__ import annotations

import functools
import re
from pathlib import Path

import rospkg

from ros_model.language.packages import EXTENSIONS, PARTS, MessageField, Spec, SpecKind

_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
_OF_AN_ACTION = re.compile(r"(\w+?)(?:Action(?:Goal|Result|Feedback)?|Goal|Result|Feedback)", re.ASCII)


class InstalledPackages:
    """The packages on ROS_PACKAGE_PATH (an `Installed` of `ros_model.language.library`)."""

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
        if kind is SpecKind.ACTION:
            is_made = (folder / "msg" / f"{name}Action.msg").is_file()
            return is_made or _is_action_of(folder, name.removesuffix("Action"))
        match = _OF_AN_ACTION.fullmatch(name)
        return kind is SpecKind.TOPIC and match is not None and _is_action_of(folder, match[1])

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
