"""Faults are taken back when the plan says so, whatever else the drive is at."""

import threading

from helpers.waiting import DEADLINE_S
from soak.driving import Drive
from soak.plan import Fault, Kind, Mission
from soak.striking import LeftOutError


def drive(folder, lasts=0.01):
    frozen = Fault(Kind.FREEZE_MASTER, 5.0, lasts=lasts)
    return Drive(Mission(0, 1, "r1", "f2_v2_r2", "pellet", (frozen,)), folder)


class Striker:
    """Strikes nothing, and notices when that is taken back."""

    def __init__(self):
        self.undone = threading.Event()

    def strike(self, fault):
        return "struck", self.undone.set


class Blunt:
    """Never strikes."""

    def strike(self, fault):
        raise LeftOutError("nothing there")


def lines(one):
    return "".join(one._lines)


def test_fault_is_taken_back_in_time_though_the_loop_is_at_something_else(tmp_path):
    one, striker = drive(tmp_path), Striker()
    one._strike(striker, 0)
    assert striker.undone.wait(DEADLINE_S)


def test_fault_that_lasts_is_taken_back_at_the_end_and_only_once(tmp_path):
    one, striker = drive(tmp_path, lasts=10 * DEADLINE_S), Striker()
    one._strike(striker, 0)
    one._take_back_all()
    assert striker.undone.is_set()
    one._take_back(0)
    assert lines(one).count("taken back") == 1


def test_fault_that_cannot_strike_is_left_out(tmp_path):
    one = drive(tmp_path)
    one._strike(Blunt(), 0)
    assert (one._left_out, lines(one)) == ({0: "nothing there"}, "")
