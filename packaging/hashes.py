#!/usr/bin/env python3
"""Writes requirements/hashes.txt: the hashes of the files of all pinned Python packages, as PyPI has them.

To be run when a pin in requirements/ is new: `python3 packaging/hashes.py`. `./mros setup` has pip refuse every file
with another hash. Only files are listed that Linux with the project's versions of Python may use, and sources.
"""

import json
import re
import sys
import urllib.error
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
REQUIREMENTS = ROOT / "requirements"
HASHES = REQUIREMENTS / "hashes.txt"
INDEX = "https://pypi.org/simple"
PINNED = sorted({*REQUIREMENTS.glob("python*.txt"), REQUIREMENTS / "node.txt"})

_FILE = re.compile(r"(?P<name>.+?)-(?P<version>\d[^-]*?)(?P<rest>-.*\.whl|\.tar\.gz|\.zip|\.tar\.bz2)")
_USABLE = re.compile(r"-(cp311|cp3\d+-abi3|py3|py2\.py3|cp311\.\S+)\S*-(any|(manylinux|musllinux|linux)\S*)\.whl")
_HEADER = "# Made by packaging/hashes.py: what pip may install for the pins in the other files.\n"


def pins() -> list[str]:
    """Return all pins, `NAME==VERSION`, in order and each once."""
    lines = {line.split("#")[0].strip() for path in PINNED for line in path.read_text().splitlines()}
    return sorted(lines - {""}, key=str.lower)


def hashes(pin: str) -> list[str]:
    """Return the hashes of the files of a package that may be used here.

    Raises:
        OSError: the index can't be reached.
    """
    name, _, version = pin.partition("==")
    address = f"{INDEX}/{re.sub(r'[-_.]+', '-', name).lower()}/"
    asked = urllib.request.Request(address, headers={"Accept": "application/vnd.pypi.simple.v1+json"})  # noqa: S310
    with urllib.request.urlopen(asked) as answer:  # noqa: S310 - the address begins with INDEX
        files = json.load(answer)["files"]
    found = []
    for file in files:
        parts = _FILE.fullmatch(file["filename"])
        if parts is None or parts["version"].lower() != version.lower():
            continue
        if not parts["rest"].endswith(".whl") or _USABLE.fullmatch(parts["rest"]):
            found.append(file["hashes"]["sha256"])
    return sorted(found)


def main() -> int:
    """Write the file; exit status 1 where a package has no file."""
    lines = []
    for pin in pins():
        try:
            found = hashes(pin)
        except OSError as error:
            print(f"{pin}: {error}: check the network", file=sys.stderr)  # noqa: T201
            return 1
        if not found:
            print(f"{pin}: {INDEX} has no file of it: correct the pin", file=sys.stderr)  # noqa: T201
            return 1
        lines.append(" ".join([pin, *(f"--hash=sha256:{digest}" for digest in found)]))
    HASHES.write_text(_HEADER + "\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
