"""Who starts a process again."""

import subprocess
import sys

from node_kit.io.supervisor import find_supervisor

FIND = "import sys; from node_kit.io.supervisor import find_supervisor; print(find_supervisor(sys.argv))"


def found_by_a_child(*arguments):
    return subprocess.run([sys.executable, "-c", FIND, *arguments], stdout=subprocess.PIPE, check=True).stdout.decode()


def test_all_that_a_roslaunch_starts_has_the_same_supervisor():
    first, second = (found_by_a_child("__name:=manipulator", "__log:=/tmp/manipulator.log") for _ in range(2))
    assert first == second != "\n"


def test_another_process_is_another_supervisor():
    assert found_by_a_child("__log:=x").strip() != find_supervisor(["__log:=x"]) != ""


def test_who_is_not_started_by_roslaunch_has_none():
    assert find_supervisor(["manipulator", "__name:=manipulator"]) == ""
