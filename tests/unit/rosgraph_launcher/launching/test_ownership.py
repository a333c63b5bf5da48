"""Whose process answers under a node's name."""

import pytest
from rosgraph_launcher.launching.ownership import Answer, Owner, ProcessFacts, ScriptProcess

MARK = "http://robot:11311/rosgraph_launcher"
OURS = ProcessFacts(10, "/bin/camera __name:=eye", MARK)
SHELL = ProcessFacts(11, "sh start.sh", MARK)
FOREIGN = ProcessFacts(20, "/bin/other __name:=eye")
ROSLAUNCH = ProcessFacts(19, "/usr/bin/python3 /usr/bin/roslaunch my_robot robot.launch")
INIT = ProcessFacts(1, "/sbin/init")


@pytest.mark.parametrize(
    ("answer", "owner"),
    [
        (Answer(), Owner.NOBODY),
        (Answer(True, True, (OURS, INIT)), Owner.LAUNCHER),
        (Answer(True, True, (ProcessFacts(12, "sudo camera"), SHELL, INIT)), Owner.LAUNCHER),  # not readable itself
        (Answer(True, True, (FOREIGN, ROSLAUNCH, INIT)), Owner.FOREIGN),
        (Answer(True, True, (ProcessFacts(13, "x", "http://robot:11312/rosgraph_launcher"),)), Owner.FOREIGN),
        (Answer(True, True, (ProcessFacts(13, "x", "http://robot:11311/b/rosgraph_launcher"),)), Owner.FOREIGN),
        (Answer(True, True, (ProcessFacts(13, "x", "http://localhost:11311//rosgraph_launcher"),)), Owner.LAUNCHER),
        (Answer(True, False, ()), Owner.UNKNOWN),  # on another host
        (Answer(True, False, (FOREIGN, INIT)), Owner.UNKNOWN),  # in a container: another process has its number here
    ],
)
def test_a_process_is_the_launchers_if_it_or_an_ancestor_bears_its_mark(answer, owner):
    assert answer.owner(MARK) is owner
    assert answer.is_up(MARK) is (owner in (Owner.LAUNCHER, Owner.UNKNOWN))
    assert bool(answer.conflict(MARK)) is (owner is Owner.FOREIGN)


def test_launch_file_that_starts_the_node_too_is_named_with_the_remedy():
    assert Answer(True, True, (FOREIGN, ROSLAUNCH, INIT)).conflict(MARK) == (
        "its name is taken by process 20 (/bin/other __name:=eye), which process 19 (/usr/bin/python3 "
        "/usr/bin/roslaunch my_robot robot.launch) starts, too: remove the node from that launch file, or its "
        'respawn="true"'
    )


def test_process_that_nobody_launched_is_named_with_the_remedy():
    line = Answer(True, True, (ProcessFacts(20, "x" * 1000), INIT)).conflict(MARK)
    assert line.endswith("xxx...): end that process, and remove the node from what starts it")
    assert len(line) < 300


def test_whoever_answers_for_a_node_that_has_ended_is_somebody_else():
    elsewhere = Answer(True, address="http://arm-pc:41000/")
    assert elsewhere.successor(MARK) == (
        "its name is taken by the node at http://arm-pc:41000/: end that node, or give it another name"
    )
    assert Answer(True, True, (FOREIGN, INIT)).successor(MARK) == Answer(True, True, (FOREIGN, INIT)).conflict(MARK)
    assert Answer(True, True, (OURS, INIT)).successor(MARK) == Answer().successor(MARK) == ""


@pytest.mark.parametrize(
    ("answer", "is_own"),
    [
        (Answer(True, True, (OURS, INIT), "http://robot:41001/"), True),
        (Answer(True, True, (FOREIGN, INIT), "http://robot:41001/"), False),
        (Answer(), False),
        (Answer(True, address="http://arm-pc:41002/"), False),  # it was started again, and has another port
        (Answer(True, address="http://172.17.0.2:41003/"), True),  # in a container of the launcher
    ],
)
def test_contested_name_is_ones_own_again_unless_the_other_host_answers(answer, is_own):
    conflict = Answer(True, address="http://arm-pc:41000/").successor(MARK)
    assert answer.is_own(MARK, conflict) is is_own


@pytest.mark.parametrize(
    ("script", "is_at_work"),
    [
        (ScriptProcess(is_shell=True, age=2.5, has_sockets=False), True),
        (ScriptProcess(is_shell=True, age=1.5, has_sockets=False), False),  # it may yet start a node
        (ScriptProcess(is_shell=True, age=2.5, has_sockets=True), False),  # it has started one: that must answer
        (ScriptProcess(is_shell=False, age=2.5, has_sockets=False), False),  # it has made way for a program
    ],
)
def test_a_shell_script_without_a_node_is_ready_when_it_has_run_for_a_while(script, is_at_work):
    assert script.is_at_work() is is_at_work
