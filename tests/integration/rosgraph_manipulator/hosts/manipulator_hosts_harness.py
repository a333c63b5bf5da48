"""What the tests over several hosts share: the other host's link and its launcher."""

import os
import signal
import subprocess
import threading
from contextlib import suppress

import rosgraph
from helpers.programs import program

HOST, ADDRESS = os.environ["OTHER_HOST"], os.environ["OTHER_ADDRESS"]
FAR_LAUNCHER = "rosgraph_launcher_arm"


def link(state):
    subprocess.run(["/usr/sbin/ip", "-n", HOST, "link", "set", "eth0", state], check=True)


class Respawned:
    """The launcher of the other host, which is started again whenever it ends, as roslaunch does there."""

    def __init__(self):
        port = rosgraph.get_master_uri().rstrip("/").rpartition(":")[2]
        self._environment = {
            **os.environ,
            "ROS_IP": ADDRESS,
            "ROS_MASTER_URI": f"http://{os.environ['THIS_ADDRESS']}:{port}",
        }
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.process = None
        self._thread.start()

    def _run(self):
        words = ["/usr/sbin/ip", "netns", "exec", HOST, program("rosgraph_launcher", "rosgraph_launcher")]
        while not self._ending.is_set():
            self.process = subprocess.Popen([*words, f"__name:={FAR_LAUNCHER}"], env=self._environment)
            self.process.wait()
            self._ending.wait(0.2)

    def end(self):
        self._ending.set()
        while self._thread.is_alive():
            with suppress(ProcessLookupError):
                self.process.send_signal(signal.SIGINT)
            self._thread.join(1.0)
