"""Histories that failed once, shrunk; each is a defect that was mended."""

from rosgraph_manipulator.change.request_queue import Policy
from simulated.faults import Fault, Kind
from simulated.history import History, run


def holds(told):
    assert not run(told).broken


def test_nothing_runs_on_when_the_master_is_silent_while_a_failed_change_is_cleared_away():
    faults = (
        Fault(7.596, Kind.REQUEST, "f3_v1_r2_b"),
        Fault(8.352, Kind.MASTER_SILENT, "", 3.721),
    )
    holds(History(11, "d2", faults, Policy.REFUSE, starts_with_initial=True))


def test_nothing_runs_on_when_the_master_is_silent_during_a_request():
    faults = (
        Fault(36.37, Kind.MASTER_SILENT, "", 2.648),
        Fault(36.798, Kind.REQUEST, "sprinkle"),
    )
    holds(History(128, "greenhouse", faults, Policy.REPLACE, starts_with_initial=True))


def test_node_that_hangs_after_its_restart_is_deployed_again():
    faults = (
        Fault(23.071, Kind.KILL_NODE, "/waterer"),
        Fault(23.385, Kind.FREEZE_NODE, "/waterer"),
    )
    holds(History(18, "greenhouse", faults, Policy.WAIT))


def test_shared_node_ends_with_the_last_function_that_needs_it():
    faults = (
        Fault(25.912, Kind.REQUEST, "by_wheel"),
        Fault(34.033, Kind.REQUEST, "by_clock"),
    )
    holds(History(871, "orchard", faults, Policy.WAIT))


def test_node_that_never_answers_under_a_name_that_was_taken_counts_as_dead():
    faults = (
        Fault(36.3, Kind.FOREIGN, "/fleet/r7/leaf_finder", 13.829),
        Fault(36.654, Kind.NEVER_READY, "/fleet/r7/leaf_finder", 4.059),
    )
    holds(History(586, "orchard", faults, Policy.REPLACE, starts_with_initial=True))


def test_change_that_was_given_up_for_a_request_that_is_taken_back_is_undone():
    faults = (
        Fault(38.802, Kind.KILL_PART, "reasoner"),
        Fault(40.273, Kind.KILL_DRIVER, "/front_laser", 15.542),
        Fault(41.439, Kind.FREEZE_PART, "manipulator", 8.705),
        Fault(46.947, Kind.CANCELLED_REQUEST, "f1_v3_r2", 1.582),
    )
    holds(History(101016, "d2", faults, Policy.REPLACE, starts_with_initial=True))


def test_what_a_new_launcher_has_started_ends_when_the_change_is_undone():
    faults = (
        Fault(38.326, Kind.REQUEST, "by_clock"),
        Fault(40.784, Kind.KILL_PART, "launcher"),
        Fault(40.998, Kind.REQUEST, "by_rows"),
    )
    holds(History(101665, "orchard", faults, Policy.REFUSE, starts_with_initial=True))


def test_first_request_of_a_function_that_is_taken_back_at_once_leaves_nothing_under_way():
    faults = (Fault(2.237, Kind.CANCELLED_REQUEST, "look_right", 0.006),)
    holds(History(202349, "station", faults, Policy.REFUSE))


def test_nothing_runs_on_when_what_a_change_would_go_back_to_can_not_be_read():
    faults = (
        Fault(3.222, Kind.DIES_LATER, "/waterer", 1.668),
        Fault(11.713, Kind.KILL_DRIVER, "/pump_driver"),
        Fault(44.271, Kind.FILE_GONE, "sprinkle", 18.658),
    )
    holds(History(400435, "greenhouse", faults, Policy.WAIT, starts_with_initial=True))


def test_late_report_of_a_launcher_that_died_is_not_believed():
    faults = (
        Fault(2.865, Kind.FREEZE_NODE, "/move_base", 6.467),
        Fault(50.808, Kind.SLOW, "functions", 3.775),
        Fault(50.975, Kind.CANCELLED_REQUEST, "f1_v2_r3", 1.612),
        Fault(53.242, Kind.KILL_PART, "launcher"),
    )
    holds(History(502265, "d2", faults, Policy.WAIT, starts_with_initial=True))


def test_dead_node_of_a_failed_function_is_not_started_again_when_the_other_function_gives_it_up():
    faults = (
        Fault(9.715, Kind.DIES_AT_START, "/fleet/r7/mast", 4.0),
        Fault(24.403, Kind.KILL_NODE, "/fleet/r7/mast"),
    )
    holds(History(507068, "orchard", faults, Policy.WAIT, starts_with_initial=True))


def test_nodes_end_that_a_change_of_a_dead_manipulator_brings_while_its_successor_waits_for_the_launcher():
    faults = (
        Fault(49.367, Kind.DEAF, "/fleet/r7/sprayer"),
        Fault(49.588, Kind.CANCELLED_REQUEST, "by_clock", 1.206),
        Fault(55.188, Kind.KILL_PART, "manipulator"),
    )
    holds(History(5000037, "orchard", faults, Policy.WAIT, starts_with_initial=True))


