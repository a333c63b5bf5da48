"""A parameter in which a node keeps something for the next one of its name, without waiting for the master."""

from __future__ import annotations

import threading
from typing import Any

import rosgraph
import rospy

from node_kit.io.background import again_and_again
from node_kit.io.xml_rpc import CallError, Client

_AGAIN = 1.0
"""Wall s after which a value is written again that the master did not take."""


class KeptParameter:
    """Writes the last value that was set, in a thread of its own. The node must have begun."""

    def __init__(self, name: str) -> None:
        """Prepare; nothing is written yet.

        Args:
            name: of the parameter; it may be private (`~asked`).
        """
        self._name = rospy.resolve_name(name)
        self._changed = threading.Condition()
        self._value: Any = None
        self._set = self._written = 0
        self._thread = threading.Thread(target=self._run, name=f"keep {self._name}", daemon=True)
        self._thread.start()

    def set(self, value: Any, patience: float = 0.0) -> None:
        """Have a value written soon.

        Args:
            value: what XML-RPC can tell; it must not be changed any more.
            patience: wall s to wait until it is, at most.
        """
        with self._changed:
            self._value, self._set = value, self._set + 1
            number = self._set
            self._changed.notify_all()
            if patience:
                self._changed.wait_for(lambda: self._written >= number, patience)

    def _run(self) -> None:
        with Client(rosgraph.get_master_uri(), rospy.get_name()) as master:
            again_and_again(lambda: self._write(master), lambda: True)

    def _write(self, master: Client) -> None:
        with self._changed:
            self._changed.wait_for(lambda: self._set > self._written)
            number, value = self._set, self._value
        try:
            master.call("setParam", self._name, value)
        except CallError:
            with self._changed:
                self._changed.wait(_AGAIN)
            return
        with self._changed:
            self._written = number
            self._changed.notify_all()
