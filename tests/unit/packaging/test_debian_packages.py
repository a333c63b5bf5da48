"""Debian packages: names, dependencies from package.xml, control files."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "packaging" / "debian_packages.py"


@pytest.fixture(scope="module")
def packaging():
    spec = importlib.util.spec_from_file_location("debian_packages", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules["debian_packages"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def manifest(packaging, tmp_path):
    def read(*needed, code=True):
        lines = "".join(f"<exec_depend>{name}</exec_depend>" for name in needed)
        path = tmp_path / "package.xml"
        path.write_text(
            '<package format="2"><name>conveyor_belt</name><version>2.3.4</version>'
            "<description>Moves\n  boxes.</description>"
            '<maintainer email="a@b.example">A. B.</maintainer>'
            f"<buildtool_depend>catkin</buildtool_depend>{lines}</package>"
        )
        if code:
            (tmp_path / "src").mkdir(exist_ok=True)
        return packaging.read_manifest(path)

    return read


def test_package_of_ours_is_needed_in_the_same_version(packaging, manifest):
    one = manifest("node_kit")
    control = packaging.control_of(one, {"conveyor_belt": one, "node_kit": one})
    assert control.name == "mros-conveyor-belt"
    assert "mros-node-kit (= 2.3.4-1)" in control.depends
    assert "mros-python (= 2.3.4-1)" in control.depends


def test_package_of_debian_is_needed_with_definitions_and_modules(packaging, manifest):
    control = packaging.control_of(manifest("nav_msgs"), {})
    assert {"python3-nav-msgs", "ros-nav-msgs"} <= set(control.depends)


def test_definitions_alone_need_no_python_packages(packaging, manifest):
    assert not [name for name in packaging.control_of(manifest(code=False), {}).depends if name.startswith("mros")]


def test_need_that_debian_has_not_is_refused(packaging, manifest):
    with pytest.raises(packaging.PackagingError, match=r"conveyor_belt needs no_such_thing, .*install it"):
        packaging.control_of(manifest("no_such_thing"), {})


def test_tools_to_build_are_not_needed_to_run(manifest):
    assert manifest("message_generation", "std_msgs").dependencies == ["std_msgs"]


def test_control_file_has_each_need_once_and_in_order(packaging):
    control = packaging.Control(
        "mros-x", "1-1", "A <a@b.example>", "Summary", "First.\n\nSecond.", depends=["b", "a", "b"], suggests=["rviz"]
    )
    assert control.written(12).splitlines() == [
        *("Package: mros-x", "Version: 1-1", "Section: science", "Priority: optional", "Architecture: all"),
        *("Maintainer: A <a@b.example>", "Installed-Size: 12", "Depends: a, b", "Suggests: rviz"),
        *("Description: Summary", " First.", " .", " Second."),
    ]


def test_metapackages_hold_each_package_once(packaging):
    manifests = {path.parent.name: packaging.read_manifest(path) for path in packaging.SOURCES.glob("*/package.xml")}
    meta, demo = packaging.metapackages(manifests)
    held = [name for name in (*meta.depends, *demo.depends) if name.startswith("mros-")]
    assert sorted(name.partition(" ")[0] for name in held) == sorted(map(packaging.debian_name, manifests))
    assert not [name for name in meta.depends if "move-base" in name or "sim" in name]


@pytest.mark.parametrize(("begin", "packages"), [("./mros_*.deb ", None), ("", ["rosgraph_launcher"])])
def test_documented_command_names_all_packages_that_apt_finds_nowhere_else(packaging, begin, packages):
    manifests = {path.parent.name: packaging.read_manifest(path) for path in packaging.SOURCES.glob("*/package.xml")}
    needed, left = {packaging.PYTHON_PACKAGE}, list(packages or packaging.META_CONTROLLER)
    while left:
        name = left.pop()
        needed.add(packaging.debian_name(name))
        left += [other for other in manifests[name].dependencies if other in manifests]
    text = (SCRIPT.parent / "README.md").read_text()
    command = text.split(f"apt-get install --no-install-recommends {begin}./mros-{{")[1].partition("\n\n")[0]
    names = re.findall(r"[a-z0-9-]+(?=[,}])", command)
    assert sorted(f"mros-{name}" for name in names) == sorted(needed)


def test_executable_of_ours_names_the_installed_interpreter(packaging, tmp_path):
    scripts = {"ours": f"#!{sys.executable}\nprint()\n", "env": "#!/usr/bin/env python3\n", "shell": "#!/bin/sh\n"}
    for name, text in scripts.items():
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    packaging.set_interpreter(tmp_path)
    first = {name: (tmp_path / name).read_text().splitlines()[0] for name in scripts}
    assert first == {"ours": "#!/usr/lib/mros/bin/python3", "env": "#!/usr/lib/mros/bin/python3", "shell": "#!/bin/sh"}


def test_file_that_names_a_folder_of_the_build_is_refused(packaging, tmp_path):
    stage = tmp_path / "stage"
    (stage / "usr" / "share").mkdir(parents=True)
    (stage / "usr" / "share" / "found.cmake").write_text(f"set(x {tmp_path}/build)")
    with pytest.raises(packaging.PackagingError, match=r"belt installs usr/share/found.cmake, which names a folder"):
        packaging.check_stage("belt", stage, tmp_path)


def test_python_packages_are_installed_by_their_hashes_into_a_new_folder(packaging, manifest, tmp_path, monkeypatch):
    stage = tmp_path / "scratch" / "python"
    stage.parent.mkdir()
    asked = []

    def run(*command):
        """Do what the commands leave behind, without downloading anything."""
        environment = stage / packaging.ENVIRONMENT
        if "venv" in command:
            (environment / "bin").mkdir(parents=True)
            (environment / "lib" / "python3.11" / "site-packages").mkdir(parents=True)
        if "install" in command:
            assert "--require-hashes" in command
            asked.append((stage / "requirements.txt").read_text())
        return "amd64\n"

    monkeypatch.setattr(packaging, "run", run)
    control = packaging.install_python(stage, manifest())
    (requirements,) = asked
    assert "owlready2==" in requirements and all("--hash=sha256:" in line for line in requirements.splitlines())
    assert control.architecture == "amd64"
    assert not (stage / "requirements.txt").exists()
