"""How nodes end: with the master, which would not come back to them, and always in time."""

from __future__ import annotations

import os
import sys
import threading
import time

import rosgraph
import rospy
from ros_model.snapshot import MasterClient, MasterGoneError, SnapshotError

BAD_START = 2
"""Exit status of a start that failed. The loss of the master ends a node with 0: it has done all it could."""

PATIENCE = 10.0
"""Wall s for which a node bears the silence of its master."""
_START_TIMEOUT = 5.0
"""The same while it starts."""
_PERIOD = 0.4
"""Wall s between questions to the master."""
_TIMEOUT = 1.2
"""Wall s for its answer: with a period before it, its silence is told within 2 s."""
_LONGEST_END = 3.0
"""Wall s that a node may take to end. To unregister, rospy waits for the answer of a silent master for ever."""


class MasterWatch:
    """Ends the node when its master is gone, is silent for long, or has become another one."""

    def __init__(self, node: str) -> None:
        """Watch from now on, before the node registers.

        Args:
            node: name of the node, for what is said.
        """
        self.patience = _START_TIMEOUT
        """Wall s of silence that are borne; raise it when the node has registered."""
        self.lost = threading.Event()
        self._node = node
        self._ending = False
        rospy.on_shutdown(self._on_shutdown)
        threading.Thread(target=self._run, name="master watch", daemon=True).start()

    def _on_shutdown(self) -> None:
        self._ending = True
        end_in_time()

    def _run(self) -> None:
        client = MasterClient(rosgraph.get_master_uri(), timeout=_TIMEOUT)
        known: int | None = None
        silent_since: float | None = None
        while not self._ending:
            begin = time.monotonic()
            try:
                pid = client.master_pid()
            except MasterGoneError as error:
                self._end(str(error))
                return
            except SnapshotError as error:
                if self._ending:
                    return
                if silent_since is None:
                    silent_since = begin
                    say(self._node, f"{error}: it ends if the master stays like this for {self.patience:g} s")
                if time.monotonic() - silent_since >= self.patience:
                    os._exit(0)  # whatever rospy did now would wait for this master
            else:
                if known not in (None, pid):
                    self._end(f"ROS master {client.uri} is another one, which knows nothing of this node")
                    return
                known, silent_since = pid, None
            time.sleep(_PERIOD)

    def _end(self, reason: str) -> None:
        if not self._ending:
            say(self._node, f"{reason}: it ends, start it again with the master")
        self.lost.set()
        rospy.signal_shutdown("the master is lost")


def require_master(node: str) -> None:
    """Exit with one line if no master answers."""
    client = MasterClient(rosgraph.get_master_uri(), timeout=_START_TIMEOUT)
    try:
        client.master_pid()
    except SnapshotError as error:
        say(node, f"{error}: start roscore or set ROS_MASTER_URI")
        sys.exit(BAD_START)
    finally:
        client.close()


def end_in_time() -> None:
    """End the process soon, whatever rospy waits for. A hook for its shutdown."""
    last_resort = threading.Timer(_LONGEST_END, os._exit, (0,))
    last_resort.daemon = True
    last_resort.start()


def say(node: str, line: str) -> None:
    """Write a line of its own: rospy's logging asks the master for a parameter, and would wait for it."""
    sys.stderr.write(f"{node}: {line}\n")
    sys.stderr.flush()
