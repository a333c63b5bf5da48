"""The checker looks for the executables that a launch file would start, where roslaunch looks for them."""

from __future__ import annotations

from pathlib import Path

import pytest
from ros_model.checks.systems import check_system
from ros_model.io import installed as installed_module
from ros_model.io.installed import InstalledPackages
from ros_model.language.system_reader import parse_system


@pytest.fixture
def vision(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a package in a source space; one of its scripts may not be executed."""
    folder = tmp_path / "src" / "vision"
    (folder / "scripts").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>vision</name></package>")
    for name, mode in (("detector_fast.py", 0o755), ("start", 0o755), ("idle.py", 0o644)):
        (folder / "scripts" / name).write_text("#!/bin/sh\n")
        (folder / "scripts" / name).chmod(mode)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    installed_module._packages.cache_clear()
    yield folder
    installed_module._packages.cache_clear()


def findings(*executables: str) -> list[str]:
    components = ", ".join(
        f"ComponentInterface {{ name c{number} NameSpace cell FromRosNode '{executable}.eye' }}"
        for number, executable in enumerate(executables)
    )
    system = parse_system(f"RosSystem {{ Name x RosComponents ( {components} ) }}", "m.rossystem")
    return [str(finding) for finding in check_system(system, installed=InstalledPackages())]


@pytest.mark.usefixtures("vision")
def test_executable_in_a_source_space_is_found():
    assert findings("vision.detector_fast.py", "vision.start") == []


@pytest.mark.usefixtures("vision")
def test_executable_without_its_extension_is_an_error_that_names_the_right_one():
    (finding,) = findings("vision.detector_fast", "vision.detector_fast")
    assert finding == (
        "m.rossystem:1:92: error: roslaunch finds no executable 'detector_fast' in the package 'vision': "
        "did you mean 'detector_fast.py'?"
    )
    assert "did you mean 'start'?" in findings("vision.start.py")[0]


def test_file_that_may_not_be_executed_is_an_error(vision: Path):
    (finding,) = findings("vision.idle.py")
    assert finding.endswith(f"{vision}/scripts/idle.py is not executable: chmod +x it")


def test_link_that_leads_nowhere_is_no_executable(vision: Path):
    (vision / "scripts" / "gone").symlink_to("nowhere")
    (finding,) = findings("vision.gone")
    assert "roslaunch finds no executable 'gone'" in finding


@pytest.mark.usefixtures("vision")
def test_package_of_another_machine_is_one_warning():
    (finding,) = findings("elsewhere.a", "elsewhere.b")
    assert finding == (
        "m.rossystem:1:92: warning: the package 'elsewhere' is not on this machine, so its executables can't be "
        "looked for: source the workspace that holds it"
    )


@pytest.mark.usefixtures("vision")
def test_executables_of_a_system_can_be_checked_by_the_command(tmp_path: Path, run):
    file = tmp_path / "a.rossystem"
    file.write_text(
        "RosSystem { Name x RosComponents ( ComponentInterface { name eye FromRosNode 'vision.detector_fast.eye' } ) }"
    )
    status, out, _ = run("check", file)
    assert (status, "did you mean 'detector_fast.py'?" in out) == (1, True)
    file.write_text(file.read_text().replace("fast.", "fast.py."))
    assert run("check", file)[0] == 0
