"""Python packages are installed by the hashes of their files, so that nobody slips others in."""

import re
from pathlib import Path

REQUIREMENTS = Path(__file__).parents[3] / "requirements"
LINE = re.compile(r"(\S+==\S+)((?: --hash=sha256:[0-9a-f]{64})+)")


def test_each_pinned_package_has_the_hashes_of_its_files():
    pinned = {
        line
        for path in (*REQUIREMENTS.glob("python*.txt"), REQUIREMENTS / "node.txt")
        for line in path.read_text().splitlines()
        if line and not line.startswith("#")
    }
    lines = (REQUIREMENTS / "hashes.txt").read_text().splitlines()[1:]
    found = [LINE.fullmatch(line) for line in lines]
    assert all(found), "run packaging/hashes.py"
    assert {match[1] for match in found} == pinned, "run packaging/hashes.py"
    assert all("==" in pin for pin in pinned)
