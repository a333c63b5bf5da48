"""A driver's process takes faults by signals."""

import os
import signal

from pybullet_simulator.io.fault_signals import SIGNALS, listen
from pybullet_simulator.robot.faults import Outlet


def test_signals_tell_a_drivers_process():
    former = {number: signal.getsignal(number) for number in SIGNALS.values()}
    outlet = Outlet()
    try:
        listen(outlet)
        for fault, number in SIGNALS.items():
            os.kill(os.getpid(), number)
            assert outlet.fault is fault
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
