"""The secret by which a launcher knows who may have it start programs: whoever can read the robot user's own files.

ROS 1 lets every host on the network call every service, and a launcher starts what it is told. So requests are signed.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import os
import secrets
from io import BytesIO
from pathlib import Path
from typing import Any

import rospkg

FILE = "rosgraph_launcher.key"
"""In ROS_HOME (~/.ros), for its owner alone."""


class SecretError(Exception):
    """The secret can't be had; one line with the file and the remedy."""


def secret_file() -> Path:
    """Return the path of the secret."""
    return Path(rospkg.get_ros_home(), FILE)


def read_secret() -> bytes:
    """Return the secret of this user on this host; the first one who asks makes it.

    Raises:
        SecretError: it can't be read or made, or others can read it.
    """
    path = secret_file()
    try:
        with contextlib.suppress(FileNotFoundError):
            return _read(path)
        _make(path)
        return _read(path)
    except OSError as error:
        raise SecretError(
            f"{path}: {error.strerror or error}: the user of the nodes must be able to read it"
        ) from error


def sign(request: Any, launcher: str) -> None:
    """Sign a request to a launcher.

    Args:
        request: a message with a field `signature`.
        launcher: full name of the node.

    Raises:
        SecretError: there is no secret.
    """
    request.signature = _signature(request, launcher, read_secret())


def check_signature(request: Any, launcher: str) -> None:
    """Check that somebody has signed a request to this launcher who knows the secret.

    Raises:
        SecretError: nobody has.
    """
    if not hmac.compare_digest(request.signature.encode(), _signature(request, launcher, read_secret()).encode()):
        said = "has another signature than this host's" if request.signature else "is not signed"
        raise SecretError(
            f"the request {said}: copy {secret_file()} from the manipulator's host to this one, for its owner alone"
        )


def _signature(request: Any, launcher: str, secret: bytes) -> str:
    given, request.signature = request.signature, ""
    content = BytesIO()
    try:
        request.serialize(content)
    finally:
        request.signature = given
    words = f"{launcher} {request._type} {request._md5sum} ".encode()
    return hmac.new(secret, words + content.getvalue(), hashlib.sha256).hexdigest()


def _read(path: Path) -> bytes:
    with path.open("rb") as file:
        if os.fstat(file.fileno()).st_mode & 0o077:
            raise SecretError(f"{path}: others can read or change it: chmod 600 {path}")
        secret = file.read(4096).strip()
    if not secret:
        raise SecretError(f"{path}: is empty: delete it, and it is made anew")
    return secret


def _make(path: Path) -> None:
    """Make the secret, unless somebody else does at the same time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    descriptor = os.open(str(beside), os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        with os.fdopen(descriptor, "w") as file:
            file.write(secrets.token_hex(32) + "\n")
        with contextlib.suppress(FileExistsError):
            os.link(str(beside), str(path))  # unlike a renaming, it replaces nothing
    finally:
        beside.unlink()
