"""Node rosgraph_manipulator: deploys configurations on request and keeps the pending action goal."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import rospy
from node_kit.io.inbox import Inbox
from node_kit.io.master_watch import MasterWatch
from node_kit.io.supervisor import find_supervisor
from node_kit.io.xml_rpc import CallError
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.plugins import PluginError
from node_kit.ros.lifetime import Lifetime
from node_kit.ros.parts import watch_parts
from rosgraph_launcher.launching.options import LONGEST_TIMEOUT

from rosgraph_manipulator.change.execution import Execution
from rosgraph_manipulator.change.journal import Journal, begin_journal, parse_journal
from rosgraph_manipulator.change.manipulation import Manipulation, resumptions
from rosgraph_manipulator.change.parameters import OverwrittenParameters
from rosgraph_manipulator.change.request_queue import Policy
from rosgraph_manipulator.change.tactics import Tactic, load_tactics
from rosgraph_manipulator.configuration.configurations import KEYS, ConfigurationError, ManipulatorOptions
from rosgraph_manipulator.io.configuration_file import options_from, read_file
from rosgraph_manipulator.io.master import set_parameters
from rosgraph_manipulator.ros.announcer import Announcer
from rosgraph_manipulator.ros.goal import PendingGoal
from rosgraph_manipulator.ros.launchers import Launchers
from rosgraph_manipulator.ros.node_names import NodeNames
from rosgraph_manipulator.ros.reconfigure_client import ReconfigureClient
from rosgraph_manipulator.ros.repairs import RepairServer
from rosgraph_manipulator.ros.requests import RequestServer
from rosgraph_manipulator.ros.standby import Standby
from rosgraph_manipulator.ros.surroundings import RosSurroundings

ASK_DELAY = 2.0  # s, wall, after a change: nodes may offer dynamic_reconfigure later than all else


PARAMETERS = (
    *KEYS,
    "concurrency",
    "host_timeout",
    "initial_configuration",
    "journal",
    "kept_goals",
    "launcher_timeout",
    "overwritten",
    "probation",
    "ready_timeout",
    "repair_timeout",
    "settle_time",
)
"""Names of all parameters."""


class JournalParameter:
    """Keeps the journal as the parameter `~journal`."""

    def __init__(self, journal: Journal) -> None:
        """Begin with a journal that nobody needs to read."""
        self._journal = journal
        self._is_behind = False  # whether the parameter could not be set
        self._lock = threading.Lock()

    def update(self, change: Callable[[Journal, float], Journal]) -> None:
        """Publish what a function returns for the journal and the present time, where the parameter differs."""
        with self._lock:
            journal = change(self._journal, time.time())
            if journal is self._journal and not self._is_behind:
                return
            self._journal, self._is_behind = journal, True
            with contextlib.suppress(CallError):  # the next heartbeat tries again
                set_parameters({rospy.resolve_name("~journal"): journal.as_parameter()})
                self._is_behind = False


class Manipulator:
    """The node. One thread carries out one thing after the other."""

    def __init__(self, options: ManipulatorOptions, tactics: Mapping[str, Tactic], initial: Mapping[str, str]) -> None:
        """Look what the launcher runs and what an earlier manipulator has left, and begin to follow both.

        Args:
            options: what can be deployed.
            tactics: the tactics, by name.
            initial: the configuration to begin with, by function.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        for line in parameters.strangers(PARAMETERS):
            rospy.logwarn("%s", line)
        self._options = options
        policy = parameters.choice("concurrency", Policy.WAIT.value, [policy.value for policy in Policy])
        self._inbox = Inbox()
        probation = parameters.number("probation", 5.0, low=0.0)
        announcer = Announcer()
        launcher_timeout = parameters.number("launcher_timeout", 10.0, high=LONGEST_TIMEOUT)
        launchers = Launchers(launcher_timeout, parameters.number("host_timeout", 3.0, low=0.1))
        if not launchers.find():
            rospy.logwarn("rosgraph_launcher is not there; start it beside this node: nothing can be deployed without")
        journal = parse_journal(parameters.value("journal"))
        supervisor = find_supervisor(sys.argv)
        self._resumptions = resumptions(options, journal, launchers.reports(), initial, time.time(), supervisor)
        around = RosSurroundings()
        self._executor = Execution(
            options,
            {name: goal for name in options.all_functions if (goal := self._pending_goal(name))},
            OverwrittenParameters.from_parameter(parameters.value("overwritten")),
            ready_timeout=parameters.number("ready_timeout", 15.0, low=0.1),
            settle_time=parameters.number("settle_time", 0.5, low=0.0),
            launchers=launchers,
            on_report=lambda: self._inbox.put(self._follow_launcher),
            around=around,
            adjusting=ReconfigureClient(),
            make_names=lambda describe, has_finished: NodeNames(launchers, describe, has_finished),
        )
        self._manipulation = Manipulation(
            options,
            tactics,
            probation,
            self._executor,
            announcer,
            JournalParameter(begin_journal(self._resumptions.values(), supervisor)),
            around,
            self._on_change,
        )
        self._requests = RequestServer(
            options, Policy(policy), self._inbox, self._manipulation.carry_out, self._manipulation.make_whole
        )
        self._executor.check = self._requests.check
        self._standby = Standby(options, launchers, around.launch_file)
        repair_timeout = parameters.number("repair_timeout", 15.0, low=0.1)
        self._repairs = RepairServer(options, self._inbox, self._executor, repair_timeout)

    def _pending_goal(self, function: str) -> PendingGoal | None:
        options, resumption = self._options.of(function), self._resumptions[function]
        if options.save_action is None:
            return None
        return PendingGoal(
            options.save_action,
            str(options.action_type),
            adopt=resumption.keep_goal,
            changing=bool(resumption.deploy),
        )

    def run(self, watch: MasterWatch) -> None:
        """Resume or deploy configurations, then serve requests until the node or the watched master ends."""
        watch.heartbeat = self._manipulation.heartbeat
        rospy.on_shutdown(self._manipulation.end)
        self._manipulation.begin(self._resumptions)
        self._requests.start()
        self._repairs.start()
        while not rospy.is_shutdown():
            self._inbox.do_next(wait_s=0.2)
            if not self._inbox:
                self._manipulation.look()
                self._repairs.look()
                self._standby.look()

    def _on_change(self, runs: bool) -> None:
        """Have processes stand by for the next change, and nodes that run describe their parameters in time for it."""
        if runs:
            ask = threading.Timer(ASK_DELAY, self._executor.system.ask_for_adjustable)
            ask.daemon = True
            try:
                ask.start()
            except RuntimeError as error:  # the next plan asks, then
                rospy.logwarn("nodes are not asked for what they take by dynamic_reconfigure yet: %s", error)
        self._standby.changed()

    def _follow_launcher(self) -> None:
        """React to the launchers' last reports."""
        self._manipulation.follow_launcher()
        self._repairs.follow_launcher()


