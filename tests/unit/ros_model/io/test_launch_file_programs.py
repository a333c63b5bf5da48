"""Reading a launch file runs nothing, unless somebody asks for it."""

import pytest
from ros_model.io.launch_files import NotRun, load, read_launch_file


@pytest.fixture
def started(tmp_path):
    """A launch file with a program, and what that leaves."""
    path, mark = tmp_path / "robot.launch", tmp_path / "mark"
    path.write_text(f"""<launch><param name="text" command="touch {mark}"/></launch>""")
    return path, mark


def test_check_and_doctor_read_without_running(started):
    path, mark = started
    read_launch_file(path)
    assert load(path).params["/text"].value == NotRun(f"touch {mark}")
    assert not mark.exists()


def test_program_runs_where_it_is_asked_for(started):
    path, mark = started
    assert load(path, runs_programs=True).params["/text"].value == ""
    assert mark.exists()
