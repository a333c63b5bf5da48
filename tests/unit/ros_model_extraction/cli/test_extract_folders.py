"""`rosmodel extract` of several folders."""

import os
import subprocess
import sys

import pytest
from ros_model_extraction.packages import package_source
from ros_model_extraction.packages.catkin_package import find_packages
from ros_model_extraction.packages.package_source import extract_package

PACKAGE = (
    "<package format='2'><name>NAME</name><version>0.1.0</version><description>x</description>"
    "<maintainer email='a@b.example'>a</maintainer><license>x</license></package>"
)


@pytest.fixture
def folders(tmp_path):
    """Two packages in folders of their own."""
    for name in ("crane", "ferry"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.xml").write_text(PACKAGE.replace("NAME", name))
        (tmp_path / name / "CMakeLists.txt").write_text("")
    return tmp_path


def test_several_folders_are_extracted_one_after_the_other(run, folders):
    out = folders / "out"
    assert run("extract", folders / "crane", folders / "ferry", "-o", out)[0] == 0
    assert sorted(path.name for path in out.iterdir()) == ["crane.ros", "ferry.ros"]


def test_folder_that_is_missing_does_not_hinder_the_others(run, folders):
    out = folders / "out"
    status, _, err = run("extract", folders / "gone", folders / "ferry", "-o", out)
    assert (status, "gone: no such folder" in err) == (2, True)
    assert [path.name for path in out.iterdir()] == ["ferry.ros"]


@pytest.mark.parametrize(
    ("more", "message"),
    [("a.launch", "give folders only, or one launch file"), ("a:=b", "arguments are for a launch file")],
)
def test_launch_file_or_argument_beside_a_folder_is_refused(run, folders, more, message):
    (folders / "a.launch").write_text("<launch/>")
    status, _, err = run("extract", folders / "crane", folders / more if "." in more else more, "-o", folders / "out")
    assert (status, message in err) == (2, True)
    assert not (folders / "out").exists()


def test_package_that_its_reader_falls_over_does_not_hinder_the_others(run, folders, monkeypatch):
    def extract(folder):
        if folder.name == "crane":
            raise RuntimeError("no way")
        return extract_package(folder)

    monkeypatch.setattr(package_source, "extract_package", extract)
    status, _, err = run("extract", folders, "-o", folders / "out")
    assert (status, "crane: can't be read (RuntimeError: no way)" in err) == (2, True)
    assert [path.name for path in (folders / "out").iterdir()] == ["ferry.ros"]


DEEP = sys.getrecursionlimit() + 20
"""More folders than Python has frames for calls."""


@pytest.fixture
def far_below(folders):
    """A package with many folders above it."""
    here = os.open(folders, os.O_RDONLY)
    for _ in range(DEEP):
        os.mkdir("a", dir_fd=here)
        below = os.open("a", os.O_RDONLY, dir_fd=here)
        os.close(here)
        here = below
    with os.fdopen(os.open("package.xml", os.O_WRONLY | os.O_CREAT, dir_fd=here), "w") as file:
        file.write(PACKAGE)
    os.close(here)
    yield folders
    subprocess.run(["rm", "-rf", str(folders / "a")], check=True)  # pytest itself can't remove it


def test_package_far_below_is_found(far_below):
    found, remarks = find_packages(far_below)
    assert [len(folder.relative_to(far_below).parts) for folder in found] == [DEEP, 1, 1] and remarks == ()


def test_headers_of_odd_names_and_circles_of_links_are_taken(run, folders, monkeypatch):
    crane, ferry = folders / "crane", folders / "ferry"
    for path in (ferry / "include" / "ferry", ferry / "src", crane / "src"):
        path.mkdir(parents=True)
    (ferry / "include" / "ferry" / "a**b.h").write_text("")
    (ferry / "include" / "ferry" / "loop.h").write_text("")
    (ferry / "src" / "loop.cpp").symlink_to("loop.cpp")
    (crane / "src" / "n.cpp").write_text(
        "#include <ferry/a**b.h>\n#include <ferry/loop.h>\n#include <ros/ros.h>\n"
        'int main(int c, char** v) { ros::init(c, v, "n"); ros::NodeHandle n; n.advertise<std_msgs::Bool>("x", 1); }'
    )
    (crane / "CMakeLists.txt").write_text("add_executable(n src/n.cpp)")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(folders), prepend=os.pathsep)
    _, _, err = run("extract", crane, "-o", folders / "out")
    assert "ferry/src/loop.cpp:1:1: not read: Too many levels" in err
    assert "Publisher { name 'x'" in (folders / "out" / "crane.ros").read_text()