def read_parameters(arguments: list[str]) -> dict[str, Any]:
    """Read the configuration from the file named by the first argument, else from parameters.

    As published, a file's keys become parameters of the node's namespace too. Those of an earlier file are removed:
    the commands read them.

    Raises:
        ConfigurationError: the file can't be read.
    """
    if arguments:
        content = read_file(arguments[0])
        set_parameters(
            {rospy.resolve_name(key): value for key, value in content.items()},
            delete=[rospy.resolve_name(key) for key in KEYS if key not in content],
        )
        return content
    return {key: rospy.get_param(f"~{key}", rospy.get_param(key, None)) for key in KEYS}


def main() -> None:
    """Run the node; exit status 2 when its configuration cannot be used."""
    with Lifetime("rosgraph_manipulator", ConfigurationError, ParameterError, PluginError) as life:
        arguments = rospy.myargv()[1:]
        life.start(writes=("journal", "kept_goals", "overwritten"), reads=() if arguments else KEYS)
        options = options_from(read_parameters(arguments))
        for configuration in (*options.configurations.values(), *options.drivers.values()):
            if configuration.problem:
                rospy.logwarn("%s is refused when it is requested: %s", configuration.name, configuration.problem)
        initial = options.one_per_function(rospy.get_param("~initial_configuration", ""), "~initial_configuration")
        manipulator = Manipulator(options, load_tactics(), initial)
        life.begun()
        watch_parts("manipulator")
        manipulator.run(life.watch)
