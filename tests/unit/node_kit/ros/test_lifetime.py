"""The end of a node that hangs, or that gets no thread: in a process of its own."""

import signal
import subprocess
import sys

import pytest
from helpers.waiting import DEADLINE_S

NODE = """
import sys
import threading
import time

import rospy
from node_kit.ros.lifetime import Lifetime

life = Lifetime("mixer")
life.longest_end = life.longest_end_without_master = float(sys.argv[1])
with life:
    if sys.argv[2] == "hangs":
        rospy.on_shutdown(lambda: time.sleep(1e6))
    if sys.argv[2] == "has no thread":
        def start(thread):
            raise RuntimeError("can't start new thread")
        threading.Thread.start = start
    print("ready", flush=True)
    time.sleep(1e6)
"""


@pytest.mark.parametrize(("why", "longest"), [("is well", 1e6), ("hangs", 0.1), ("has no thread", 1e6)])
def test_node_that_is_told_to_end_ends_whatever_it_lacks(why, longest):
    with subprocess.Popen([sys.executable, "-c", NODE, str(longest), why], stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout.readline() == b"ready\n"
            process.send_signal(signal.SIGINT)
            assert process.wait(DEADLINE_S) == 0
        finally:
            process.kill()
