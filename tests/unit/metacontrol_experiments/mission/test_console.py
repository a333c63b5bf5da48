"""Why a system has ended, from its console."""

from metacontrol_experiments.mission.console import cause_in, last_complaint_in

MASTER_GONE = """[ERROR] [17957.1, 27.0]: /planner, a part of the meta-controller, is lost: its process has ended
/watcher: ROS master http://localhost:56155/ is gone: it ends, start it again with the master
[ERROR] [17957.9, 30.7]: unknown configuration ''; known are: a, b
\x1b[31m========REQUIRED process [world-2] has died!
process has finished cleanly
log file: /tmp/log/world-2*.log\x1b[0m
"""


def test_what_follows_from_the_end_of_the_master_is_not_taken_for_the_cause():
    assert cause_in(MASTER_GONE) == "ROS master http://localhost:56155/ is gone"


def test_required_process_is_the_cause_where_the_master_lives():
    text = "\n".join(line for line in MASTER_GONE.splitlines() if "is gone" not in line)
    assert cause_in(text) == "REQUIRED process [world-2] has died!"


def test_last_error_is_told_where_nothing_tells_that_all_ends():
    assert cause_in("error one\nRLException: error two\nThe traceback for the exception was written") == (
        "RLException: error two"
    )


def test_last_line_is_told_where_nothing_is_an_error():
    assert cause_in("one\ntwo\n") == "two" and cause_in("") == "it said nothing"


def test_last_complaint_is_told_without_its_stamp():
    text = "[ INFO] [17.5]: up\n\x1b[31m[ERROR] [17.5, 3.2]: disk full\x1b[0m\n[ INFO] [17.6]: Closing 'a.bag'.\n"
    assert last_complaint_in(text) == "disk full"
    assert last_complaint_in("[ INFO] [17.5]: up") == ""


def test_what_was_seen_comes_before_what_is_an_error_and_after_what_tells_that_all_ends():
    assert cause_in("OSError: no space", "ROS master x is gone") == "ROS master x is gone"
    assert cause_in("REQUIRED process [world-2] has died!", "ROS master x is gone").startswith("REQUIRED")
