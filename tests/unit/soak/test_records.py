"""Records of missions and their report; observations as lines."""

import pytest
from soak.observed import Beat, End, Process, Sample, Told, line, read
from soak.process_table import role_of
from soak.records import Record, RecordsError, Struck, faults, report, write
from soak.records import read as read_records

ONE = Record(
    0,
    "reached: goal reached",
    61.5,
    1.2,
    (Struck("KILL", "killed", 1.0), Struck("KILL", "killed", 3.0), Struck("DISK_FULL", "full", None, "no small disk")),
    ("no two of one role: two move_base",),
    {"move_base": 70.0},
)


def test_records_are_read_as_they_were_written(tmp_path):
    path = tmp_path / "missions.jsonl"
    assert read_records(path) == []
    write(path, ONE)
    with path.open("a") as file:
        file.write('{"number": 1, "outc')
    assert read_records(path) == [ONE]


def test_file_of_another_form_is_refused(tmp_path):
    path = tmp_path / "missions.jsonl"
    path.write_text("[1]\n")
    with pytest.raises(RecordsError, match=r"missions.jsonl:1: no record"):
        read_records(path)


def test_fault_that_was_left_out_does_not_count():
    assert faults([ONE, ONE]) == 4


def test_report_has_figures_by_kind():
    told = report([ONE], "abc", 3)
    assert "1 missions of seed 3 on code abc, 2 faults" in told
    assert "| process killed | 2 | 0 | 2 | 3.0 | 3.0 | 1 |" in told
    assert "| disk full | 0 | 1 | 0 | - | - | 0 |" in told
    assert "- mission 0: no two of one role: two move_base" in told


def test_observations_come_back_and_a_line_that_was_cut_off_is_left_out():
    sample = Sample(1.0, (Process(3, "move_base", True, False),))
    told = Told(2.0, 1.5, {"f": ("a", "STABLE")})
    end = End(9.0, 1, "said", ("left",))
    lines = [
        line("told", told),
        line("samples", sample),
        line("beats", Beat(3.0, 1.5)),
        line("end", end),
        '["beats", 4',
    ]
    observed = read(lines)
    assert (observed.samples, observed.told, observed.beats) == ([sample], [told], [Beat(3.0, 1.5)])
    assert observed.end == end


@pytest.mark.parametrize(
    ("command", "role"),
    [
        ("python /x/lib/move_base/move_base odom:=odometry __name:=move_base __log:=/x.log", "move_base"),
        ("/usr/lib/rosbag/record -O x.bag __name:=mission_recorder", "mission_recorder"),
        ("/usr/bin/python3 /usr/bin/rosmaster --core -p 1 -w 3 __log:=/x/master.log", "master"),
        ("python -P /x/mros1_reasoner/pellet/child.py 20241 x.so", "pellet"),
        ("sleep 1", ""),
    ],
)
def test_role_follows_from_the_command_line(command, role):
    assert role_of(command.split()) == role
