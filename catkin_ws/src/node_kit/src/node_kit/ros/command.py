"""How a command of the command line joins the graph, so that no master that hangs makes it wait for ever."""

from __future__ import annotations

import rosgraph
import rospy.core

from node_kit.io.xml_rpc import Client
from node_kit.ros.lifetime import BAD_START, Lifetime

ANSWER_TIMEOUT = 5.0
"""Wall s in which the master must answer at the start."""


def join(name: str) -> None:
    """Become an anonymous node. If the master is lost later, the process ends with one line and status 2.

    Signals stay the terminal's.

    Raises:
        GoneError: there is no master.
        CallError: the master does not answer, or its address is none.
    """
    with Client(rosgraph.get_master_uri(), f"/{name}", ANSWER_TIMEOUT) as master:
        master.call("getPid")
    life = Lifetime(name)  # not entered: that would take over signals
    life.on_end = lambda reason: life.end(reason, BAD_START)
    life.start(anonymous=True)
    rospy.core.add_preshutdown_hook(lambda _reason: rospy.core._shutdown_threads.clear())
    # rospy would wait at the end for its thread of registrations, which looks only every 0.5 s whether it shall end
