"""All packages of the project: one version, descriptions for people, declared dependencies."""

import ast
import re
import subprocess
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "catkin_ws" / "src"
MANIFESTS = sorted(
    [*SOURCE.glob("*/package.xml"), *(ROOT / "examples").glob("*/package.xml"), ROOT / "tests" / "package.xml"]
)
PACKAGES = {path.parent.name: parse_package(str(path)) for path in sorted(SOURCE.glob("*/package.xml"))}


def imported(package):
    """Return the top-level modules that a package's Python files import."""
    found = set()
    for file in [*(SOURCE / package).glob("src/**/*.py"), *(SOURCE / package).glob("nodes/*")]:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.partition(".")[0])
    return found


def test_all_packages_have_the_newest_released_version_of_the_changelog():
    released = re.search(r"^## (\d+\.\d+\.\d+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    versions = {path.parent.name: parse_package(str(path)).version for path in MANIFESTS}
    assert set(versions.values()) == {released.group(1)}, versions


@pytest.mark.parametrize("manifest", MANIFESTS, ids=lambda path: path.parent.name)
def test_a_description_says_what_it_is_and_what_it_is_good_for(manifest):
    sentences = re.findall(r"[A-Z].*?[.](?:\s|$)", " ".join(parse_package(str(manifest)).description.split()))
    assert len(sentences) >= 2


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_declares_the_packages_of_the_project_that_it_imports(package):
    manifest = PACKAGES[package]
    declared = {dependency.name for dependency in [*manifest.build_export_depends, *manifest.exec_depends]}
    assert imported(package) & set(PACKAGES) - {package} <= declared


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="an archive of the source has no index")
def test_nothing_that_is_made_is_committed():
    command = ["git", "-C", str(ROOT), "ls-files", "--cached", "--ignored", "--exclude-standard"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == ""
