"""Node rosgraph_launcher: owns the processes of the configuration that runs.

The roslaunch API starts them from the main thread; each gets the kernel's parent-death signal, so none outlives this
node, however it ends.
"""

from __future__ import annotations

import queue
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import rosgraph.names
import roslaunch
import roslaunch.pmon
import rospy
from metacontrol_msgs.srv import (
    LaunchConfiguration,
    LaunchConfigurationRequest,
    LaunchConfigurationResponse,
    StopConfiguration,
    StopConfigurationRequest,
    StopConfigurationResponse,
)
from std_msgs.msg import String

from rosgraph_manipulator.master import NodeApi

# Kills the node when the launcher dies (PR_SET_PDEATHSIG); from util-linux, which every Debian has. The path is
# absolute, since for cwd="node" roslaunch changes to the folder of the command's first word.
DIE_WITH_LAUNCHER = "/usr/bin/setpriv --pdeathsig KILL --"
SHUTDOWN_TIMEOUT = 3.0  # s, wall, for a node to end after it was asked to over XML-RPC; rospy takes 0.5 s
SIGINT_TIMEOUT = 2.0  # s, wall, then SIGTERM
SIGTERM_TIMEOUT = 1.0  # s, wall, then SIGKILL
POLL_PERIOD = 0.02  # s, wall


@dataclass
class _Job:
    """A request that waits for the main thread."""

    work: Callable[[], Any]
    done: threading.Event = field(default_factory=threading.Event)
    answer: Any = None


class Launcher:
    """Starts and stops configurations; everything but the service callbacks runs in the main thread."""

    def __init__(self) -> None:
        self._jobs: queue.Queue[_Job] = queue.Queue()
        self._monitor = roslaunch.pmon.start_process_monitor()
        self._running = ""
        self._processes: dict[str, Any] = {}
        self._publisher = rospy.Publisher("~running", String, queue_size=1, latch=True)
        self._publisher.publish(String(""))
        rospy.Service(
            "~launch", LaunchConfiguration, lambda request: self._in_main_thread(lambda: self._launch(request))
        )
        rospy.Service("~stop", StopConfiguration, lambda request: self._in_main_thread(lambda: self._stop(request)))

    def spin(self) -> None:
        """Serve requests until the node is told to end; then stop what runs."""
        while not self._monitor.is_shutdown and not rospy.is_shutdown():
            self._monitor.mainthread_spin_once()
            try:
                job = self._jobs.get(timeout=0.1)
            except queue.Empty:
                continue
            job.answer = job.work()
            job.done.set()
        if not self._monitor.is_shutdown:
            self._stop_processes()
            self._monitor.shutdown()
        self._monitor.join()
        rospy.signal_shutdown("the launcher ends")

    def _in_main_thread(self, work: Callable[[], Any]) -> Any:
        job = _Job(work)
        self._jobs.put(job)
        while not job.done.wait(0.5):
            if rospy.is_shutdown() or self._monitor.is_shutdown:
                raise rospy.ServiceException("the launcher is shutting down")
        return job.answer

    def _launch(self, request: LaunchConfigurationRequest) -> LaunchConfigurationResponse:
        if self._running:
            return LaunchConfigurationResponse(False, f"{self._running} still runs: stop it first", [])
        try:
            config = roslaunch.config.load_config_default(
                [(request.launch_file, list(request.args))], None, assign_machines=True
            )
            if config.config_errors:
                return LaunchConfigurationResponse(False, _one_line(config.config_errors[0]), [])
            names = [rosgraph.names.ns_join(node.namespace, node.name) for node in config.nodes]
            if not names:
                return LaunchConfigurationResponse(False, f"{request.launch_file} starts no node", [])
            for node in config.nodes:
                node.launch_prefix = f"{DIE_WITH_LAUNCHER} {node.launch_prefix or ''}".strip()
            runner = roslaunch.launch.ROSLaunchRunner(
                rospy.get_param("/run_id", None) or roslaunch.core.generate_run_id(),
                config,
                pmon=self._monitor,
                sigint_timeout=SIGINT_TIMEOUT,
                sigterm_timeout=SIGTERM_TIMEOUT,
            )
            before = set(self._monitor.procs)
            _, failed = runner.launch()
        except (roslaunch.core.RLException, roslaunch.xmlloader.XmlParseException, OSError) as error:
            return LaunchConfigurationResponse(False, _one_line(error), [])
        started = [process for process in self._monitor.procs if process not in before]
        self._processes = dict(zip(names, started, strict=False))
        if failed:
            self._stop_processes()
            return LaunchConfigurationResponse(False, f"could not start {', '.join(map(str, failed))}", [])
        self._set_running(request.name)
        return LaunchConfigurationResponse(True, "", names)

    def _stop(self, request: StopConfigurationRequest) -> StopConfigurationResponse:
        if request.name and request.name != self._running:
            return StopConfigurationResponse(False, f"'{request.name}' does not run, '{self._running}' does")
        errors = self._stop_processes()
        self._set_running("")
        return StopConfigurationResponse(not errors, "; ".join(errors))

    def _stop_processes(self) -> list[str]:
        """Ask the nodes to shut down, wait until they are gone, and escalate where they are not."""
        for name, process in self._processes.items():
            if process.is_alive():
                NodeApi.request_shutdown(name, "replaced by another configuration")
        deadline = time.monotonic() + SHUTDOWN_TIMEOUT
        while time.monotonic() < deadline and any(process.is_alive() for process in self._processes.values()):
            time.sleep(POLL_PERIOD)
        errors: list[str] = []
        for process in self._processes.values():
            if process.is_alive():
                process.stop(errors)
        self._processes = {}
        return [_one_line(error) for error in errors]

    def _set_running(self, name: str) -> None:
        self._running = name
        self._publisher.publish(String(name))


def _one_line(error: object) -> str:
    return " ".join(str(error).split())


def main() -> None:
    """Run the node."""
    try:
        # roslaunch's process monitor handles the signals of this process.
        rospy.init_node("rosgraph_launcher", disable_signals=True)
    except rospy.ROSInitException as error:
        sys.stderr.write(f"rosgraph_launcher: {_one_line(error)}\n")
        sys.exit(2)
    Launcher().spin()
