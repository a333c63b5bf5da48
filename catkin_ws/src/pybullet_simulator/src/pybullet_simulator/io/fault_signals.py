"""Signals that tell a driver's process to simulate a fault of its device."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from pybullet_simulator.robot.faults import Fault

if TYPE_CHECKING:
    from pybullet_simulator.robot.faults import Outlet

SIGNALS = {Fault.REPEAT: signal.SIGRTMIN + 1, Fault.JUMP: signal.SIGRTMIN + 2, None: signal.SIGCONT}
"""The signal of each fault; that of None ends every fault.

Handlers of several signals run in the order of their numbers, and that of SIGCONT may wait for a while: so the others'
numbers are higher.
"""


def listen(outlet: Outlet) -> None:
    """Let signals set the fault of an outlet (in a process's main thread only)."""

    def on_signal(number: int, _frame: object) -> None:
        outlet.fault = next(fault for fault, known in SIGNALS.items() if known == number)

    for number in SIGNALS.values():
        signal.signal(number, on_signal)