def test_connection_that_was_broken_and_is_first_heard_after_its_successor_makes_nobody_deaf():
    faults = (
        Fault(43.105, Kind.CANCELLED_REQUEST, "f3_v1_r3_b", 2.765),
        Fault(43.257, Kind.REQUEST, "f1_v2_r1"),
        Fault(46.224, Kind.KILL_NODE, "/move_base"),
        Fault(47.856, Kind.RECONNECT, "functions"),
        Fault(47.999, Kind.SLOW, "functions", 4.884),
        Fault(48.012, Kind.RECONNECT, "functions"),
    )
    holds(History(6009136, "d2", faults, Policy.REFUSE, starts_with_initial=True))


def test_manipulator_that_begins_with_nothing_says_so_to_who_believes_the_last_one():
    faults = (
        Fault(34.312, Kind.FOREIGN, "/waterer", 16.159),
        Fault(38.751, Kind.KILL_PART, "manipulator"),
        Fault(40.313, Kind.KILL_PART, "launcher"),
        Fault(40.799, Kind.WALL_JUMPS, "", 43.819),  # the journal is too old for the next one
    )
    holds(History(30014334, "greenhouse", faults, Policy.WAIT))


def test_function_whose_change_was_given_up_for_nothing_has_failed_where_it_can_not_be_released():
    faults = (
        Fault(14.506, Kind.FOREIGN, "/cell/three/looker", 16.797),
        Fault(15.7, Kind.LOCK, "", 11.7),
        Fault(30.158, Kind.MASTER_SILENT, "", 2.087),
        Fault(33.316, Kind.REQUEST, "grasp_rough"),
        Fault(33.902, Kind.CANCELLED_REQUEST, "grasp_rough", 0.368),
        Fault(33.961, Kind.MASTER_SILENT, "", 1.449),
    )
    holds(History(50016143, "station", faults, Policy.REPLACE))


def test_lock_of_an_objective_that_is_still_to_come_outlasts_one_of_all_and_the_reasoner():
    faults = (
        Fault(4.471, Kind.LOCK, "o_look", 17.619),
        Fault(6.17, Kind.LOCK, "", 12.211),
        Fault(7.081, Kind.KILL_PART, "reasoner"),
    )
    holds(History(60014042, "station", faults, Policy.WAIT))


def test_strange_node_is_not_ended_while_the_launcher_is_gone():
    faults = (
        Fault(13.232, Kind.FOREIGN, "/move_base", 2.789),
        Fault(14.049, Kind.KILL_PART, "launcher"),
    )
    holds(History(160001721, "d2", faults, Policy.WAIT))


def test_manipulator_that_begins_while_the_launcher_hangs_ends_no_node():
    faults = (
        Fault(20.0, Kind.FREEZE_PART, "launcher", 25.0),
        Fault(22.0, Kind.KILL_PART, "manipulator"),
    )
    holds(History(1, "d2", faults, Policy.WAIT))


def test_driver_that_dies_again_while_the_master_is_silent_stays_told_as_missing():
    faults = (
        Fault(6.092, Kind.KILL_DRIVER, "/fleet/r7/receiver", 16.74),
        Fault(23.217, Kind.MASTER_SILENT, "", 3.758),
        Fault(25.909, Kind.KILL_DRIVER, "/fleet/r7/receiver"),
    )
    holds(History(310019903, "orchard", faults, Policy.REPLACE, starts_with_initial=True))


def test_driver_that_dies_a_second_after_it_has_come_is_told():
    faults = (Fault(1.801, Kind.KILL_DRIVER, "/front_laser"),)
    holds(History(330008750, "d2", faults, Policy.REPLACE))


def test_death_that_is_reported_after_the_next_change_does_not_fail_what_runs_since():
    faults = (
        Fault(4.23, Kind.DIES_LATER, "/waterer", 2.458),
        Fault(7.775, Kind.FREEZE_NODE, "/waterer"),
        Fault(8.645, Kind.DISMISS_PART, "manipulator"),
        Fault(41.497, Kind.LOCK, "o_water", 2.514),
        Fault(41.827, Kind.KILL_NODE, "/waterer"),
        Fault(45.462, Kind.FREEZE_NODE, "/waterer", 12.428),
        Fault(56.681, Kind.SLOW, "functions", 4.713),
    )
    holds(History(350012747, "greenhouse", faults, Policy.REPLACE, starts_with_initial=True))


def test_connection_that_is_made_anew_while_a_node_recovers_brings_the_report_late():
    faults = (
        Fault(56.173, Kind.KILL_NODE, "/fleet/r7/mast"),
        Fault(56.531, Kind.SLOW, "functions", 3.739),
        Fault(56.934, Kind.RECONNECT, "functions"),
    )
    holds(History(370000150, "orchard", faults, Policy.WAIT))
