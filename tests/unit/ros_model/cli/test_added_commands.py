"""Commands that other packages add to rosmodel."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[4] / "catkin_ws" / "src"
ALONE = """
import sys
for name in ("ros_model_extraction", "tree_sitter", "tree_sitter_cpp"):
    sys.modules[name] = None  # importing it fails
from ros_model.cli.rosmodel import main
main(sys.argv[1:])
"""


@pytest.fixture
def alone(tmp_path):
    """Run rosmodel where the package ros_model_extraction is not installed."""
    packages = tmp_path / "src"
    packages.mkdir()
    for path in SOURCES.iterdir():
        if (path / "package.xml").is_file() and path.name != "ros_model_extraction":
            (packages / path.name).symlink_to(path)

    def run(*arguments):
        return subprocess.run(
            [sys.executable, "-c", ALONE, *map(str, arguments)],
            env={**os.environ, "ROS_PACKAGE_PATH": str(packages)},
            capture_output=True,
            text=True,
            check=False,
        )

    return run


def listed(text):
    return [line.split()[0] for line in text.partition("Commands:\n")[2].splitlines()]


def test_help_lists_the_commands_of_the_extraction(run):
    status, out, err = run("--help")
    assert (status, err) == (0, "")
    assert {"check", "extract", "generate", "snapshot"} <= set(listed(out))


def test_rosmodel_works_without_the_extraction(alone):
    assert alone("check", SOURCES / "metacontrol_sim" / "models" / "d2.rossystem").returncode == 0
    helped = alone("--help")
    assert helped.returncode == 0
    assert "check" in listed(helped.stdout)
    assert not {"extract", "snapshot"} & set(listed(helped.stdout))


@pytest.mark.parametrize("command", ["extract", "snapshot"])
def test_command_that_is_not_there_names_its_package(alone, command):
    done = alone(command, "--help")
    assert done.returncode == 2
    assert done.stderr == (
        f"rosmodel: no command {command!r}: package ros_model_extraction offers it: build it and source the workspace\n"
    )


def test_command_that_nobody_offers_is_refused(run):
    status, _, err = run("extrakt")
    assert status == 2
    assert "No such command 'extrakt'" in err
